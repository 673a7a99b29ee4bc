// A run that goes on from a checkpoint is the rest of the run that went on by itself, to the bit.
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/experiment/snapshot.h"
#include "tests/unit/engine/experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

MotionStep Lower(double force_n) {
  MotionStep s;
  s.verb = "lower";
  s.velocity_m_per_s = {0, 0, -0.1};
  s.force_n = force_n;
  return s;
}

MotionStep Hold(double force_n, double spin_rad_per_s, double for_s) {
  MotionStep s;
  s.verb = spin_rad_per_s > 0 ? "turn" : "hold_force";
  s.hold = true;
  s.hold_force_n = force_n;
  s.spin_rad_per_s = {0, 0, spin_rad_per_s};
  s.ramp_s = spin_rad_per_s > 0 ? 0.02 : 0;
  s.for_s = for_s;
  return s;
}

/// A plate is lowered on grains, pressed, turned and let go; every step of the program and every
/// kind of probe that adds up is on its way at one of the checkpoints.
Experiment Press() {
  Experiment e;
  e.name = "press";
  e.materials = {{"sand", 2500, 5e6, 0.3}, {"steel", 7800, 0, 0}};
  e.interfaces = {{"any", "any", 0.5, 0.5, 0.05, {}}};
  e.box = {0.1, 0.1, 0.2, Side::kWall, Side::kPeriodic, "steel"};
  Grains g;
  g.material = "sand";
  g.sizes = {{0.01, 0.5}, {0.012, 0.5}};
  g.count = 120;
  e.grains = {g};
  BodySpec b;
  b.name = "plate";
  b.material = "steel";
  PartSpec p;
  p.shape = PartShape::kCylinder;
  p.radius_m = 0.03;
  p.length_m = 0.01;
  b.parts = {p};
  b.position_m = {0.05, 0.05, 0};
  b.above_surface_m = 0.001;
  MotionStep release;
  release.verb = "release";
  release.free = true;
  release.for_s = 0.04;
  b.motion = {Lower(1), Hold(2, 0, 0.04), Hold(2, 3, 0.05), release};
  e.bodies = {b};
  using K = Probe::Kind;
  for (const K kind :
       {K::kPose, K::kVelocity, K::kWrench, K::kEnergy, K::kCoordination, K::kRest, K::kSurface}) {
    Probe probe;
    probe.kind = kind;
    probe.body = kind == K::kPose || kind == K::kVelocity || kind == K::kWrench ? "plate" : "";
    if (kind == K::kSurface) {
      probe.name = "top";
      probe.n[0] = probe.n[1] = 3;
      probe.every_s = 0.03;
    }
    e.probes.push_back(probe);
  }
  e.sample_s = 0.004;
  e.frames.every_s = 0.025;
  e.checkpoint_every_s = 0.023;
  return e;
}

struct Whole {
  Recorded recorded;
  std::vector<double> frames_s;
  struct Mark {
    std::string bytes;
    std::vector<std::size_t> rows;
    std::size_t frames;
  };
  std::vector<Mark> marks;
  Result result;
};

Whole RunIt(const Experiment& e, const std::string& from = "") {
  Whole out;
  RunExtras extras;
  extras.resume = from;
  extras.frame = [&](const Snapshot& s) { out.frames_s.push_back(s.time_s); };
  extras.checkpoint = [&](const std::string& bytes) {
    std::vector<std::size_t> rows;
    for (const auto& table : out.recorded.rows) rows.push_back(table.size());
    out.marks.push_back({bytes, rows, out.frames_s.size()});
  };
  out.result = RunExperiment(e, out.recorded.Sink(), nullptr, {}, extras);
  return out;
}

