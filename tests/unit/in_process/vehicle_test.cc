// grouser/vehicle.h against the solver behind it: the same bits, nothing allocated, bad sizes
// refused, bad input named.
#include "grouser/vehicle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "surrogate/vehicle/constants.h"
#include "surrogate/vehicle/energy.h"
#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/vehicle_file.h"
#include "tests/unit/count_allocations.h"

namespace grouser {
namespace {

using ::testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const std::string kFolder = GROUSER_VEHICLES;
std::string FileOf(const std::string& name) { return kFolder + "/" + name + ".vehicle.yaml"; }

bool SameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// 150 motions of a vehicle: turns, grades, soils, worse ground, one that is not finite.
struct Batch {
  static constexpr std::size_t kCount = 150;
  std::vector<double> v_x, yaw_rate, grade, bank, worse;
  std::vector<std::uint8_t> soil;

  explicit Batch(const Vehicle& vehicle) {
    for (std::size_t i = 0; i < kCount; ++i) {
      const double x = static_cast<double>(i);
      v_x.push_back(0.02 * x - 0.3);
      yaw_rate.push_back(0.4 * std::sin(x));
      grade.push_back(0.1 * std::sin(3 * x));
      bank.push_back(0.05 * std::cos(2 * x));
      worse.push_back(i % 3 == 0 ? 1.2 : 0);
      soil.push_back(static_cast<std::uint8_t>(i % vehicle.soils().size()));
    }
    grade[77] = kNaN;
  }
  Motions motions() const {
    return {.v_x = v_x,
            .yaw_rate = yaw_rate,
            .grade = grade,
            .bank = bank,
            .worse_by_sd = worse,
            .soil = soil};
  }
  std::vector<vehicle::Motion> ours() const {
    std::vector<vehicle::Motion> all(kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
      all[i].v_x_m_per_s = v_x[i];
      all[i].yaw_rate_rad_per_s = yaw_rate[i];
      all[i].grade_rad = grade[i];
      all[i].bank_rad = bank[i];
      all[i].worse_by_sd = worse[i];
      all[i].soil.fill(soil[i]);
    }
    return all;
  }
};

TEST(InProcessVehicle, SolvesBitForBitAsTheSolverWithoutAllocation) {
  for (const char* name : {"husky", "cart", "rover"}) {
    const Vehicle vehicle = Vehicle::Open(FileOf(name));
    const Batch batch(vehicle);
    const std::size_t n = Batch::kCount, wheels = vehicle.wheels();
    std::vector<std::uint32_t> reasons(n), flags(n * wheels);
    std::vector<double> residual(n), v_y(n), electric(n), rim(n * vehicle.drives());
    std::vector<double> load(n * wheels), slip(n * wheels), torque(n * wheels);
    Solutions out{.reasons = reasons,
                  .residual = residual,
                  .v_y = v_y,
                  .electric_power = electric,
                  .rim_speed = rim};
    out.wheel.load = load;
    out.wheel.slip = slip;
    out.wheel.torque = torque;
    out.wheel.flags = flags;
    VehicleSolver solver(vehicle);
    const long before = g_allocations;
    ASSERT_TRUE(solver.Solve(batch.motions(), out)) << solver.Problem(batch.motions(), out);
    EXPECT_EQ(g_allocations, before);

    const vehicle::VehicleFile file = vehicle::ReadVehicle(FileOf(name));
    vehicle::Solver theirs(file.vehicle, file.grounds);
    const std::vector<vehicle::Motion> motions = batch.ours();
    std::vector<vehicle::Solution> s(n);
    theirs.Solve(motions, s);  // all at once: how many are solved together changes no bit
    std::size_t balanced = 0;
    for (std::size_t i = 0; i < n; ++i) {
      balanced += s[i].balanced;
      ASSERT_EQ(reasons[i], s[i].reasons) << name << " " << i;
      if (i == 77) continue;
      ASSERT_TRUE(SameBits(residual[i], s[i].residual)) << name << " " << i;
      ASSERT_TRUE(SameBits(v_y[i], s[i].v_y_m_per_s)) << name << " " << i;
      ASSERT_TRUE(SameBits(electric[i], s[i].electric_power_w)) << name << " " << i;
      for (std::size_t d = 0; d < vehicle.drives(); ++d) {
        ASSERT_TRUE(SameBits(rim[i * vehicle.drives() + d], s[i].rim_speed_m_per_s[d]));
      }
      for (std::size_t w = 0; w < wheels; ++w) {
        ASSERT_TRUE(SameBits(load[i * wheels + w], s[i].wheel[w].load_n)) << name << " " << i;
        ASSERT_TRUE(SameBits(slip[i * wheels + w], s[i].wheel[w].slip)) << name << " " << i;
        ASSERT_TRUE(SameBits(torque[i * wheels + w], s[i].wheel[w].torque_n_m));
        ASSERT_EQ(flags[i * wheels + w], s[i].wheel[w].flags);
      }
    }
    EXPECT_EQ(reasons[77], std::uint32_t{kBadInput});
    EXPECT_GT(balanced, n / 4) << name;
  }
}

// What the comments of WheelPlace say of rim speeds and headings, in a solved turn.
TEST(InProcessVehicle, WheelPlacesGiveRimSpeedsAndHeadings) {
  for (const char* name : {"husky", "cart", "rover", "rover_lugged", "atv", "warthog"}) {
    const Vehicle vehicle = Vehicle::Open(FileOf(name));
    const std::size_t wheels = vehicle.wheels();
    const double v = std::string(name).starts_with("rover") ? 0.05 : 0.5;
    const std::vector<double> v_x = {v}, yaw_rate = {0.2 * v};
    std::vector<std::uint32_t> reasons(1);
    std::vector<double> psi(1), drive(vehicle.drives()), rim(wheels), steer(wheels), x(wheels);
    Solutions out{.reasons = reasons, .steering = psi, .rim_speed = drive};
    out.wheel = {.rim_speed = rim, .v_x = x, .steer = steer};
    ASSERT_TRUE(VehicleSolver(vehicle).Solve({.v_x = v_x, .yaw_rate = yaw_rate}, out));
    EXPECT_EQ(reasons[0], 0u) << name;
    ASSERT_EQ(vehicle.wheel_places().size(), wheels);
    std::vector<double> sum(vehicle.drives()), count(vehicle.drives());
    for (std::size_t i = 0; i < wheels; ++i) {
      const WheelPlace& w = vehicle.wheel_places()[i];
      const double length = vehicle.steering_length_m();
      const double c = std::cos(psi[0]) - std::sin(psi[0]) * w.y_m / length;
      const double s = std::sin(psi[0]) * (w.x_m - vehicle.steering_centre_m()) / length;
      EXPECT_NEAR(steer[i], w.steered ? std::atan2(s, c) : 0, 1e-12) << name << i;
      if (!w.steered) {
        EXPECT_NEAR(x[i], v - 0.2 * v * w.y_m, 1e-12) << name << i;
      }
      EXPECT_GT(w.radius_m, 0.05);
      if (w.drive < 0) continue;
      const auto d = static_cast<std::size_t>(w.drive);
      const double asked = vehicle.steered() ? (w.steered ? std::hypot(c, s) : c) : 1;
      if (w.own_motor) {
        EXPECT_NEAR(rim[i], asked * drive[d], 1e-12) << name << i;
      }
      sum[d] += w.own_motor ? drive[d] : rim[i];
      ++count[d];
    }
    for (std::size_t d = 0; d < sum.size(); ++d) {
      EXPECT_NEAR(sum[d] / count[d], drive[d], 1e-6 * drive[d]) << name;
    }
  }
}

TEST(InProcessVehicle, EnergyProbabilityAndConstantsAreThose) {
  const Vehicle vehicle = Vehicle::Open(FileOf("husky"));
  const vehicle::VehicleFile file = vehicle::ReadVehicle(FileOf("husky"));
  const Batch batch(vehicle);
  const std::size_t n = Batch::kCount;
  std::vector<std::uint32_t> reasons(n);
  std::vector<double> electric(n), scrub(n), low(n), shaft(n * 4), least(n), most(n);
  const Powers out{.reasons = reasons,
                   .electric = electric,
                   .scrub = scrub,
                   .joules_per_metre_low = low,
                   .wheel_shaft = shaft};
  VehicleSolver solver(vehicle);
  const Margins margins{.tip = 0};
  const long before = g_allocations;
  ASSERT_TRUE(solver.Energy(batch.motions(), out));
  ASSERT_TRUE(solver.ProbabilityToGo(batch.motions(), margins, least, most));
  EXPECT_EQ(g_allocations, before);
  vehicle::Solver theirs(file.vehicle, file.grounds);
  vehicle::SpeedPlanner planner(file.vehicle, file.grounds, 1);
  vehicle::SpeedOptions limits;
  limits.tip_margin = 0;
  const std::vector<vehicle::Motion> motions = batch.ours();
  for (std::size_t i = 0; i < n; ++i) {
    const vehicle::PowerInterval p = vehicle::PowerOf(&theirs, motions[i]);
    ASSERT_EQ(reasons[i], p.solution.reasons) << i;
    ASSERT_TRUE(SameBits(electric[i], p.mean.electric)) << i;
    ASSERT_TRUE(SameBits(scrub[i], p.mean.scrub)) << i;
    ASSERT_TRUE(SameBits(low[i], p.low) || (std::isnan(low[i]) && std::isnan(p.low))) << i;
    ASSERT_TRUE(SameBits(shaft[4 * i + 3], p.mean.wheel[3])) << i;
    const vehicle::GoProbability go = planner.ProbabilityToGo(motions[i], limits);
    ASSERT_TRUE(SameBits(least[i], go.least) && SameBits(most[i], go.most)) << i;
  }
  const std::vector<double> speeds = {0.3, 0.8}, radii = {1, 5};
  const auto constants = vehicle.Constants(speeds, radii);
  const auto expected = vehicle::ConstantsOf(file.vehicle, file.grounds, speeds, radii);
  ASSERT_EQ(constants.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(constants[i].soil, expected[i].soil);
    EXPECT_TRUE(SameBits(constants[i].separation_multiplier, expected[i].separation_multiplier));
    EXPECT_TRUE(SameBits(constants[i].pull_low, expected[i].pull_low));
  }
}

/// A path of n points through curves, hills and soils.
struct Course {
  std::vector<double> s, curvature, grade;
  std::vector<std::uint8_t> soil;
  Course(std::size_t n, std::size_t soils) {
    for (std::size_t i = 0; i < n; ++i) {
      s.push_back(0.2 * static_cast<double>(i));
      curvature.push_back(0.3 * std::sin(0.1 * static_cast<double>(i)));
      grade.push_back(0.08 * std::cos(0.07 * static_cast<double>(i)));
      soil.push_back(static_cast<std::uint8_t>(i / 40 % soils));
    }
  }
  Path path() const { return {.s = s, .curvature = curvature, .grade = grade, .soil = soil}; }
};

TEST(InProcessVehicle, PlansBitForBitAsThePlannerWithoutAllocation) {
  for (const char* name : {"husky", "cart"}) {
    const Vehicle vehicle = Vehicle::Open(FileOf(name));
    const Course course(200, vehicle.soils().size());
    std::vector<double> speed(200), safe(200), acceleration(200), shortfall(200);
    std::vector<Binding> binding(200), safe_binding(200);
    std::vector<std::uint8_t> holds(200);
    const SpeedPlan plan{.speed = speed,
                         .acceleration = acceleration,
                         .safe = safe,
                         .shortfall = shortfall,
                         .safe_binding = safe_binding,
                         .binding = binding,
                         .holds = holds};
    const SpeedOptions options{.speed_limit = 2};
    SpeedPlanner planner(vehicle, 300);
    std::size_t not_held = 999;
    for (int pass = 0; pass < 2; ++pass) {  // what a planner did before changes no bit
      const long before = g_allocations;
      ASSERT_TRUE(planner.Plan(course.path(), options, plan, &not_held));
      EXPECT_EQ(g_allocations, before);
    }
    const vehicle::VehicleFile file = vehicle::ReadVehicle(FileOf(name));
    std::vector<vehicle::PathPoint> path;
    for (std::size_t i = 0; i < 200; ++i) {
      path.push_back({course.s[i], course.curvature[i], course.grade[i], 0, course.soil[i]});
    }
    std::vector<vehicle::SpeedPoint> expected(200);
    vehicle::SpeedOptions theirs;
    theirs.speed_limit_m_per_s = 2;
    const std::size_t count =
        vehicle::SpeedPlanner(file.vehicle, file.grounds, 200).Plan(path, theirs, expected);
    EXPECT_EQ(not_held, count);
    for (std::size_t i = 0; i < 200; ++i) {
      ASSERT_TRUE(SameBits(speed[i], expected[i].speed_m_per_s)) << name << " " << i;
      ASSERT_TRUE(SameBits(safe[i], expected[i].safe_m_per_s)) << name << " " << i;
      ASSERT_TRUE(SameBits(acceleration[i], expected[i].acceleration_m_per_s2)) << i;
      ASSERT_TRUE(SameBits(shortfall[i], expected[i].shortfall)) << i;
      ASSERT_STREQ(NameOfBinding(binding[i]), vehicle::NameOf(expected[i].binding)) << i;
      ASSERT_EQ(holds[i] != 0, expected[i].holds) << i;
    }
    GradeRange grades;
    ASSERT_TRUE(planner.Grades(0.4, 1, kWorseBySd, {}, &grades));
    const auto range = vehicle::SpeedPlanner(file.vehicle, file.grounds, 1).Grades(0.4, 1, theirs);
    EXPECT_EQ(grades.up, range.up_rad);
    EXPECT_EQ(grades.down, range.down_rad);
  }
}

TEST(InProcessVehicle, DrawsAreThoseOfTheSolverWithoutAllocation) {
  for (const char* name : {"husky", "cart"}) {
    const Vehicle vehicle = Vehicle::Open(FileOf(name));
    const vehicle::VehicleFile file = vehicle::ReadVehicle(FileOf(name));
    const auto draws = std::make_shared<const vehicle::GroundDraws>(file.grounds, 20);
    const Batch batch(vehicle);
    const std::size_t n = Batch::kCount;
    std::vector<std::int32_t> draw(n);
    for (std::size_t i = 0; i < n; ++i) draw[i] = static_cast<std::int32_t>(i % 21) - 1;
    Motions in = batch.motions();
    in.draw = draw;
    std::vector<std::uint32_t> reasons(n);
    std::vector<double> power(n), least(n), most(n);
    VehicleSolver solver(vehicle);
    solver.UseDraws(20);
    const long before = g_allocations;
    ASSERT_TRUE(solver.Solve(in, {.reasons = reasons, .electric_power = power}));
    ASSERT_TRUE(solver.ProbabilityByDraws(in, {}, least, most));
    EXPECT_EQ(g_allocations, before);
    vehicle::Solver theirs(file.vehicle, file.grounds);
    theirs.UseDraws(draws);
    vehicle::SpeedPlanner planner(file.vehicle, file.grounds, 200);
    planner.UseDraws(draws);
    std::vector<vehicle::Motion> motions = batch.ours();
    for (std::size_t i = 0; i < n; ++i) motions[i].draw = draw[i];
    std::vector<vehicle::Solution> s(n);
    theirs.Solve(motions, s);
    for (std::size_t i = 0; i < n; ++i) {
      ASSERT_EQ(reasons[i], s[i].reasons) << name << " " << i;
      if (i != 77) {
        ASSERT_TRUE(SameBits(power[i], s[i].electric_power_w)) << name << " " << i;
      }
      const vehicle::GoProbability go = planner.ProbabilityByDraws(motions[i], {});
      ASSERT_EQ(least[i], go.least) << name << " " << i;
      ASSERT_EQ(most[i], go.most) << name << " " << i;
    }
    const Course course(200, vehicle.soils().size());
    std::vector<double> speed(200), acceleration(200), safe(200), at(200), expected(200);
    const SpeedOptions options{.speed_limit = 2};
    SpeedPlanner along(vehicle, 200);
    double holds = -1;
    ASSERT_TRUE(along.Plan(course.path(), options,
                           {.speed = speed, .acceleration = acceleration, .safe = safe}));
    EXPECT_FALSE(along.PlanByDraws(course.path(), options, speed, acceleration, &holds));
    along.UseDraws(20);
    ASSERT_TRUE(along.PlanByDraws(course.path(), options, speed, acceleration, &holds, at, safe));
    std::vector<vehicle::PathPoint> path;
    for (std::size_t i = 0; i < 200; ++i) {
      path.push_back({course.s[i], course.curvature[i], course.grade[i], 0, course.soil[i]});
    }
    std::vector<vehicle::SpeedPoint> plan(200);
    vehicle::SpeedOptions limits;
    limits.speed_limit_m_per_s = 2;
    planner.Plan(path, limits, plan);
    EXPECT_EQ(holds, planner.PlanByDraws(path, limits, plan, expected));
    EXPECT_EQ(at, expected);
    safe[3] = 0;
    ASSERT_TRUE(along.PlanByDraws(course.path(), options, speed, acceleration, &holds, at, safe));
    EXPECT_EQ(at[3], 0);
    EXPECT_EQ(holds, 0);
    EXPECT_FALSE(along.PlanByDraws(course.path(), options, speed, acceleration, &holds, at,
                                   std::span(safe).first(3)));
    speed[3] = kNaN;
    EXPECT_FALSE(along.PlanByDraws(course.path(), options, speed, acceleration, &holds));
    EXPECT_THROW(solver.UseDraws(2000), std::invalid_argument);
    solver.UseDraws(0);
    EXPECT_FALSE(solver.ProbabilityByDraws(in, {}, least, most));
  }
}

TEST(InProcessVehicle, RefusesSizesAndNamesThem) {
  const Vehicle vehicle = Vehicle::Open(FileOf("husky"));
  VehicleSolver solver(vehicle);
  const std::vector<double> three(3), two(2), nan = {0.1, kNaN, 0.3};
  std::vector<std::uint32_t> reasons(3, 77);
  std::vector<double> residual(3), load(8);
  Solutions out{.reasons = reasons, .residual = residual};
  EXPECT_FALSE(solver.Solve({.v_x = three, .yaw_rate = two}, out));
  EXPECT_EQ(solver.Problem({.v_x = three, .yaw_rate = two}, out),
            "yaw_rate: 2 entries, expected 3 or none");
  EXPECT_EQ(solver.Problem({.rim_speed = three}, out), "rim_speed: 3 entries, expected 2");
  out.wheel.load = load;
  EXPECT_FALSE(solver.Solve({.v_x = three}, out));
  EXPECT_EQ(solver.Problem({.v_x = three}, out), "wheel.load: 8 entries, expected 12 or none");
  EXPECT_EQ(reasons[0], 77u);  // nothing was written
  EXPECT_FALSE(solver.Energy({.v_x = three}, {.reasons = reasons}, -1));
  out.wheel.load = {};
  EXPECT_TRUE(solver.Solve({.v_x = three}, out));

  SpeedPlanner planner(vehicle, 3);
  std::vector<double> speed(3);
  const std::vector<double> s = {0, 1, 2}, repeated = {0, 1, 1}, four(4);
  const std::vector<std::uint8_t> soil = {0, 9, 0};
  const SpeedOptions options{.speed_limit = 1};
  const auto problem = [&](const Path& path, const SpeedOptions& o, std::span<double> to) {
    EXPECT_FALSE(planner.Plan(path, o, {.speed = to}));
    return planner.Problem(path, o, {.speed = to});
  };
  EXPECT_THAT(problem({.s = std::span(s).first(1)}, options, std::span(speed).first(1)),
              HasSubstr("points: 1"));
  EXPECT_THAT(problem({.s = four}, options, speed), HasSubstr("points: 4"));
  EXPECT_THAT(problem({.s = repeated}, options, speed), HasSubstr("s[2]: 1.0"));
  EXPECT_THAT(problem({.s = s, .curvature = nan}, options, speed), HasSubstr("curvature[1]: nan"));
  EXPECT_THAT(problem({.s = s, .soil = soil}, options, speed), HasSubstr("soil[1]: 9"));
  EXPECT_THAT(problem({.s = s}, {}, speed), HasSubstr("speed_limit: 0"));
  EXPECT_THAT(problem({.s = s}, {.speed_limit = 1, .margins = {.tip = 1}}, speed),
              HasSubstr("margins.tip: 1"));
  EXPECT_TRUE(planner.Plan({.s = s}, options, {.speed = speed}));
  const std::vector<double> large = {1e307, 1e308, 1.7e308};  // finite, their sums are not
  EXPECT_TRUE(planner.Plan({.s = large, .curvature = large, .grade = large, .bank = large}, options,
                           {.speed = speed}));
  GradeRange grades;
  EXPECT_FALSE(planner.Grades(0, 200, 0, {}, &grades));
  EXPECT_THAT(planner.Problem(kNaN, 0, 0, {}), HasSubstr("speed: nan"));

  const std::vector<double> zero = {0.0};
  EXPECT_THROW(vehicle.Constants(s, zero), std::invalid_argument);
  EXPECT_THROW(vehicle.Constants({}, s), std::invalid_argument);
  EXPECT_THROW(Vehicle::Open(FileOf("cart")).Constants(four, four), std::invalid_argument);
  EXPECT_THROW(vehicle.soil("mud"), std::invalid_argument);
}

// Bad files: a named error each, of a class that a stranger can catch.
TEST(InProcessVehicle, NamesWhatIsWrongInAFile) {
  const std::string file = ::testing::TempDir() + "/grouser_in_process.vehicle.yaml";
  using Changes = std::vector<std::pair<std::string, std::string>>;
  const auto refusal = [&](const char* name, const Changes& changes) -> std::string {
    std::ifstream in(FileOf(name));
    std::stringstream read;
    read << in.rdbuf();
    std::string text = read.str();
    for (std::size_t p; (p = text.find("../../pairs")) != std::string::npos;) {
      text.replace(p, 11, kFolder + "/../../../surrogate/pairs");
    }
    for (const auto& [from, to] : changes) {
      const std::size_t at = text.find(from);
      EXPECT_NE(at, std::string::npos) << from;
      text.replace(at, from.size(), to);
    }
    std::ofstream(file) << text;
    try {
      Vehicle::Open(file);
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(file));
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("rover", {}), "");
  EXPECT_THAT(refusal("husky", {{"mass_kg: 70", "mass_kg: -70"}}), HasSubstr("mass_kg"));
  EXPECT_THAT(refusal("husky", {{"mass_kg: 70", "mass_kg: .nan"}}), HasSubstr("mass_kg"));
  EXPECT_THAT(refusal("husky", {{"radius_m: 0.165", "radius_m: 0"}}), HasSubstr("radius_m"));
  EXPECT_THAT(refusal("husky", {{"  - {name: front_left, ", "# "},
                                {"  - {name: front_right, ", "# "},
                                {"  - {name: rear_left, ", "# "},
                                {"  - {name: rear_right, ", "# "}}),
              HasSubstr("wheels"));
  EXPECT_THAT(refusal("husky", {{"[0.256, 0.2854]", "[0.3, 0]"},
                                {"[0.256, -0.2854]", "[0.1, 0]"},
                                {"[-0.256, 0.2854]", "[-0.1, 0]"},
                                {"[-0.256, -0.2854]", "[-0.3, 0]"}}),
              HasSubstr("wheels: got all on one line"));
  EXPECT_THAT(refusal("rover", {{"mass_kg: 7.3", "mass_kg: 7.3\ngravity_m_per_s2: 1.62"}}),
              HasSubstr("gravity 9.8"));
  EXPECT_THROW(Vehicle::Open("/nonexistent.vehicle.yaml"), std::runtime_error);
}

TEST(InProcessVehicle, MovedFromRefuses) {
  const Vehicle vehicle = Vehicle::Open(FileOf("husky"));
  VehicleSolver a(vehicle);
  const VehicleSolver b(std::move(a));
  std::vector<std::uint32_t> reasons(1);
  const std::vector<double> one(1);
  EXPECT_FALSE(a.Solve({.v_x = one}, {.reasons = reasons}));
}

}  // namespace
}  // namespace grouser
