#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/engine/rig/window.h"

namespace grouser::dem::experiment {

/// What a window keeps frozen on either side of its seam, and what it exchanges at a time.
WindowSettings WindowOf(const Experiment& e);

/// The prepared bed, endless along x, and the window of it that follows a body.
class Follower {
 public:
  /// prepared: at rest, periodic along x, its floor the body 0, origin of its frame 0; its frame
  /// is at least kLeastSpan high.
  Follower(const Experiment& e, World& prepared, double density_kg_per_m3, double body_x_m);

  /// A world that holds the window's first filling, without bodies.
  std::unique_ptr<World> Open(WorldConfig config);
  /// Contact histories, once the floor has been added as body 0.
  void Restore(World& world);
  /// After a step: moves on with the body. False: the body came to soil that was dropped.
  bool Follow(World& world, double body_x_m, double reach_m);
  const Window& window() const { return *window_; }

  static constexpr double kLeastSpan = 1.0;  ///< [m] height of the frame (TileZSpan)

 private:
  void HoldBands(World& world);

  Tile tile_;
  std::unique_ptr<BedFeed> feed_;
  std::unique_ptr<Window> window_;
  std::vector<std::uint8_t> frozen_;
};

/// Throws SpecError for what a window cannot hold.
void CheckFollow(const Experiment& e);

}  // namespace grouser::dem::experiment
