#pragma once

#include "dem_offline/engine/laws/contact_model.h"

// Time steps from what the laws state (ContactModel::Bounds), in one place: for
// a World's guard, a wheel test and the beds of verify.

namespace grouser::dem {

/// Largest step [s] of a leapfrog whose damping lags by half a step: mass m
/// (inertia), spring K, dashpot C: K dt^2/m + 2 C dt/m <= 4, that is
///   dt = 4 m/(C + sqrt(C^2 + 4 K m)).
/// Infinite where there is neither spring nor dashpot.
double LeapfrogLimit(double mass, const SpringBound& bound);

/// Largest step [s] of a grain in a packing whose contacts reach this overlap over
/// the radius: the smallest LeapfrogLimit of
///   its fastest modes of motion: 16 times spring and dashpot of a contact of two
///     equal grains, 28 times the spring alone (fitted where wheel tests lose their
///     energy: see LargestStep in rig/scaling.h); both grow with the tangential and
///     rolling spring where these are stiffer than Mindlin's;
///   rolling in 6 contacts of which each is felt by two grains;
///   its contact with a body;
/// times the share that the rolling law asks for.
/// Materials [0, of_grains) are those of grains; two others never touch. < 0: all are.
double PackedLimit(const ContactModel& contacts, double overlap_over_radius, double radius_m,
                   double mass_kg, int of_grains = -1);

/// 0.2 sqrt(m/K), or m/(8 C) where that is less: K and C of the contact with a body that is
/// hardest on a grain, at this overlap [m]. A tenth of the limit of one contact
/// without dashpot, and well under that of a grain in a packing.
double CriticalStepOf(const ContactModel& contacts, double overlap_m, double radius_m,
                      double mass_kg);

/// Overlap over the radius [-] at which two equal grains of material `a`, pressed
/// together for the first time and slowly, bear the force [N]; at most 1.
double OverlapUnderForce(const ContactModel& contacts, int a, double force_n, double radius_m,
                         double mass_kg);

}  // namespace grouser::dem
