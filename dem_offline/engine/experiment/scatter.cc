#include "dem_offline/engine/experiment/scatter.h"

#include <algorithm>
#include <cmath>

#include "dem_offline/engine/core/rotation.h"

namespace grouser::dem::experiment {
namespace {

constexpr int kMostRounds = 4000;
constexpr double kOverlap = 1e-3;  // [largest radius] that may stay
constexpr double kRoom = 4e-3;     // [radius] by which spheres are made larger meanwhile

struct Sphere3 {
  Vec3d x;
  double r;
};

class Scatterer {
 public:
  Scatterer(const BoxSpec& box, const Region& region, const std::vector<double>& radii,
            const std::vector<Body>& bodies)
      : box_(box), region_(region), bodies_(bodies), axis_(AxisOf(box)) {
    for (const double r : radii) largest_ = std::max(largest_, r);
    for (const double r : radii) spheres_.push_back({{0, 0, 0}, r * (1 + kRoom)});
    const double width = 2 * largest_ * (1 + kRoom);
    for (int k = 0; k < 3; ++k) {
      const double side = region.high_m[k] - region.low_m[k];
      cells_[k] = std::max<std::int64_t>(1, static_cast<std::int64_t>(side / width));
      cell_m_[k] = side / static_cast<double>(cells_[k]);
    }
  }

  /// Hexagonal layers across the axis, as wide apart as the number allows, each turned, moved and
  /// disturbed at random: from places that are random to begin with, a dense layer jams.
  void Begin(Random* random) {
    const double height = region_.high_m[axis_] - region_.low_m[axis_];
    const auto most =
        box_.planar ? 1
                    : std::max<std::int64_t>(1, static_cast<std::int64_t>(height / (2 * largest_)));
    const auto n = static_cast<std::int64_t>(spheres_.size());
    std::vector<Vec3d> sites;
    for (std::int64_t layers = 1; layers <= most; ++layers) {
      const std::int64_t each = (n + layers - 1) / layers;
      const double pitch = PitchFor(each);
      if (pitch < 2 * largest_ && layers < most) continue;
      for (std::int64_t layer = 0; layer < layers; ++layer) {
        const double share = layers > 1
                                 ? (static_cast<double>(layer) + 0.5) / static_cast<double>(layers)
                                 : random->Uniform();
        const double level = region_.low_m[axis_] + share * height;
        AddLayer(pitch, level, layers > 1 ? 0 : height, random, &sites);
      }
      break;
    }
    for (std::size_t k = sites.size(); k > 1; --k) {
      std::swap(sites[k - 1], sites[random->Next() % k]);
    }
    for (std::size_t k = 0; k < spheres_.size(); ++k) {
      spheres_[k].x = sites[k % sites.size()];
      Confine(&spheres_[k]);
    }
  }

  /// Moves all apart once; the largest overlap that was met, without the added room [m].
  double Round() {
    worst_ = 0;
    Sort();
    for (std::size_t i = 0; i < spheres_.size(); ++i) ForNeighbours(i);
    for (Sphere3& s : spheres_) {
      for (const Body& b : bodies_) LeaveBody(b, &s);
      Confine(&s);
    }
    return worst_;
  }

  std::vector<Vec3d> Places() const {
    std::vector<Vec3d> out;
    for (const Sphere3& s : spheres_) out.push_back(s.x);
    return out;
  }
  double largest_m() const { return largest_; }

 private:
  /// f at every site of a hexagonal layer whose sphere lies in the region.
  template <class F>
  void ForSites(double pitch, double turn, double du, double dw, F&& f) const {
    const int u = (axis_ + 1) % 3, w = (axis_ + 2) % 3;
    const Vec3d middle = Scale(0.5, Add(region_.low_m, region_.high_m));
    const double reach = 0.5 * std::hypot(region_.high_m[u] - region_.low_m[u],
                                          region_.high_m[w] - region_.low_m[w]);
    const double row = std::sqrt(0.75) * pitch, c = std::cos(turn), s = std::sin(turn);
    const auto rows = static_cast<std::int64_t>(reach / row) + 2;
    const auto columns = static_cast<std::int64_t>(reach / pitch) + 2;
    for (std::int64_t j = -rows; j <= rows; ++j) {
      for (std::int64_t i = -columns; i <= columns; ++i) {
        const double a = (static_cast<double>(i) + (j % 2 != 0 ? 0.5 : 0.0) + du) * pitch,
                     b = (static_cast<double>(j) + dw) * row;
        Vec3d x = middle;
        x[u] += c * a - s * b;
        x[w] += s * a + c * b;
        Sphere3 inside = {x, largest_};
        Confine(&inside);
        inside.x[axis_] = x[axis_];
        if (Norm(Sub(inside.x, x)) < 0.25 * largest_) f(x);
      }
    }
  }