bool SameBits(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void GoesOnToTheBit(const Experiment& e, std::size_t least_marks) {
  const Whole whole = RunIt(e);
  ASSERT_TRUE(whole.result.done) << whole.result.reason;
  ASSERT_GE(whole.marks.size(), least_marks);
  for (std::size_t m = 0; m < whole.marks.size(); ++m) {
    const Whole::Mark& mark = whole.marks[m];
    const Whole rest = RunIt(e, mark.bytes);
    EXPECT_EQ(rest.result.done, whole.result.done);
    EXPECT_EQ(rest.result.steps, whole.result.steps);
    EXPECT_EQ(rest.result.grains, whole.result.grains);
    EXPECT_EQ(rest.result.left, whole.result.left);
    EXPECT_EQ(rest.result.surface_m, whole.result.surface_m);
    EXPECT_EQ(rest.result.list_rebuilds, whole.result.list_rebuilds);
    EXPECT_EQ(rest.result.particle_steps, whole.result.particle_steps);
    EXPECT_EQ(rest.result.energy_input_j, whole.result.energy_input_j);
    EXPECT_EQ(rest.result.overlap_p99, whole.result.overlap_p99);
    EXPECT_EQ(rest.marks.size(), whole.marks.size() - m - 1);
    EXPECT_TRUE(std::equal(rest.frames_s.begin(), rest.frames_s.end(),
                           whole.frames_s.begin() + static_cast<std::ptrdiff_t>(mark.frames),
                           whole.frames_s.end()));
    for (std::size_t t = 0; t < whole.recorded.tables.size(); ++t) {
      const std::string& name = whole.recorded.tables[t].name;
      const std::size_t skipped = t < mark.rows.size() ? mark.rows[t] : 0;
      std::size_t k = 0;
      while (k < rest.recorded.tables.size() && rest.recorded.tables[k].name != name) ++k;
      const std::size_t expected = whole.recorded.rows[t].size() - skipped;
      if (expected == 0) continue;
      ASSERT_LT(k, rest.recorded.tables.size()) << name;
      ASSERT_EQ(rest.recorded.rows[k].size(), expected) << name;
      for (std::size_t r = 0; r < expected; ++r) {
        const auto& now = rest.recorded.rows[k][r];
        const auto& then = whole.recorded.rows[t][skipped + r];
        ASSERT_TRUE(std::equal(now.begin(), now.end(), then.begin(), then.end(), SameBits))
            << name << ", checkpoint " << m << ", row " << r << ", time " << now[0];
      }
    }
  }
}

TEST(Checkpoint, PressTurnAndRelease) { GoesOnToTheBit(Press(), 5); }

TEST(Checkpoint, GrainsThatLeaveAtOpenSides) {
  Experiment e = Press();
  e.box.y = Side::kOpen;
  e.preparation = {{}};
  e.preparation[0].most_s = 0.06;  // they are still on their way out
  e.preparation[0].rest = 1e-30;
  const Whole whole = RunIt(e);
  EXPECT_GT(whole.result.left, 0u);
  GoesOnToTheBit(e, 5);
}

TEST(Checkpoint, Clumps) {
  Experiment e = Press();
  e.grains[0].clump = {{{0, 0, 0}, 1}, {{1, 0, 0}, 0.8}};
  e.grains[0].sizes = {{0.012, 1}};
  e.grains[0].count = 60;
  GoesOnToTheBit(e, 5);
}

TEST(Checkpoint, PlanarWorldOfDiscs) {
  Experiment e = Press();
  e.box = {0.2, 0.12, 0.3, Side::kWall, Side::kPeriodic, "steel", true, 0.01};
  e.grains[0].count = 60;
  e.bodies[0].parts[0].shape = PartShape::kBox;
  e.bodies[0].parts[0].size_m = {0.06, 0.1, 0.02};
  e.bodies[0].position_m = {0.1, 0.06, 0};
  e.bodies[0].motion = {Lower(1), Hold(2, 0, 0.06)};
  GoesOnToTheBit(e, 3);
}

TEST(Checkpoint, FreeAxesAndAnotherTimeStepOfTheProgram) {
  Experiment e = Press();
  e.program_step = 0.7;
  BodySpec& b = e.bodies[0];
  b.mass_kg = 0.2;
  b.inertia_kg_m2 = {1e-4, 1e-4, 1e-4};
  MotionStep drag;
  drag.verb = "move";
  drag.velocity_m_per_s = {0.05, 0, 0};
  drag.free_axes[2] = true;
  drag.free_spin = true;
  drag.for_s = 0.1;
  b.motion = {Lower(1), drag, Hold(2, 0, 0.02)};
  GoesOnToTheBit(e, 5);
}

TEST(Checkpoint, BedOfAWheelTest) {
  Experiment e = Press();
  e.box = {0.1, 0.1, 0.2, Side::kPeriodic, Side::kPeriodic, "steel"};
  Grains& g = e.grains[0];
  g.filling = Filling::kBed;
  g.sizes = {{0.0115, 0.5}, {0.0125, 0.5}};
  g.depth_m = 0.04;
  g.solid_fraction = 0.628;
  g.count = 0;
  GoesOnToTheBit(e, 5);
}

TEST(Checkpoint, OfAnotherExperimentIsRefused) {
  Experiment e = Press();
  const Whole whole = RunIt(e);
  Experiment other = e;
  other.bodies.push_back(other.bodies[0]);
  other.bodies[1].name = "second";
  other.bodies[1].position_m = {0.05, 0.05, 0.1};
  other.bodies[1].motion.clear();
  EXPECT_THROW(RunIt(other, whole.marks[0].bytes), std::invalid_argument);
  const std::string& bytes = whole.marks[0].bytes;
  for (const std::size_t n : {std::size_t{3}, bytes.size() / 2, bytes.size() - 1}) {
    EXPECT_THROW(RunIt(e, bytes.substr(0, n)), std::invalid_argument) << n;
  }
}

}  // namespace
}  // namespace grouser::dem::experiment
