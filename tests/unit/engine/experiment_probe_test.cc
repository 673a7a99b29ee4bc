// Bodies out of parts, grains of every kind, probes: against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/probes.h"
#include "dem_offline/engine/experiment/shapes.h"
#include "experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

PartSpec Part(PartShape shape) {
  PartSpec p;
  p.shape = shape;
  p.radius_m = 0.03;
  p.inner_radius_m = 0.02;
  p.outer_radius_m = 0.05;
  p.height_m = 0.04;
  p.length_m = 0.06;
  p.wall_m = 0.005;
  p.thickness_m = 0.004;
  p.count = 6;
  p.width_m = 0.05;
  p.size_m = {0.1, 0.08, 0.06};
  return p;
}

/// The closed forms of single parts against the sum over the triangles of the same solid.
TEST(ExperimentShapes, MassIsThatOfTheSolid) {
  const std::vector<std::array<double, 2>> cone = {{0, 0}, {0.03, 0.04}, {0, 0.04}};
  const std::vector<std::array<double, 2>> ring = {
      {0.02, 0}, {0.05, 0}, {0.05, 0.04}, {0.02, 0.04}};
  const std::pair<PartShape, std::vector<std::array<double, 2>>> cases[] = {
      {PartShape::kCone, cone}, {PartShape::kRing, ring}};
  for (const auto& [shape, profile] : cases) {
    const MassProperties exact = MassOf({Part(shape)}, "body");
    const MassProperties mesh = MassOfMesh(Revolve(profile, 720));
    EXPECT_NEAR(mesh.volume_m3, exact.volume_m3, 2e-5 * exact.volume_m3);
    EXPECT_NEAR(mesh.centre_m[2], exact.centre_m[2], 1e-9);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(mesh.tensor_m5[k], exact.tensor_m5[k], 1e-4 * exact.tensor_m5[k]);
    }
  }
}

TEST(ExperimentShapes, PartsAddUpByTheParallelAxes) {
  PartSpec a = Part(PartShape::kBox), b = a;
  a.at_m = {0.05, 0, 0};
  b.at_m = {-0.05, 0, 0};
  PartSpec whole = Part(PartShape::kBox);
  whole.size_m[0] = 0.2;
  const MassProperties two = MassOf({a, b}, "body"), one = MassOf({whole}, "body");
  EXPECT_NEAR(two.volume_m3, one.volume_m3, 1e-15);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(two.tensor_m5[k], one.tensor_m5[k], 1e-15);
}

TEST(ExperimentShapes, LowestPointOfEveryShape) {
  BodySpec spec = Ball({});
  const std::pair<PartShape, double> expected[] = {
      {PartShape::kBox, -0.03},   {PartShape::kCylinder, -0.03}, {PartShape::kTube, -0.03},
      {PartShape::kDisc, 0},      {PartShape::kAnnulus, 0},      {PartShape::kRing, 0},
      {PartShape::kVanes, -0.04}, {PartShape::kCone, 0},         {PartShape::kSphere, -0.03},
      {PartShape::kWheel, -0.03}};
  for (const auto& [shape, low] : expected) {
    spec.parts = {Part(shape)};
    EXPECT_NEAR(LowestPoint(BuildBody(spec, {}, 1, false, "b").body), 0.5 + low, 1e-7)
        << static_cast<int>(shape);
  }
  spec.parts = {Part(PartShape::kCylinder)};
  spec.turn = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};  // lying down
  EXPECT_NEAR(LowestPoint(BuildBody(spec, {}, 1, false, "b").body), 0.5 - 0.03, 1e-7);
}

