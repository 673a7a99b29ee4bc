// Experiment files: examples, schema, every key, and what is refused.
#include "dem_offline/scenes/experiment_yaml.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/scenes/experiment_joints_yaml.h"
#include "dem_offline/scenes/experiment_keys.h"
#include "dem_offline/scenes/sweep_yaml.h"
#include "proto/records/durable_file.h"

namespace grouser::campaign {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

const fs::path kExamples = GROUSER_EXPERIMENTS;

constexpr char kPlanar[] = R"(name: planar
materials: {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.3, width_m: 0.1, height_m: 0.3, planar: on, disc_thickness_m: 0.01,
      material: sand}
grains: {kind: poured, material: sand, diameter_m: 0.01, count: 50}
preparation: {do: settle, solid_fraction: 0.8}
duration_s: 0.1
output: {frames: {every_s: 0.05}}
numerics: {program_step: 0.5}
)";
constexpr char kClumps[] = R"(name: clumps
materials: {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.3, width_m: 0.1, height_m: 0.3, material: sand}
grains: {kind: poured, material: sand, diameter_m: 0.01, count: 50,
         clump: [{at: [0, 0, 0], radius: 1}, {at: [1, 0, 0], radius: 1}]}
duration_s: 0.1
)";

/// A body, a material and a table whose names nothing else uses.
constexpr char kNamed[] = R"(name: named
materials: [{name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}, {name: spare}]
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.2, width_m: 0.2, height_m: 0.3, material: sand}
grains: {kind: lattice, material: sand, diameter_m: 0.01, count: 20}
bodies: [{name: plate, material: sand, parts: {shape: disc, radius_m: 0.1},
          position_m: [0.1, 0.1, 0.2]}]
probes: [{kind: grains, name: all}]
duration_s: 0.1
)";

/// Bonded grains, one by one and on a circle.
constexpr char kBonded[] = R"(name: bonded
materials: {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.6, width_m: 0.6, height_m: 0.3, material: sand}
grains:
  - kind: placed
    material: sand
    diameter_m: 0.05
    places: [{at_m: [0.3, 0.3, 0.2]}]
    bonds: {fragment_m: 0.01, fragments: 40, count: 90, disk_scale: 1.25,
            normal_stiffness_n_per_m3: 1.0e8, shear_stiffness_n_per_m3: 2.0e8, strength_pa: 1.0e5,
            strength_ratio: 3, largest_stretch: 0.2, largest_distance: 1.5, damping_ratio: 0.1,
            beside_contact: off}
  - {kind: placed, material: sand, diameter_m: 0.05,
     circle: {count: 4, radius_m: 0.2, at_m: [0.3, 0.3, 0.1]}}
probes:
  - {kind: bonds}
  - {kind: bond_forces, name: forces, every_s: 0.1}
  - {kind: fragments, name: fragments}
duration_s: 0.1
)";

/// A loose layer on a dense bed, whose grains have frictions of their own while they settle.
constexpr char kLayers[] = R"(name: layers
materials: {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5, rolling_friction: 0.2}
box: {length_m: 0.2, width_m: 0.1, height_m: 0.3, material: sand}
grains: {kind: bed, material: sand, diameter_m: 0.01, depth_m: 0.1, solid_fraction: 0.60,
         preparation: {friction: 0.3, rolling_friction: 0.1},
         top_layer: {thickness_m: 0.04, solid_fraction: 0.54, preparation: {friction: 0.8}}}
duration_s: 0.1
)";

/// Every key that no other has.
constexpr char kRest[] = R"(name: all
seed: 3
gravity_m_per_s2: 1.62
duration_s: 0.1
laws: {normal: hertz_restitution, tangential: mindlin, rolling: epsd, cohesion: jkr,
       rolling_damping: 0.2, surface_energy_j_per_m2: 0.01}
materials:
  - {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6, poisson_ratio: 0.3}
  - {name: steel, density_kg_per_m3: 7800}
interfaces:
  - {between: [sand, any], restitution: 0.5, friction: 0.5, rolling_friction: 0.1,
     rolling_damping: 0.1, surface_energy_j_per_m2: 0.02}