  /// The widest pitch with so many sites in a layer.
  double PitchFor(std::int64_t count) const {
    const double area = ArealOf(region_, box_);
    double low = 0.3 * std::sqrt(area / static_cast<double>(count)),
           high = 8 * std::sqrt(area / static_cast<double>(count));
    for (int k = 0; k < 40; ++k) {
      const double pitch = std::sqrt(low * high);
      std::int64_t found = 0;
      ForSites(pitch, 0, 0, 0, [&](const Vec3d&) { ++found; });
      (found >= count ? low : high) = pitch;
    }
    return low;
  }

  void AddLayer(double pitch, double level, double play, Random* random,
                std::vector<Vec3d>* sites) const {
    const double turn = random->Between(0, 2 * M_PI), du = random->Uniform(),
                 dw = random->Uniform();
    const auto jitter = [&](double by) { return by * random->Between(-0.5, 0.5); };
    // Another turn and place has a few sites more or fewer.
    ForSites(0.99 * pitch, turn, du, dw, [&](const Vec3d& at) {
      Vec3d x = at;
      for (int k = 0; k < 3; ++k) x[k] += jitter(0.2 * pitch);
      x[axis_] = level + jitter(play);
      sites->push_back(x);
    });
  }

  Vec3d FromAxis(const Vec3d& x) const {
    Vec3d d = Sub(x, Scale(0.5, Add(region_.low_m, region_.high_m)));
    d[axis_] = 0;
    return d;
  }
  double Rho(const Vec3d& x) const { return Norm(FromAxis(x)); }

  /// An overlap of spheres that are larger by their room.
  void Note(double overlap, double radii) {
    worst_ = std::max(worst_, overlap - kRoom / (1 + kRoom) * radii);
  }

  /// Back into the region by its whole body.
  void Confine(Sphere3* s) const {
    for (int k = 0; k < 3; ++k) {
      const double low = region_.low_m[k] + s->r, high = region_.high_m[k] - s->r;
      s->x[k] = low < high ? std::clamp(s->x[k], low, high) : 0.5 * (low + high);
    }
    if (box_.planar) s->x[1] = 0.5 * box_.width_m;
    if (!(region_.radius_m > 0)) return;
    const Vec3d d = FromAxis(s->x);
    const double rho = std::max(Norm(d), 1e-300), out = region_.radius_m - s->r,
                 in = region_.inner_radius_m > 0 ? region_.inner_radius_m + s->r : 0;
    const double wanted = std::clamp(rho, std::min(in, out), out);
    s->x = Add(s->x, Scale(wanted / rho - 1, d));
  }

  void LeaveBody(const Body& b, Sphere3* s) {
    const Mat3d m = MatrixOf(b.orientation);
    const Vec3d at = m.Back(Sub(s->x, b.position_m));
    const Vec3f p = {static_cast<float>(at[0]), static_cast<float>(at[1]),
                     static_cast<float>(at[2])};
    SurfacePoint found[kMostSurfacePoints];
    const int n = SurfacePoints(b.shape, p, static_cast<float>(s->r), found);
    for (int k = 0; k < n; ++k) {
      const Vec3f& normal = found[k].normal;
      const double overlap = s->r - found[k].distance;
      Note(overlap, s->r);
      s->x = Add(s->x, Scale(overlap, m * Vec3d{normal.x, normal.y, normal.z}));
    }
  }

