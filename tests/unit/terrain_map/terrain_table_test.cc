// Slopes, the table of a soil against direct solves, and cells of several soils. No GDAL.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "surrogate/terrain_map/build_table.h"
#include "surrogate/terrain_map/cell.h"
#include "surrogate/terrain_map/cells.h"
#include "surrogate/terrain_map/creeping.h"
#include "surrogate/terrain_map/slope.h"
#include "surrogate/terrain_map/table_check.h"
#include "surrogate/vehicle/vehicle_file.h"
#include "tests/unit/vehicle/vehicles.h"

namespace grouser::terrain_map {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kUp = 0, kDown = std::numbers::pi, kRight = -std::numbers::pi / 2;

TEST(Slope, OfAPlaneIsExact) {
  const double width = 2, height = 3;
  for (const double azimuth : {0.0, 0.4, 1.6, 3.0, 4.5, 6.0}) {
    const double rise = std::tan(0.3);
    std::array<std::array<float, 5>, 3> z;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 5; ++c) {
        const double east = width * c, north = -height * r;
        z[r][c] = static_cast<float>(rise * (east * std::sin(azimuth) + north * std::cos(azimuth)));
      }
    }
    const Slope slope = SlopeAt({z[0], z[1], z[2]}, 2, width, height);
    EXPECT_NEAR(slope.angle_rad, 0.3, 1e-6);
    EXPECT_NEAR(std::remainder(slope.up_azimuth_rad - azimuth, 2 * std::numbers::pi), 0, 1e-6);
    for (int hole = 0; hole < 9; ++hole) {  // the middle one too, though it is in no difference
      auto torn = z;
      torn[hole / 3][1 + hole % 3] = std::numeric_limits<float>::quiet_NaN();
      EXPECT_TRUE(std::isnan(SlopeAt({torn[0], torn[1], torn[2]}, 2, width, height).angle_rad));
    }
  }
  const std::array<float, 3> flat = {7, 7, 7};
  EXPECT_EQ(SlopeAt({flat, flat, flat}, 1, 1, 1).angle_rad, 0);
  EXPECT_EQ(SlopeAt({flat, flat, flat}, 1, 1, 1).up_azimuth_rad, 0);
}

TEST(Slope, AttitudeOnEveryHeading) {
  for (const double slope : {1e-9, 0.01, 0.3, 1.0}) {
    for (double heading = -3; heading <= 3.1; heading += 0.5) {
      const Attitude a = AttitudeOf(slope, heading);
      EXPECT_NEAR(std::cos(a.grade_rad) * std::cos(a.bank_rad), std::cos(slope), 1e-12);
      const SlopeHeading back = SlopeHeadingOf(a);
      EXPECT_NEAR(back.slope_rad / slope, 1, 1e-9);
      EXPECT_NEAR(back.heading_rad, heading, 1e-6);
    }
    EXPECT_NEAR(AttitudeOf(slope, kUp).grade_rad, slope, 1e-12);
    EXPECT_NEAR(AttitudeOf(slope, kDown).grade_rad, -slope, 1e-12);
    // Heading right of the way up, the ground rises to the left.
    EXPECT_NEAR(AttitudeOf(slope, kRight).bank_rad, slope, 1e-12);
  }
}

// The ice of the shipped husky: single solves miss balances on it.
struct Ice {
  const vehicle::VehicleFile file =
      vehicle::ReadVehicle(GROUSER_SOURCE "/surrogate/vehicle/shipped/husky.vehicle.yaml");
  const std::uint8_t soil = static_cast<std::uint8_t>(
      std::find(file.grounds.soils.begin(), file.grounds.soils.end(), "ice") -
      file.grounds.soils.begin());
};

class Tables : public ::testing::Test {
 protected:
  explicit Tables(vehicle::Vehicle v = vehicle::testing::Skid()) : vehicle_(std::move(v)) {
    vehicle_.centre_z_m = 0.1;
    for (vehicle::Drive& d : vehicle_.drives) d.motor.power_limit_w = 150;
    options_.limits.speed_limit_m_per_s = 1;
    options_.headings = 48;
  }
  std::uint8_t AddGround(const char* name, surrogate::HardGround ground) {
    models_.push_back(
        std::make_unique<surrogate::HardGroundModel>(ground, vehicle_.wheel_types[0].radius_m));
    grounds_.soils.emplace_back(name);
    grounds_.models.push_back(models_.back().get());
    return static_cast<std::uint8_t>(grounds_.soils.size() - 1);
  }
  SlopeTable Table(std::uint8_t soil) const {
    return BuildTable(vehicle_, grounds_, soil, options_, [](double) {});
  }
  static surrogate::HardGround Ground(double friction, double sd) {
    surrogate::HardGround g = vehicle::testing::WithFriction(friction);
    g.friction_sd = sd;
    return g;
  }