box: {length_m: 0.2, width_m: 0.2, height_m: 0.3, x: wall, y: open, material: steel}
grains:
  - kind: rained
    material: sand
    sizes: [{diameter_m: 0.01, mass_fraction: 0.6}, {diameter_m: 0.012, mass_fraction: 0.4}]
    count: 50
    speed_m_per_s: 0.5
  - {kind: lattice, material: sand, diameter_m: 0.01, pitch_m: 0.02, count: 5,
     region: {low_m: [0, 0, 0.1], high_m: [0.2, 0.2, 0.2], radius_m: 0.1}}
  - {kind: file, material: sand, file: grains.csv}
preparation:
  - {do: settle, rest: 1.0e-5, most_s: 0.5, friction: 0.1}
  - {do: relax}
  - {do: shake, amplitude_m: [0, 0, 0.001], frequency_hz: 20, for_s: 0.1}
  - {do: cut, height_m: 0.1}
bodies:
  - name: one
    material: steel
    parts:
      - {shape: wheel, radius_m: 0.03, width_m: 0.02,
         treads: {count: 8, height_m: 0.005, root_thickness_m: 0.004, tip_thickness_m: 0.003,
                  width_m: 0.01, offset_m: 0.001, lean_deg: 10}}
      - {shape: box, size_m: [0.01, 0.01, 0.01], at_m: [0, 0.02, 0], turn_deg: [0, 0, 45]}
      - {shape: mesh, file: tetra.obj, scale: 0.01, axle: z, repair: on, solid: inside}
    position_m: [0.1, 0.1, 0.2]
    turn_deg: [0, 0, 30]
    mass_kg: 2
    centre_m: [0, 0.001, 0]
    inertia_kg_m2: [0.001, 0.002, 0.003]
    motion:
      - {do: shake, amplitude_m: [0.001, 0, 0], frequency_hz: 10, for_s: 0.01}
      - {do: lower, speed_m_per_s: 0.1, touch: on, most_s: 1}
      - {do: hold_force, hold_force_n: 5, hold_axis: -z, hold_mass_kg: 1, hold_damper_s: 0.01,
         for_s: 0.01}
      - {do: wait, until_done: two, most_s: 1}
      - {do: turn, axis: axle, rate_deg_per_s: 20, free: [x, z], applied_force_n: [-1, 0, -5],
         for_s: 0.01}
      - {do: wait, free: [spin], applied_torque_n_m: 0.1, angle_deg: 5, most_s: 1}
      - {do: release, for_s: 0.01}
  - name: two
    material: steel
    parts:
      - {shape: disc, radius_m: 0.02}
      - {shape: annulus, inner_radius_m: 0.02, outer_radius_m: 0.03, at_m: [0, 0, 0.01]}
      - {shape: sphere, radius_m: 0.01, at_m: [0, 0, 0.03]}
    position_m: [0.05, 0.05, 0.25]
    motion: {do: wait, for_s: 0.01}
probes:
  - {kind: wrench, body: one, frame: body}
  - {kind: velocity, body: one}
  - {kind: coordination}
  - {kind: energy}
  - {kind: bins, name: rings, region: {low_m: [0, 0, 0], high_m: [0.2, 0.2, 0.1], radius_m: 0.1},
     n: [4, 1, 2], every_s: 0.05}
  - {kind: ruts, name: trace, body: one, n: [60, 3, 1], from_s: 0.01}
output: {sample_s: 0.005, frames: {times_s: [0, 0.01]},
         checkpoint_every_s: 0.02}
numerics: {rayleigh_fraction: 0.1, overlap: 0.04}
)";

/// Joints, springs and their probes; the box turned before. Keys that joints.yaml lacks.
constexpr char kJoints[] = R"(name: joints
materials:
  - {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
  - {name: steel, density_kg_per_m3: 7800}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.2, width_m: 0.2, height_m: 0.6, x: wall, y: wall, material: steel}
grains: {kind: poured, material: sand, diameter_m: 0.01, count: 50}
preparation:
  - {do: settle}
  - {do: turn, turns: 2, rate_deg_per_s: 90, axis: x, height_m: 0.2}
