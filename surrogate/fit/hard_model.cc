#include "surrogate/fit/hard_model.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <numbers>
#include <stdexcept>

#include "surrogate/model_io/write_model.h"
#include "surrogate/soils/hard_table.h"

namespace grouser::surrogate {
namespace {

constexpr double kLeastLoad = 10, kMostLoad = 1e5;  // [N]: no limits of the law
constexpr double kSpeed = 0.5;                      // [m/s]
constexpr double kLevel = 0.9;                      // of +- 1.645 sd

}  // namespace

std::string OptionOf(const HardGroundField& field) {
  std::string name = std::string("--") + field.name;
  for (char& c : name) c = c == '_' ? '-' : c;
  if (name.ends_with("-m")) name.resize(name.size() - 2);
  return name;
}

void SetGround(const std::string& ground, std::span<const std::optional<double>> given,
               HardModelRequest* request) {
  HardGround& parameters = request->parameters;
  request->ground = "hard ground";
  request->source.clear();
  if (!ground.empty()) {
    const auto published = PublishedHardGrounds();
    const PublishedHardGround& found = FindHardGround(published, ground);
    request->ground = found.name;
    request->source = found.source;
    parameters = found.ground;
  }
  SetUsualContact(request->wheel.radius_m(), request->wheel.width_m(), &parameters);
  std::string said;
  const auto fields = HardGroundFields();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::string option = OptionOf(fields[i]);
    if (given[i]) {
      parameters.*fields[i].member = *given[i];
      said += (said.empty() ? "" : ", ") + option.substr(2);
    } else if (ground.empty() && fields[i].required && !option.starts_with("--contact")) {
      throw std::invalid_argument(option + ": not given, expected a number (or --ground)");
    }
  }
  if (!said.empty())
    request->source += (request->source.empty() ? "" : "; ") + ("as given: " + said);
}

v1alpha1::Model MakeHardModel(const HardModelRequest& request) {
  const double least = request.load_min_n.value_or(kLeastLoad);
  const double most = request.load_max_n.value_or(kMostLoad);
  if (!(least > 0 && most > least)) {
    throw std::invalid_argument(
        fmt::format("loads {:g} to {:g} N, expected 0 < least < most", least, most));
  }
  v1alpha1::Model model;
  model.set_name(request.name);
  model.set_kind(v1alpha1::MODEL_KIND_HARD);
  model.set_untuned(true);
  *model.mutable_wheel() = request.wheel;
  model.mutable_soil()->set_name(request.ground);
  model.mutable_soil()->set_source(request.source);
  model.mutable_soil()->set_gravity_m_per_s2(request.gravity_m_per_s2);
  SetHard(request.parameters, &model);
  v1alpha1::Domain* d = model.mutable_domain();
  d->set_slip_min(-2);
  d->set_slip_max(2);
  d->set_attack_angle_max_rad(std::numbers::pi);
  d->set_load_min_n(least);
  d->set_load_max_n(most);
  d->set_speed_m_per_s(kSpeed);
  model.set_interval_level(kLevel);
  v1alpha1::Provenance* p = model.mutable_provenance();
  p->set_command(request.command);
  p->set_reason("hard ground: " + request.source);
  p->set_grouser_version(GROUSER_VERSION);
  *model.mutable_create_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
  SetGoldenVectors(&model);
  return model;
}

}  // namespace grouser::surrogate
