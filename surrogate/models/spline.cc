#include "surrogate/models/spline.h"

#include <cstddef>
#include <numbers>

namespace grouser::surrogate {
namespace {

constexpr double kPole = -0.26794919243112270647;  // sqrt(3) - 2, of the filter
constexpr int kMemory = 29;                        // |kPole|^28 < 1e-16

/// Values of one line, continued by kMemory on either side.
class Line {
 public:
  explicit Line(int last) : last_(last), values_(last + 1 + 2 * kMemory) {}

  double& operator[](int i) { return values_[i + kMemory]; }

  void Continue(SplineEnd first, SplineEnd last) {
    for (int k = 1; k <= kMemory; ++k) {  // in turns: short lines need both sides
      (*this)[-k] = Beyond(first, (*this)[0], (*this)[k]);
      (*this)[last_ + k] = Beyond(last, (*this)[last_], (*this)[last_ - k]);
    }
  }

  /// Period last + 1, after which the sign is `sign`.
  void Wrap(int sign) {
    const int period = last_ + 1;
    for (int k = 1; k <= kMemory; ++k) {
      (*this)[-k] = sign * (*this)[period - k];
      (*this)[last_ + k] = sign * (*this)[k - 1];
    }
  }

  /// Values become coefficients: c(i-1) + 4 c(i) + c(i+1) = 6 value(i).
  void Filter() {
    const int n = static_cast<int>(values_.size());
    for (int i = 1; i < n; ++i) values_[i] += kPole * values_[i - 1];
    values_[n - 1] *= -kPole / (1 - kPole * kPole);
    for (int i = n - 2; i >= 0; --i) values_[i] = kPole * (values_[i + 1] - values_[i]);
    for (double& value : values_) value *= 6;
  }

 private:
  static double Beyond(SplineEnd end, double edge, double mirror) {
    switch (end) {
      case SplineEnd::kEven:
        return mirror;
      case SplineEnd::kOdd:
        return -mirror;
      default:
        return 2 * edge - mirror;
    }
  }

  int last_;
  std::vector<double> values_;
};

/// A block of `outer` x `count` x `inner` values, filtered along its middle;
/// `continued` says how a line goes on. The result is padded to `padded`: one
/// element before the first, the rest after the last.
template <typename Continued>
std::vector<double> Along(const std::vector<double>& values, int outer, int count, int inner,
                          int padded, const Continued& continued) {
  std::vector<double> result(static_cast<std::size_t>(outer) * padded * inner);
  Line line(count - 1);
  for (int o = 0; o < outer; ++o) {
    for (int i = 0; i < inner; ++i) {
      const std::size_t from = static_cast<std::size_t>(o) * count * inner + i;
      const std::size_t to = static_cast<std::size_t>(o) * padded * inner + i;
      for (int k = 0; k < count; ++k) line[k] = values[from + static_cast<std::size_t>(k) * inner];
      continued(line);
      line.Filter();
      for (int k = 0; k < padded; ++k) {
        result[to + static_cast<std::size_t>(k) * inner] = line[k - 1];
      }
    }
  }
  return result;
}

}  // namespace

std::vector<TableNode> TableNodes(const TableAxes& axes) {
  constexpr double kPi = std::numbers::pi;
  std::vector<TableNode> nodes;
  const double step = (axes.log_load_max - axes.log_load_min) / axes.load;
  for (int i = 0; i < axes.direction; ++i) {
    for (int j = 0; j <= axes.lateral; ++j) {
      for (int k = 0; k <= axes.load; ++k) {
        nodes.push_back({{-kPi / 2 + kPi * i / axes.direction, kPi / 2 * j / axes.lateral},
                         axes.log_load_min + step * k});
      }
    }
  }
  return nodes;
}

std::vector<double> InterpolateTable(const TableAxes& axes, ResidualTable::Parity parity,
                                     const std::vector<double>& node_values,
                                     const SplineEnds& ends) {
  const int a = axes.direction, b = axes.lateral, c = axes.load;
  const SplineEnd ahead = parity.y > 0 ? SplineEnd::kEven : SplineEnd::kOdd;
  std::vector<double> part =
      Along(node_values, 1, a, (b + 1) * (c + 1), a + 3, [&](Line& line) { line.Wrap(parity.x); });
  part =
      Along(part, a + 3, b + 1, c + 1, b + 3, [&](Line& line) { line.Continue(ahead, ends.pole); });
  return Along(part, (a + 3) * (b + 3), c + 1, 1, c + 3,
               [&](Line& line) { line.Continue(ends.load, ends.load); });
}

}  // namespace grouser::surrogate
