#include "dem_offline/engine/rig/work.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

namespace grouser::dem {
namespace {

constexpr double kPollGrainSteps = 2e6;

/// First number in a file; NaN: there is none.
double NumberIn(const char* path) {
  std::ifstream file(path);
  double value = std::nan("");
  return file >> value ? value : std::nan("");
}

double AvailableBytes() {
  double bytes = 1e300;
  std::ifstream info("/proc/meminfo");
  for (std::string key, unit; info >> key;) {
    double kib = 0;
    info >> kib;
    std::getline(info, unit);
    if (key == "MemAvailable:") bytes = 1024 * kib;
  }
  const double most = NumberIn("/sys/fs/cgroup/memory.max");  // "max": no limit
  const double used = NumberIn("/sys/fs/cgroup/memory.current");
  if (most > 0 && used >= 0) bytes = std::min(bytes, std::max(0.0, most - used));
  return bytes;
}

std::string InGibibytes(double bytes) { return Short(bytes / 1073741824.0) + " GiB"; }

}  // namespace

std::string Short(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

void CheckPositive(const std::string& field, double value) {
  if (!std::isfinite(value) || !(value > 0)) throw SpecError(field, Short(value), "a number > 0");
}

void CheckWithin(const std::string& field, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw SpecError(field, Short(value), "a number in [" + Short(low) + ", " + Short(high) + "]");
  }
}

double MostBytes(const WorkLimits& limits) {
  return limits.bytes > 0 ? limits.bytes : kMemoryShare * AvailableBytes();
}

void CheckWork(const std::string& field, const Work& work, const WorkLimits& limits) {
  const auto refuse = [&](const std::string& got, const std::string& expected) {
    throw SpecError(field, got, expected);
  };
  const std::string grains = Short(work.grains) + " grains";
  if (!(work.grains <= kMostGrains)) refuse(grains, "at most " + Short(kMostGrains));
  if (!(work.steps <= limits.steps)) {
    refuse(Short(work.steps) + " time steps", "at most " + Short(limits.steps));
  }
  if (!(work.grains * work.steps <= limits.grain_steps)) {
    refuse(grains + " over " + Short(work.steps) + " time steps, " +
               Short(work.grains * work.steps) + " grain-steps",
           "at most " + Short(limits.grain_steps));
  }
  const double most = MostBytes(limits);
  if (!(work.bytes <= most)) {
    refuse(grains + " over " + Short(work.steps) + " time steps in " + InGibibytes(work.bytes) +
               " of memory",
           "at most " + InGibibytes(most) + " of memory");
  }
}

std::int64_t PollSteps(std::int64_t grains) {
  return std::clamp<std::int64_t>(
      static_cast<std::int64_t>(kPollGrainSteps /
                                static_cast<double>(std::max<std::int64_t>(grains, 1))),
      1, 500);
}

}  // namespace grouser::dem
