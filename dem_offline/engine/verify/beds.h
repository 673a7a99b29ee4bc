#pragma once

#include <cstdint>
#include <vector>

#include "dem_offline/engine/core/random.h"
#include "dem_offline/engine/verify/scenes.h"

// Many grains, the same every time.

namespace grouser::dem::verify {

/// About n grains (a cube number) that fly about in a periodic box and collide
/// often; zero gravity, floor and lid.
World Gas(const Laws& laws, int n, std::uint64_t seed, bool energy = false, int threads = 1);

struct BedSpec {
  double length_m = 0.24, width_m = 0.12, depth_m = 0.05;
  double smallest_d_m = 0.010, largest_d_m = 0.012;
  Elastic grains = {2e6, 0.3};
  ContactProperties surfaces = {.restitution = 0.5, .friction = 0.5, .rolling_friction = 0.1};
  Laws laws = {.rolling = "epsd"};
  double density = 2290;
  double gravity = 9.81;
  /// Of 0.2 Rayleigh times, or of what the laws bear at an overlap of 0.05 radii.
  double step_share = 1;
  std::uint64_t seed = 1;
  WorldConfig Config() const;  ///< periodic in x and y, floor plane at z = 0
};
/// Grains of a bed that has fallen and come to rest on z = 0, at rest.
std::vector<GrainState> Settle(const BedSpec& spec);
/// Moved by less than a quantum to where rounding to fixed point cannot tip
/// over, so that shifted and mirrored copies keep the same distances.
std::vector<GrainState> Steadied(std::vector<GrainState> grains, const Frame& frame);
/// Loose grains on a jittered grid over [x0, x1] x [y0, y1], from z0 up.
std::vector<GrainState> Grid(const BedSpec& spec, double x0, double x1, double y0, double y1,
                             double z0, int count);

/// Volume of a sphere between two heights [m^3].
double SphereInSlab(double z, double radius, double low, double high);

/// Translational kinetic energy over the sum of m g d: how far from rest. (No
/// law resists a sphere that spins on the spot about the normal of a contact.)
double Restlessness(const World& world);
/// Highest z + r [m].
double Top(const World& world);

}  // namespace grouser::dem::verify
