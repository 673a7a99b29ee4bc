// Settles, cuts and relaxes the periodic bed that wheel tests start from.
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>

#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/scaling.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

constexpr double kFractionTolerance = 0.004;  // DESIGN asks for 0.005
constexpr double kDragTime = 0.05;            // [s] viscous fall: gentle and quick
constexpr int kMostAttempts = 6;
constexpr double kLeastFriction = 0.02, kMostFriction = 4.0;

/// splitmix64: the same stream on every machine (std:: distributions are not).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ull + 1) {}
  double Uniform() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
  }

 private:
  std::uint64_t state_;
};

class Preparation {
 public:
  Preparation(const WheelTestSpec& spec, const ProgressFn& progress)
      : spec_(spec), progress_(progress) {
    depth_ = spec.rig.bed_depth_m;
    diameter_ = LargestDiameter(spec.soil);
    const double weight = spec.soil.density_kg_per_m3 * spec.soil.gravity_m_per_s2 * depth_;
    dt_ = StepWithin(spec.soil, spec.wheel, spec.rig.rayleigh_fraction,
                     OverlapUnder(spec.soil, spec.wheel, weight));
  }

  Tile Run() {
    std::vector<GrainState> best;
    std::vector<Attempt> tried;
    double best_error = 1e9, best_mu = 0;
    double mu = 2 * std::max(spec_.soil.friction, kLeastFriction);
    for (attempt_ = 0; attempt_ < kMostAttempts; ++attempt_) {
      mu = std::clamp(mu, kLeastFriction, kMostFriction);
      std::vector<GrainState> bed = Settle(mu);
      const double error =
          SolidFraction(bed, -depth_ + diameter_, -diameter_) - spec_.soil.solid_fraction;
      if (std::abs(error) < std::abs(best_error)) {
        best_error = error;
        best_mu = mu;
        best = std::move(bed);
      }
      tried.push_back({std::log(mu), error});
      if (std::abs(error) <= kFractionTolerance) break;
      if (error > 0 && mu >= kMostFriction) break;  // as loose as it gets
      mu = std::exp(NextGuess(tried));
    }
    return Relax(CutFlat(best), best_mu);
  }

 private:
  struct Attempt {
    double log_mu, error;
  };

  /// More friction packs looser: about -0.012 in solid fraction per unit of
  /// ln(mu), then the secant through the two best tries.
  static double NextGuess(const std::vector<Attempt>& tried) {
    const Attempt& last = tried.back();
    double slope = -0.012;
    if (tried.size() > 1) {
      const Attempt& before = tried[tried.size() - 2];
      const double seen = (last.error - before.error) / (last.log_mu - before.log_mu);
      if (seen < -0.003) slope = seen;
    }
    return last.log_mu - std::clamp(last.error / slope, -1.2, 1.2);
  }

  WorldConfig Config(double friction) const {
    WorldConfig c;
    c.frame = {spec_.rig.bed_length_m, spec_.rig.bed_width_m, std::max(1.0, 8 * depth_)};
    c.gravity_m_per_s2 = {0, 0, -spec_.soil.gravity_m_per_s2};
    c.dt_s = dt_;
    c.skin_m = 0.3 * diameter_;
    c.contacts = RigContacts(spec_.soil, friction, spec_.wheel);
    return c;
  }

  double DrawDiameter(Random& random) const {
    double total = 0;
    for (const auto& b : spec_.soil.sizes) total += b.mass_fraction / std::pow(b.diameter_m, 3);
    double at = random.Uniform() * total;
    for (const auto& b : spec_.soil.sizes) {
      at -= b.mass_fraction / std::pow(b.diameter_m, 3);
      if (at <= 0) return b.diameter_m;
    }
    return spec_.soil.sizes.back().diameter_m;
  }

