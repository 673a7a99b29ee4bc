#include "surrogate/fit/stress_profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "surrogate/model_io/run_summary.h"

namespace grouser::surrogate {
namespace {

constexpr double kContact = 0.01;    // of the peak: less is no contact
constexpr double kLeastShear = 0.1;  // of the normal peak: near slip 0 there is none to scale by
constexpr double kShareMin = 0.4, kShareMax = 1.2;
constexpr int kPerBin = 4;  // points of the law a bin

double PeakOf(const std::vector<double>& values) {
  double peak = 0;
  for (const double v : values) peak = std::max(peak, std::fabs(v));
  return peak;
}

// Share of a box of width `bin` that another of width `smear`, `apart` from it
// centre to centre, covers: how much a point counts in a smeared bin.
double Overlap(double apart, double bin, double smear) {
  const double low = std::max(-0.5 * bin, apart - 0.5 * smear);
  const double high = std::min(0.5 * bin, apart + 0.5 * smear);
  return std::max(0.0, high - low);
}

}  // namespace

RimForces ForcesOf(const RimProfile& p, const WheelGeometry& wheel) {
  RimForces sum{0, 0, 0};
  const double area = wheel.radius_m * wheel.width_m * p.step_rad;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double s = std::sin(p.MiddleOf(i)), c = std::cos(p.MiddleOf(i));
    sum.f_z += area * (p.normal[i] * c + p.tangential[i] * s);
    sum.f_x += area * (p.tangential[i] * c - p.normal[i] * s);
    sum.torque += area * wheel.radius_m * p.tangential[i];
  }
  return sum;
}

bool HasProfile(const v1alpha1::RunSummary& run) {
  if (const std::string damage = StressDamageOf(run); !damage.empty()) {
    throw std::invalid_argument("run " + run.run_id() + ": " + damage);
  }
  return HasStress(run);
}

RimProfile CanonicalProfile(const Sample& row) {
  v1alpha1::StressSummary s = row.source->stress();
  if (row.state().sign_x < 0) MirrorStress(&s);
  return {s.first_angle_rad(),
          s.angle_step_rad(),
          {s.normal_pa().begin(), s.normal_pa().end()},
          {s.shear_tangential_pa().begin(), s.shear_tangential_pa().end()}};
}

ProfileSamples SamplesOf(const RimProfile& like, double smear_rad) {
  const double fine = like.step_rad / kPerBin;
  const double smear = std::max(smear_rad, 1e-9);
  // Points beyond the ends reach into the last bins; beside a bin, as many.
  const int beside = static_cast<int>(std::ceil(0.5 * smear / fine));
  ProfileSamples s{kPerBin, std::vector<double>(like.size() * kPerBin + 2 * beside),
                   std::vector<double>(kPerBin + 2 * beside)};
  for (std::size_t j = 0; j < s.angle.size(); ++j) {
    s.angle[j] = like.first_rad + (static_cast<double>(j) - beside + 0.5) * fine;
  }
  double sum = 0;
  for (std::size_t k = 0; k < s.weight.size(); ++k) {
    const double apart = (static_cast<double>(k) - beside + 0.5 - 0.5 * kPerBin) * fine;
    s.weight[k] = Overlap(apart, like.step_rad, smear);
    sum += s.weight[k];
  }
  for (double& w : s.weight) w /= sum;
  return s;
}

RimProfile ModelProfile(const BekkerModel& model, const Canonical& state, double sinkage,
                        const RimProfile& like, double smear_rad) {
  const ProfileSamples samples = SamplesOf(like, smear_rad);
  std::vector<RimStress> stress(samples.angle.size());
  model.StressesAt(state, sinkage, samples.angle, stress);
  const std::size_t bins = like.size();
  RimProfile p{like.first_rad, like.step_rad, std::vector<double>(bins), std::vector<double>(bins)};
  for (std::size_t i = 0; i < bins; ++i) {
    for (std::size_t k = 0; k < samples.weight.size(); ++k) {
      const RimStress& at = stress[i * samples.per_bin + k];
      p.normal[i] += samples.weight[k] * at.normal;
      p.tangential[i] += samples.weight[k] * at.tangential;
    }
  }
  return p;
}

double GrainAngle(const v1alpha1::Scene& scene) {
  double mass = 0, sum = 0;
  for (const auto& size : scene.soil().grains().sizes()) {
    mass += size.mass_fraction();
    sum += size.mass_fraction() * size.diameter_m();
  }
  return mass > 0 && scene.wheel().radius_m() > 0 ? sum / mass / scene.wheel().radius_m() : 0;
}

ComparedProfile MakeCompared(const Sample& row, const WheelGeometry& wheel) {
  ComparedProfile c{CanonicalProfile(row), 0, 0, 0, 0};
  c.share = ForcesOf(c.measured, wheel).f_z / row.mean[kFz];
  if (!IsComparable(c)) return c;
  for (double& v : c.measured.normal) v /= c.share;
  for (double& v : c.measured.tangential) v /= c.share;
  const double peak = PeakOf(c.measured.normal);
  c.sd_normal = kProfileNoise * peak;
  c.sd_tangential = kProfileNoise * std::max(PeakOf(c.measured.tangential), kLeastShear * peak);
  c.bins = static_cast<int>(std::count_if(c.measured.normal.begin(), c.measured.normal.end(),
                                          [&](double v) { return v > kContact * peak; }));
  return c;
}

bool IsComparable(const ComparedProfile& profile) {
  return profile.share >= kShareMin && profile.share <= kShareMax;
}

ProfileMisfit MisfitOf(const RimProfile& model, const RimProfile& measured) {
  const auto relative = [](const std::vector<double>& a, const std::vector<double>& b) {
    double difference = 0, size = 0;
    for (std::size_t i = 0; i < b.size(); ++i) {
      difference += (a[i] - b[i]) * (a[i] - b[i]);
      size += b[i] * b[i];
    }
    return std::sqrt(difference / size);
  };
  return {relative(model.normal, measured.normal), relative(model.tangential, measured.tangential)};
}

}  // namespace grouser::surrogate