  vehicle::Vehicle vehicle_;
  vehicle::Grounds grounds_;
  TableOptions options_;
  std::vector<std::unique_ptr<const surrogate::WheelModel>> models_;
};

// Coulomb friction of known mu carries the vehicle up to atan(mu) on every heading: an edge.
TEST_F(Tables, EndsAtTheFrictionAngle) {
  options_.limits.speed_limit_m_per_s = 0.2;
  const SlopeTable table = Table(AddGround("firm", Ground(0.5, 0)));
  const double edge = std::atan(0.5);
  for (double heading = 0; heading < 6.2; heading += 0.3) {
    const GroundAnswer below = table.At(edge - 0.01, heading),
                       beyond = table.At(edge + 0.01, heading);
    EXPECT_EQ(below.go.least, 1) << heading;
    EXPECT_GT(below.safe_m_per_s, 0) << heading;
    EXPECT_EQ(beyond.go.least, 0) << heading;
    EXPECT_EQ(beyond.safe_m_per_s, 0) << heading;
    EXPECT_TRUE(std::isnan(table.PowerAt(edge + 0.01, heading, 0.1))) << heading;
  }
  EXPECT_EQ(table.At(edge + 0.01, kUp).binding, vehicle::Binding::kTraction);
  EXPECT_EQ(table.At(edge + 0.01, kRight).binding, vehicle::Binding::kLateralGrip);
  EXPECT_EQ(table.At(0, 0).binding, vehicle::Binding::kSpeedLimit);
  EXPECT_TRUE(table.most.empty());
}

// P(GO) at the edge of what is driven is the probability of the risk that the speed is safe at.
TEST_F(Tables, DrivesWhereTheProbabilityIsThatOfTheRisk) {
  const SlopeTable table = Table(AddGround("firm", Ground(0.5, 0.05)));
  const double risk = ProbabilityOf(options_.limits.worse_by_sd);
  int driven = 0;
  for (double slope = 0; slope < 0.7; slope += 0.0131) {
    for (double heading = 0; heading < 6.2; heading += 0.37) {
      const GroundAnswer a = table.At(slope, heading);
      if (std::fabs(a.go.least - risk) < 1e-6) continue;
      EXPECT_EQ(a.safe_m_per_s > 0, a.go.least > risk) << slope << " " << heading;
      driven += a.safe_m_per_s > 0;
    }
  }
  EXPECT_GT(driven, 100);
}

TEST_F(Tables, GoesAsThePlannerJudges) {
  const std::uint8_t soil = AddGround("firm", Ground(0.4, 0.06));
  vehicle::Solver solver(vehicle_, grounds_);
  vehicle::SpeedPlanner planner(vehicle_, grounds_, 1);
  int both = 0;
  for (const double slope : {0.1, 0.3, 0.36, 0.4}) {
    for (const double heading : {0.0, 0.8, 1.7, 3.1}) {
      const double p =
          planner.ProbabilityToGo(MotionOn(slope, heading, 0, 0, soil), options_.limits).least;
      for (double z = -3.5; z < 3.6; z += 0.5) {
        if (std::fabs(ProbabilityOf(z) - p) < 2e-3) continue;
        const vehicle::Motion m = MotionOn(slope, heading, 0, z, soil);
        vehicle::Solution s;
        solver.Solve({&m, 1}, {&s, 1});
        EXPECT_EQ(Goes(s, options_.limits, false), ProbabilityOf(z) < p) << slope << " " << z;
        both += p > 0 && p < 1;
      }
    }
  }
  EXPECT_GT(both, 20);
}

