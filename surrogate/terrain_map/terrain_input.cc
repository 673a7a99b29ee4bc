#include "surrogate/terrain_map/terrain_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace grouser::terrain_map {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

std::string PlaceOf(const Window& w, std::size_t i) {
  return fmt::format(" at column {}, row {}", w.column + static_cast<std::ptrdiff_t>(i % w.columns),
                     w.row + static_cast<std::ptrdiff_t>(i / w.columns));
}

}  // namespace

TerrainInput::TerrainInput(const std::string& elevation, const SoilSources& sources)
    : elevation_(elevation, "elevation", true) {
  const auto index = [&](const std::string& soil) {
    const auto found = std::find(soils_.begin(), soils_.end(), soil);
    if (found != soils_.end()) return static_cast<std::size_t>(found - soils_.begin());
    soils_.push_back(soil);
    return soils_.size() - 1;
  };
  if (!sources.class_raster.empty()) {
    classes_.emplace(sources.class_raster, "soil class", false);
    classes_->CheckSameGrid(elevation_);
    for (const auto& [value, soil] : sources.classes) {
      soil_of_class_.emplace_back(value, index(soil));
    }
  }
  for (const auto& [soil, file] : sources.probabilities) {
    if (index(soil) != probabilities_.size()) {
      throw std::invalid_argument("--soil-probability: got " + soil + " twice, expected it once");
    }
    probabilities_.emplace_back(file, "probability of " + soil, false);
    probabilities_.back().CheckSameGrid(elevation_);
  }
  if (soils_.empty()) soils_ = {sources.soil};
}

std::vector<std::string> TerrainInput::files() const {
  std::vector<std::string> out = {elevation_.file()};
  if (classes_) out.push_back(classes_->file());
  for (const RasterInput& p : probabilities_) out.push_back(p.file());
  return out;
}

void TerrainInput::ReadSoils(const Window& w, std::vector<float>* out) const {
  if (classes_) {
    ReadClasses(w, out);
  } else if (!probabilities_.empty()) {
    ReadProbabilities(w, out);
  } else {
    out->assign(w.cells(), 1);
  }
}

void TerrainInput::ReadClasses(const Window& w, std::vector<float>* out) const {
  std::vector<float> values;
  classes_->Read(w, &values);
  out->assign(soils_.size() * w.cells(), 0);
  for (std::size_t i = 0; i < w.cells(); ++i) {
    const auto found = std::find_if(soil_of_class_.begin(), soil_of_class_.end(), [&](auto& c) {
      return static_cast<float>(c.first) == values[i];
    });
    if (found != soil_of_class_.end()) {
      (*out)[found->second * w.cells() + i] = 1;
    } else if (std::isnan(values[i])) {
      for (std::size_t s = 0; s < soils_.size(); ++s) (*out)[s * w.cells() + i] = kNaN;
    } else {
      throw std::invalid_argument(
          fmt::format("{}: soil class: got {}{}, expected one of --soils (or nodata)",
                      classes_->file(), values[i], PlaceOf(w, i)));
    }
  }
}

void TerrainInput::ReadProbabilities(const Window& w, std::vector<float>* out) const {
  out->clear();
  std::vector<float> one, sum(w.cells(), 0);
  for (const RasterInput& raster : probabilities_) {
    raster.Read(w, &one);
    for (std::size_t i = 0; i < w.cells(); ++i) {
      sum[i] += one[i];
      if (!(one[i] < 0)) continue;
      throw std::invalid_argument(fmt::format("{}: probability: got {}{}, expected 0 to 1",
                                              raster.file(), one[i], PlaceOf(w, i)));
    }
    out->insert(out->end(), one.begin(), one.end());
  }
  for (std::size_t i = 0; i < w.cells(); ++i) {
    if (std::fabs(sum[i] - 1) > 0.01F) {
      throw std::invalid_argument(
          fmt::format("--soil-probability: got the sum {}{}, expected 1", sum[i], PlaceOf(w, i)));
    }
    for (std::size_t s = 0; s < soils_.size(); ++s) (*out)[s * w.cells() + i] /= sum[i];
  }
}

}  // namespace grouser::terrain_map
