#pragma once

#include <cstdint>
#include <vector>

#include "dem_offline/engine/bodies/body.h"

namespace grouser::dem {

/// Rigid cluster of spheres, possibly overlapping, in its principal axes about
/// its centre of mass.
struct ClumpTemplate {
  struct Member {
    Vec3d offset_m;
    double radius_m;
  };
  std::vector<Member> members;
  double volume_m3 = 0;                   ///< of the union
  Vec3d inertia_per_density = {0, 0, 0};  ///< principal, of the union [m^5]
  /// Where the principal frame stands in the frame of the members as given:
  /// x_given = centre_m + turn x_principal. A clump that should lie as given
  /// starts at position p + q centre_m with orientation q turn.
  Vec3d centre_m = {0, 0, 0};
  Quatd turn = {1, 0, 0, 0};
};

/// Mass properties of the union of the spheres (overlaps counted once), to a
/// relative error under 1e-6: slices along one axis, each slice the exact area
/// and moments of a union of discs, Gauss-Legendre between all heights where a
/// slice changes its kind. Moves and turns the members into principal axes.
/// Throws std::invalid_argument for no members, radii <= 0 or non-finite data.
ClumpTemplate MakeClump(const std::vector<ClumpTemplate::Member>& members);

/// Makes a tensor of inertia diagonal; returns the turn of its principal axes: x_given = turn
/// x_principal. What is diagonal to rounding stays as it is.
Quatd ToPrincipalAxes(double tensor[3][3]);

/// One clump of a world.
struct ClumpState {
  int shape = 0;  ///< number of its template
  double density_kg_per_m3 = 0;
  int material = 0;
  Vec3d position_m = {0, 0, 0};
  Quatd orientation = {1, 0, 0, 0};
  Vec3d velocity_m_per_s = {0, 0, 0}, spin_rad_per_s = {0, 0, 0};
};

}  // namespace grouser::dem
