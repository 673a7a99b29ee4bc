#include "surrogate/fit/hard_model.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <numbers>
#include <stdexcept>

#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

constexpr double kLeastLoad = 10, kMostLoad = 1e5;  // [N]: no limits of the law
constexpr double kSpeed = 0.5;                      // [m/s]
constexpr double kLevel = 0.9;                      // of +- 1.645 sd

}  // namespace

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