  std::int64_t CellOf(const Vec3d& x, int k) const {
    const auto c = static_cast<std::int64_t>((x[k] - region_.low_m[k]) / cell_m_[k]);
    return std::clamp<std::int64_t>(c, 0, cells_[k] - 1);
  }
  std::int64_t Number(std::int64_t a, std::int64_t b, std::int64_t c) const {
    return (a * cells_[1] + b) * cells_[2] + c;
  }

  void Sort() {
    first_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]) + 1, 0);
    const auto number = [&](const Sphere3& s) {
      return static_cast<std::size_t>(Number(CellOf(s.x, 0), CellOf(s.x, 1), CellOf(s.x, 2)));
    };
    for (const Sphere3& s : spheres_) ++first_[number(s) + 1];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    in_cell_.resize(spheres_.size());
    for (std::size_t i = 0; i < spheres_.size(); ++i) in_cell_[next[number(spheres_[i])]++] = i;
  }

  void ForNeighbours(std::size_t i) {
    std::int64_t low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      const std::int64_t c = CellOf(spheres_[i].x, k);
      low[k] = std::max<std::int64_t>(0, c - 1);
      high[k] = std::min(cells_[k] - 1, c + 1);
    }
    for (std::int64_t a = low[0]; a <= high[0]; ++a) {
      for (std::int64_t b = low[1]; b <= high[1]; ++b) {
        for (std::int64_t c = low[2]; c <= high[2]; ++c) {
          const auto cell = static_cast<std::size_t>(Number(a, b, c));
          for (std::size_t k = first_[cell]; k < first_[cell + 1]; ++k) {
            if (in_cell_[k] > i) Part(&spheres_[i], &spheres_[in_cell_[k]]);
          }
        }
      }
    }
  }

  void Part(Sphere3* a, Sphere3* b) {
    const Vec3d d = Sub(b->x, a->x);
    const double distance = Norm(d), overlap = a->r + b->r - distance;
    if (!(overlap > 0)) return;
    Note(overlap, a->r + b->r);
    const Vec3d along = distance > 0 ? Scale(1 / distance, d) : Vec3d{1, 0, 0};
    a->x = Sub(a->x, Scale(0.5 * overlap, along));
    b->x = Add(b->x, Scale(0.5 * overlap, along));
  }

  const BoxSpec& box_;
  const Region& region_;
  const std::vector<Body>& bodies_;
  int axis_;
  double largest_ = 0, worst_ = 0;
  std::vector<Sphere3> spheres_;
  std::int64_t cells_[3] = {1, 1, 1};
  double cell_m_[3] = {1, 1, 1};
  std::vector<std::size_t> first_, in_cell_;
};

}  // namespace

double ArealOf(const Region& r, const BoxSpec& box) {
  if (r.radius_m > 0) {
    return M_PI * (r.radius_m * r.radius_m - r.inner_radius_m * r.inner_radius_m);
  }
  const int across = box.planar ? 2 : 1;
  return (r.high_m[0] - r.low_m[0]) * (r.high_m[across] - r.low_m[across]);
}

std::int64_t CountByArea(const Grains& g, const BoxSpec& box) {
  double number = 0, square = 0;  // of grains of a unit of mass, by d^-3
  for (const SizeBin& b : g.sizes) {
    number += b.mass_fraction / (b.diameter_m * b.diameter_m * b.diameter_m);
    square += b.mass_fraction / b.diameter_m;
  }
  const double count = g.areal_fraction * ArealOf(g.region, box) / (M_PI / 4 * square / number);
  return std::isfinite(count) && count < 1e15 ? std::llround(count) : 0;
}

std::vector<Vec3d> Scatter(const BoxSpec& box, const Region& region,
                           const std::vector<double>& radii, const std::vector<Body>& bodies,
                           const std::string& field, Random* random,
                           const std::function<void()>& poll) {
  Scatterer all(box, region, radii, bodies);
  all.Begin(random);
  double worst = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    worst = all.Round();
    if (worst <= kOverlap * all.largest_m()) return all.Places();
    poll();
  }
  throw SpecError(field,
                  std::to_string(radii.size()) + " grains, which overlap by " + Short(worst) +
                      " m wherever they are put",
                  "fewer, or a larger region: there is no room");
}

}  // namespace grouser::dem::experiment
