// Settles, cuts and relaxes the periodic bed that experiments start from.
#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "dem_offline/engine/core/random.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/preparation.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

constexpr std::int64_t kLookSteps = 200;  // between looks at whether it is quiet

class Preparation {
 public:
  Preparation(const BedSpec& spec, const ProgressFn& progress) : spec_(spec), progress_(progress) {
    depth_ = spec.depth_m;
    diameter_ = LargestDiameter(spec.soil);
    dt_ = BedStep(spec);
  }

  Tile Run() {
    std::vector<GrainState> best;
    std::vector<FrictionTry> tried;
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
      mu = std::exp(NextLogFriction(tried));
    }
    return Relax(CutFlat(best), best_mu);
  }

 private:
  WorldConfig Config(double friction) const {
    WorldConfig c;
    c.frame = {spec_.length_m, spec_.width_m, TileZSpan(depth_)};
    c.gravity_m_per_s2 = {0, 0, -spec_.soil.gravity_m_per_s2};
    c.dt_s = dt_;
    c.skin_m = 0.3 * diameter_;
    c.contacts = BedContacts(spec_.soil, friction);
    return c;
  }

  /// Loose jittered lattice holding enough solid for the bed and its cut.
  std::vector<GrainState> Loose() const {
    Random random = RandomOfSeed(spec_.seed);
    const LooseLattice lattice = LatticeOf(spec_);
    double solid = lattice.solid_m3;
    const double pitch = lattice.pitch_m;
    const int nx = static_cast<int>(lattice.nx), ny = static_cast<int>(lattice.ny);
    const double first = FirstSpeed(spec_);
    const double px = spec_.length_m / nx, py = spec_.width_m / ny;
    std::vector<GrainState> out;
    for (int layer = 0; solid > 0; ++layer) {
      Report(0, "pour");
      for (int ix = 0; ix < nx; ++ix) {
        for (int iy = 0; iy < ny; ++iy) {
          const double d = DrawDiameter(spec_.soil.sizes, random), play = 0.5 * (pitch - d);
          const auto jitter = [&] { return play * (2 * random.Uniform() - 1); };
          GrainState g = {};
          g.x_m = (ix + 0.5 + 0.5 * (layer % 2)) * px + jitter();
          g.y_m = (iy + 0.5 + 0.5 * (layer % 2)) * py + jitter();
          g.z_m = -depth_ + (layer + 0.6) * pitch + jitter();
          g.radius_m = 0.5 * d;
          g.density_kg_per_m3 = spec_.soil.density_kg_per_m3;
          const auto kick = [&] { return first * (2 * random.Uniform() - 1); };
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

  /// Tells the caller; throws when he has had enough. share: of this stage.
  void Report(double share, const char* stage) const {
    if (!progress_) return;
    const double all = (attempt_ + std::min(share, 1.0)) / (kMostAttempts + 1.0);
    if (!progress_(all, stage)) throw std::runtime_error("stopped by caller");
  }

  /// Steps until `quiet` says so, at the earliest after least_s, or most_s are over.
  template <class QuietFn>
  void StepUntil(World& world, const StageTimes& times, const char* stage, QuietFn&& quiet) {
    const auto steps = static_cast<std::int64_t>(times.most_s / dt_),
               least = static_cast<std::int64_t>(times.least_s / dt_);
    const std::int64_t poll = PollSteps(world.count());
    for (std::int64_t s = 0; s < steps; ++s) {
      if (world.Step() != StepFault::kNone) {
        throw std::runtime_error(std::string("tile: the bed blew up while it was to ") + stage +
                                 "; expected a stable time step (rig.rayleigh_fraction)");
      }
      if (s % poll == 0) Report(static_cast<double>(s) / static_cast<double>(steps), stage);
      if (s % kLookSteps == 0 && s > least && quiet()) break;
    }
  }

  /// Runs until kinetic energy per grain is under 1e-6 m g d or time is up.
  void Quiet(World& world, const StageTimes& times, const char* stage) {
    world.SetDrag(1 - dt_ / DragTime(spec_));
    double mass = 0;
    for (const auto& g : world.grains()) mass += g.id >= 0 ? g.mass : 0;
    const double quiet = 1e-6 * mass * spec_.soil.gravity_m_per_s2 * diameter_;
    StepUntil(world, times, stage, [&] { return world.KineticEnergy() < quiet; });
  }

  /// Runs on without drag until the liveliest grain has under 1e-5 m g d: a bed
  /// is full of clones, and one grain that still rolls would roll in each.
  void Rest(World& world) {
    world.SetDrag(1);
    const double lively = 2e-5 * spec_.soil.gravity_m_per_s2 * diameter_;  // v^2
    StepUntil(world, RestTimes(spec_), "rest", [&] {
      double fastest = 0;
      for (std::int64_t i = 0; i < world.count(); ++i) {
        const Grain& g = world.grains()[i];
        fastest = std::max<double>(fastest, g.vx * g.vx + g.vy * g.vy + g.vz * g.vz);
      }
      return fastest < lively;
    });
  }

  std::vector<GrainState> Settle(double friction) {
    World world(Config(friction), Loose());
    world.AddBody(FloorBody(depth_));
    Quiet(world, SettleTimes(spec_), "settle");
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
    return solid / (spec_.length_m * spec_.width_m * (z1 - z0));
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
    Quiet(world, RelaxTimes(spec_), "relax");
    Rest(world);
    Tile tile;
    tile.length_m = spec_.length_m;
    tile.width_m = spec_.width_m;
    tile.depth_m = depth_;
    tile.preparation_friction = preparation_friction;
    tile.solid_fraction = SolidFraction(States(world), -depth_ + diameter_, -diameter_);
    tile.coordination = world.MeanContacts();
    std::vector<float> overlaps = world.OverlapRatios();
    std::sort(overlaps.begin(), overlaps.end());
    if (!overlaps.empty()) {
      tile.overlap_p99_over_radius = overlaps[static_cast<std::size_t>(0.99 * overlaps.size())];
    }
    ExportGrains(world, tile);
    return tile;
  }

  BedSpec spec_;
  ProgressFn progress_;
  double depth_, diameter_, dt_;
  int attempt_ = 0;
};

}  // namespace

void ExportGrains(World& world, Tile& tile) {
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

double DrawDiameter(const std::vector<SizeBin>& sizes, Random& random) {
  double total = 0;
  for (const SizeBin& b : sizes) total += b.mass_fraction / std::pow(b.diameter_m, 3);
  double at = random.Uniform() * total;
  for (const SizeBin& b : sizes) {
    at -= b.mass_fraction / std::pow(b.diameter_m, 3);
    if (at <= 0) return b.diameter_m;
  }
  return sizes.back().diameter_m;
}

double NextLogFriction(const std::vector<FrictionTry>& tried) {
  const FrictionTry& last = tried.back();
  double slope = -0.012;
  if (tried.size() > 1) {
    const FrictionTry& before = tried[tried.size() - 2];
    const double seen = (last.error - before.error) / (last.log_friction - before.log_friction);
    if (seen < -0.003) slope = seen;
  }
  return last.log_friction - std::clamp(last.error / slope, -1.2, 1.2);
}

Tile PrepareBed(const BedSpec& bed, const ProgressFn& progress, const WorkLimits& limits) {
  ValidateBed(bed, limits);
  return Preparation(bed, progress).Run();
}

}  // namespace grouser::dem
