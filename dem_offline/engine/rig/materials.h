#pragma once

#include <cmath>

#include "dem_offline/engine/bodies/body.h"
#include "dem_offline/engine/laws/contact_model.h"
#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem {

inline constexpr int kGrainMaterial = 0, kFloorMaterial = 1, kWheelMaterial = 2;

/// Of the grains among themselves: the soil's own, or others while they settle.
struct GrainFriction {
  double friction = 0, rolling_friction = 0;
};
inline GrainFriction FrictionOf(const GrainSoil& s) { return {s.friction, s.rolling_friction}; }

/// Grains, and a floor as rough as they are.
inline ContactModel BedContacts(const GrainSoil& s, const GrainFriction& between) {
  ContactModel model(LawsOf(s.contact));
  model.AddMaterial({s.youngs_modulus_pa, s.poisson_ratio});
  model.AddMaterial({kRigid, 0.0});
  ContactProperties f;
  f.restitution = s.restitution;
  f.friction = between.friction;
  f.rolling_friction = between.rolling_friction;
  PutInto(f, s.contact);
  model.SetContactProperties(kGrainMaterial, kGrainMaterial, f, SettingsOf(s.contact));
  f.friction = s.friction;
  f.rolling_friction = s.rolling_friction;
  PutInto(f, s.contact, s.contact.floor);
  model.SetContactProperties(kGrainMaterial, kFloorMaterial, f,
                             SettingsOf(s.contact, s.contact.floor));
  return model;
}

/// The same with a wheel, rigid as the floor, with its own numbers for the laws.
inline ContactModel RigContacts(const GrainSoil& s, const WheelShape& w) {
  ContactModel model = BedContacts(s, FrictionOf(s));
  model.AddMaterial({kRigid, 0.0});
  ContactProperties f;
  f.restitution = w.restitution;
  f.friction = w.friction;
  f.rolling_friction = w.rolling_friction;
  PutInto(f, s.contact, s.contact.wheel);
  model.SetContactProperties(kGrainMaterial, kWheelMaterial, f,
                             SettingsOf(s.contact, s.contact.wheel));
  return model;
}

/// The bed's floor, at z = -depth.
inline Body FloorBody(double depth_m) {
  Body floor;
  const double up[3] = {0, 0, 1};
  floor.shape = HalfSpace(up);
  floor.material = kFloorMaterial;
  floor.position_m = {0, 0, -depth_m};
  return floor;
}
/// Height of the frame of a tile [m]: 2^32 quanta of a grain's z.
inline double TileZSpan(double depth_m) { return depth_m > 0.125 ? 8 * depth_m : 1.0; }

inline constexpr int kFloorBody = 0, kWheelBody = 1;

inline double SmallestRadius(const GrainSoil& s) {
  double r = s.sizes.front().diameter_m;
  for (const auto& b : s.sizes) r = b.diameter_m < r ? b.diameter_m : r;
  return 0.5 * r;
}
inline double LargestDiameter(const GrainSoil& s) {
  double d = 0;
  for (const auto& b : s.sizes) d = b.diameter_m > d ? b.diameter_m : d;
  return d;
}
/// Mean volume by number [m^3]: pi/6 over sum(mass fraction/d^3), the fractions
/// summing to 1.
inline double MeanGrainVolume(const GrainSoil& s) {
  double n = 0;
  for (const auto& b : s.sizes) n += b.mass_fraction / (b.diameter_m * b.diameter_m * b.diameter_m);
  return M_PI / 6 / n;
}
/// Mean by number [m].
inline double MeanDiameter(const GrainSoil& s) {
  double n = 0, nd = 0;
  for (const auto& b : s.sizes) {
    const double share = b.mass_fraction / (b.diameter_m * b.diameter_m * b.diameter_m);
    n += share;
    nd += share * b.diameter_m;
  }
  return nd / n;
}

/// The units of the rig's own times and speeds: sqrt(d/g) [s] and sqrt(g d) [m/s], d
/// the mean diameter by number. 0.030 s and 0.29 m/s for the shipped soil of 9 mm.
inline double GravityTime(const GrainSoil& s) {
  return std::sqrt(MeanDiameter(s) / s.gravity_m_per_s2);
}
inline double GravitySpeed(const GrainSoil& s) {
  return std::sqrt(MeanDiameter(s) * s.gravity_m_per_s2);
}

}  // namespace grouser::dem
