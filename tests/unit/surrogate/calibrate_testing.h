#pragma once

#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "surrogate/calibrate/soil_law.h"
#include "surrogate/soils/soil_table.h"

namespace grouser::surrogate::testing {

inline Typical Known() {
  std::ifstream file(GROUSER_SOILS);
  Typical typical;
  typical.soils = ReadSoils(file, GROUSER_SOILS);
  typical.wheel_error.fill(0.08);
  return typical;
}

inline Soil PublishedSoil(const std::string& name) {
  for (const Soil& soil : Known().soils) {
    if (soil.name == name) return soil;
  }
  throw std::runtime_error("no soil " + name);
}

/// What a set of tests would have measured on a known soil, with relative noise of normal
/// distribution (sd 0: none; then 1 % is stated).
class Measuring {
 public:
  Measuring(const BekkerParameters& truth, SoilKind kind, double noise, unsigned seed)
      : truth_(truth), noise_(noise), random_(seed) {
    soil_.kind = kind;
    soil_.density_kg_per_m3 = truth.unit_weight / soil_.gravity;
  }

  void Plate(double width, double depth) {
    Begin(TestKind::kPlate);
    for (int i = 1; i <= 12; ++i) {
      Observation at;
      at.width = width;
      at.sinkage = depth * i / 12;
      Add(at, (truth_.k_c / width + truth_.k_phi) * std::pow(at.sinkage, truth_.n));
    }
  }
  void Shear(double pressure) {
    Begin(TestKind::kShear);
    for (int i = 1; i <= 12; ++i) {
      Observation at;
      at.pressure = pressure;
      at.displacement = 0.4 * truth_.shear_modulus * i;
      Add(at, (truth_.cohesion + pressure * std::tan(truth_.friction_angle)) *
                  (1 - std::exp(-at.displacement / truth_.shear_modulus)));
    }
  }
  /// All that is measurable; the rim is as rough as the soil.
  void Wheel(const WheelGeometry& wheel, double load, const std::vector<double>& slips,
             double angle) {
    Begin(TestKind::kWheel);
    soil_.tests.back().wheel = wheel;
    const BekkerModel model(truth_, wheel);
    for (const double slip : slips) {
      Observation at;
      at.slip = slip;
      at.attack_angle = angle;
      at.motion = FromSlip(slip, angle, 1);
      at.load = load;
      const auto answer = model.Solve(at.motion.v_x, at.motion.v_y, at.motion.rim_speed, load);
      ++line_;
      for (const Output o : kMeasurable) {
        at.output = o;
        const double sd = (noise_ > 0 ? noise_ : 0.01) * OutputScale(o, load, wheel.radius_m);
        Put(at, answer.value[o], sd);
      }
    }
  }

  /// All values anew: what the law says at `x`, and noise.
  void MeasureAt(const SoilLaw& law, const Coordinates& x) {
    const std::vector<double> value = law.Predict(x);
    for (std::size_t i = 0; i < value.size(); ++i) {
      Observation& at = soil_.observations[i];
      if (at.output < 0) at.sd = noise_ * value[i];
      at.value = value[i] + at.sd * normal_(random_);
    }
  }
  double Normal() { return normal_(random_); }

  MeasuredSoil& soil() { return soil_; }

 private:
  void Begin(TestKind kind) {
    MeasuredTest test;
    test.kind = kind;
    test.name = std::string(NameOf(kind)) + " " + std::to_string(soil_.tests.size());
    soil_.tests.push_back(test);
    line_ = 1;
  }
  void Add(const Observation& at, double value) {
    ++line_;
    Put(at, value, (noise_ > 0 ? noise_ : 0.01) * value);
  }
  void Put(Observation at, double value, double sd) {
    at.test = static_cast<int>(soil_.tests.size()) - 1;
    at.line = line_;
    at.sd = sd;
    at.value = value + (noise_ > 0 ? sd * normal_(random_) : 0);
    soil_.observations.push_back(at);
  }

  BekkerParameters truth_;
  double noise_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  MeasuredSoil soil_;
  int line_ = 0;
};

inline void PlatesAndShear(Measuring* measuring) {
  measuring->Plate(0.03, 0.04);
  measuring->Plate(0.06, 0.04);
  for (const double pressure : {5e3, 2e4, 8e4}) measuring->Shear(pressure);
}

}  // namespace grouser::surrogate::testing
