#include "dem_offline/engine/rig/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <unordered_map>

#include "dem_offline/engine/rig/materials.h"

namespace grouser::dem {
namespace {

constexpr double kBandDiameters = 2.5;  // frozen on either side of the seam
constexpr double kSlabDiameters = 2.0;  // exchanged at a time

void CheckTile(const RigSettings& rig, const Tile& tile) {
  if (std::abs(tile.length_m - rig.bed_length_m) > 1e-9 ||
      std::abs(tile.width_m - rig.bed_width_m) > 1e-9 ||
      std::abs(tile.depth_m - rig.bed_depth_m) > 1e-9) {
    throw std::invalid_argument("tile: its size is not that of the rig's bed");
  }
}

int HistoryWords(const WheelTestSpec& spec) {
  return BedContacts(spec.soil, FrictionOf(spec.soil)).layout().words;
}

std::int64_t KeyOf(const TilePlace& h) {
  return (static_cast<std::int64_t>(h.grain) << 32) + h.copy;
}

/// The tile's contact histories, written to a new World. A bed of `copies`
/// tiles that closes on itself has contacts across its ends; 0: it has none.
void Restore(const BedPiece& piece, int copies, World* world) {
  std::vector<std::int32_t> place_of(piece.tile_places.size());  // in memory
  for (std::int64_t i = 0; i < world->count(); ++i) {
    place_of[world->grains()[i].id] = static_cast<std::int32_t>(i);
  }
  std::unordered_map<std::int64_t, std::int32_t> by_tile_place;
  for (std::size_t p = 0; p < piece.tile_places.size(); ++p) {
    by_tile_place[KeyOf(piece.tile_places[p])] = static_cast<std::int32_t>(p);
  }
  const auto find = [&](std::int32_t in, TilePlace place) {
    if (in >= 0 || copies == 0) return in;
    place.copy = ((place.copy % copies) + copies) % copies;
    return by_tile_place.at(KeyOf(place));
  };
  for (const BedTouch& t : piece.touches) {
    const std::int32_t a = find(t.in_a, t.a), b = find(t.in_b, t.b);
    if (a >= 0 && b >= 0) world->list().SetHistory(place_of[a], place_of[b], t.words);
  }
  for (const FloorTouch& t : piece.floor) {
    world->SetBodyHistory(place_of[t.in], kFloorBody, 0, t.words);
  }
}

}  // namespace

double YawOf(const WheelTestSpec& spec) {
  return spec.state.mode == RigMode::kFreeSlip ? 0.0 : -spec.state.attack_angle_rad;
}

Vec3d HalfExtents(const WheelShape& wheel, double yaw_rad) {
  double tip = 0;
  for (const Tread& t : wheel.treads) tip = std::max(tip, t.height_m);
  const double r = wheel.radius_m + tip, half = 0.5 * wheel.width_m;
  const double c = std::abs(std::cos(yaw_rad)), s = std::abs(std::sin(yaw_rad));
  return {r * c + half * s, r * s + half * c, r};
}

WindowSettings WindowOf(const WheelTestSpec& spec) {
  const double diameter = LargestDiameter(spec.soil);
  WindowSettings w;
  w.ahead = spec.rig.scene.window_ahead;
  w.band_m = kBandDiameters * diameter;
  w.slab_m = kSlabDiameters * diameter;
  w.length_m = spec.rig.scene.window_length_m;
  if (w.length_m > 0) return w;
  const double clear = MostSinkage(spec) + 5 * MeanDiameter(spec.soil);
  w.length_m = LeastWindow(spec) + clear / std::min(w.ahead, 1 - w.ahead);
  return w;
}

double LeastWindow(const WheelTestSpec& spec) {
  const double ahead = spec.rig.scene.window_ahead;
  const double frozen = (kBandDiameters + kSlabDiameters) * LargestDiameter(spec.soil);
  return (HalfExtents(spec.wheel, YawOf(spec))[0] + frozen) / std::min(ahead, 1 - ahead);
}

double SceneLength(const WheelTestSpec& spec) {
  const double tile = spec.rig.bed_length_m;
  switch (spec.rig.scene.bed) {
    case SceneBed::kWindow:
      return WindowOf(spec).length_m;
    case SceneBed::kFull:  // whole tiles that the wheel neither leaves nor re-enters
      return tile * (std::ceil(spec.rig.speed_m_per_s * DriveTime(spec) / tile) + 1);
    case SceneBed::kPeriodic:
      break;
  }
  return tile;
}

RigScene::RigScene(const WheelTestSpec& spec, const Tile& tile, double dt_s)
    : spec_(spec),
      dt_(dt_s),
      diameter_(LargestDiameter(spec.soil)),
      feed_(tile, spec.soil.density_kg_per_m3, HistoryWords(spec)) {
  CheckTile(spec.rig, tile);
  const SceneSettings& scene = spec.rig.scene;
  start_x_ = 0.5 * tile.length_m;
  if (scene.bed == SceneBed::kWindow) {
    const WindowSettings w = WindowOf(spec);
    window_.emplace(feed_, w, start_x_);
    length_ = w.length_m;
    Open(window_->Fill(), length_, dt_s);
  } else {
    length_ = SceneLength(spec);
    Open(feed_.Between(0, length_), length_, dt_s);
  }
  if (scene.freeze) {
    FreezerSettings f;
    const Vec3d half = HalfExtents(spec.wheel, YawOf(spec));
    for (int a = 0; a < 3; ++a) f.half_m[a] = scene.freeze_box * half[a];
    f.quiet_m_per_s = scene.freeze_speed * spec.rig.speed_m_per_s;
    f.disturb_m_per_s = 2 * f.quiet_m_per_s;
    f.cell_m = 1.1 * diameter_;
    freezer_.emplace(f);
  }
}

void RigScene::Open(const BedPiece& piece, double length_m, double dt_s) {
  WorldConfig c;
  c.frame = {length_m, spec_.rig.bed_width_m, TileZSpan(spec_.rig.bed_depth_m)};
  c.gravity_m_per_s2 = {0, 0, -spec_.soil.gravity_m_per_s2};
  c.dt_s = dt_s;
  c.skin_m = 0.3 * diameter_;  // of the long-lived list; the short one finds its own
  c.contacts = RigContacts(spec_.soil, spec_.wheel);
  world_ = std::make_unique<World>(c, piece.grains);
  world_->AddBody(FloorBody(spec_.rig.bed_depth_m));
  Restore(piece, window_ ? 0 : static_cast<int>(std::lround(length_m / feed_.tile_length_m())),
          world_.get());
  active_ = world_->count();
}

void RigScene::Follow(std::uint64_t step, const Vec3d& hub_m) {
  if (LookDue(step)) Look(hub_m);
  CountSteps(1);
}

bool RigScene::LookDue(std::uint64_t step) const {
  return Looks() && step % static_cast<std::uint64_t>(spec_.rig.scene.look_steps) == 0;
}

void RigScene::CountSteps(double steps) {
  use_.particle_steps += steps * static_cast<double>(world_->count());
  use_.active_particle_steps += steps * static_cast<double>(active_);
  use_.deep_particle_steps += steps * static_cast<double>(deep_);
}

bool RigScene::Look(const Vec3d& hub_m) {
  bool changed = false;
  if (window_) {
    for (; window_->Due(hub_m[0]); changed = true) window_->Advance(*world_);
  }
  const auto held = [this](const Grain& g) { return Held(g); };
  if (freezer_) {
    freezer_->Look(*world_, hub_m, spec_.rig.scene.look_steps * dt_, held, &frozen_);
  } else if (window_) {
    frozen_.resize(world_->count());
    for (std::int64_t i = 0; i < world_->count(); ++i) frozen_[i] = Held(world_->grains()[i]);
  } else {
    return false;
  }
  bool other = false;
  active_ = deep_ = 0;
  const auto half_depth = static_cast<std::int32_t>(
      -0.5 * spec_.rig.bed_depth_m / TileZSpan(spec_.rig.bed_depth_m) * 4294967296.0);
  for (std::int64_t i = 0; i < world_->count(); ++i) {
    other |= world_->Frozen(i) != (frozen_[i] != 0);
    if (frozen_[i]) continue;
    ++active_;
    deep_ += world_->grains()[i].z < half_depth;
  }
  if (other) world_->Freeze(frozen_);
  return changed || other;
}

BedLimit RigScene::Limit() const {
  if (window_) return {true, window_->from_m() + window_->settings().band_m, 0};
  return {false, 0, length_ - 2 * diameter_};
}

}  // namespace grouser::dem