  /// Loose jittered lattice holding enough solid for the bed and its cut.
  std::vector<GrainState> Loose() const {
    Random random(spec_.seed);
    const double area = spec_.rig.bed_length_m * spec_.rig.bed_width_m;
    double solid = (spec_.soil.solid_fraction + 0.02) * area * (depth_ + 1.5 * diameter_);
    const double pitch = 1.12 * diameter_;
    const int nx = static_cast<int>(spec_.rig.bed_length_m / pitch);
    const int ny = static_cast<int>(spec_.rig.bed_width_m / pitch);
    const double px = spec_.rig.bed_length_m / nx, py = spec_.rig.bed_width_m / ny;
    std::vector<GrainState> out;
    for (int layer = 0; solid > 0; ++layer) {
      for (int ix = 0; ix < nx; ++ix) {
        for (int iy = 0; iy < ny; ++iy) {
          const double d = DrawDiameter(random), play = 0.5 * (pitch - d);
          const auto jitter = [&] { return play * (2 * random.Uniform() - 1); };
          GrainState g = {};
          g.x_m = (ix + 0.5 + 0.5 * (layer % 2)) * px + jitter();
          g.y_m = (iy + 0.5 + 0.5 * (layer % 2)) * py + jitter();
          g.z_m = -depth_ + (layer + 0.6) * pitch + jitter();
          g.radius_m = 0.5 * d;
          g.density_kg_per_m3 = spec_.soil.density_kg_per_m3;
          const auto kick = [&] { return 0.1 * (2 * random.Uniform() - 1); };
          g.v_x = kick();
          g.v_y = kick();
          g.v_z = kick();
          out.push_back(g);
          solid -= M_PI / 6 * d * d * d;
        }
      }
    }
    return out;
  }

  /// Runs until kinetic energy per grain is under 1e-6 m g d or time is up.
  void Quiet(World& world, double least_s, double most_s, const char* stage) {
    world.SetDrag(1 - dt_ / kDragTime);
    double mass = 0;
    for (const auto& g : world.grains()) mass += g.id >= 0 ? g.mass : 0;
    const double quiet = 1e-6 * mass * spec_.soil.gravity_m_per_s2 * diameter_;
    const auto steps = static_cast<long>(most_s / dt_), least = static_cast<long>(least_s / dt_);
    for (long s = 0; s < steps; ++s) {
      if (world.Step() != StepFault::kNone) {
        throw std::runtime_error(std::string("tile: the bed blew up while it was to ") + stage +
                                 "; expected a stable time step (rig.rayleigh_fraction)");
      }
      if (s % 200 != 0) continue;
      const double share = std::min(1.0, (attempt_ + s * dt_ / most_s) / (kMostAttempts + 1.0));
      if (progress_ && !progress_(share, stage)) throw std::runtime_error("stopped by caller");
      if (s > least && world.KineticEnergy() < quiet) break;
    }
  }

  /// Runs on without drag until the liveliest grain has under 1e-5 m g d: a bed
  /// is full of clones, and one grain that still rolls would roll in each.
  void Rest(World& world, double least_s, double most_s) {
    world.SetDrag(1);
    const double lively = 2e-5 * spec_.soil.gravity_m_per_s2 * diameter_;  // v^2
    const auto steps = static_cast<long>(most_s / dt_), least = static_cast<long>(least_s / dt_);
    for (long s = 0; s < steps; ++s) {
      if (world.Step() != StepFault::kNone) throw std::runtime_error("tile: no bed at rest");
      if (s < least || s % 200 != 0) continue;
      double fastest = 0;
      for (std::int64_t i = 0; i < world.count(); ++i) {
        const Grain& g = world.grains()[i];
        fastest = std::max<double>(fastest, g.vx * g.vx + g.vy * g.vy + g.vz * g.vz);
      }
      if (fastest < lively) break;
    }
  }

  std::vector<GrainState> Settle(double friction) {
    World world(Config(friction), Loose());
    world.AddBody(FloorBody(depth_));
    const double fall = std::sqrt(4 * depth_ / spec_.soil.gravity_m_per_s2);
    const double slow = 2.5 * depth_ / (spec_.soil.gravity_m_per_s2 * kDragTime);
    Quiet(world, fall, 2.5 * (fall + slow), "settle");
    return States(world);
  }

