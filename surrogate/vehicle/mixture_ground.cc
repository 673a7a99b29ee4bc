#include "surrogate/vehicle/mixture_ground.h"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "surrogate/models/mixture_model.h"
#include "surrogate/vehicle/yaml.h"

namespace grouser::vehicle {
namespace {

using surrogate::MixturePart;
using surrogate::WheelModel;

std::size_t SoilOf(const Grounds& grounds, const std::string& name) {
  const auto found = std::ranges::find(grounds.soils, name);
  if (found == grounds.soils.end()) {
    throw std::invalid_argument("soil " + name + ": none of the vehicle, expected one such as " +
                                yaml::NearestOf(name, grounds.soils));
  }
  return static_cast<std::size_t>(found - grounds.soils.begin());
}

/// In the order of MixtureModel::parts, with the same weights. Precondition: their sum is above 0.
std::vector<SoilShare> SharesOf(const std::vector<std::size_t>& of, const SoilWeights& weights) {
  double sum = 0;
  for (const auto& [name, weight] : weights) sum += weight;
  std::vector<SoilShare> shares;
  for (std::size_t k = 0; k < of.size(); ++k) {
    const double weight = weights[k].second / sum;
    if (weight > 0) shares.push_back({of[k], weight});
  }
  return shares;
}

/// The models stay where they are.
std::shared_ptr<const WheelModel> Borrowed(const WheelModel* model) {
  return {std::shared_ptr<const WheelModel>(), model};
}

SoilWeights WeightsOf(yaml::YamlSection* from) {
  SoilWeights weights;
  for (const std::string& name : from->Keys()) {
    weights.emplace_back(name, from->Number(name, yaml::kNonNegative));
  }
  return weights;
}

}  // namespace

std::size_t AddMixture(const std::string& soil, const SoilWeights& weights, VehicleFile* file) {
  Grounds& grounds = file->grounds;
  const std::size_t soils = grounds.soils.size(), types = file->vehicle.wheel_types.size();
  if (soil.empty()) throw std::invalid_argument("name: empty, expected one to call the mixture by");
  if (std::ranges::find(grounds.soils, soil) != grounds.soils.end()) {
    throw std::invalid_argument("soil " + soil + ": there is one, expected another name");
  }
  if (soils >= kMostSoils) {
    const std::string most = std::to_string(kMostSoils);
    throw std::invalid_argument("soils: over " + most + ", expected " + most + " at most");
  }
  std::vector<std::size_t> of;
  for (const auto& [name, weight] : weights) {
    of.push_back(SoilOf(grounds, name));
    if (std::ranges::count(of, of.back()) > 1) {
      throw std::invalid_argument("soil " + name + ": twice, expected each once");
    }
  }
  std::vector<const WheelModel*> models;
  for (std::size_t type = 0; type < types; ++type) {
    const WheelType& wheel = file->vehicle.wheel_types[type];
    std::vector<MixturePart> parts;
    for (std::size_t k = 0; k < of.size(); ++k) {
      const WheelModel* model = grounds.At(type, of[k]);
      if (model == nullptr) continue;
      parts.push_back({Borrowed(model), weights[k].second, wheel.radius_m, wheel.width_m,
                       file->vehicle.gravity_m_per_s2});
    }
    if (!parts.empty() && parts.size() < of.size()) {
      throw std::invalid_argument("wheel " + wheel.name + ": models of " +
                                  std::to_string(parts.size()) + " of the " +
                                  std::to_string(of.size()) + " soils, expected of all or none");
    }
    for (std::size_t s = 0; s < soils; ++s) models.push_back(grounds.At(type, s));
    models.push_back(nullptr);
    if (parts.empty() && !of.empty()) continue;
    file->models.push_back(std::make_unique<surrogate::MixtureModel>(std::move(parts)));
    models.back() = file->models.back().get();
    file->sources.push_back(soil + ": " + wheel.name + ": mixture");
  }
  grounds.models = std::move(models);
  grounds.shares.resize(soils + 1);
  grounds.shares[soils] = SharesOf(of, weights);
  grounds.soils.push_back(soil);
  return soils;
}

SoilWeights ReadSoilWeights(const std::string& text) {
  yaml::YamlSection section = yaml::YamlSection::OfText(text, "soil " + text);
  return WeightsOf(&section);
}

void ReadMixtures(yaml::YamlSection* file, VehicleFile* out) {
  if (!file->Has("mixtures")) return;
  for (yaml::YamlSection& s : file->Sections("mixtures")) {
    const std::string soil = s.Text("soil");
    yaml::YamlSection of = s.Section("of");
    const SoilWeights weights = WeightsOf(&of);
    of.Finish();
    s.Finish();
    try {
      AddMixture(soil, weights, out);
    } catch (const std::invalid_argument& error) {
      s.Fail("of", error.what(), "soils of `grounds` with their weights");
    }
  }
}

}  // namespace grouser::vehicle
