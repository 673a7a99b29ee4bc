#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "dem_offline/engine/rig/bed_feed.h"
#include "dem_offline/engine/rig/freezer.h"
#include "dem_offline/engine/rig/wheel_step.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/rig/window.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {

/// Turn of the wheel's plane from the direction of travel, the bed's x axis.
double YawOf(const WheelTestSpec& spec);

/// Half extents [m] of the wheel along travel, across it and down, seen from
/// its hub; yaw: of its plane from the direction of travel.
Vec3d HalfExtents(const WheelShape& wheel, double yaw_rad);

/// The window of a spec. A length of 0 is chosen so that wheel and frozen seam
/// keep the distance of FillSceneRules, sinkage + 5 d, up to MostSinkage,
/// beyond which a run is an overload: so far is soil pushed by a wheel that is
/// locked or goes sideways.
WindowSettings WindowOf(const WheelTestSpec& spec);
/// Below this length [m] the wheel itself would stand on the frozen seam.
double LeastWindow(const WheelTestSpec& spec);

/// Length [m] of the stretch of bed that a scene holds at a time: one tile, all
/// that the wheel can travel, or the window.
double SceneLength(const WheelTestSpec& spec);

/// The bed of a wheel test, and how much of it is worked on: opens the World
/// with the tile's grains, histories and floor, and keeps what the scene's
/// switches say as the wheel goes.
class RigScene {
 public:
  /// Throws std::invalid_argument when tile, rig and scene do not fit.
  RigScene(const WheelTestSpec& spec, const Tile& tile, double dt_s);

  World& world() { return *world_; }
  double start_x_m() const { return start_x_; }  ///< of the hub
  /// Before each step: the window follows, grains freeze and become active.
  void Follow(std::uint64_t step, const Vec3d& hub_m);
  /// The same for whoever makes the steps elsewhere: does the scene look at its
  /// grains, is a look due before this step; the look itself (true: something
  /// changed); so many steps were made since.
  bool Looks() const { return window_.has_value() || freezer_.has_value(); }
  bool LookDue(std::uint64_t step) const;
  bool Look(const Vec3d& hub_m);
  void CountSteps(double steps);
  /// Where the wheel comes to ground that it has disturbed, or leaves the window.
  BedLimit Limit() const;

  const Window* window() const { return window_ ? &*window_ : nullptr; }
  const SceneUse& use() const { return use_; }

 private:
  void Open(const BedPiece& piece, double length_m, double dt_s);
  bool Held(const Grain& g) const { return window_ && window_->InBand(g.x); }

  WheelTestSpec spec_;
  double dt_, diameter_, length_ = 0, start_x_ = 0;
  BedFeed feed_;
  std::optional<Window> window_;
  std::optional<Freezer> freezer_;
  std::unique_ptr<World> world_;
  std::vector<std::uint8_t> frozen_;
  std::int64_t active_ = 0, deep_ = 0;
  SceneUse use_;
};

}  // namespace grouser::dem
