#include "surrogate/fit/error_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace grouser::surrogate {

v1alpha1::Region RegionOf(double slip, double attack_angle_rad) {
  const double limit = 15 * std::numbers::pi / 180 + 1e-9;
  if (std::fabs(attack_angle_rad) > limit) return v1alpha1::REGION_LATERAL;
  if (slip < -0.05) return v1alpha1::REGION_BRAKING;
  return slip > 0.05 ? v1alpha1::REGION_DRIVING : v1alpha1::REGION_TOWED;
}

const char* RegionName(v1alpha1::Region region) {
  static constexpr std::array kNames = {"all", "braking", "towed", "driving", "lateral"};
  const auto* at = std::ranges::find(kRegions, region);
  return kNames[at == kRegions.end() ? 0 : at - kRegions.begin()];
}

bool IsIn(v1alpha1::Region region, double slip, double attack_angle_rad) {
  return region == v1alpha1::REGION_ALL || region == RegionOf(slip, attack_angle_rad);
}

bool Covered(double mean, double value, double half_width) {
  return std::fabs(mean - value) <= half_width * (1 + 1e-9) + 1e-12;
}

std::vector<Comparison> CompareRows(const TabulatedModel& model, const std::vector<Sample>& rows) {
  std::vector<Comparison> result;
  for (const Sample& row : rows) {
    const WheelAnswer a =
        model.EvaluateOne(row.motion.v_x, row.motion.v_y, row.motion.rim_speed, row.load_n);
    result.push_back({&row, a.value, a.half_width});
  }
  return result;
}

std::vector<v1alpha1::ErrorRow> ErrorTable(const std::vector<Comparison>& comparisons,
                                           const std::string& set) {
  std::vector<v1alpha1::ErrorRow> table;
  for (const v1alpha1::Region region : kRegions) {
    for (const Output o : kPredicted) {
      double square = 0, largest = 0;
      int n = 0, covered = 0;
      for (const Comparison& c : comparisons) {
        if (!IsIn(region, c.row->slip, c.row->attack_angle_rad)) continue;
        const double miss = std::fabs(c.row->mean[o] - c.value[o]);
        ++n;
        square += miss * miss;
        largest = std::max(largest, miss);
        covered += Covered(c.row->mean[o], c.value[o], c.half_width[o]) ? 1 : 0;
      }
      if (n == 0) continue;
      v1alpha1::ErrorRow row;
      row.set_region(region);
      row.set_output(kOutputFields[o].name);
      row.set_set(set);
      row.set_n(n);
      row.set_rmse(std::sqrt(square / n));
      row.set_max_abs(largest);
      row.set_covered90(static_cast<double>(covered) / n);
      table.push_back(row);
    }
  }
  return table;
}

}  // namespace grouser::surrogate