TEST_F(Tables, IsNearDirectSolves) {
  options_.headings = TableOptions{}.headings;
  const std::uint8_t soil = AddGround("firm", Ground(0.5, 0.05));
  const TableErrors e =
      CheckTable(vehicle_, grounds_, soil, options_, Table(soil), 300, 3, [](double) {});
  EXPECT_GT(e.speed.count, 150u);
  EXPECT_LE(e.speed.p95, 0.01);
  EXPECT_LE(e.speed.largest, 0.05);
  EXPECT_LE(e.energy.p95, 0.03);
  EXPECT_LE(e.go.p95, 0.01);
  EXPECT_LE(e.only_table + e.only_direct, 3u);
  EXPECT_LE(e.edge_rad, 0.01);
}

// Nothing that is driven creeping may end at a balance that is missed, nor be 0 among what is
// driven.
TEST_F(Tables, HaveNoGapsOnIce) {
  const auto& [file, soil] = Ice();
  options_.headings = TableOptions{}.headings;
  const SlopeTable table = BuildTable(file.vehicle, file.grounds, soil, options_, [](double) {});
  std::size_t driven = 0;
  for (std::size_t i = 0; i < table.speed.size(); ++i) {
    if (!table.least[table.risk * table.headings + i / table.slopes].any()) continue;
    ++driven;
    EXPECT_GT(table.speed[i], 0) << i / table.slopes << " " << i % table.slopes;
  }
  EXPECT_EQ(driven, table.speed.size());
  // Each heading ends about where those beside it do. (At -3 and -4, which are ground of 1 in
  // 1000 or less, the solver finds less straight down than 5 degrees beside, from whatever start.)
  for (std::size_t i = 0; i < table.least.size(); ++i) {
    const std::size_t h = i % table.headings, first = i - h;
    if (table.levels[i / table.headings] < -2) continue;
    const Interval &a = table.least[first + (h + table.headings - 1) % table.headings],
                   &b = table.least[i], &c = table.least[first + (h + 1) % table.headings];
    if (!a.any() || !c.any()) continue;
    EXPECT_TRUE(b.any()) << i;
    EXPECT_GT(b.hi, std::min(a.hi, c.hi) - 0.5 * kDegree) << i;
  }
  const TableErrors e =
      CheckTable(file.vehicle, file.grounds, soil, options_, table, 150, 5, [](double) {});
  EXPECT_LE(e.speed.p95, 0.01);
  EXPECT_LE(e.go.largest, 0.05);
  EXPECT_EQ(e.energy.skipped, 0u);
}

// Single solves miss four of these states, each with slopes that go on both sides.
TEST(Creeping, HasNoHolesOnIce) {
  const auto& [file, soil] = Ice();
  const vehicle::SpeedOptions limits{.speed_limit_m_per_s = 1};
  constexpr std::size_t kHeadings = 72, kSlopes = 100;
  vehicle::Solver solver(file.vehicle, file.grounds);
  CreepingBatch batch(&solver, soil, limits, kHeadings, false);
  const vehicle::Solution none{};
  for (std::size_t h = 0; h < kHeadings; ++h) {
    for (std::size_t i = 0; i < kSlopes; ++i) {
      batch.Ask(h, 0.1 * kDegree * static_cast<double>(i), limits.worse_by_sd, &none);
    }
  }
  batch.Answer(kSlopes);
  std::size_t ends = 0;
  for (std::size_t i = 0; i < kHeadings * kSlopes; ++i) {
    const bool last = i % kSlopes + 1 == kSlopes;
    EXPECT_TRUE(batch.goes(i) || last || !batch.goes(i + 1)) << i / kSlopes << " " << i % kSlopes;
    ends += !last && batch.goes(i) && !batch.goes(i + 1);
  }
  EXPECT_EQ(ends, kHeadings);
}

// A slope that is not driven is never said to be bound by the speed limit.
TEST_F(Tables, SayWhatEndsThem) {
  options_.limits.speed_limit_m_per_s = 0.2;
  for (const double friction : {0.15, 0.5}) {
    const SlopeTable table = Table(AddGround("firm", Ground(friction, 0.03)));
    for (double slope = 0; slope < 1; slope += 0.01) {
      for (double heading = 0; heading < 6.2; heading += 0.1) {
        const GroundAnswer a = table.At(slope, heading);
        if (a.safe_m_per_s > 0) continue;
        EXPECT_NE(a.binding, vehicle::Binding::kSpeedLimit) << slope << " " << heading;
      }
    }
  }
}