/// A grain at rest on a body of each shape: its weight is the wrench.
TEST(ExperimentProbes, WrenchIsTheWeightOfAGrain) {
  for (const PartShape shape : {PartShape::kBox, PartShape::kCylinder, PartShape::kDisc,
                                PartShape::kRing, PartShape::kMesh}) {
    Experiment e = Empty();
    PartSpec part = Part(shape);
    part.mesh = Revolve({{0, 0}, {0.05, 0}, {0.05, 0.02}, {0, 0.02}});
    BodySpec table = Ball({});
    table.parts = {part};
    table.position_m = {0.5, 0.5, 0.3};
    e.bodies = {table};
    const double top = shape == PartShape::kBox || shape == PartShape::kCylinder ? 0.03
                       : shape == PartShape::kDisc                               ? 0.0
                       : shape == PartShape::kRing                               ? 0.04
                                                                                 : 0.02;
    GrainState& g = e.grains[0].listed[0];
    g.x_m = shape == PartShape::kDisc ? 0.51 : 0.53;
    g.y_m = 0.5;
    g.z_m = 0.3 + top + g.radius_m;
    if (shape == PartShape::kCylinder) g.x_m = 0.51;
    e.duration_s = 0.5;
    Probe p;
    p.kind = Probe::Kind::kWrench;
    p.body = "ball";
    e.probes = {p};
    Recorded rec;
    ASSERT_TRUE(RunExperiment(e, rec.Sink(), nullptr).done);
    const double weight = 2500 * 4.0 / 3 * M_PI * 1e-6 * 9.81;
    EXPECT_NEAR(rec.Column("ball.f_z_n").back(), -weight, 2e-3 * weight) << static_cast<int>(shape);
    EXPECT_NEAR(rec.Column("ball.t_y_n_m").back(), weight * (g.x_m - 0.5), 5e-3 * weight * 0.03);
  }
}

TEST(ExperimentProbes, BodyFrameTurnsWithTheBody) {
  Experiment e = Empty();
  BodySpec table = Ball({});
  table.parts = {Part(PartShape::kBox)};
  table.position_m = {0.5, 0.5, 0.3};
  table.turn = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};  // about x: its y is the world's z
  e.bodies = {table};
  GrainState& g = e.grains[0].listed[0];
  g.x_m = g.y_m = 0.5;
  g.z_m = 0.3 + 0.04 + g.radius_m;
  e.duration_s = 0.3;
  Probe p;
  p.kind = Probe::Kind::kWrench;
  p.body = "ball";
  p.body_frame = true;
  e.probes = {p};
  Recorded rec;
  ASSERT_TRUE(RunExperiment(e, rec.Sink(), nullptr).done);
  const double weight = 2500 * 4.0 / 3 * M_PI * 1e-6 * 9.81;
  EXPECT_NEAR(rec.Column("ball.body_f_y_n").back(), -weight, 2e-3 * weight);
}

std::vector<GrainState> Lattice(int n, double pitch, double radius) {
  std::vector<GrainState> out;
  for (int k = 0; k < n * n * n; ++k) {
    GrainState s = {};
    s.x_m = (k % n + 0.5) * pitch;
    s.y_m = (k / n % n + 0.5) * pitch;
    s.z_m = (k / n / n + 0.5) * pitch;
    s.radius_m = radius;
    s.mass_kg = 1;
    out.push_back(s);
  }
  return out;
}

Probe Bins(Vec3d high, int nx, int ny, int nz, double radius = 0) {
  Probe p;
  p.kind = Probe::Kind::kBins;
  p.region = {{0, 0, 0}, high, radius};
  p.n[0] = nx;
  p.n[1] = ny;
  p.n[2] = nz;
  return p;
}

TEST(ExperimentProbes, BinsOfALattice) {
  auto grains = Lattice(10, 0.01, 0.005);
  for (std::size_t k = 0; k < grains.size(); ++k) {  // v = 2 up, +-0.3 along x
    grains[k].v_z = 2;
    grains[k].v_x = k % 2 ? 0.3 : -0.3;
  }
  const auto bins = MeasureBins({grains}, Bins({0.1, 0.1, 0.1}, 2, 1, 3));
  ASSERT_EQ(bins.size(), 6u);
  for (const Bin& b : bins) {
    EXPECT_NEAR(b.solid_fraction, M_PI / 6, 0.03);
    EXPECT_NEAR(b.velocity_m_per_s[2], 2, 1e-12);
    EXPECT_NEAR(b.temperature_m2_per_s2, 0.3 * 0.3 / 3, 2e-3);
  }
  double solid = 0, count = 0;
  for (const Bin& b : bins) solid += b.solid_fraction / 6, count += b.grains;
  EXPECT_NEAR(solid, M_PI / 6, 1e-12);  // nothing is lost between bins
  EXPECT_EQ(count, 1000);
}

