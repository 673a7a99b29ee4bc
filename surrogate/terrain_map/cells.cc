#include "surrogate/terrain_map/cells.h"

#include <array>
#include <cmath>
#include <limits>

namespace grouser::terrain_map {
namespace {

// Probabilities of a cell's soils, or all of one soil. False: a hole.
bool SoilsOf(const Cells& cells, std::size_t cell, std::span<float> probabilities) noexcept {
  if (cells.probability.empty()) {
    const std::size_t soil = cells.soil.empty() ? 0 : cells.soil[cell];
    if (soil >= probabilities.size()) return false;
    for (float& p : probabilities) p = 0;
    probabilities[soil] = 1;
    return true;
  }
  for (std::size_t s = 0; s < probabilities.size(); ++s) {
    probabilities[s] = cells.probability[s * cells.stride + cell];
  }
  return !std::isnan(probabilities[0]);
}

void Put(const CellAnswers& out, std::size_t cell, const CellAnswer& a, std::uint8_t binding) {
  const auto put = [cell](auto span, auto value) {
    if (!span.empty()) span[cell] = value;
  };
  put(out.speed, a.speed_m_per_s);
  put(out.energy, a.joules_per_metre);
  put(out.go_least, a.go_least);
  put(out.go_most, a.go_most);
  put(out.binding, binding);
}

}  // namespace

void SlopesOf(const Heights& in, std::span<double> slope_rad,
              std::span<double> up_azimuth_rad) noexcept {
  const auto row = [&](std::size_t r) { return in.heights_m.subspan(r * in.stride, in.columns); };
  std::size_t cell = 0;
  for (std::size_t r = 1; r + 1 < in.rows; ++r) {
    const Rows three = {row(r - 1), row(r), row(r + 1)};
    for (std::size_t c = 1; c + 1 < in.columns; ++c, ++cell) {
      const Slope slope = SlopeAt(three, c, in.width_m, in.height_m);
      slope_rad[cell] = slope.angle_rad;
      up_azimuth_rad[cell] = slope.up_azimuth_rad;
    }
  }
}

void AnswerCells(std::span<const SlopeTable> tables, double negligible, const Cells& cells,
                 const Way& way, const CellAnswers& out) noexcept {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  static_assert(vehicle::kMostSoils <= kNoCell);
  std::array<float, vehicle::kMostSoils> room;
  const std::span<float> probabilities = std::span(room).first(tables.size());
  for (std::size_t i = 0; i < cells.slope_rad.size(); ++i) {
    const double slope = cells.slope_rad[i];
    double heading = way.of_grid ? cells.up_azimuth_rad[i] - way.angle_rad : way.angle_rad;
    if (!std::isfinite(heading) && slope == 0) heading = 0;  // all are alike
    if (std::isnan(slope) || !std::isfinite(heading) || !SoilsOf(cells, i, probabilities)) {
      Put(out, i, {kNaN, kNaN, kNaN, kNaN, {}}, kNoCell);
      continue;
    }
    const auto ask = [&](double on) {
      return AnswerOf(tables, probabilities, negligible, slope, on);
    };
    CellAnswer answer = ask(heading);
    if (way.both_ways) {
      const CellAnswer other = ask(-way.angle_rad);
      if (other.speed_m_per_s < answer.speed_m_per_s ||
          (other.speed_m_per_s == answer.speed_m_per_s && other.go_least < answer.go_least)) {
        answer = other;
      }
    }
    Put(out, i, answer, static_cast<std::uint8_t>(answer.binding));
  }
}

}  // namespace grouser::terrain_map
