// Settles, cuts and relaxes the periodic bed that experiments start from.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

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
    top_ = spec.soil.top.thickness_m;
    diameter_ = LargestDiameter(spec.soil);
    dt_ = BedStep(spec);
  }

  Tile Run() {
    Layer under, top;
    bool again = true, top_again = top_ > 0;
    for (int round = 0;; ++round) {
      if (again) {
        under = Pack(spec_.soil.solid_fraction - denser_[0], {}, 0);
        if (top_ > 0) CutAt(*under.world, -top_);
      }
      if (top_again) {
        top = Pack(spec_.soil.top.solid_fraction - denser_[1], States(*under.world), 1);
      }
      const Tile tile = Relax(*(top_ > 0 ? top : under).world, under, top);
      const double miss = tile.solid_fraction - spec_.soil.solid_fraction,
                   top_miss =
                       top_ > 0 ? tile.top_solid_fraction - spec_.soil.top.solid_fraction : 0;
      if (std::max(std::abs(miss), std::abs(top_miss)) <= kFractionTolerance) return tile;
      Remember("soil.grains.solid_fraction", spec_.soil.solid_fraction, tile.solid_fraction, 0);
      Remember("soil.grains.top_layer.solid_fraction", spec_.soil.top.solid_fraction,
               tile.top_solid_fraction, 1);
      // A bed that became denser at rest under its own friction is aimed so much lower.
      const bool met_before = std::abs(under.error) <= kFractionTolerance &&
                              (top_ == 0 || std::abs(top.error) <= kFractionTolerance);
      if (round + 1 == kMostRounds || !met_before) Refuse();
      again = std::abs(miss) > kFractionTolerance;
      if (again) AimLower(0, miss - under.error);
      if (std::abs(top_miss) > kFractionTolerance) AimLower(1, top_miss - top.error);
      top_again = top_ > 0;
    }
  }

 private:
  /// Grains that have settled, nearest to their aim of all that were tried.
  struct Layer {
    std::unique_ptr<World> world;
    double error = 1e9;  ///< solid fraction less its aim
    GrainFriction friction;
  };
  /// The nearest that was reached, of each layer.
  struct Nearest {
    std::string field;
    double target = 0, reached = 1e9;
  };

  /// layer: 0, the bed under its top layer, or 1, that layer on the grains `under`.
  Layer Pack(double aim, const std::vector<GrainState>& under, int layer) {
    Layer best;
    if (!search_[layer]) {
      const GrainSoil& soil = spec_.soil;
      search_[layer].emplace(layer == 0 ? soil.preparation : soil.top.preparation, FrictionOf(soil),
                             Rolls(LawsOf(spec_.soil.contact)),
                             2 * std::max(spec_.soil.friction, kLeastFriction));
    }
    PackingSearch& search = *search_[layer];
    bool more = true;
    for (attempt_ = 0; more; ++attempt_) {
      const GrainFriction friction = search.next();
      std::unique_ptr<World> world = Settle(friction, under, layer);
      const double error = SolidFractionOf(States(*world), layer) - aim;
      if (std::abs(error) < std::abs(best.error)) best = {std::move(world), error, friction};
      more = search.Tried(error);
    }
    return best;
  }

  void AimLower(int layer, double denser) {
    denser_[layer] += denser;
    search_[layer]->AimLower(denser);
  }

  void Remember(const char* field, double target, double reached, int layer) {
    Nearest& n = nearest_[layer];
    if (std::abs(reached - target) < std::abs(n.reached - target)) n.reached = reached;
    n.field = field;
    n.target = target;
  }
  [[noreturn]] void Refuse() const {
    const int worst = top_ > 0 && std::abs(nearest_[1].reached - nearest_[1].target) >
                                      std::abs(nearest_[0].reached - nearest_[0].target);
    const Nearest& n = nearest_[worst];
    throw SpecError(n.field, Short(n.target),
                    "one that the preparation reaches within " + Short(kFractionTolerance) +
                        "; the nearest was " + Short(n.reached));
  }

  /// Between floor and surface of a layer, without the grains that touch either.
  double SolidFractionOf(const std::vector<GrainState>& bed, int layer) const {
    return layer == 0 ? SolidFraction(bed, -depth_ + diameter_, -top_ - diameter_)
                      : SolidFraction(bed, -top_ + diameter_, -diameter_);
  }

  WorldConfig Config(const GrainFriction& friction) const {
    WorldConfig c;
    c.frame = {spec_.length_m, spec_.width_m, TileZSpan(depth_)};
    c.gravity_m_per_s2 = {0, 0, -spec_.soil.gravity_m_per_s2};
    c.dt_s = dt_;
    c.skin_m = 0.3 * diameter_;
    c.contacts = BedContacts(spec_.soil, friction);
    return c;
  }

  /// Loose jittered lattice holding enough solid for a layer and its cut.
  std::vector<GrainState> Loose(int layer) const {
    Random random =
        RandomOfSeed(spec_.seed + 0x9e3779b97f4a7c15 * static_cast<std::uint64_t>(layer));
    const LooseLattice lattice = LatticesOf(spec_)[layer];
    const double floor = layer == 0 ? -depth_ : -top_;
    double solid = lattice.solid_m3;
    const double pitch = lattice.pitch_m;
    const int nx = static_cast<int>(lattice.nx), ny = static_cast<int>(lattice.ny);
    const double first = FirstSpeed(spec_);
    const double px = spec_.length_m / nx, py = spec_.width_m / ny;
    std::vector<GrainState> out;
    for (int sheet = 0; solid > 0; ++sheet) {
      Report(0, "pour");
      for (int ix = 0; ix < nx; ++ix) {
        for (int iy = 0; iy < ny; ++iy) {
          const double d = DrawDiameter(spec_.soil.sizes, random), play = 0.5 * (pitch - d);
          const auto jitter = [&] { return play * (2 * random.Uniform() - 1); };
          GrainState g = {};
          g.x_m = (ix + 0.5 + 0.5 * (sheet % 2)) * px + jitter();
          g.y_m = (iy + 0.5 + 0.5 * (sheet % 2)) * py + jitter();
          g.z_m = floor + (sheet + 0.6) * pitch + jitter();
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
    const double all = (attempt_ + std::min(share, 1.0)) / (PackingSearch::kTries + 1.0);
    if (!progress_(std::min(all, 1.0), stage)) throw std::runtime_error("stopped by caller");
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

  std::unique_ptr<World> Settle(const GrainFriction& friction, const std::vector<GrainState>& under,
                                int layer) {
    std::vector<GrainState> grains = under;
    const std::vector<GrainState> loose = Loose(layer);
    grains.insert(grains.end(), loose.begin(), loose.end());
    auto world = std::make_unique<World>(Config(friction), grains);
    world->AddBody(FloorBody(depth_));
    Quiet(*world, SettleTimes(spec_), "settle");
    return world;
  }

  /// In the order of memory.
  static std::vector<GrainState> States(const World& world) {
    std::vector<GrainState> out;
    for (std::int64_t i = 0; i < world.count(); ++i) out.push_back(world.State(i));
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

  /// The grains that stay keep the history of their contacts: a loose bed that lost it would fall.
  static void CutAt(World& world, double height_m) {
    GrainExchange exchange;
    for (std::int64_t i = 0; i < world.count(); ++i) {
      const GrainState g = world.State(i);
      if (g.z_m + g.radius_m > height_m) exchange.out.push_back(world.grains()[i].id);
    }
    std::sort(exchange.out.begin(), exchange.out.end());  // whatever the order of memory
    if (static_cast<std::int64_t>(exchange.out.size()) == world.count()) {
      throw std::runtime_error("tile: nothing is left under the cut plane");
    }
    if (!exchange.out.empty()) world.Exchange(exchange);
  }

  /// Plane of equal mass: the solid above the measured part of the uppermost layer stands there at
  /// the solid fraction of that part.
  double SurfaceOf(const std::vector<GrainState>& bed, double solid_fraction) const {
    const double all = SolidFraction(bed, -diameter_, diameter_) * 2 * diameter_;
    return -diameter_ + all / solid_fraction;
  }

  Tile Relax(World& world, const Layer& under, const Layer& top) {
    attempt_ = PackingSearch::kTries;
    CutAt(world, 0);
    world.SetContacts(BedContacts(spec_.soil, FrictionOf(spec_.soil)));
    Quiet(world, RelaxTimes(spec_), "relax");
    Rest(world);
    Tile tile;
    tile.length_m = spec_.length_m;
    tile.width_m = spec_.width_m;
    tile.depth_m = depth_;
    tile.preparation_friction = {under.friction.friction, top.friction.friction};
    tile.preparation_rolling_friction = {under.friction.rolling_friction,
                                         top.friction.rolling_friction};
    const std::vector<GrainState> bed = States(world);
    tile.solid_fraction = SolidFractionOf(bed, 0);
    if (top_ > 0) tile.top_solid_fraction = SolidFractionOf(bed, 1);
    tile.surface_m = SurfaceOf(bed, top_ > 0 ? tile.top_solid_fraction : tile.solid_fraction);
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
  double depth_, diameter_, dt_, top_ = 0;
  double denser_[2] = {};  ///< of layer and top layer at rest than as they settled
  std::optional<PackingSearch> search_[2];
  Nearest nearest_[2];
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

Tile PrepareBed(const BedSpec& bed, const ProgressFn& progress, const WorkLimits& limits) {
  ValidateBed(bed, limits);
  return Preparation(bed, progress).Run();
}

}  // namespace grouser::dem