TEST(ExperimentProbes, CylindricalBinsSeeASolidRotation) {
  auto grains = Lattice(20, 0.01, 0.005);
  for (GrainState& s : grains) {
    s.v_x = -3 * (s.y_m - 0.1);
    s.v_y = 3 * (s.x_m - 0.1);
  }
  const auto bins = MeasureBins({grains}, Bins({0.2, 0.2, 0.2}, 5, 1, 1, 0.1));
  ASSERT_EQ(bins.size(), 5u);
  for (int k = 1; k < 5; ++k) {
    const Bin& b = bins[k];
    EXPECT_NEAR(b.velocity_m_per_s[0], 0, 1e-12);  // nothing flows outwards
    EXPECT_NEAR(b.velocity_m_per_s[1], 3 * (k + 0.5) * 0.02, 3 * 0.004);
    EXPECT_NEAR(b.solid_fraction, M_PI / 6, 0.05);
  }
}

TEST(ExperimentProbes, SurfaceOfALattice) {
  Probe p = Bins({0.1, 0.1, 0.2}, 10, 10, 1);
  const auto height = MeasureSurface(Lattice(10, 0.01, 0.005), p);
  for (const double h : height) EXPECT_NEAR(h, 0.1, 1e-12);
  const auto none = MeasureSurface({}, p);
  EXPECT_TRUE(std::isnan(none[0]));
}

TEST(ExperimentProbes, HeapOfAKnownAngle) {
  const double d = 0.005, slope = std::tan(25 * M_PI / 180);
  std::vector<GrainState> grains;
  for (GrainState s : Lattice(80, d, 0.5 * d)) {
    const double rho = std::hypot(s.x_m - 0.2, s.y_m - 0.2);
    if (s.z_m < slope * (0.15 - rho)) grains.push_back(s);
  }
  Probe p = Bins({0.4, 0.4, 0.4}, 1, 1, 1);
  const Heap heap = MeasureHeap(grains, p, d);
  EXPECT_NEAR(heap.angle_rad * 180 / M_PI, 25, 1.5);
  EXPECT_NEAR(heap.height_m, slope * 0.15, 1.5 * d);
  EXPECT_NEAR(heap.foot_m, 0.15, 3 * d);
}

Experiment Pouring(Filling filling) {
  Experiment e = Empty();
  e.box = {0.12, 0.1, 0.3, Side::kWall, Side::kPeriodic, "steel"};
  Grains g;
  g.filling = filling;
  g.material = "sand";
  g.sizes = {{0.010, 0.5}, {0.012, 0.5}};
  g.count = 700;
  e.grains = {g};
  e.duration_s = 0.02;
  Probe coordination, rest, energy;
  coordination.kind = Probe::Kind::kCoordination;
  rest.kind = Probe::Kind::kRest;
  energy.kind = Probe::Kind::kEnergy;
  e.probes = {coordination, rest, energy};
  return e;
}

TEST(ExperimentGrains, EveryKindComesToRestInItsWalls) {
  for (const Filling filling : {Filling::kPoured, Filling::kRained}) {
    Experiment e = Pouring(filling);
    Recorded rec;
    const Result result = RunExperiment(e, rec.Sink(), nullptr);
    ASSERT_TRUE(result.done) << result.reason;
    EXPECT_EQ(result.grains, 700u);
    EXPECT_LT(rec.Column("kinetic_over_weight").back(), 1e-4);
    EXPECT_GT(rec.Column("coordination").back(), 3);
    // All of them within the walls: the height of the heap says so.
    EXPECT_LT(result.surface_m, 700 * 6.7e-7 / 0.5 / (0.12 * 0.1) + 0.03);
    EXPECT_NEAR(result.solid_fraction, 0.56, 0.08);
  }
}

TEST(ExperimentGrains, LatticeStandsInItsPlaces) {
  Experiment e = Pouring(Filling::kLattice);
  e.gravity_m_per_s2 = 0;
  e.grains[0].sizes = {{0.01, 1.0}};
  e.grains[0].pitch_m = 0.02;
  e.grains[0].count = 0;
  e.grains[0].region = {{0.02, 0, 0.1}, {0.1, 0.1, 0.14}, 0};
  Probe surface = Bins({0.12, 0.1, 0.3}, 12, 10, 1);
  surface.kind = Probe::Kind::kSurface;
  surface.name = "surface";
  e.probes = {surface};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_EQ(result.grains, 4u * 5 * 2);
  EXPECT_NEAR(result.surface_m, 0.1 + 1.5 * 0.02 + 0.005, 1e-9);
}