// Neighbours that go, and are asked last, do not decide; the answers are those of single questions.
TEST_F(Tables, AskAgainBesideWhatGoes) {
  const std::uint8_t soil = AddGround("firm", Ground(0.4, 0));
  vehicle::Solver solver(vehicle_, grounds_);
  CreepingBatch batch(&solver, soil, options_.limits, 8, false);
  const vehicle::Solution none{};
  const double edge = std::atan(0.4);
  for (int round = 0; round < 2; ++round) {
    for (std::size_t h = 0; h < 8; ++h) {
      for (const double slope : {edge - 0.2, edge - 0.01, edge + 0.01, edge + 0.2}) {
        batch.Ask(h, slope, 0, &none);
      }
    }
    batch.Answer(4);
    for (std::size_t i = 0; i < 32; ++i) {
      EXPECT_EQ(batch.goes(i), i % 4 < 2) << i;
      EXPECT_EQ(batch.solution(i).balanced, i % 4 < 2) << i;
      if (i % 4 >= 2) EXPECT_NE(batch.BindingAt(i), vehicle::Binding::kSpeedLimit);
    }
  }
}

// A heading that has no power at all leaves the ones beside it alone.
TEST(Power, AtANodeBesideOneWithout) {
  SlopeTable t;
  t.headings = 4;
  t.slopes = 3;
  t.levels = {-4, 4};
  t.risk = 1;
  t.least.assign(8, {0, 0.2F});
  t.speed.assign(12, 1);
  t.binding.assign(12, 0);
  t.edges.resize(4);
  for (auto& power : t.power_w) {
    power.assign(12, 50);
    for (std::size_t i = 3; i < 6; ++i) power[i] = std::numeric_limits<float>::quiet_NaN();
  }
  EXPECT_NEAR(t.PowerAt(0.1, 0, 1), 50, 1e-6);
  EXPECT_NEAR(t.PowerAt(0.2, std::numbers::pi, 1), 50, 1e-6);
  EXPECT_TRUE(std::isnan(t.PowerAt(0.1, 0.1, 1)));
}

TEST_F(Tables, CheckOneState) {
  const std::uint8_t soil = AddGround("firm", Ground(0.5, 0.05));
  const TableErrors e =
      CheckTable(vehicle_, grounds_, soil, options_, Table(soil), 1, 3, [](double) {});
  EXPECT_EQ(e.go.count, 1u);
}

// Ten soils of 0.04 are 0.4 together: not negligible. One of them is.
TEST_F(Tables, NegligibleIsWhatIsSoTogether) {
  const SlopeTable firm = Table(AddGround("firm", Ground(0.6, 0.05)));
  const SlopeTable ice = Table(AddGround("ice", Ground(0.15, 0.03)));
  const double slope = 8 * kDegree;  // ice does not carry it
  std::vector<SlopeTable> tables(11, ice);
  tables[0] = firm;
  std::vector<float> p(11, 0.04F);
  p[0] = 0.6F;
  EXPECT_EQ(AnswerOf(tables, p, 0.05, slope, kUp).speed_m_per_s, 0);
  for (std::size_t s = 2; s < 11; ++s) p[s] = 0;
  p[0] = 0.96F;
  EXPECT_GT(AnswerOf(tables, p, 0.05, slope, kUp).speed_m_per_s, 0);
  p[2] = 0.009F;  // 0.049 of both
  p[0] = 0.951F;
  EXPECT_GT(AnswerOf(tables, p, 0.05, slope, kUp).speed_m_per_s, 0);
  p[2] = 0.03F;
  p[0] = 0.93F;
  EXPECT_EQ(AnswerOf(tables, p, 0.05, slope, kUp).speed_m_per_s, 0);
}

TEST_F(Tables, RefusesWhatMakesNoSense) {
  const std::uint8_t soil = AddGround("firm", Ground(0.5, 0.05));
  options_.limits.worse_by_sd = 4.5;
  EXPECT_THROW(Table(soil), std::invalid_argument);
  options_ = {};
  EXPECT_THROW(Table(soil), std::invalid_argument);  // no speed limit
}

