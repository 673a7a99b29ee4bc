// The keys of experiment files.
#include "dem_offline/scenes/experiment_keys.h"

#include <sstream>

namespace grouser::campaign {

#define ENDS "lower|lift|move|turn|shake|hold_force|wait"
#define HOLDS "move|turn|shake|hold_force|wait"

const std::vector<Key>& ExperimentKeys() {
  using K = KeyKind;
  static const std::vector<Key> keys = {
      {"", "name", K::kText, "", "!", "", "name of the experiment, for people"},
      {"", "seed", K::kCount, "", "1", "", "of the grains' sizes and first places"},
      {"", "gravity_m_per_s2", K::kNumber, "", "9.81", "", "along -z"},
      {"", "duration_s", K::kNumber, "", "as the program takes", "",
       "end of the program; needed where no body moves"},
      {"", "materials", K::kSections, "material", "!", "", "of grains, walls and bodies"},
      {"", "interfaces", K::kSections, "interface", "!", "",
       "numbers of pairs of materials; a pair by name stands over `any`"},
      {"", "laws", K::kSection, "laws", "hertz_restitution, mindlin, epsd", "",
       "one law combination for the whole experiment (`./grouser dem laws`)"},
      {"", "box", K::kSection, "box", "!", "", "floor at z = 0, corner at x = y = 0"},
      {"", "grains", K::kSections, "grains", "!", "", "groups of grains"},
      {"", "preparation", K::kSections, "preparation", "settle, where grains fall", "",
       "what is done before the bodies come, in order"},
      {"", "bodies", K::kSections, "body", "none", "", "rigid bodies, each with a program"},
      {"", "probes", K::kSections, "probe", "pose, wrench, velocity of bodies that move", "",
       "what is written"},
      {"", "output", K::kSection, "output", "", "", ""},
      {"", "numerics", K::kSection, "numerics", "", "", ""},
      {"", "joints", K::kLater, "", "", "", "joints between bodies"},
      {"", "bonds", K::kLater, "", "", "", "bonded grains"},
      {"", "sweep", K::kLater, "", "", "", "sweeps over keys"},

      {"material", "name", K::kText, "", "!", "", ""},
      {"material", "density_kg_per_m3", K::kNumber, "", "0", "",
       "of grains; of bodies whose mass is computed"},
      {"material", "youngs_modulus_pa", K::kNumber, "", "rigid", "", "grains need one"},
      {"material", "poisson_ratio", K::kNumber, "", "0", "", ""},

      {"interface", "between", K::kTexts, "", "!", "", "two materials, or `any`"},
      {"interface", "restitution", K::kNumber, "", "!", "", "(0, 1]"},
      {"interface", "friction", K::kNumber, "", "!", "", "Coulomb's, 0 to 10"},
      {"interface", "rolling_friction", K::kNumber, "", "0", "", ""},
      {"interface", "rolling_damping", K::kNumber, "", "as in laws", "", "of epsd"},
      {"interface", "surface_energy_j_per_m2", K::kNumber, "", "as in laws", "", "of jkr"},
      {"interface", "", K::kLaws, "", "as in laws", "", "settings of a law of the combination"},

      {"laws", "normal", K::kText, "", "hertz_restitution", "", ""},
      {"laws", "tangential", K::kText, "", "mindlin", "", ""},
      {"laws", "rolling", K::kText, "", "epsd", "", ""},
      {"laws", "cohesion", K::kText, "", "none", "", ""},
      {"laws", "rolling_damping", K::kNumber, "", "0.3", "", "of epsd"},
      {"laws", "surface_energy_j_per_m2", K::kNumber, "", "0", "", "of jkr"},
      {"laws", "", K::kLaws, "", "", "", "settings of a law of the combination"},

      {"box", "length_m", K::kNumber, "", "!", "", "along x"},
      {"box", "width_m", K::kNumber, "", "!", "", "along y"},
      {"box", "height_m", K::kNumber, "", "!", "", "no grain or body begins above it"},
      {"box", "x", K::kChoice, "periodic|wall|open", "periodic", "",
       "open: grains that leave are taken out"},
      {"box", "y", K::kChoice, "periodic|wall|open", "periodic", "", ""},
      {"box", "material", K::kText, "", "!", "", "of floor and walls"},
      {"box", "planar", K::kSwitch, "", "off", "",
       "nothing moves along y: one layer of grains in the plane y = width/2"},
      {"box", "disc_thickness_m", K::kNumber, "", "spheres", "", "planar: discs of this thickness"},

      {"grains", "kind", K::kChoice, "bed|poured|rained|lattice|file", "!", "",
       "bed: settled and periodic, as of a wheel test"},
      {"grains", "material", K::kText, "", "!", "", ""},
      {"grains", "diameter_m", K::kNumber, "", "", "bed|poured|rained|lattice",
       "of grains of one size"},
      {"grains", "sizes", K::kSections, "size", "", "bed|poured|rained|lattice",
       "instead of diameter_m"},
      {"grains", "depth_m", K::kNumber, "", "!", "bed", ""},
      {"grains", "solid_fraction", K::kNumber, "", "!", "bed",
       "met within 0.005, else refused with the nearest"},
      {"grains", "region", K::kSection, "region", "the box", "poured|rained|lattice", ""},
      {"grains", "count", K::kCount, "", "lattice: as many as fit", "poured|rained|lattice", ""},
      {"grains", "pitch_m", K::kNumber, "", "1.12 (lattice 1.02) largest diameters",
       "poured|rained|lattice", "between places"},
      {"grains", "speed_m_per_s", K::kNumber, "", "sqrt(g d)", "rained", "first, downwards"},
      {"grains", "file", K::kText, "", "!", "file", "CSV with the columns x,y,z,r in metres"},
      {"grains", "clump", K::kSections, "sphere", "spheres", "poured|lattice",
       "rigid clumps of these spheres, scaled to the volume of a sphere of the diameter"},

      {"sphere", "at", K::kVector, "", "!", "", "in any unit of length"},
      {"sphere", "radius", K::kNumber, "", "!", "", "in the same"},

      {"size", "diameter_m", K::kNumber, "", "!", "", ""},
      {"size", "mass_fraction", K::kNumber, "", "!", "", "sum 1"},

      {"region", "low_m", K::kVector, "", "!", "", "corner"},
      {"region", "high_m", K::kVector, "", "!", "", "opposite corner"},
      {"region", "radius_m", K::kNumber, "", "a block", "",
       "an upright cylinder in its middle instead"},

      {"preparation", "do", K::kChoice, "settle|relax|shake|cut", "!", "",
       "settle: with drag; relax: without"},
      {"preparation", "rest", K::kNumber, "", "1e-6", "settle|relax",
       "at rest below this kinetic energy over sum m g d"},
      {"preparation", "most_s", K::kNumber, "", "by rule", "settle|relax", "gone on after"},
      {"preparation", "friction", K::kNumber, "", "their own", "settle|relax|shake",
       "between grains meanwhile: less packs denser"},
      {"preparation", "solid_fraction", K::kNumber, "", "as it falls", "settle",
       "met within 0.005 by the friction meanwhile, else refused with what was reached"},
      {"preparation", "amplitude_m", K::kVector, "", "!", "shake", "of floor and walls"},
      {"preparation", "frequency_hz", K::kNumber, "", "!", "shake", ""},
      {"preparation", "for_s", K::kNumber, "", "!", "shake", "rounded to whole swings"},
      {"preparation", "height_m", K::kNumber, "", "!", "cut",
       "grains that reach above are taken out"},

      {"body", "name", K::kText, "", "!", "", "begins its columns"},
      {"body", "material", K::kText, "", "!", "", ""},
      {"body", "parts", K::kSections, "part", "!", "", "in body coordinates"},
      {"body", "position_m", K::kVector, "", "!", "", "of the origin of body coordinates"},
      {"body", "turn_deg", K::kAngles, "", "[0, 0, 0]", "", "about x, then y, then z"},
      {"body", "above_surface_m", K::kNumber, "", "position_m counts", "",
       "lowest point above the prepared surface"},
      {"body", "mass_kg", K::kNumber, "", "from parts and density", "", "of a body released"},
      {"body", "centre_m", K::kVector, "", "[0, 0, 0]", "", "of mass, with mass_kg"},
      {"body", "inertia_kg_m2", K::kVector, "", "from the parts", "",
       "about the centre, along the body's axes, with mass_kg"},
      {"body", "while_preparing", K::kSwitch, "", "off", "", "stands there from the beginning"},
      {"body", "motion", K::kSections, "motion", "it stands still", "", "its program, in order"},

      {"part", "shape", K::kChoice,
       "box|cylinder|tube|disc|annulus|ring|vanes|cone|sphere|wheel|mesh", "!", "",
       "own axis z; wheel and mesh: axle y"},
      {"part", "at_m", K::kVector, "", "[0, 0, 0]", "", "in body coordinates"},
      {"part", "turn_deg", K::kAngles, "", "[0, 0, 0]", "", "about x, then y, then z"},
      {"part", "size_m", K::kVector, "", "!", "box", "full sizes"},
      {"part", "radius_m", K::kNumber, "", "!", "cylinder|tube|disc|cone|sphere|wheel",
       "tube: inner; cone: of its base"},
      {"part", "length_m", K::kNumber, "", "!", "cylinder|tube", ""},
      {"part", "wall_m", K::kNumber, "", "!", "tube", "0: solid all around"},
      {"part", "inner_radius_m", K::kNumber, "", "!", "annulus|ring|vanes", ""},
      {"part", "outer_radius_m", K::kNumber, "", "!", "annulus|ring|vanes", ""},
      {"part", "height_m", K::kNumber, "", "!", "ring|vanes|cone",
       "ring, cone: from z = 0 up; vanes: down"},
      {"part", "thickness_m", K::kNumber, "", "!", "vanes", ""},
      {"part", "count", K::kCount, "", "!", "vanes", "radial bars around the axis"},
      {"part", "shaft_radius_m", K::kNumber, "", "its base", "cone", ""},
      {"part", "shaft_length_m", K::kNumber, "", "0", "cone", "behind the base"},
      {"part", "width_m", K::kNumber, "", "!", "wheel", ""},
      {"part", "treads", K::kSections, "tread", "smooth", "wheel", ""},
      {"part", "file", K::kText, "", "!", "mesh", "STL or OBJ"},
      {"part", "scale", K::kNumber, "", "1", "mesh", "metres per unit of the file"},
      {"part", "axle", K::kChoice, "x|y|z", "y", "mesh", "axis of the file that becomes y"},

      {"tread", "count", K::kCount, "", "!", "", ""},
      {"tread", "height_m", K::kNumber, "", "!", "", "beyond the rim"},
      {"tread", "root_thickness_m", K::kNumber, "", "!", "", ""},
      {"tread", "tip_thickness_m", K::kNumber, "", "as the root", "", ""},
      {"tread", "width_m", K::kNumber, "", "as the wheel", "", ""},
      {"tread", "offset_m", K::kNumber, "", "0", "", "along the axle"},
      {"tread", "lean_deg", K::kDegrees, "", "0", "", ""},

      {"motion", "do", K::kChoice, "move|turn|shake|lower|lift|hold_force|wait|release", "!", "",
       ""},
      {"motion", "velocity_m_per_s", K::kVector, "", "!", "move|turn", "turn: 0"},
      {"motion", "speed_m_per_s", K::kNumber, "", "!", "lower|lift", ""},
      {"motion", "axis", K::kChoice, "x|y|z|axle", "z", "move|turn",
       "of the turn, of the world; axle: the body's own y axis"},
      {"motion", "rate_deg_per_s", K::kDegrees, "", "!", "move|turn", "move: 0"},
      {"motion", "amplitude_m", K::kVector, "", "!", "shake", "displacement A sin(2 pi f t)"},
      {"motion", "frequency_hz", K::kNumber, "", "!", "shake", ""},
      {"motion", "ramp_s", K::kNumber, "", "0", "move|turn|lower|lift",
       "speed rises as 1/2 - 1/2 cos(pi t/ramp)"},
      {"motion", "hold_force_n", K::kNumber, "", "!", HOLDS,
       "pressed so along hold_axis, which is free (needed in hold_force)"},
      {"motion", "hold_axis", K::kChoice, "-z|z|x|-x|y|-y", "-z", HOLDS, ""},
      {"motion", "hold_mass_kg", K::kNumber, "", "force/g", HOLDS, "of the free axis"},
      {"motion", "hold_damper_s", K::kNumber, "", "sqrt(d/g)/3; beside a motion 0", HOLDS,
       "m v/damper; 0: none"},
      {"motion", "free", K::kChoices, "x|y|z|spin", "none", ENDS,
       "axes of the world that are free with the body's mass and weight; spin: about the body's "
       "own y"
       " axis, its axle"},
      {"motion", "applied_force_n", K::kVector, "", "[0, 0, 0]", ENDS,
       "on the free axes, beside weight and grains: a load, a drawbar pull"},
      {"motion", "applied_torque_n_m", K::kNumber, "", "0", ENDS,
       "about the axle, where spin is free"},
      {"motion", "for_s", K::kNumber, "", "", ENDS "|release", "end: after this time"},
      {"motion", "distance_m", K::kNumber, "", "", ENDS,
       "end: after this way; where nothing else moves it, held or along free axes"},
      {"motion", "angle_deg", K::kDegrees, "", "", ENDS,
       "end: after this turn (of a free spin, too)"},
      {"motion", "force_n", K::kNumber, "", "", "lower|move|hold_force",
       "end: the grains push back so"},
      {"motion", "touch", K::kSwitch, "", "off", "lower|move", "end: a grain touches"},
      {"motion", "rest", K::kNumber, "", "", "wait|release|hold_force",
       "end: kinetic energy over sum m g d"},
      {"motion", "until_done", K::kText, "", "", "wait|turn|move|hold_force|shake",
       "end: that body's program is done"},
      {"motion", "most_s", K::kNumber, "", "by rule", "",
       "the run fails where no end comes by then"},

      {"probe", "kind", K::kChoice,
       "wrench|pose|velocity|coordination|energy|rest|repose|bins|surface|treads", "!", "", ""},
      {"probe", "body", K::kText, "", "!", "wrench|pose|velocity|treads", ""},
      {"probe", "frame", K::kChoice, "world|body", "world", "wrench", ""},
      {"probe", "name", K::kText, "", "!", "bins|surface", "of its CSV"},
      {"probe", "region", K::kSection, "region", "the box", "bins|surface|repose",
       "with a radius: cylindrical bins"},
      {"probe", "n", K::kCounts, "", "!", "bins|surface",
       "bins along x, y, z (cylindrical: radius, turn, z)"},
      {"probe", "every_s", K::kNumber, "", "at the end", "bins|surface", ""},

      {"output", "sample_s", K::kNumber, "", "0.01", "", "of the series; wrenches are means"},
      {"output", "checkpoint_s", K::kLater, "", "", "", "checkpoints"},
      {"output", "frames_s", K::kLater, "", "", "", "frames for pictures"},
      {"numerics", "rayleigh_fraction", K::kNumber, "", "0.2", "", "largest time step"},
      {"numerics", "program_step", K::kNumber, "", "1", "",
       "time step of the program over that of the preparation"},
      {"numerics", "overlap", K::kNumber, "", "0.05", "",
       "largest overlap over the radius that the step has to bear"},
  };
  return keys;
}

#undef ENDS
#undef HOLDS

std::vector<std::string> SplitChoices(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, '|');) out.push_back(part);
  return out;
}

std::string SelectorOf(const std::string& section) {
  if (section == "grains" || section == "probe") return "kind";
  if (section == "part") return "shape";
  return section == "preparation" || section == "motion" ? "do" : "";
}

}  // namespace grouser::campaign