TEST(ExperimentGrains, ClumpsHaveTheVolumeOfTheirSphere) {
  Experiment e = Empty();
  e.gravity_m_per_s2 = 0;
  Grains g;
  g.filling = Filling::kLattice;
  g.material = "sand";
  g.sizes = {{0.02, 1.0}};
  g.count = 30;
  g.clump = {{{0, 0, 0}, 2}, {{3, 0, 0}, 2}, {{0, 2, 0}, 1}};  // any unit
  e.grains = {g};
  e.duration_s = 0.01;
  Probe p = Bins({1, 1, 1}, 1, 1, 1);
  p.name = "all";
  e.probes = {p};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_EQ(result.grains, 90u);  // their spheres
  const double volume = 30 * M_PI / 6 * 8e-6;
  EXPECT_NEAR(rec.Column("solid_fraction", "all").back(), volume, 1e-5 * volume);
}

TEST(ExperimentGrains, ClumpsPackAndRest) {
  Experiment e = Pouring(Filling::kPoured);
  e.grains[0].clump = {{{0, 0, 0}, 1}, {{1, 0, 0}, 1}};
  e.grains[0].count = 1000;  // layers enough: the solid fraction is that of the middle ones
  e.box.height_m = 0.6;
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_LT(rec.Column("kinetic_over_weight").back(), 1e-4);
  EXPECT_NEAR(result.solid_fraction, 0.57, 0.1);
}

/// Stress of a bed at rest against the weight of what lies above, layer by layer.
void ExpectWeightCarried(Experiment e) {
  e.box.x = Side::kPeriodic;
  Probe bins = Bins({0.12, 0.1, 0.09}, 1, 1, 6);
  bins.name = "bins";
  e.probes = {bins};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  const auto solid = rec.Column("solid_fraction", "bins");
  const auto zz = rec.Column("stress_zz_pa", "bins"), xx = rec.Column("stress_11_pa", "bins");
  const auto xz = rec.Column("stress_1z_pa", "bins");
  const double layer = 2500 * 9.81 * 0.015;
  double above = 0, sum = 0, moment = 0;
  for (int k = 5; k >= 0; --k) {
    above += 0.5 * solid[k] * layer;
    if (k < 3) {  // layers under the surface
      EXPECT_NEAR(zz[k], above, 0.04 * above) << k;
      EXPECT_LT(std::abs(xz[k]), 0.1 * above) << k;
    }
    above += 0.5 * solid[k] * layer;
    sum += zz[k];
    moment += solid[k] * layer * (k + 0.5);
  }
  EXPECT_NEAR(sum, moment, 0.02 * moment);  // equilibrium: the integral of both
  EXPECT_GT(xx[0], 0.2 * zz[0]);            // at rest: between active and passive
  EXPECT_LT(xx[0], 1.2 * zz[0]);
  EXPECT_LT(std::abs(rec.Column("d_z_m", "bins")[0]), 1e-4);  // since the bed came to rest
}

TEST(ExperimentGrains, StressInBinsCarriesTheWeightOfWhatLiesAbove) {
  ExpectWeightCarried(Pouring(Filling::kRained));
  Experiment pairs = Pouring(Filling::kPoured);
  pairs.grains[0].sizes = {{0.010, 1}};
  pairs.grains[0].clump = {{{-0.003, 0, 0}, 0.004}, {{0.003, 0, 0}, 0.004}};
  ExpectWeightCarried(pairs);
}

TEST(ExperimentGrains, DisplacementInBinsIsThatOfTheGrains) {
  Experiment e = Empty();
  e.grains[0].listed[0].z_m = 0.3;
  e.duration_s = 0.05;
  Probe bins = Bins({1, 1, 0.5}, 1, 1, 1);
  bins.name = "bins";
  bins.every_s = 0.05;
  e.probes = {bins};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_NEAR(rec.Column("d_z_m", "bins")[0], -0.5 * 9.81 * result.run_s * result.run_s, 1e-5);
  EXPECT_NEAR(rec.Column("d_1_m", "bins")[0], 0, 1e-9);
}

TEST(ExperimentGrains, AThinBedHasASolidFraction) {
  Experiment e = Pouring(Filling::kPoured);
  e.grains[0].clump = {{{0, 0, 0}, 1}, {{1, 0, 0}, 1}};
  e.grains[0].count = 300;  // three to four layers
  const Result thin = RunExperiment(e, nullptr, nullptr);
  ASSERT_TRUE(thin.done) << thin.reason;
  EXPECT_LT(thin.surface_m, 0.05);
  EXPECT_NEAR(thin.solid_fraction, 0.54, 0.1);
}

