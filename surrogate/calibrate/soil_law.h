#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "surrogate/calibrate/measurement.h"
#include "surrogate/models/bekker.h"

namespace grouser::surrogate {

/// What is fitted. The first six are the soil's; the others belong to the wheel on it and are
/// free where there are wheels, fitted or predicted: what is not known of them widens predictions.
/// With z0, b0 the typical sinkage and width of the tests:
enum Coordinate : int {
  kLogPressure = 0,  ///< ln of the pressure [Pa] at z0 under a plate of width b0
  kExponent,         ///< n
  kModulusShare,     ///< of k_c/b0 in k_c/b0 + k_phi; Reece: of c k_c' in c k_c' + gamma b0 k_phi'
  kCohesion,         ///< c [Pa]
  kFriction,         ///< phi [rad]
  kLogShearModulus,  ///< ln K [m]
  kC1,
  kC2,
  kC3,
  kSinkageDrive,
  kSinkageBrake,
  kSinkageLateral,
  kLogSidePassive,
  kLogFrontPassive,
  kLogBulldozingLength,
  kRimFriction,  ///< rim against soil over soil against soil, of tan phi and of c
  kCoordinates
};
inline constexpr int kSoilCoordinates = kLogShearModulus + 1;
using Coordinates = std::array<double, kCoordinates>;

/// What is known before anything is measured.
struct Typical {
  std::vector<Soil> soils;  ///< published ones
  /// Fitted models of wheels: beside FromSoil they say what the wheel's own coordinates are like.
  std::vector<BekkerParameters> fitted;
  /// Errors of the law itself with parameters that were fitted. Of wheels, by output: sd over
  /// OutputScale and over 1 + bulldozing P (Hull::Bulldozing).
  std::array<double, kOutputs> wheel_error{}, bulldozing{};
  double curve_error = 0.1;  ///< of plates, shear and press, over the value; by judgement
};

/// Where a coordinate is expected before anything is measured, and where it must lie.
struct Prior {
  double center = 0, sd = 1, low = 0, high = 0;
};

/// A reported parameter held at a value. Moduli bind kModulusShare, as the others stand.
struct Pin {
  int parameter = 0;  ///< index in SoilLaw::Reported
  double value = 0;
};

/// A parameter as users know it.
struct ReportedParameter {
  const char* name;
  const char* unit;
  double BekkerParameters::*member;  ///< null: rim_friction
  int coordinate;                    ///< one to one with it; -1: a modulus
  bool logarithmic = false;          ///< the coordinate is its logarithm
  const char* words;                 ///< as a direction in words names it
};

/// What the tests of one soil should have measured, by parameters:
/// plate  p = k z^n, k = k_c/b + k_phi (Bekker 1969) or (c k_c' + gamma b k_phi')/b^n (Reece
///        1965), b the radius of a disc or the lesser side;
/// shear  tau = (c + sigma tan phi)(1 - exp(-j/K)) (Janosi & Hanamoto 1961);
/// press  and wheel: BekkerModel, AtSinkage of a standing wheel and Solve, with c and tan phi times
///        the rim's share.
class SoilLaw {
 public:
  /// `form`: kBekkerForm or kReeceForm. Of `typical` the soils of soil.kind count, if it is set.
  /// Keeps a reference to `soil`.
  SoilLaw(const MeasuredSoil& soil, const Typical& typical, double form);

  const MeasuredSoil& soil() const { return soil_; }
  double form() const { return form_; }
  /// What counts as 1 where the law is off by a share: for wheels OutputScale (1 + bulldozing P),
  /// else `value`, but at least a twentieth of the test's largest that is fitted.
  double ScaleOf(const Observation& at, double value) const;
  /// The law's typical error in such units.
  double TypicalError(TestKind kind, int output) const;
  const std::array<Prior, kCoordinates>& priors() const { return priors_; }
  /// Coordinates that are to be fitted; the others stay at their centers.
  const std::vector<int>& free() const { return free_; }
  const std::vector<ReportedParameter>& Reported() const { return reported_; }
  double reference_width() const { return width_; }
  double reference_sinkage() const { return sinkage_; }

  BekkerParameters ParametersOf(const Coordinates& x) const;
  /// Of the soil's six; the rest at the priors' centers.
  Coordinates CoordinatesOf(const BekkerParameters& soil) const;
  double ReportedValue(int parameter, const Coordinates& x) const;
  /// kModulusShare at which the pinned modulus has its value.
  double ShareAt(const Pin& pin, const Coordinates& x) const;

  /// Of every given observation; sizes agree. Throws std::invalid_argument where the model
  /// refuses the parameters.
  void Predict(const Coordinates& x, const std::vector<Observation>& at,
               const std::vector<MeasuredTest>& tests, std::vector<double>* out) const;
  std::vector<double> Predict(const Coordinates& x) const;

 private:
  void SetPriors();
  void SetFree();

  const MeasuredSoil& soil_;
  Typical typical_;
  double form_, width_ = 0, sinkage_ = 0;
  std::vector<double> largest_;  // of each test
  std::array<Prior, kCoordinates> priors_;
  std::vector<int> free_;
  std::vector<ReportedParameter> reported_;
};

}  // namespace grouser::surrogate