// As many soils as a vehicle may have.
TEST_F(Tables, ACellOfTheLastOf255Soils) {
  const SlopeTable firm = Table(AddGround("firm", Ground(0.6, 0))),
                   ice = Table(AddGround("ice", Ground(0.15, 0)));
  std::vector<SlopeTable> tables(vehicle::kMostSoils, ice);
  tables.back() = firm;
  const std::vector<double> slope(2, 0.1), azimuth(2, 0);
  const std::vector<std::uint8_t> soil = {vehicle::kMostSoils - 1, kNoCell};
  std::vector<float> speed(2);
  AnswerCells(tables, 0.05, {.slope_rad = slope, .up_azimuth_rad = azimuth, .soil = soil},
              {true, 0, false}, {speed, {}, {}, {}, {}});
  EXPECT_NEAR(speed[0], firm.At(0.1, 0).safe_m_per_s * std::cos(0.1), 1e-6);
  EXPECT_TRUE(std::isnan(speed[1]));
}

// Which way is up does not count on level ground, nor on headings from the way up.
TEST_F(Tables, ACellWithoutAnAzimuth) {
  const std::vector<SlopeTable> tables = {Table(AddGround("firm", Ground(0.5, 0)))};
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinity = std::numeric_limits<double>::infinity();
  const std::vector<double> slope = {0, 0.1, 0.1, 0, 0.1},
                            azimuth = {nan, nan, -infinity, 1e300, 0};
  std::vector<float> speed(5), from_up(5);
  std::vector<std::uint8_t> binding(5);
  const Cells cells{.slope_rad = slope, .up_azimuth_rad = azimuth};
  AnswerCells(tables, 0.05, cells, {true, 0, false}, {speed, {}, {}, {}, binding});
  EXPECT_NEAR(speed[0], tables[0].At(0, 0).safe_m_per_s, 1e-6);
  EXPECT_NEAR(speed[3], speed[0], 1e-6);
  for (const std::size_t hole : {1, 2}) {
    EXPECT_TRUE(std::isnan(speed[hole])) << speed[hole];
    EXPECT_EQ(binding[hole], kNoCell);
  }
  EXPECT_GT(speed[4], 0);
  AnswerCells(tables, 0.05, cells, {false, 0, false}, {from_up, {}, {}, {}, {}});
  for (const std::size_t i : {1, 2}) EXPECT_EQ(from_up[i], speed[4]);
}

TEST_F(Tables, ACellOfSeveralSoils) {
  const std::uint8_t firm = AddGround("firm", Ground(0.6, 0.05));
  const std::uint8_t ice = AddGround("ice", Ground(0.15, 0.03));
  const std::vector<SlopeTable> tables = {Table(firm), Table(ice)};
  const double slope = 8 * kDegree;  // ice does not carry it
  const auto cell = [&](float p_firm) {
    const std::array<float, 2> p = {p_firm, 1 - p_firm};
    return AnswerOf(tables, p, 0.05, slope, kUp);
  };
  EXPECT_GT(cell(1).speed_m_per_s, 0);
  EXPECT_EQ(cell(0).speed_m_per_s, 0);
  EXPECT_EQ(cell(0.9F).speed_m_per_s, 0) << "a tenth of ice is not negligible";
  EXPECT_TRUE(std::isnan(cell(0.9F).joules_per_metre));
  EXPECT_EQ(cell(0.97F).speed_m_per_s, cell(1).speed_m_per_s);
  const double go =
      0.9 * tables[0].At(slope, kUp).go.least + 0.1 * tables[1].At(slope, kUp).go.least;
  EXPECT_NEAR(cell(0.9F).go_least, go, 1e-6);
  EXPECT_LT(tables[1].At(slope, kUp).go.least, ProbabilityOf(options_.limits.worse_by_sd));
  EXPECT_NEAR(cell(1).speed_m_per_s, tables[0].At(slope, kUp).safe_m_per_s * std::cos(slope), 1e-6);

  // On the level both are driven: the mean of both energies at the lower speed.
  const std::array<float, 2> half = {0.5, 0.5};
  const CellAnswer level = AnswerOf(tables, half, 0.05, 0, 0);
  const double v = std::min(tables[0].At(0, 0).safe_m_per_s, tables[1].At(0, 0).safe_m_per_s);
  EXPECT_NEAR(level.speed_m_per_s, v, 1e-6);
  EXPECT_NEAR(level.joules_per_metre,
              (tables[0].PowerAt(0, 0, v) + tables[1].PowerAt(0, 0, v)) / (2 * v), 1e-3);
}

}  // namespace
}  // namespace grouser::terrain_map
