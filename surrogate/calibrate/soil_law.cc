#include "surrogate/calibrate/soil_law.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>

#include "surrogate/models/bekker_constants.h"
#include "surrogate/models/hull.h"

namespace grouser::surrogate {
namespace {

using P = BekkerParameters;

// Middle and reach of what published soils have: the prior reaches them all.
Prior PriorOf(std::vector<double> values, double least_sd) {
  constexpr double kReach = 0.75;  // sd over the full range
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  const double median =
      values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
  return {median, std::max(least_sd, kReach * (values.back() - values.front())), 0, 0};
}

double ModulusAt(const P& p, double width) {
  return std::exp(bekker::LogModulus<double>([&](double P::*m) { return p.*m; }, width));
}

}  // namespace

SoilLaw::SoilLaw(const MeasuredSoil& soil, const Typical& typical, double form)
    : soil_(soil), typical_(typical), form_(form), largest_(soil.tests.size()) {
  double log_width = 0, log_sinkage = 0;
  int n = 0;
  const auto gather = [&](bool plates) {
    for (const Observation& at : soil.observations) {
      const MeasuredTest& test = soil.tests[at.test];
      const bool plate = test.kind == TestKind::kPlate;
      if (at.held_out || plate != plates || test.kind == TestKind::kShear) continue;
      const double depth = at.sinkage > 0 ? at.sinkage : 0.3 * test.wheel.radius_m;
      log_width += std::log(plate ? at.width : test.wheel.width_m);
      log_sinkage += std::log(depth);
      ++n;
    }
  };
  for (const Observation& at : soil.observations) {
    if (!at.held_out) largest_[at.test] = std::max(largest_[at.test], std::abs(at.value));
  }
  gather(/*plates=*/true);
  if (n == 0) gather(/*plates=*/false);
  width_ = n == 0 ? 0.05 : std::exp(log_width / n);
  sinkage_ = n == 0 ? 0.02 : std::exp(log_sinkage / n);
  SetPriors();
  SetFree();
}

void SoilLaw::SetPriors() {
  std::vector<double> pressure, n, share, cohesion, friction, log_shear, unit_weight;
  for (const Soil& soil : typical_.soils) {
    if (soil_.kind && soil.kind != *soil_.kind) continue;
    const P p = FromSoil(soil, soil_.gravity);
    if (!(p.k_c / width_ + p.k_phi > 0)) continue;
    pressure.push_back(std::log(ModulusAt(p, width_)) + p.n * std::log(sinkage_));
    n.push_back(p.n);
    share.push_back(p.k_c / width_ / (p.k_c / width_ + p.k_phi));
    cohesion.push_back(p.cohesion);
    friction.push_back(p.friction_angle);
    log_shear.push_back(std::log(p.shear_modulus));
    unit_weight.push_back(p.unit_weight);
  }
  if (n.empty()) throw std::invalid_argument("no published soil of this kind, expected one");
  Prior* a = priors_.data();
  a[kLogPressure] = PriorOf(pressure, 3);
  a[kExponent] = PriorOf(n, 0.3);
  a[kModulusShare] = PriorOf(share, 0.5);
  a[kCohesion] = PriorOf(cohesion, 2000);
  a[kFriction] = PriorOf(friction, 0.2);
  a[kLogShearModulus] = PriorOf(log_shear, 0.8);
  const auto bound = [&](int i, double low, double high) { a[i].low = low, a[i].high = high; };
  bound(kLogPressure, -5, 25);
  bound(kExponent, 0.06, 2.4);
  bound(kCohesion, form_ == kReeceForm ? 1 : 0, 5e5);
  bound(kFriction, 0.01, 1.2);
  bound(kLogShearModulus, std::log(1e-5), std::log(2.0));
  // What stays positive at every width that is used.
  double low = -20, high = form_ == kReeceForm ? 20 : 0.9999;
  const auto use = [&](double width) {
    const double ratio =
        form_ == kReeceForm ? width / width_ : width_ / width;  // of the other part
    const double room = 0.98;
    if (form_ == kReeceForm) {
      if (ratio > 1.001) high = std::min(high, room * ratio / (ratio - 1));
      if (ratio < 0.999) low = std::max(low, -room * ratio / (1 - ratio));
    } else {
      if (ratio < 0.999) high = std::min(high, room / (1 - ratio));
      if (ratio > 1.001) low = std::max(low, -room / (ratio - 1));
    }
  };
  if (form_ != kReeceForm) high = 20;
  for (const Observation& at : soil_.observations) {
    if (at.width > 0) use(at.width);
    if (soil_.tests[at.test].wheel.width_m > 0) use(soil_.tests[at.test].wheel.width_m);
  }
  bound(kModulusShare, low, high);
  // The wheel's: as an unfitted model has them, and fitted ones; least spreads by judgement.
  Soil typical;
  typical.friction_angle_rad = a[kFriction].center;
  typical.density_kg_per_m3 = 1;
  typical.shear_modulus_m = std::exp(a[kLogShearModulus].center);
  std::vector<P> known = typical_.fitted;
  known.push_back(FromSoil(typical, 1));
  const auto wheel = [&](int i, double P::*member, double least_sd, double low, double high,
                         bool logarithmic = false) {
    std::vector<double> values;
    for (const P& p : known) values.push_back(logarithmic ? std::log(p.*member) : p.*member);
    a[i] = PriorOf(values, least_sd);
    bound(i, logarithmic ? std::log(low) : low, logarithmic ? std::log(high) : high);
    a[i].center = std::clamp(a[i].center, a[i].low, a[i].high);
  };
  wheel(kC1, &P::c1, 0.2, 0.02, 0.8);
  wheel(kC2, &P::c2, 0.25, -0.3, 0.7);
  wheel(kC3, &P::c3, 0.3, 0, 1);
  wheel(kSinkageDrive, &P::sinkage_drive, 1, 0, 3);
  wheel(kSinkageBrake, &P::sinkage_brake, 0.5, 0, 3);
  wheel(kSinkageLateral, &P::sinkage_lateral, 0.5, 0, 3);
  wheel(kLogSidePassive, &P::side_passive, 1, 0.02, 90, true);
  wheel(kLogFrontPassive, &P::front_passive, 1, 0.01, 90, true);
  wheel(kLogBulldozingLength, &P::bulldozing_length, 0.8, 1e-5, 2, true);
  a[kRimFriction] = {0.85, 0.15, 0.1, 1.3};
}

void SoilLaw::SetFree() {
  bool press = false, wheel = false, shear = false;
  for (const Observation& at : soil_.observations) {
    const TestKind kind = soil_.tests[at.test].kind;
    press |= kind == TestKind::kPress;
    wheel |= kind == TestKind::kWheel;
    shear |= kind == TestKind::kShear && !at.held_out;
  }
  for (int i = 0; i < kSoilCoordinates; ++i) free_.push_back(i);
  if (wheel) {
    for (int i = kC1; i < kRimFriction; ++i) free_.push_back(i);
  } else if (press) {
    free_.push_back(kC3);
  }
  // Without shear tests c and phi are the rim's own.
  if (wheel && shear) {
    free_.push_back(kRimFriction);
  } else {
    priors_[kRimFriction].center = 1;
  }
  const bool reece = form_ == kReeceForm;
  reported_ = {{"n", "-", &P::n, kExponent, false, "n"}};
  if (reece) {
    reported_.push_back({"reece_k_c", "-", &P::reece_k_c, -1, false, "k_c'"});
    reported_.push_back({"reece_k_phi", "-", &P::reece_k_phi, -1, false, "k_phi'"});
  } else {
    reported_.push_back({"k_c", "N/m^(n+1)", &P::k_c, -1, false, "k_c"});
    reported_.push_back({"k_phi", "N/m^(n+2)", &P::k_phi, -1, false, "k_phi"});
  }
  const ReportedParameter rest[] = {
      {"cohesion", "Pa", &P::cohesion, kCohesion, false, "cohesion"},
      {"friction_angle", "rad", &P::friction_angle, kFriction, false, "friction angle"},
      {"shear_modulus", "m", &P::shear_modulus, kLogShearModulus, true, "K"},
      {"c1", "-", &P::c1, kC1, false, "c1"},
      {"c2", "-", &P::c2, kC2, false, "c2"},
      {"c3", "-", &P::c3, kC3, false, "c3 (exit angle)"},
      {"sinkage_drive", "-", &P::sinkage_drive, kSinkageDrive, false, "slip sinkage by driving"},
      {"sinkage_brake", "-", &P::sinkage_brake, kSinkageBrake, false, "slip sinkage by braking"},
      {"sinkage_lateral", "-", &P::sinkage_lateral, kSinkageLateral, false,
       "slip sinkage by lateral motion"},
      {"side_passive", "-", &P::side_passive, kLogSidePassive, true,
       "passive pressure on the side"},
      {"front_passive", "-", &P::front_passive, kLogFrontPassive, true,
       "passive pressure ahead of a braked rim"},
      {"bulldozing_length", "m", &P::bulldozing_length, kLogBulldozingLength, true, "K_b"},
      {"rim_friction", "-", nullptr, kRimFriction, false, "friction of the rim"}};
  for (const ReportedParameter& r : rest) {
    if (std::ranges::count(free_, r.coordinate) > 0) reported_.push_back(r);
  }
}

double SoilLaw::ScaleOf(const Observation& at, double value) const {
  if (at.output < 0) return std::max(std::abs(value), 0.05 * largest_[at.test]);
  const VelocityState& v = at.motion;
  const bool rest = v.v_x == 0 && v.v_y == 0 && v.rim_speed == 0;
  const double p = rest ? 0 : Hull::Bulldozing(ToCanonical(v.v_x, v.v_y, v.rim_speed));
  return OutputScale(at.output, at.load, soil_.tests[at.test].wheel.radius_m) *
         (1 + typical_.bulldozing[at.output] * p);
}

double SoilLaw::TypicalError(TestKind kind, int output) const {
  return kind == TestKind::kWheel ? typical_.wheel_error[output] : typical_.curve_error;
}

BekkerParameters SoilLaw::ParametersOf(const Coordinates& x) const {
  P p;
  p.n = x[kExponent];
  p.cohesion = x[kCohesion];
  p.friction_angle = x[kFriction];
  p.shear_modulus = std::exp(x[kLogShearModulus]);
  p.c1 = x[kC1];
  p.c2 = x[kC2];
  p.c3 = x[kC3];
  p.sinkage_drive = x[kSinkageDrive];
  p.sinkage_brake = x[kSinkageBrake];
  p.sinkage_lateral = x[kSinkageLateral];
  p.side_passive = std::exp(x[kLogSidePassive]);
  p.front_passive = std::exp(x[kLogFrontPassive]);
  p.bulldozing_length = std::exp(x[kLogBulldozingLength]);
  p.unit_weight = soil_.gravity * soil_.density_kg_per_m3.value_or(1600);
  p.pressure_form = form_;
  const double share = x[kModulusShare], pressure = std::exp(x[kLogPressure]);
  if (form_ == kReeceForm) {
    const double of_width = pressure * std::pow(width_ / sinkage_, p.n);
    p.reece_k_c = share * of_width / p.cohesion;
    p.reece_k_phi = (1 - share) * of_width / (p.unit_weight * width_);
    p.k_phi = 0;
  } else {
    const double modulus = pressure / std::pow(sinkage_, p.n);
    p.k_c = share * modulus * width_;
    p.k_phi = (1 - share) * modulus;
  }
  return p;
}

Coordinates SoilLaw::CoordinatesOf(const BekkerParameters& p) const {
  Coordinates x;
  for (int i = 0; i < kCoordinates; ++i) x[i] = priors_[i].center;
  const double modulus = ModulusAt(p, width_);
  x[kLogPressure] = std::log(modulus) + p.n * std::log(sinkage_);
  x[kExponent] = p.n;
  x[kModulusShare] = form_ == kReeceForm
                         ? p.cohesion * p.reece_k_c / (modulus * std::pow(width_, p.n))
                         : p.k_c / width_ / modulus;
  x[kCohesion] = p.cohesion;
  x[kFriction] = p.friction_angle;
  x[kLogShearModulus] = std::log(p.shear_modulus);
  return x;
}

double SoilLaw::ReportedValue(int parameter, const Coordinates& x) const {
  const ReportedParameter& r = reported_[parameter];
  if (r.member == nullptr) return x[kRimFriction];
  return ParametersOf(x).*r.member;
}

double SoilLaw::ShareAt(const Pin& pin, const Coordinates& x) const {
  const double pressure = std::exp(x[kLogPressure]);
  const bool first =
      reported_[pin.parameter].member == (form_ == kReeceForm ? &P::reece_k_c : &P::k_c);
  if (form_ == kReeceForm) {
    const double of_width = pressure * std::pow(width_ / sinkage_, x[kExponent]);
    const double weight = soil_.gravity * soil_.density_kg_per_m3.value_or(1600);
    return first ? pin.value * x[kCohesion] / of_width : 1 - pin.value * weight * width_ / of_width;
  }
  const double modulus = pressure / std::pow(sinkage_, x[kExponent]);
  return first ? pin.value / (modulus * width_) : 1 - pin.value / modulus;
}

namespace {

// The states of one wheel, solved as a batch.
struct WheelStates {
  std::vector<double> v_x, v_y, rim, load;
  std::vector<std::size_t> observation;
  std::vector<std::size_t> state;  // of each observation
};

void PredictWheels(const BekkerModel& model, const WheelStates& states,
                   const std::vector<Observation>& at, std::vector<double>* out) {
  std::array<std::vector<double>, kOutputs> value;
  BekkerBatch batch;
  batch.v_x = states.v_x;
  batch.v_y = states.v_y;
  batch.rim_speed = states.rim;
  batch.load = states.load;
  for (int o = 0; o < kOutputs; ++o) {
    value[o].resize(states.load.size());
    batch.value[o] = value[o];
  }
  model.SolveBatch(batch);
  for (std::size_t k = 0; k < states.observation.size(); ++k) {
    const std::size_t i = states.observation[k];
    (*out)[i] = value[at[i].output][states.state[k]];
  }
}

}  // namespace

void SoilLaw::Predict(const Coordinates& x, const std::vector<Observation>& at,
                      const std::vector<MeasuredTest>& tests, std::vector<double>* out) const {
  const P soil = ParametersOf(x);
  P rim = soil;
  rim.cohesion *= x[kRimFriction];
  rim.friction_angle = std::atan(x[kRimFriction] * std::tan(soil.friction_angle));
  if (form_ == kReeceForm) rim.reece_k_c /= x[kRimFriction];  // c k_c' is the soil's
  out->resize(at.size());
  std::map<int, WheelStates> wheels;
  std::map<int, BekkerModel> models;
  const auto model_of = [&](int test) -> const BekkerModel& {
    return models.try_emplace(test, rim, tests[test].wheel).first->second;
  };
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Observation& o = at[i];
    switch (tests[o.test].kind) {
      case TestKind::kPlate:
        (*out)[i] = ModulusAt(soil, o.width) * std::pow(o.sinkage, soil.n);
        break;
      case TestKind::kShear:
        (*out)[i] = (soil.cohesion + o.pressure * std::tan(soil.friction_angle)) *
                    -std::expm1(-o.displacement / soil.shear_modulus);
        break;
      case TestKind::kPress:
        (*out)[i] = model_of(o.test).AtSinkage({0, 0, 0, 0, 1, 1}, o.sinkage).value[kFz];
        break;
      case TestKind::kWheel: {
        WheelStates& w = wheels[o.test];
        const VelocityState& v = o.motion;
        if (w.load.empty() || w.v_x.back() != v.v_x || w.v_y.back() != v.v_y ||
            w.rim.back() != v.rim_speed || w.load.back() != o.load) {
          w.v_x.push_back(v.v_x);
          w.v_y.push_back(v.v_y);
          w.rim.push_back(v.rim_speed);
          w.load.push_back(o.load);
        }
        w.observation.push_back(i);
        w.state.push_back(w.load.size() - 1);
      }
    }
  }
  for (const auto& [test, states] : wheels) PredictWheels(model_of(test), states, at, out);
}

std::vector<double> SoilLaw::Predict(const Coordinates& x) const {
  std::vector<double> out;
  Predict(x, soil_.observations, soil_.tests, &out);
  return out;
}

}  // namespace grouser::surrogate
