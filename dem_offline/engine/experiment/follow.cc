#include "dem_offline/engine/experiment/follow.h"

#include <algorithm>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/shapes.h"
#include "dem_offline/engine/rig/preparation.h"

namespace grouser::dem::experiment {
namespace {

// As of a wheel test (rig/scene.cc), in largest diameters.
constexpr double kBandDiameters = 2.5;
constexpr double kSlabDiameters = 2.0;

const BodySpec* BodyNamed(const Experiment& e, const std::string& name) {
  const auto at = std::find_if(e.bodies.begin(), e.bodies.end(),
                               [&](const BodySpec& b) { return b.name == name; });
  return at == e.bodies.end() ? nullptr : &*at;
}

}  // namespace

WindowSettings WindowOf(const Experiment& e) {
  const double d = LargestDiameter(e);
  return {e.box.follow.length_m, e.box.follow.ahead, kSlabDiameters * d, kBandDiameters * d};
}

Follower::Follower(const Experiment& e, World& prepared, double density_kg_per_m3,
                   double body_x_m) {
  const Frame& frame = prepared.config().frame;
  tile_.length_m = frame.length_m;
  tile_.width_m = frame.width_m;
  tile_.depth_m = frame.z_span_m / 8;  // so that TileZSpan is the height of the frame
  ExportGrains(prepared, tile_);
  feed_ = std::make_unique<BedFeed>(tile_, density_kg_per_m3, prepared.list().words());
  window_ = std::make_unique<Window>(*feed_, WindowOf(e), body_x_m);
}

std::unique_ptr<World> Follower::Open(WorldConfig config) {
  config.frame.length_m = window_->settings().length_m;
  return std::make_unique<World>(config, window_->Fill().grains);
}

void Follower::Restore(World& world) {
  const BedPiece& piece = window_->first();
  std::vector<std::int32_t> place(piece.grains.size());
  for (std::int64_t i = 0; i < world.count(); ++i) {
    place[world.grains()[i].id] = static_cast<std::int32_t>(i);
  }
  for (const BedTouch& t : piece.touches) {
    if (t.in_a < 0 || t.in_b < 0) continue;  // with soil beyond the seam
    world.list().SetHistory(place[t.in_a], place[t.in_b], t.words);
  }
  for (const FloorTouch& t : piece.floor) world.SetBodyHistory(place[t.in], 0, 0, t.words);
  HoldBands(world);
}

void Follower::HoldBands(World& world) {
  frozen_.resize(world.count());
  for (std::int64_t i = 0; i < world.count(); ++i) {
    frozen_[i] = window_->InBand(world.grains()[i].x);
  }
  world.Freeze(frozen_);
}

bool Follower::Follow(World& world, double body_x_m, double reach_m) {
  if (body_x_m - reach_m < window_->from_m() + window_->settings().band_m) return false;
  if (!window_->Due(body_x_m)) return true;
  while (window_->Due(body_x_m)) window_->Advance(world);
  HoldBands(world);
  return true;
}

void CheckFollow(const Experiment& e) {
  const FollowSpec& f = e.box.follow;
  if (f.body.empty()) return;
  const auto refuse = [](const std::string& with, const std::string& expected) {
    throw SpecError("box.follow", "it with " + with, expected);
  };
  const BodySpec* body = BodyNamed(e, f.body);
  if (!body || body->motion.empty()) {
    throw SpecError("box.follow.body", "'" + f.body + "'", "the name of a body that moves");
  }
  if (e.box.x != Side::kPeriodic || e.box.y != Side::kPeriodic) refuse("walls", "periodic sides");
  if (e.box.disc_thickness_m > 0) refuse("discs", "spheres: not possible yet");
  for (const Grains& g : e.grains) {
    if (!g.clump.empty()) refuse("clumps", "spheres: not possible yet");
    if (g.bonds.fragments > 0) refuse("bonded grains", "spheres: not possible yet");
    if (g.filling == Filling::kBed) refuse("a bed", "poured grains that are cut: not possible yet");
    if (g.material != e.grains[0].material) refuse("two materials of grains", "one");
  }
  for (const BodySpec& b : e.bodies) {
    if (b.while_preparing) refuse("'" + b.name + "' in the preparation", "bodies that come later");
  }
  for (const Probe& p : e.probes) {
    if (p.kind == Probe::Kind::kRepose) refuse("the probe repose", "other probes");
  }
  if (!(f.ahead > 0 && f.ahead < 1)) {
    throw SpecError("box.follow.ahead", Short(f.ahead), "more than 0 and less than 1");
  }
  const double reach = ShapeOf(body->parts, "box.follow.body").reach;
  const double least = (reach + (kBandDiameters + kSlabDiameters) * LargestDiameter(e)) /
                       std::min(f.ahead, 1 - f.ahead);
  if (!(f.length_m >= least && f.length_m <= 1e3)) {
    throw SpecError("box.follow.length_m", Short(f.length_m),
                    "at least " + Short(least) + " m: the body and what is frozen at the ends");
  }
}

}  // namespace grouser::dem::experiment
