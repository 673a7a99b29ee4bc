#pragma once

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/engine/laws/contact_model.h"

// What an experiment means in numbers, before anything is made: materials in the order of a
// world, lattices, times.

namespace grouser::dem::experiment {

/// Number of a material in the world: those of grains in the order of their groups, then the
/// others as given. Throws SpecError naming `field` for an unknown name.
int MaterialNumber(const Experiment& e, const std::string& name, const std::string& field);
const Material& MaterialOf(const Experiment& e, const std::string& name);

/// Of a body over the height of the box: the frame ends at 2, where it would come back below.
inline constexpr double kMostHeight = 1.9;
inline constexpr double kMostFrames = 1e5;  ///< of a run, and checkpoints

inline constexpr const char* kAny = "any";  ///< every material, in an interface

/// Laws and interfaces of all materials; meanwhile and surface energy: of grains among
/// themselves instead of their own.
ContactModel ContactsOf(const Experiment& e, const BedPreparation& meanwhile = {},
                        std::optional<double> surface_energy_j_per_m2 = {});

/// Places of a simple cubic lattice in a region, layer by layer from its low end.
struct Sites {
  double pitch_m = 0, step_x_m = 0, step_y_m = 0;
  double nx = 0, ny = 0, layers = 0;  ///< whole numbers; of layers: as many as the region holds
  double PerLayer() const { return nx * ny; }
};
/// Of a group that is poured, rained or on a lattice.
Sites SitesOf(const Grains& g);
/// The centres of one layer, in rows along y. A cylinder leaves out what does not lie in it.
std::vector<Vec3d> LayerOf(const Sites& sites, const Grains& g, std::int64_t layer);
/// Centres in a layer, without making them: for a cylinder its own, else PerLayer.
double CountInLayer(const Sites& sites, const Grains& g);

/// The same with what was left out: regions (the box), preparation (settle, where grains fall),
/// probes (pose, wrench and velocity of every body that moves).
Experiment Resolved(const Experiment& given);

/// Diameter of what a grain of diameter 1 takes up: more than 1 for clumps.
double ReachOf(const Grains& g);
double LargestOf(const Grains& g);  ///< diameter of what a grain of the group takes up, at most
double LargestDiameter(const Experiment& e);
/// The same, but of single spheres where grains are bonded.
double LargestSphere(const Experiment& e);
double SmallestRadius(const Experiment& e);
/// sqrt(d/g) of the largest grains (bonded ones: of their fragments) [s]: the unit of the times
/// that are set by rule.
double GravityTime(const Experiment& e);

/// Least and most time of a settling [s]: from the height of the box.
struct SettlingTimes {
  double least_s, most_s;
};
SettlingTimes SettlingOf(const Experiment& e, const Preparation& step);
/// Time that a turn of the box takes; 0: another step [s].
double TurnTime(const Preparation& step);
/// Time between two layers of rain, and over all of them [s].
double RainInterval(const Experiment& e, const Grains& g);
double RainTime(const Experiment& e);

/// Most time of a step of a program [s]; kNever: it has no end.
double MostTime(const Experiment& e, const BodySpec& body, const MotionStep& step);
/// Most time of the whole program [s].
double ProgramTime(const Experiment& e);

/// The bed of a group of kind bed.
BedSpec BedOf(const Experiment& e, const Grains& g);

bool MovesFreely(const BodySpec& body);

}  // namespace grouser::dem::experiment
