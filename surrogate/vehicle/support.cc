#include "surrogate/vehicle/support.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace grouser::vehicle {
namespace {

constexpr double kInside = 1e-9;  // margin at which loads of a tipping vehicle are taken

using Point = std::pair<double, double>;

double Cross(const Point& o, const Point& a, const Point& b) {
  return (a.first - o.first) * (b.second - o.second) - (a.second - o.second) * (b.first - o.first);
}

// Andrew's monotone chain, anticlockwise, without points on edges.
std::vector<Point> ConvexHull(std::vector<Point> points) {
  std::sort(points.begin(), points.end());
  std::vector<Point> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t first = hull.size();
    for (const Point& p : points) {
      while (hull.size() >= first + 2 && Cross(hull[hull.size() - 2], hull.back(), p) <= 0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

// Inverse of a 3 x 3 matrix by cofactors; false: singular.
bool Invert(const double (&m)[3][3], double (*inverse)[3]) {
  const auto minor = [&](int r, int c) {
    const int r0 = (r + 1) % 3, r1 = (r + 2) % 3, c0 = (c + 1) % 3, c1 = (c + 2) % 3;
    return m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0];
  };
  const double det = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
  double size = 1;
  for (const auto& row : m) {
    size *= std::max({std::fabs(row[0]), std::fabs(row[1]), std::fabs(row[2])});
  }
  if (!(std::fabs(det) > 1e-12 * size)) return false;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) inverse[r][c] = minor(c, r) / det;
  }
  return true;
}

}  // namespace

Support::Support(const Vehicle& vehicle) : n_(vehicle.wheels.size()) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < n_; ++i) {
    const Wheel& wheel = vehicle.wheels[i];
    double members = 0;
    for (const Wheel& other : vehicle.wheels) {  // of its bogie: itself if it has none
      if (wheel.bogie < 0 ? &other != &wheel : other.bogie != wheel.bogie) continue;
      x_[i] += other.x_m;
      y_[i] += other.y_m;
      ++members;
    }
    x_[i] /= members;
    y_[i] /= members;
    stiffness_[i] = wheel.stiffness;
    roll_[i] = wheel.roll_share;
    points.emplace_back(x_[i], y_[i]);
  }
  const std::vector<Point> hull = ConvexHull(points);
  for (const Point& p : hull) {
    middle_x_ += p.first / static_cast<double>(hull.size());
    middle_y_ += p.second / static_cast<double>(hull.size());
  }
  for (std::size_t e = 0; e < hull.size(); ++e) {
    const Point &a = hull[e], &b = hull[(e + 1) % hull.size()];
    const double out_x = b.second - a.second, out_y = a.first - b.first;
    const double distance = out_x * (a.first - middle_x_) + out_y * (a.second - middle_y_);
    edge_x_[edges_] = out_x / distance;
    edge_y_[edges_++] = out_y / distance;
  }
  Loads loads;
  double heights[kMostWheels];
  Balance((1u << n_) - 1, true, {1, middle_x_, middle_y_}, &loads, heights);
  all_ = loads.slope;
}

void Support::Describe(pack::Body* body) const noexcept {
  body->middle_x = middle_x_;
  body->middle_y = middle_y_;
  body->edges = static_cast<int>(edges_);
  for (std::size_t e = 0; e < edges_; ++e) {
    body->edge_x[e] = edge_x_[e];
    body->edge_y[e] = edge_y_[e];
  }
  for (std::size_t i = 0; i < n_; ++i) {
    body->wheel[i].load_by_load = all_[i].load;
    body->wheel[i].load_by_x = all_[i].by_x;
    body->wheel[i].load_by_y = all_[i].by_y;
  }
}

double Support::TipMargin(double x, double y) const noexcept {
  double farthest = 0;
  for (std::size_t e = 0; e < edges_; ++e) {
    farthest = std::max(farthest, edge_x_[e] * (x - middle_x_) + edge_y_[e] * (y - middle_y_));
  }
  return 1 - farthest;
}

// Loads with the wheels of the mask on the ground; heights: A + B X + C q Y of all. False: these
// wheels cannot balance anything (fewer than three, or on a line).
bool Support::Balance(unsigned touching, bool shared, const Resultant& r, Loads* out,
                      double* heights) const noexcept {
  double m[3][3] = {};
  for (std::size_t i = 0; i < n_; ++i) {
    if (!(touching >> i & 1)) continue;
    const double x = x_[i] - middle_x_, y = y_[i] - middle_y_, q = shared ? roll_[i] : 1;
    const double row[3] = {1, x, y}, column[3] = {1, x, q * y};
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) m[a][b] += stiffness_[i] * row[a] * column[b];
    }
  }
  double inverse[3][3];
  if (!Invert(m, inverse)) return false;
  // The resultant about the middle: conditioning, and so that symmetric loads are equal.
  const double by_x = r.by_x - middle_x_ * r.load, by_y = r.by_y - middle_y_ * r.load;
  for (std::size_t i = 0; i < n_; ++i) {
    const double x = x_[i] - middle_x_, y = (y_[i] - middle_y_) * (shared ? roll_[i] : 1);
    double s[3];
    for (int b = 0; b < 3; ++b) s[b] = inverse[0][b] + inverse[1][b] * x + inverse[2][b] * y;
    heights[i] = s[0] * r.load + s[1] * by_x + s[2] * by_y;
    const double k = touching >> i & 1 ? stiffness_[i] : 0;
    out->load[i] = k * heights[i];
    out->slope[i] = {k * (s[0] - s[1] * middle_x_ - s[2] * middle_y_), k * s[1], k * s[2]};
  }
  return true;
}

void Support::Spread(const Resultant& resultant, Loads* out) const noexcept {
  Resultant r = resultant;
  const double x = r.by_x / r.load, y = r.by_y / r.load;
  out->tip_margin = TipMargin(x, y);
  if (out->tip_margin < kInside) {
    const double share = (1 - kInside) / (1 - out->tip_margin);
    r.by_x = r.load * (middle_x_ + share * (x - middle_x_));
    r.by_y = r.load * (middle_y_ + share * (y - middle_y_));
  }
  bool lifted = false;
  for (std::size_t i = 0; i < n_; ++i) {
    out->slope[i] = all_[i];
    out->load[i] = all_[i].load * r.load + all_[i].by_x * r.by_x + all_[i].by_y * r.by_y;
    lifted |= out->load[i] < 0;
  }
  if (!lifted) return;
  // One wheel at a time lifts off (the one that pulls most) or comes down again. Equal roll
  // shares are springs, whose balance is unique; unequal ones are tried first.
  for (const bool shared : {true, false}) {
    unsigned touching = (1u << n_) - 1;
    double heights[kMostWheels];
    for (std::size_t round = 0; round < 3 * kMostWheels; ++round) {
      if (!Balance(touching, shared, r, out, heights)) break;
      std::size_t worst = n_;
      double most = 1e-12 * r.load;
      for (std::size_t i = 0; i < n_; ++i) {
        const double wrong = (touching >> i & 1 ? -1 : 1) * heights[i] * stiffness_[i];
        if (wrong > most) {
          most = wrong;
          worst = i;
        }
      }
      if (worst == n_) {
        for (std::size_t i = 0; i < n_; ++i) out->load[i] = std::max(0.0, out->load[i]);
        return;
      }
      touching ^= 1u << worst;
    }
  }
  // On the edge itself two wheels carry all; the limit from inside, by a lever.
  for (std::size_t i = 0; i < n_; ++i) out->load[i] = std::max(0.0, out->load[i]);
}

}  // namespace grouser::vehicle
