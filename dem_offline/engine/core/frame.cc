#include "dem_offline/engine/core/frame.h"

#include <stdexcept>
#include <string>

namespace grouser::dem {
namespace {

constexpr double kPeriod = 4294967296.0;  // 2^32

}  // namespace

std::array<float, 3> Frame::Quantum() const {
  return {static_cast<float>(length_m / kPeriod), static_cast<float>(width_m / kPeriod),
          static_cast<float>(z_span_m / kPeriod)};
}
std::int32_t Frame::FixX(double x_m) const { return WrapFix(x_m, length_m); }
std::int32_t Frame::FixY(double y_m) const { return WrapFix(y_m, width_m); }
std::int32_t Frame::FixZ(double z_m) const {
  if (!(std::abs(z_m) < 0.5 * z_span_m)) {
    throw std::out_of_range("z: " + std::to_string(z_m) + " m, expected within +-" +
                            std::to_string(0.5 * z_span_m) + " m");
  }
  return SpanFix(z_m, z_span_m);
}

}  // namespace grouser::dem
