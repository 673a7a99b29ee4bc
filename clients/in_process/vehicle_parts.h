#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "clients/in_process/grouser/vehicle.h"
#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/vehicle_file.h"

// What vehicle.cc, vehicle_solver.cc and speed_planner.cc share; not installed.

namespace grouser {

struct Vehicle::Parts {
  vehicle::VehicleFile file;
  std::vector<std::string> wheels, drives;
  std::vector<WheelPlace> places;
};

/// Why an answer is refused, without allocation: the first thing that was found.
struct Fault {
  const char* name = nullptr;  ///< of a span or number; null: nothing is wrong
  const char* expected = "";   ///< of a number, or besides `entries` of a span
  bool of_size = false;
  std::size_t got_entries = 0, entries = 0;  ///< of_size
  double got = 0;                            ///< else
  std::ptrdiff_t index = -1;                 ///< of the number in its span; -1: no span

  explicit operator bool() const noexcept { return name != nullptr; }
  std::string Text() const;
};

/// Collects the first fault.
class FaultFinder {
 public:
  const Fault& fault() const noexcept { return fault_; }

  template <class T>
  void Size(const char* name, std::span<T> span, std::size_t n, bool required = false) noexcept {
    if (fault_ || span.size() == n || (!required && span.empty())) return;
    fault_ = {name, required ? "" : " or none", true, span.size(), n, 0, -1};
  }
  void Number(bool good, const char* name, double got, const char* expected,
              std::ptrdiff_t index = -1) noexcept {
    if (fault_ || good) return;
    fault_ = {name, expected, false, 0, 0, got, index};
  }
  void Finite(const char* name, std::span<const double> span) noexcept {
    for (std::size_t i = 0; i < span.size() && !fault_; ++i) {
      Number(std::isfinite(span[i]), name, span[i], "a finite number",
             static_cast<std::ptrdiff_t>(i));
    }
  }
  void Check(const Margins& m) noexcept {
    Number(m.tip >= 0 && m.tip < 1, "margins.tip", m.tip, "0 to below 1");
    Number(std::isfinite(m.torque), "margins.torque", m.torque, "a finite number");
    Number(std::isfinite(m.sinkage), "margins.sinkage", m.sinkage, "a finite number");
  }

 private:
  Fault fault_;
};

inline vehicle::SpeedOptions ToOurs(const Margins& m) noexcept {
  vehicle::SpeedOptions o;
  o.tip_margin = m.tip;
  o.torque_margin = m.torque;
  o.sinkage_margin = m.sinkage;
  o.trained_only = m.trained_only;
  return o;
}

/// Null for none. Throws std::invalid_argument.
inline std::shared_ptr<const vehicle::GroundDraws> DrawsOf(const vehicle::Grounds& grounds,
                                                           std::size_t count) {
  if (count == 0) return nullptr;
  return std::make_shared<const vehicle::GroundDraws>(grounds, count);
}

/// The entry of a span, or 0 where there is none.
inline double EntryOf(std::span<const double> span, std::size_t i) noexcept {
  return span.empty() ? 0.0 : span[i];
}

}  // namespace grouser