TEST(ExperimentGrains, PlanarDiscsStayInTheirPlane) {
  Experiment e = Pouring(Filling::kPoured);
  e.box = {0.3, 0.2, 0.5, Side::kWall, Side::kPeriodic, "steel", true, 0.01};
  e.grains[0].count = 200;
  Probe bins = Bins({0.3, 0.2, 0.5}, 1, 3, 1);
  Probe surface = bins;
  surface.kind = Probe::Kind::kSurface;
  surface.name = "surface";
  surface.n[0] = 1;
  e.probes = {surface};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  const auto height = rec.Column("height_m", "surface");
  EXPECT_TRUE(std::isnan(height[0]) && std::isnan(height[2]));
  EXPECT_GT(height[1], 0.02);
  EXPECT_NEAR(result.solid_fraction, 0.8, 0.08);  // of areas: random discs pack to 0.84
  bins.name = "bins";
  e.probes = {bins};
  EXPECT_THROW(PlanOf(e), SpecError);
  e.probes[0] = Bins({0.3, 0.2, 0.5}, 3, 1, 2);
  e.probes[0].name = "bins";
  Recorded areas;
  ASSERT_TRUE(RunExperiment(e, areas.Sink(), nullptr).done);
  double area = 0;
  for (const double f : areas.Column("solid_fraction", "bins")) area += f * 0.1 * 0.25;
  double discs = 0;
  for (const double d : {0.010, 0.012}) discs += 100 * M_PI / 4 * d * d;
  EXPECT_NEAR(area, discs, 0.06 * discs);  // by number as many of each, within a few
}

TEST(ExperimentGrains, LessFrictionPacksDenser) {
  const auto fraction = [](double friction) {
    Experiment e = Pouring(Filling::kPoured);
    Preparation settle;
    settle.friction = friction;
    e.preparation = {settle};
    return RunExperiment(e, nullptr, nullptr).solid_fraction;
  };
  EXPECT_GT(fraction(0.02), fraction(1.0) + 0.02);
}

TEST(ExperimentGrains, CohesiveOnesPackDenserWithoutTheirSurfaceEnergy) {
  const auto fraction = [](double surface_energy) {
    Experiment e = Pouring(Filling::kPoured);
    e.laws.cohesion = "jkr";
    PairProperties sand = e.interfaces[0];  // the floor and walls stay dry
    sand.a = sand.b = "sand";
    sand.numbers.surface_energy_j_per_m2 = 10;  // Bond number about 9
    e.interfaces.push_back(sand);
    Preparation settle;
    settle.friction = 0.2;
    settle.surface_energy_j_per_m2 = surface_energy;
    e.preparation = {settle};
    return RunExperiment(e, nullptr, nullptr).solid_fraction;
  };
  EXPECT_GT(fraction(0), fraction(10) + 0.02);
  EXPECT_THROW(fraction(12), SpecError);
}

TEST(ExperimentGrains, ReachesItsSolidFractionOrSaysWhatItReached) {
  Experiment e = Pouring(Filling::kPoured);
  e.box = {0.1, 0.1, 0.5, Side::kPeriodic, Side::kPeriodic, "steel"};
  e.grains[0].count = 900;
  e.preparation = {Preparation{}};
  e.preparation[0].solid_fraction = 0.58;
  EXPECT_NEAR(RunExperiment(e, nullptr, nullptr).solid_fraction, 0.58, 0.005);
  e.preparation[0].solid_fraction = 0.7;
  try {
    RunExperiment(e, nullptr, nullptr);
    FAIL();
  } catch (const SpecError& error) {
    EXPECT_EQ(error.field(), "preparation[0].solid_fraction");
    EXPECT_NE(error.expected().find("tried: 0.5"), std::string::npos) << error.expected();
  }
}

TEST(ExperimentGrains, SaysWhereASolidFractionCannotBeMeasured) {
  Experiment e = Pouring(Filling::kPoured);
  e.box = {0.1, 0.1, 0.5, Side::kPeriodic, Side::kPeriodic, "steel"};
  e.grains[0].count = 60;
  e.preparation = {Preparation{}};
  e.preparation[0].solid_fraction = 0.58;
  try {
    RunExperiment(e, nullptr, nullptr);
    FAIL();
  } catch (const SpecError& error) {
    EXPECT_NE(error.expected().find("more than 5 diameters"), std::string::npos) << error.what();
  }
}

