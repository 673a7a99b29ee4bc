#pragma once

#include <cstdint>
#include <vector>

#include "dem_offline/engine/rig/bed_feed.h"

namespace grouser::dem {

struct WindowSettings {
  double length_m = 0;  ///< of the frame along x
  double ahead = 0.5;   ///< share of it in front of the hub
  double slab_m = 0;    ///< exchanged at a time
  double band_m = 0;    ///< frozen on either side of the seam; more than the search radius
};

/// A periodic frame that follows the wheel through the endless bed. Front and
/// back of the frame are the same plane, the seam. When the hub has gone on by a
/// slab, the grains centred in the last slab behind leave and the next slab of
/// virgin soil comes in front, with its contacts; the seam then stands a slab
/// further. Grains that face each other across the seam never touched before: the band on either
/// side is kept frozen, so that this misfit is never evaluated. Virgin grains are frozen when they
/// enter and become active, in balance with their neighbours, when the band has passed.
class Window {
 public:
  /// Throws std::invalid_argument for a frame too short for its band and slab.
  Window(const BedFeed& feed, const WindowSettings& settings, double hub_x_m);

  double from_m() const { return from_; }  ///< back of the frame
  double to_m() const { return to_; }      ///< front
  const WindowSettings& settings() const { return settings_; }

  /// The first filling; World ids are places in it.
  const BedPiece& Fill();
  const BedPiece& first() const { return first_; }
  /// Whether the hub has gone on by a slab or more.
  bool Due(double hub_x_m) const;
  /// Moves on by one slab. The caller then freezes the band.
  void Advance(World& world);
  /// Where a grain stands, from its wrapped fixed-point coordinate [m].
  double Unwrapped(std::int32_t x) const;
  bool InBand(std::int32_t x) const;
  std::uint64_t slabs() const { return slabs_; }

 private:
  struct Resident {
    std::int32_t copy = INT32_MIN, id = -1;
  };
  void Register(const BedPiece& piece, std::int32_t first_id);

  const BedFeed& feed_;
  WindowSettings settings_;
  double from_, to_;
  BedPiece first_;
  std::vector<Resident> newest_;  ///< [tile grain] its foremost copy
  std::uint64_t slabs_ = 0;
};

}  // namespace grouser::dem