bodies:
  - {name: arm, material: steel, parts: {shape: box, size_m: [0.1, 0.02, 0.02]},
     position_m: [0.1, 0.1, 0.5]}
  - {name: block, material: steel, parts: {shape: box, size_m: [0.02, 0.02, 0.02]},
     position_m: [0.1, 0.05, 0.5]}
joints:
  - {name: hinge, kind: revolute, child: arm, at_m: [-0.05, 0, 0], axis: [0, 1, 0]}
  - {name: slide, kind: translational, child: block, axis: [0, 0, 1], locked: on}
springs:
  - {name: leg, kind: linear, body_b: block, at_a_m: [0.1, 0.05, 0.4], at_b_m: [0, 0, -0.01],
     stiffness_n_per_m: 100, damping_n_s_per_m: 1, free_length_m: 0.08,
     force: [{force_n: 1, ramp_s: 0.01, for_s: 0.05}, {force_n: 2}]}
  - {name: coil, kind: rotational, joint: hinge, stiffness_n_m_per_rad: 0.1,
     damping_n_m_s_per_rad: 0.001, free_angle_deg: 30, torque: {torque_n_m: 0.01}}
probes:
  - {kind: joint, joint: hinge, frame: body}
  - {kind: spring, spring: leg}
  - {kind: mixing, diameter_m: 0.009, n: [1, 1, 2]}
duration_s: 0.1
)";

/// A window that follows a body.
constexpr char kFollowed[] = R"(name: followed
materials: {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 1, width_m: 0.1, height_m: 0.3, planar: on, material: sand,
      follow: {body: wheel, length_m: 0.5, ahead: 0.5}}
grains: {kind: poured, material: sand, diameter_m: 0.01, count: 50}
bodies: {name: wheel, material: sand, parts: {shape: wheel, radius_m: 0.03, width_m: 0.02},
         position_m: [0.5, 0.05, 0.2],
         motion: {do: move, velocity_m_per_s: [0.1, 0, 0], for_s: 0.1}}
numerics: {program_step: 0.5}
)";

constexpr char kSweep[] = R"(sweep:
  axes:
    - {key: gravity_m_per_s2, values: [1.62, 9.81]}
    - {key: "interfaces[0].friction", values: [0.4, 0.5], zipped: on}
  replicates: 4
  held_out: {axes: {key: gravity_m_per_s2, values: [3.7]}}
  results:
    - {column: coordination, of: mean, from_s: 0.01, to_s: -0.01, name: contacts}
)";