TEST(ExperimentGrains, ShakenAndCutToItsHeight) {
  Experiment e = Pouring(Filling::kPoured);
  Preparation shake, cut;
  shake.kind = Preparation::Kind::kShake;
  shake.amplitude_m = {0, 0, 0.001};
  shake.frequency_hz = 20;
  shake.for_s = 0.2;
  cut.kind = Preparation::Kind::kCut;
  cut.height_m = 0.03;
  e.preparation = {Preparation{}, shake, Preparation{}, cut};
  const Result result = RunExperiment(e, nullptr, nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_LT(result.grains, 700u);
  EXPECT_EQ(result.surface_m, 0.03);
}

TEST(ExperimentGrains, OpenSidesLetGrainsGo) {
  Experiment e = Empty();
  e.box.x = Side::kOpen;
  GrainState moving = e.grains[0].listed[0];
  moving.x_m = 0.98;
  moving.y_m = 0.2;
  moving.z_m = 0.5;
  moving.v_x = 1;
  e.grains[0].listed.push_back(moving);
  e.duration_s = 0.2;
  const Result result = RunExperiment(e, nullptr, nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_EQ(result.left, 1u);
}

TEST(ExperimentProbes, EnergyOfABouncingGrainIsKept) {
  Experiment e = Empty();
  e.grains[0].listed[0].z_m = 0.2;
  e.duration_s = 0.6;
  e.rayleigh_fraction = 0.01;  // a bounce at 2 m/s is then two hundred steps
  Probe energy;
  energy.kind = Probe::Kind::kEnergy;
  e.probes = {energy};
  Recorded rec;
  ASSERT_TRUE(RunExperiment(e, rec.Sink(), nullptr).done);
  const double fall = 2500 * 4.0 / 3 * M_PI * 1e-6 * 9.81 * 0.19;
  EXPECT_NEAR(rec.Column("energy.residual_j").back(), 0, 0.01 * fall);
  // Restitution 0.5 takes three quarters at the first bounce.
  EXPECT_GT(rec.Column("energy.normal_damping_j").back(), 0.7 * fall);
}

TEST(ExperimentPlan, RefusesMoreMemoryThanIsAllowedBeforeAnythingIsMade) {
  Experiment e = Pouring(Filling::kLattice);
  e.box = {1000, 1000, 1000, Side::kWall, Side::kWall, "steel"};
  e.grains[0].count = 0;
  EXPECT_THROW(PlanOf(e), SpecError);
}

TEST(ExperimentPlan, CountsTheMemoryOfBodies) {
  Experiment e = Empty();
  e.duration_s = 0.1;
  const double alone = PlanOf(e).work.bytes;
  PartSpec mesh;
  mesh.shape = PartShape::kMesh;
  mesh.mesh = Revolve({{0, 0}, {0.1, 0}, {0.1, 0.1}, {0, 0.1}}, 5000);
  e.bodies = {Ball({})};
  e.bodies[0].parts = {mesh};
  const double bytes = PlanOf(e).work.bytes - alone;
  EXPECT_GT(bytes, 300.0 * static_cast<double>(mesh.mesh.triangles.size()));
  try {
    PlanOf(e, {.bytes = 0.5 * bytes});
    FAIL();
  } catch (const SpecError& error) {
    EXPECT_EQ(error.field(), "bodies");
  }
}

TEST(ExperimentPlan, NamesTheMissingInterface) {
  Experiment e = Empty();
  e.interfaces = {{"sand", "sand", 0.5, 0.5, 0.1, {}}};
  try {
    PlanOf(e);
    FAIL();
  } catch (const SpecError& error) {
    EXPECT_EQ(error.field(), "interfaces");
    EXPECT_EQ(error.got(), "none of sand and steel");
  }
}

TEST(ExperimentPlan, NamedPairStandsOverAny) {
  Experiment e = Empty();
  e.interfaces = {{"sand", "steel", 0.5, 0.2, 0, {}}, {"any", "any", 0.5, 0.7, 0, {}}};
  const ContactModel model = ContactsOf(e);
  using Law = MindlinRescaled;
  const auto table = model.Table();
  EXPECT_NEAR(ParamsOf<Law>(table[1]).friction, 0.2f, 1e-7);
  EXPECT_NEAR(ParamsOf<Law>(table[0]).friction, 0.7f, 1e-7);
}

TEST(ExperimentRun, EqualBitsOnARepeat) {
  const auto once = [] {
    Recorded rec;
    RunExperiment(Pouring(Filling::kRained), rec.Sink(), nullptr);
    return rec.rows;
  };
  EXPECT_EQ(once(), once());
}

}  // namespace
}  // namespace grouser::dem::experiment