  static std::vector<GrainState> States(const World& world) {
    std::vector<GrainState> out(world.count());
    for (std::int64_t i = 0; i < world.count(); ++i) out[world.grains()[i].id] = world.State(i);
    return out;
  }

  double SolidFraction(const std::vector<GrainState>& bed, double z0, double z1) const {
    double solid = 0;
    for (const auto& g : bed) {  // exact volume of the slice of each sphere
      const double r = g.radius_m;
      const double a = std::clamp(z0 - g.z_m, -r, r), b = std::clamp(z1 - g.z_m, -r, r);
      solid += M_PI * (r * r * (b - a) - (b * b * b - a * a * a) / 3);
    }
    return solid / (spec_.rig.bed_length_m * spec_.rig.bed_width_m * (z1 - z0));
  }

  static std::vector<GrainState> CutFlat(const std::vector<GrainState>& bed) {
    std::vector<GrainState> out;
    for (const auto& g : bed) {
      if (g.z_m + g.radius_m <= 0) out.push_back(g);
    }
    if (out.empty()) throw std::runtime_error("tile: nothing is left under the cut plane");
    return out;
  }

  Tile Relax(const std::vector<GrainState>& cut, double preparation_friction) {
    attempt_ = kMostAttempts;
    World world(Config(spec_.soil.friction), cut);
    world.AddBody(FloorBody(depth_));
    Quiet(world, 0.05, 0.3, "relax");
    Rest(world, 0.1, 0.5);
    Tile tile;
    tile.length_m = spec_.rig.bed_length_m;
    tile.width_m = spec_.rig.bed_width_m;
    tile.depth_m = depth_;
    tile.preparation_friction = preparation_friction;
    tile.solid_fraction = SolidFraction(States(world), -depth_ + diameter_, -diameter_);
    tile.coordination = world.MeanContacts();
    std::vector<float> overlaps = world.OverlapRatios();
    std::sort(overlaps.begin(), overlaps.end());
    if (!overlaps.empty()) {
      tile.overlap_p99_over_radius = overlaps[static_cast<std::size_t>(0.99 * overlaps.size())];
    }
    Export(world, tile);
    return tile;
  }

  /// Each contact of two grains once, with the one that comes first.
  static void Export(World& world, Tile& tile) {
    const int count = world.list().words();
    const auto add = [&](std::int32_t partner, const float* words) {
      tile.contact_partner.push_back(partner);
      tile.contact_history.insert(tile.contact_history.end(), words, words + count);
    };
    std::int64_t done = 0;
    const auto finish = [&](std::int64_t upto) {  // floor contacts end a grain's list
      for (; done < upto; ++done) {
        if (const float* words = world.BodyHistory(done, kFloorBody, 0)) add(-1, words);
        tile.contact_first.push_back(static_cast<std::int32_t>(tile.contact_partner.size()));
      }
    };
    tile.contact_first.push_back(0);
    world.list().ForEachHistory([&](std::int32_t i, std::int32_t j, const float* words) {
      finish(i);
      add(j, words);
    });
    finish(world.count());
    for (std::int64_t i = 0; i < world.count(); ++i) {
      const Grain& g = world.grains()[i];
      tile.radius_m.push_back(g.radius);
      for (const std::int32_t p : {g.x, g.y, g.z}) tile.position.push_back(p);
      for (int a = 0; a < 3; ++a) {  // at rest by definition
        tile.velocity.push_back(0.0f);
        tile.spin.push_back(0.0f);
      }
    }
  }

  WheelTestSpec spec_;
  ProgressFn progress_;
  double depth_, diameter_, dt_;
  int attempt_ = 0;
};

}  // namespace

Tile PrepareTile(const WheelTestSpec& spec, const ProgressFn& progress) {
  ValidateSpec(spec);
  return Preparation(spec, progress).Run();
}

}  // namespace grouser::dem