class ExperimentYaml : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("experiment_yaml_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    std::ofstream(folder_ / "grains.csv")
        << "x,y,z,r\n0.1,0.1,0.05,0.005\n# two\n0.15,0.1,0.05,0.005\n";
    std::ofstream(folder_ / "tetra.obj")
        << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  }
  void TearDown() override { fs::remove_all(folder_); }

  ExperimentFile Read(const std::string& text, const std::vector<std::string>& sets = {}) const {
    return ReadExperiment(text, "e.yaml", folder_, {}, sets);
  }
  /// What is said of kRest with one text replaced.
  std::string Complaint(const std::string& old, const std::string& now) const {
    std::string text = kRest;
    const std::size_t at = text.find(old);
    EXPECT_NE(at, std::string::npos) << old;
    text.replace(at, old.size(), now);
    try {
      Read(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  fs::path folder_;
};

TEST_F(ExperimentYaml, ReadsEveryKey) {
  const ExperimentFile file = Read(kRest);
  const auto& e = file.experiment;
  EXPECT_EQ(e.seed, 3u);
  EXPECT_EQ(e.grains.size(), 3u);
  ASSERT_EQ(e.grains[2].listed.size(), 2u);
  EXPECT_EQ(e.grains[2].listed[1].x_m, 0.15);
  EXPECT_EQ(e.bodies[0].parts[0].treads[0].count, 8);
  EXPECT_NEAR(e.bodies[0].parts[0].treads[0].lean_rad, 10 * M_PI / 180, 1e-12);
  EXPECT_NEAR(e.bodies[0].turn[3], std::sin(15 * M_PI / 180), 1e-12);
  EXPECT_EQ(e.bodies[0].motion[2].direction, (dem::Vec3d{0, 0, -1}));
  EXPECT_TRUE(e.bodies[0].motion[4].about_axle);
  EXPECT_EQ(e.bodies[0].motion[4].free_axes, (std::array<bool, 3>{true, false, true}));
  EXPECT_TRUE(e.bodies[0].motion[5].free_spin);
  EXPECT_EQ(e.probes.back().kind, dem::experiment::Probe::Kind::kRuts);
  EXPECT_EQ(e.probes.back().n[1], 3);
  EXPECT_EQ(e.probes.back().from_s, 0.01);
  EXPECT_EQ(file.others.size(), 2u);
  EXPECT_NEAR(e.bodies[0].parts[2].mesh.vertices[3][1], 0.01, 1e-15);  // its z is the axle
  EXPECT_EQ(e.frames.times_s.size(), 2u);
  std::string all =
      std::string(kRest) + kPlanar + kClumps + kBonded + kFollowed + kSweep + kJoints + kLayers;
  EXPECT_EQ(Read(kPlanar).experiment.frames.every_s, 0.05);
  EXPECT_EQ(ReadSweep(std::string(kRest) + kSweep, "e.yaml", folder_)->members.size(), 9u);
  EXPECT_TRUE(Read(kPlanar).experiment.box.planar);
  EXPECT_EQ(Read(kClumps).experiment.grains[0].clump.size(), 2u);
  EXPECT_EQ(Read(kFollowed).experiment.box.follow.length_m, 0.5);
  EXPECT_THROW(Read(kClumps, {"box.planar=on"}), InputError);
  const auto bed = Read(kLayers).experiment.grains[0];
  EXPECT_EQ(bed.preparation.friction, 0.3);
  EXPECT_EQ(bed.preparation.rolling_friction, 0.1);
  EXPECT_EQ(std::pair(bed.top.thickness_m, bed.top.solid_fraction), std::pair(0.04, 0.54));
  EXPECT_EQ(bed.top.preparation.friction, 0.8);
  EXPECT_THROW(Read(kLayers, {"grains[0].top_layer.thickness_m=0.09"}), InputError);
  for (const auto& entry : fs::directory_iterator(kExamples)) {
    if (entry.path().extension() == ".yaml") all += records::ReadFileBytes(entry.path());
  }
  for (const Key& key : ExperimentKeys()) {
    if (key.kind == KeyKind::kLaws) continue;
    EXPECT_THAT(all, HasSubstr(std::string(key.name) + ":")) << key.section << ": no example";
  }
}

/// A wheel with six grousers about z, in millimetres, as a file has it: inside-out, one triangle
/// twice, one without area, off the origin.
std::string WheelFile() {
  std::string text;
  for (int i = 0; i < 24; ++i) {
    const double a = 2 * M_PI * i / 24, r = i % 4 == 0 ? 60 : 50;
    for (const double z : {0.0, 40.0}) {
      text += fmt::format("v {} {} {}\n", 100 + r * std::cos(a), 20 + r * std::sin(a), z);
    }
  }
  text += "v 100 20 0\nv 100 20 40\n";
  for (int i = 0; i < 24; ++i) {
    const int a = 2 * i + 1, b = (2 * i + 2) % 48 + 1;
    text += fmt::format("f {0} {2} {1}\nf {1} {2} {3}\nf {0} {4} {2}\nf {1} {3} {5}\n", a, a + 1, b,
                        b + 1, 49, 50);
  }
  return text;
}

TEST_F(ExperimentYaml, MeshesAreRepairedAndPutOnTheirAxle) {
  const auto put = [&](const std::string& text) { std::ofstream(folder_ / "tetra.obj") << text; };
  const auto read = [&](const std::string& keys) {
    return Read(kRest, {"bodies[0].parts[2]={shape: mesh, file: tetra.obj, " + keys + "}"});
  };
  const auto refusal = [&](const std::string& keys) -> std::string {
    try {
      read(keys);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  put(WheelFile());
  const ExperimentFile clean = read("scale: 0.001, axle: auto, repair: off");
  EXPECT_THAT(Described(clean.others.back()),
              HasSubstr("tetra.obj: 96 triangles, 1 closed shell; nothing to repair; axle found "
                        "along (0, 0, 1) of the file through (100, 20, 20), principal moments"));
  double radius = 0, low = 1, high = -1;
  for (const auto& v : clean.experiment.bodies[0].parts[2].mesh.vertices) {
    radius = std::max(radius, std::hypot(v[0], v[2]));
    low = std::min(low, v[1]);
    high = std::max(high, v[1]);
  }
  EXPECT_NEAR(radius, 0.06, 1e-9);
  EXPECT_NEAR(low, -0.02, 1e-9);
  EXPECT_NEAR(high, 0.02, 1e-9);
  put(WheelFile() + "f 1 3 2\nf 5 5 6\n");
  EXPECT_THAT(refusal("repair: off"), HasSubstr("parts[2].repair': got off, but tetra.obj needs"));
  const ExperimentFile mended = read("scale: 0.001, axle: auto");
  EXPECT_THAT(mended.others.back().note,
              HasSubstr("; 1 triangle without area dropped; 1 copy dropped; axle found"));
  EXPECT_EQ(mended.experiment.bodies[0].parts[2].mesh.vertices,
            clean.experiment.bodies[0].parts[2].mesh.vertices);
  EXPECT_THAT(read("scale: 0.001, solid: outside").others.back().note,
              HasSubstr("1 shell inside-out turned"));
  put("v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  EXPECT_THAT(refusal("axle: auto"), HasSubstr("parts[2].axle': got tetra.obj: got principal"));
  put("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  EXPECT_THAT(refusal("scale: 1"),
              HasSubstr("parts[2].file': got tetra.obj: got no triangle with"));
}

TEST_F(ExperimentYaml, ReadsBondedGrains) {
  const dem::experiment::Experiment e = Read(kBonded).experiment;
  const dem::experiment::Bonding& b = e.grains[0].bonds;
  EXPECT_EQ(b.fragments, 40);
  EXPECT_EQ(b.count, 90);
  EXPECT_EQ(b.law.shear_stiffness_n_per_m3, 2e8);
  EXPECT_EQ(b.law.tensile_strength_pa, 1e5);
  EXPECT_EQ(b.law.shear_strength_pa, 3e5);
  EXPECT_EQ(b.law.largest_stretch, 0.2);
  EXPECT_EQ(b.largest_distance, 1.5);
  EXPECT_FALSE(b.law.beside_contact);
  EXPECT_EQ(e.grains[1].bonds.fragments, 0);
  ASSERT_EQ(e.grains[1].places_m.size(), 4u);
  EXPECT_NEAR(e.grains[1].places_m[1][0], 0.3, 1e-12);
  EXPECT_NEAR(e.grains[1].places_m[1][1], 0.5, 1e-12);
  const auto refusal = [&](const std::string& set) -> std::string {
    try {
      Read(kBonded, {set});
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal("grains[0].bonds.fragments=1"), HasSubstr("grains[0].bonds.fragments"));
  EXPECT_THAT(refusal("grains[0].bonds.fragments=300"), HasSubstr("of the grain's volume"));
  EXPECT_THAT(refusal("grains[0].circle={count: 1, radius_m: 0, at_m: [0.1, 0.1, 0.1]}"),
              HasSubstr("it beside circle"));
  EXPECT_THAT(refusal("box.planar=on"), HasSubstr("bonded grains with planar"));
  EXPECT_THAT(refusal("probes[0].kind=bond"), HasSubstr("the nearest is 'bonds'"));
}

TEST_F(ExperimentYaml, ReadsEveryExample) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(kExamples)) {
    if (entry.path().extension() != ".yaml") continue;
    ++count;
    if (!JointMechanism() && entry.path().stem() == "joints") continue;
    EXPECT_NO_THROW(LoadExperiment(entry.path(), {})) << entry.path();
  }
  EXPECT_GE(count, 5);
}

TEST_F(ExperimentYaml, ReadsTheShearCell) {
  const std::string file = kExamples / "shear_cell.yaml";
  const auto e = LoadExperiment(file, {}).experiment;
  EXPECT_EQ(e.bodies[0].parts[1].count, 70);  // floor(pi/asin(1.6 r/R))
  EXPECT_EQ(e.grains[0].areal_fraction, 0.75);
  EXPECT_EQ(e.grains[0].region.inner_radius_m, 0.085725);
  EXPECT_EQ(e.probes[0].rings, 6);
  const auto spheres = [&](const std::string& how) {
    return LoadExperiment(file, {},
                          {"bodies[0].parts[1]={shape: spheres, radius_m: 0.00238125, "
                           "ring_radius_m: 0.085725, " +
                           how + "}"})
        .experiment.bodies[0]
        .parts[1]
        .count;
  };
  EXPECT_EQ(spheres("spacing: 0"), 113);
  EXPECT_EQ(spheres("count: 12"), 12);
  EXPECT_THROW(spheres("count: 12, spacing: 1"), InputError);
  EXPECT_THROW(spheres("count: 0"), InputError);
  for (const char* bad :
       {"grains.count=5", "grains.areal_fraction=-1", "grains.areal_fraction=1e9",
        "grains.region.inner_radius_m=0.2", "probes[0].rings=0", "probes[0].region.radius_m=0"}) {
    EXPECT_THROW(LoadExperiment(file, {}, {bad}), InputError) << bad;
  }
}

TEST_F(ExperimentYaml, ListedGrainsMayHaveVelocities) {
  std::ofstream(folder_ / "grains.csv")
      << "x,y,z,r,v_x,v_y,v_z\n0.1,0.1,0.05,0.005,1,-2,0.5\n0.15,0.1,0.05,0.005,0,0,0\n";
  const auto grains = Read(kRest).experiment.grains[2].listed;
  ASSERT_EQ(grains.size(), 2u);
  EXPECT_EQ(grains[0].v_x, 1);
  EXPECT_EQ(grains[0].v_y, -2);
  EXPECT_EQ(grains[0].v_z, 0.5);
  for (const char* bad : {"0.1,0.1,0.05,0.005,1,2\n", "0.1,0.1,0.05,0.005,1,2,3,4\n",
                          "0.1,0.1,0.05,0.005 m\n", "nan,0.1,0.05,0.005\n", "0.1,0.1,0.05\n"}) {
    for (const char* before : {"", "0.1,0.1,0.05,0.005\n", "x,y,z,r\n"}) {
      std::ofstream(folder_ / "grains.csv") << before << bad;
      EXPECT_THROW(Read(kRest), InputError) << before << bad;
    }
  }
}

TEST_F(ExperimentYaml, SchemaIsTheCommittedOne) {
  EXPECT_TRUE(ExperimentSchema() == records::ReadFileBytes(kExamples / "experiment.schema.json"))
      << "./grouser dem schema > dem_offline/experiments/experiment.schema.json";
}

TEST_F(ExperimentYaml, TableOfKeysIsTheDocumentedOne) {
  EXPECT_TRUE(records::ReadFileBytes(kExamples / "../../docs/experiments.md")
                  .ends_with(ExperimentKeyTable()))
      << "./grouser dem schema --table";
}

TEST_F(ExperimentYaml, NamesTheNearestKey) {
  EXPECT_THAT(Complaint("gravity_m_per_s2: 1.62", "gravity: 1.62"),
              HasSubstr("e.yaml:3: key 'gravity': got an unknown key, expected one of"));
  EXPECT_THAT(Complaint("gravity_m_per_s2: 1.62", "gravty_m_per_s2: 1.62"),
              HasSubstr("the nearest is 'gravity_m_per_s2'"));
  EXPECT_THAT(Complaint("hold_mass_kg: 1", "hold_mas_kg: 1"),
              HasSubstr("key 'bodies[0].motion[2].hold_mas_kg': got an unknown key"));
  EXPECT_THAT(Complaint("do: shake, amplitude_m: [0.001", "do: shke, amplitude_m: [0.001"),
              HasSubstr("the nearest is 'shake'"));
  EXPECT_THAT(Complaint("touch: on", "touch: on, size_m: [1, 1, 1]"), HasSubstr("unknown key"));
}

TEST_F(ExperimentYaml, RefusesAKeyOfAnotherKind) {
  EXPECT_THAT(Complaint("speed_m_per_s: 0.1, touch", "amplitude_m: [1, 0, 0], touch"),
              HasSubstr("got it with do: lower, expected do: one of shake"));
}

TEST_F(ExperimentYaml, ReadsJointsOrSaysThatTheProgramHasNone) {
  if (!JointMechanism()) {
    try {
      Read(kJoints);
      FAIL() << "accepted";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("key 'joints': got joints or springs, but this program "
                                          "was built without Simbody, expected libsimbody-dev"));
    }
    return;
  }
  const auto e = Read(kJoints).experiment;
  ASSERT_EQ(e.joints.size(), 2u);
  EXPECT_EQ(e.joints[0].at_m, (dem::Vec3d{-0.05, 0, 0}));
  EXPECT_EQ(e.joints[0].parent, "") << "the world";
  EXPECT_TRUE(e.joints[1].locked);
  ASSERT_EQ(e.springs.size(), 2u);
  EXPECT_EQ(e.springs[0].rest, 0.08);
  EXPECT_EQ(e.springs[0].force[0].for_s, 0.05);
  EXPECT_NEAR(e.springs[1].rest, M_PI / 6, 1e-12);
  EXPECT_EQ(e.springs[1].force[0].value, 0.01);
  EXPECT_EQ(e.preparation[1].turns, 2);
  EXPECT_TRUE(e.preparation[1].about_x);
  EXPECT_NEAR(e.preparation[1].rate_rad_per_s, M_PI / 2, 1e-12);
  using P = dem::experiment::Probe::Kind;
  EXPECT_EQ(e.probes[0].kind, P::kJoint);
  EXPECT_EQ(e.probes[1].kind, P::kSpring);
  EXPECT_EQ(e.probes[2].kind, P::kMixing);
  EXPECT_THROW(Read(kJoints, {"output.checkpoint_every_s=0.01"}), InputError);
}

TEST_F(ExperimentYaml, EngineComplainsAtTheLineOfTheKey) {
  EXPECT_THAT(Complaint("mass_fraction: 0.4", "mass_fraction: 0.7"),
              HasSubstr("key 'grains[0].sizes': got mass fractions that sum to 1.3"));
  EXPECT_THAT(Complaint("speed_m_per_s: 0.1, touch", "speed_m_per_s: 1000, touch"),
              HasSubstr("key 'bodies[0].motion[1]'"));
  EXPECT_THAT(Complaint("until_done: two", "until_done: ghost"),
              HasSubstr("motion[3].until_done': got 'ghost'"));
  EXPECT_THAT(Complaint("free: [x, z]", "free: [x, u]"),
              HasSubstr("motion[4].free': got 'u', expected some of: x, y, z, spin"));
  EXPECT_THAT(Complaint("free: [x, z]", "free: [x]"),
              HasSubstr("motion[4].applied_force_n': got -5 N along z, which is not free"));
  EXPECT_THAT(Complaint("cohesion: jkr", "cohesion: glue"), HasSubstr("key 'laws'"));
  EXPECT_THAT(Complaint("material: sand, diameter_m: 0.01, pitch_m",
                        "material: sand, diameter_m: 10, pitch_m"),
              HasSubstr("key 'grains[1].diameter_m': got '10'"));
  EXPECT_THAT(Complaint("count: 50", "count: 900000000"), HasSubstr("key 'grains[0].count'"));
}

/// Texts that would take time or memory without end.
TEST_F(ExperimentYaml, RefusesAliasesThatGrowAndTextsTooLarge) {
  EXPECT_THAT(Complaint("seed: 3", "seed: &z [*z]"), HasSubstr("e.yaml: got more than 100 levels"));
  std::string bomb = "seed: {a0: &a0 [0]";
  for (int k = 1; k < 10; ++k) {
    bomb += fmt::format(", a{}: &a{} [", k, k);
    for (int n = 0; n < 10; ++n) bomb += fmt::format("*a{},", k - 1);
    bomb += "]";
  }
  EXPECT_THAT(Complaint("seed: 3", bomb + "}"), HasSubstr("with its aliases written out"));
  const std::string large(std::size_t{1} << 20, 'a');
  EXPECT_THAT(Complaint("seed: 3", "seed: &l " + large), HasSubstr("expected at most 1048576"));
  EXPECT_THAT(Complaint("name: all", "name: [&l " + large.substr(9999) + ", *l, *l, *l, *l]"),
              HasSubstr("with its aliases written out"));
  std::ofstream(folder_ / "large.yaml") << std::string(3 << 20, ' ');
  try {
    LoadExperiment(folder_ / "large.yaml", {});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("large.yaml: got 3145728 bytes, expected at most 1048576"));
  }
  // What is put at an anchor counts at every alias of it.
  const std::string text = "a: &a {x: 1}\nb: [*a, *a, *a, *a]\n";
  YamlSection root = YamlSection::OfText(text, "f");
  EXPECT_NO_THROW(root.Set("a.x", "2"));
  EXPECT_THROW(root.Set("a.x", "[&l " + large.substr(9999) + "]"), InputError);
}

TEST_F(ExperimentYaml, RefusesASecondDocument) {
  EXPECT_THAT(Complaint("name: all", "name: none\n---\nname: all"),
              HasSubstr("e.yaml:2: got a second YAML document"));
  EXPECT_THAT(Complaint("name: all", "--- # the only one\nname: all"), HasSubstr("accepted"));
}

TEST_F(ExperimentYaml, SwitchesTakeYamlsBooleans) {
  for (const char* on : {"on", "true", "yes", "True"}) {
    EXPECT_TRUE(Read(kPlanar, {fmt::format("box.planar={}", on)}).experiment.box.planar) << on;
  }
  for (const char* off : {"off", "false", "no", "FALSE"}) {
    EXPECT_THAT(Complaint("touch: on", fmt::format("touch: {}", off)), HasSubstr("accepted"));
  }
  EXPECT_THAT(Complaint("touch: on", "touch: 1"), HasSubstr("expected on or off"));
}

/// Names stand in names of files and in columns of CSVs.
TEST_F(ExperimentYaml, RefusesNamesThatAreNone) {
  for (const char* bad : {"../x", "a/b", "'a,b'", "a b", "\"a\\nb\"", "any", "a.b"}) {
    for (const char* key : {"bodies[0].name", "materials[1].name", "probes[0].name"}) {
      const std::string text = fmt::format("{}={}", key, bad);
      try {
        Read(kNamed, {text});
        ADD_FAILURE() << text;
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr(fmt::format("key '{}'", key)));
        EXPECT_THAT(error.what(), HasSubstr("letters (a to z), digits, _ and -")) << text;
      }
    }
  }
  EXPECT_NO_THROW(Read(kNamed, {"bodies[0].name=Plate_2-b", "probes[0].name=x-1"}));
}

TEST_F(ExperimentYaml, SetPutsAValueOverTheFile) {
  EXPECT_EQ(Read(kRest, {"seed=9"}).experiment.seed, 9u);
  EXPECT_EQ(Read(kRest, {"grains[0].count=60"}).experiment.grains[0].count, 60);
  EXPECT_EQ(Read(kRest, {"bodies[0].motion[1].speed_m_per_s=0.2"})
                .experiment.bodies[0]
                .motion[1]
                .velocity_m_per_s[2],
            -0.2);
  EXPECT_EQ(Read(kRest, {"bodies[0].motion[1].ramp_s=0.02"}).experiment.bodies[0].motion[1].ramp_s,
            0.02);
  for (const char* bad : {"seed", "grains[7].count=3", "ghost.key=1", "=3", "seed=[", "seed.x=1",
                          "grains[0=3", "sede=4"}) {
    EXPECT_THROW(Read(kRest, {bad}), InputError) << bad;
  }
}

}  // namespace
}  // namespace grouser::campaign
