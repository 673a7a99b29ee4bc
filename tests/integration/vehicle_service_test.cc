// VehicleService by a real server: the answers of the in-process header and of the command line,
// bit for bit; bad input named; hostile sizes. Cancelled calls: vehicle_cancel_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <thread>

#include "clients/cpp/client_error.h"
#include "clients/cpp/terrain_client.h"
#include "clients/cpp/vehicle_client.h"
#include "grouser/vehicle.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using client::ClientError;
using client::VehicleClient;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kFolder = GROUSER_VEHICLES;
std::string FileOf(const std::string& name) { return kFolder + "/" + name + ".vehicle.yaml"; }

template <class Array>
bool SameBits(const Array& message, const std::vector<double>& ours) {
  return static_cast<std::size_t>(message.size()) == ours.size() &&
         std::memcmp(message.data(), ours.data(), ours.size() * sizeof(double)) == 0;
}

/// The text of the error, which must have that code.
template <class Call>
std::string RefusalOf(grpc::StatusCode code, const Call& call) {
  try {
    call();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "not refused";
  return "";
}

class VehicleServiceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    dir_ = new testing::TempDir;
    testing::MakeStable(dir_->path(), testing::PhysicsModel("sand"));
    std::ofstream(dir_->path() + "/bad.vehicle.yaml") << "name: bad\nmass_kg: -3\n";
    server_ = new testing::ServerProcess(
        dir_->path(),
        {"--no-lcm", "--vehicles", kFolder, dir_->path() + "/bad.vehicle.yaml",
         dir_->path() + "/missing.vehicle.yaml", FileOf("husky"), "--vehicle-threads", "2"});
  }
  static void TearDownTestSuite() {
    delete server_;
    delete dir_;
  }
  static VehicleClient Client(int deadline_ms = 60000) {
    return VehicleClient(server_->address(), client::Milliseconds(deadline_ms));
  }
  static v1alpha1::PlanSpeedRequest PathRequest(const std::string& vehicle, int n) {
    v1alpha1::PlanSpeedRequest request;
    request.set_vehicle(vehicle);
    request.set_speed_limit_m_per_s(2);
    for (int i = 0; i < n; ++i) {
      request.mutable_path()->add_s_m(0.1 * i);
      request.mutable_path()->add_curvature_per_m(0.3 * std::sin(0.05 * i));
      request.mutable_path()->add_grade_rad(0.06 * std::cos(0.03 * i));
      request.mutable_path()->add_soil(static_cast<std::uint32_t>(i / 60 % 2));
    }
    return request;
  }

  static testing::TempDir* dir_;
  static testing::ServerProcess* server_;
};
testing::TempDir* VehicleServiceTest::dir_ = nullptr;
testing::ServerProcess* VehicleServiceTest::server_ = nullptr;

TEST_F(VehicleServiceTest, SolvesAndWeighsEnergyAsInProcess) {
  for (const char* name : {"husky", "cart"}) {
    const Vehicle vehicle = Vehicle::Open(FileOf(name));
    const std::size_t n = 120, wheels = vehicle.wheels();
    std::vector<double> v_x(n), yaw(n), grade(n), worse(n);
    std::vector<std::uint8_t> soil(n * wheels);
    v1alpha1::SolveRequest request;
    request.set_vehicle(name);
    for (std::size_t i = 0; i < n; ++i) {
      const double x = static_cast<double>(i);
      v_x[i] = 0.01 * x - 0.4;
      yaw[i] = 0.2 * std::sin(x);
      grade[i] = i == 50 ? NAN : 0.08 * std::cos(3 * x);
      worse[i] = i % 2 == 0 ? 0 : 1;
      for (std::size_t w = 0; w < wheels; ++w) {
        soil[i * wheels + w] = static_cast<std::uint8_t>(w % 2);
      }
    }
    auto* motions = request.mutable_motions();
    *motions->mutable_twist()->mutable_v_x_m_per_s() = {v_x.begin(), v_x.end()};
    *motions->mutable_twist()->mutable_yaw_rate_rad_per_s() = {yaw.begin(), yaw.end()};
    *motions->mutable_grade_rad() = {grade.begin(), grade.end()};
    *motions->mutable_worse_by_sd() = {worse.begin(), worse.end()};
    *motions->mutable_soil() = {soil.begin(), soil.end()};
    request.set_with_go_probability(true);
    request.mutable_margins()->set_tip(0.2);
    const v1alpha1::SolveResponse solved = Client().Solve(request);
    v1alpha1::EnergyRequest energy_request;
    energy_request.set_vehicle(name);
    *energy_request.mutable_motions() = request.motions();
    const v1alpha1::EnergyResponse energy = Client().Energy(energy_request);

    VehicleSolver solver(vehicle);
    const Motions in{
        .v_x = v_x, .yaw_rate = yaw, .grade = grade, .worse_by_sd = worse, .soil = soil};
    std::vector<std::uint32_t> reasons(n), reasons2(n);
    std::vector<double> residual(n), v_y(n), tip(n), rim(n * vehicle.drives()), f_y(n * wheels),
        load(n * wheels), least(n), most(n), joules(n), scrub(n), low(n);
    Solutions out{
        .reasons = reasons, .residual = residual, .v_y = v_y, .tip_margin = tip, .rim_speed = rim};
    out.wheel.f_y = f_y;
    out.wheel.load = load;
    ASSERT_TRUE(solver.Solve(in, out)) << solver.Problem(in, out);
    ASSERT_TRUE(solver.ProbabilityToGo(in, {.tip = 0.2}, least, most));
    ASSERT_TRUE(solver.Energy(
        in,
        {.reasons = reasons2, .scrub = scrub, .electric_low = low, .joules_per_metre = joules}));
    const v1alpha1::Solutions& s = solved.solutions();
    EXPECT_THAT(s.reasons(), ::testing::ElementsAreArray(reasons));
    EXPECT_EQ(s.reasons(50), std::uint32_t{v1alpha1::MOTION_REASON_INPUT});
    EXPECT_TRUE(SameBits(s.residual(), residual));
    EXPECT_TRUE(SameBits(s.v_y_m_per_s(), v_y));
    EXPECT_TRUE(SameBits(s.tip_margin(), tip));
    EXPECT_TRUE(SameBits(s.rim_speed_m_per_s(), rim));
    EXPECT_EQ(s.wheels().f_y_n_size(), static_cast<int>(n * wheels));
    for (std::size_t i = 0; i < n * wheels; ++i) {
      if (i / wheels == 50) continue;
      ASSERT_EQ(s.wheels().f_y_n(static_cast<int>(i)), f_y[i]);
      ASSERT_EQ(s.wheels().load_n(static_cast<int>(i)), load[i]);
    }
    EXPECT_TRUE(SameBits(solved.go_probability_least(), least));
    EXPECT_TRUE(SameBits(solved.go_probability_most(), most));
    EXPECT_TRUE(SameBits(energy.powers().scrub_w(), scrub));
    EXPECT_TRUE(SameBits(energy.powers().electric_low_w(), low));
    EXPECT_TRUE(SameBits(energy.powers().joules_per_metre(), joules));
  }
}

TEST_F(VehicleServiceTest, WeighsTrajectoriesAsInProcess) {
  for (const char* name : {"husky", "cart"}) {
    const Vehicle vehicle = Vehicle::Open(FileOf(name));
    constexpr std::size_t kTrajectories = 6, kSteps = 20, n = kTrajectories * kSteps;
    std::vector<double> v_x(n), yaw(n), grade(kSteps);
    for (std::size_t i = 0; i < n; ++i) {
      const double x = static_cast<double>(i);
      v_x[i] = 0.5 + 0.1 * std::sin(x);
      yaw[i] = 0.2 * std::sin(3 * x);
      grade[i % kSteps] = 0.1 * std::cos(static_cast<double>(i % kSteps));
    }
    v1alpha1::EvaluateTrajectoriesRequest request;
    request.set_vehicle(name);
    request.set_with_steps(true);
    v1alpha1::Trajectories& t = *request.mutable_trajectories();
    t.mutable_steps()->Resize(kTrajectories, kSteps);
    t.add_duration_s(0.2);
    *t.mutable_v_x_m_per_s() = {v_x.begin(), v_x.end()};
    *t.mutable_yaw_rate_rad_per_s() = {yaw.begin(), yaw.end()};
    *t.mutable_grade_rad() = {grade.begin(), grade.end()};
    t.add_soil(1);
    const auto response = Client().EvaluateTrajectories(request);

    std::vector<double> all_grades, watts(n), low(n), high(n), residual(n);
    for (std::size_t i = 0; i < n; ++i) all_grades.push_back(grade[i % kSteps]);
    const std::vector<std::uint8_t> soil(n, 1);
    std::vector<std::uint32_t> reasons(n);
    ASSERT_TRUE(VehicleSolver(vehicle).Energy(
        {.v_x = v_x, .yaw_rate = yaw, .grade = all_grades, .soil = soil}, {.reasons = reasons,
                                                                           .residual = residual,
                                                                           .electric = watts,
                                                                           .electric_low = low,
                                                                           .electric_high = high}));
    EXPECT_TRUE(SameBits(response.steps().electric_w(), watts));
    EXPECT_TRUE(SameBits(response.steps().electric_low_w(), low));
    EXPECT_TRUE(SameBits(response.steps().residual(), residual));
    EXPECT_THAT(response.steps().reasons(), ::testing::ElementsAreArray(reasons));
    for (std::size_t k = 0; k < kTrajectories; ++k) {
      double joules = 0, most = 0;
      for (std::size_t i = k * kSteps; i < (k + 1) * kSteps; ++i) {
        if (!std::isfinite(low[i]) || residual[i] > 1e-6) continue;
        joules += watts[i] * 0.2;
        most += high[i] * 0.2;
      }
      EXPECT_EQ(response.costs().energy_j(static_cast<int>(k)), joules) << name << k;
      EXPECT_EQ(response.costs().energy_high_j(static_cast<int>(k)), most) << name << k;
    }
  }
}

TEST_F(VehicleServiceTest, PlansAsInProcess) {
  for (const char* name : {"husky", "cart"}) {
    const int n = 240;
    const v1alpha1::PlanSpeedRequest request = PathRequest(name, n);
    const v1alpha1::PlanSpeedResponse response = Client().PlanSpeed(request);
    const Vehicle vehicle = Vehicle::Open(FileOf(name));
    SpeedPlanner planner(vehicle, n);
    const auto copy = [](const auto& array) {
      return std::vector<double>(array.begin(), array.end());
    };
    const auto s = copy(request.path().s_m()), curvature = copy(request.path().curvature_per_m()),
               grade = copy(request.path().grade_rad());
    const std::vector<std::uint8_t> soil(request.path().soil().begin(),
                                         request.path().soil().end());
    std::vector<double> speed(n), safe(n), acceleration(n), shortfall(n);
    std::vector<Binding> binding(n);
    std::vector<std::uint8_t> holds(n);
    std::size_t not_held = 0;
    ASSERT_TRUE(planner.Plan({.s = s, .curvature = curvature, .grade = grade, .soil = soil},
                             {.speed_limit = 2},
                             {.speed = speed,
                              .acceleration = acceleration,
                              .safe = safe,
                              .shortfall = shortfall,
                              .binding = binding,
                              .holds = holds},
                             &not_held));
    const v1alpha1::SpeedPlan& plan = response.plan();
    EXPECT_TRUE(SameBits(plan.speed_m_per_s(), speed));
    EXPECT_TRUE(SameBits(plan.safe_m_per_s(), safe));
    EXPECT_TRUE(SameBits(plan.acceleration_m_per_s2(), acceleration));
    EXPECT_TRUE(SameBits(plan.shortfall(), shortfall));
    EXPECT_EQ(response.not_held(), not_held);
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      EXPECT_EQ(v1alpha1::SpeedBinding_Name(plan.binding(i)),
                std::string("SPEED_BINDING_") + NameOfBinding(binding[k]));
      EXPECT_EQ(plan.holds(i), holds[k] != 0);
    }
    // Soils by their names, the other way round: the same plan.
    v1alpha1::PlanSpeedRequest named = request;
    named.mutable_path()->add_soils(vehicle.soils()[1]);
    named.mutable_path()->add_soils(vehicle.soils()[0]);
    for (auto& index : *named.mutable_path()->mutable_soil()) index = 1 - index;
    EXPECT_TRUE(SameBits(Client().PlanSpeed(named).plan().speed_m_per_s(), speed));
  }
}

TEST_F(VehicleServiceTest, CommandLinePrintsTheSameFromAFileAndFromAServer) {
  const std::string path = dir_->path() + "/path.csv";
  {
    std::ofstream out(path);
    out << "s_m,curvature_per_m,grade_deg,soil\n";
    for (int i = 0; i < 60; ++i) {
      out << 0.3 * i << "," << 0.4 * std::sin(0.2 * i) << "," << 3 * std::cos(0.1 * i) << ","
          << (i < 30 ? "asphalt" : "ice") << "\n";
    }
  }
  const std::string drive = dir_->path() + "/drive.csv";
  std::ofstream(drive)
      << "time_s,speed_m_per_s,yaw_rate_rad_per_s\n0,0.5,0.3\n1,0.4,0\n3,0,0.5\n4,0,0\n";
  const std::string other = dir_->path() + "/other.csv";
  std::ofstream(other) << "time_s,speed_m_per_s,grade_deg\n0,0.3,3\n2,0.4,-2\n2.5,0.4,40\n4,0,0\n";
  const std::string day = dir_->path() + "/day.csv";  // more steps than one call takes
  {
    std::ofstream rows(day);
    rows << "time_s,speed_m_per_s,yaw_rate_rad_per_s,grade_deg\n";
    for (int i = 0; i < 30500; ++i) {
      rows << 0.5 * i << "," << 0.3 + 0.001 * (i % 300) << "," << 0.01 * (i % 7) << ","
           << (i == 20000 ? 50 : 0.01 * (i % 100)) << "\n";
    }
  }
  const std::string bare_path = dir_->path() + "/bare_path.csv";
  std::ofstream(bare_path) << "s_m,curvature_per_m\n0,0.1\n1,0.3\n2,-0.2\n3,0\n";
  const std::vector<std::vector<std::string>> calls = {
      {"show", "husky"},
      {"solve", "husky", "--soil", "floor", "--speed", "0.8", "--radius", "2", "--json"},
      {"solve", "husky", "--speed", "0.5", "--grade-deg", "12"},
      {"solve", "cart", "--rim", "1.5", "--steer-deg", "10"},
      {"energy", "husky", "--soil", "asphalt", "--speed", "0.5", "--radius", "1", "--json"},
      {"energy", "cart", "--speed", "2"},
      {"energy", "husky", "--drive", drive},
      {"energy", "husky", "--drive", drive, "--soil", "ice", "--json"},
      {"energy", "husky", "--drive", drive, other, "--json"},
      {"energy", "husky", "--soil", "{asphalt: 1, ice: 2}", "--drive", drive, other, drive},
      {"energy", "husky", "--drive", drive, day, other, "--json"},
      {"solve", "husky", "--soil", "floor", "--speed", "0.3", "--grade-deg", "28", "--draws", "60"},
      {"solve", "cart", "--speed", "2", "--radius", "6", "--draws", "30", "--json"},
      {"climb", "husky", "--json"},
      {"climb", "cart", "--speed", "0.5", "--soil", "ice", "--worse-by-sd", "0"},
      {"speed", "husky", path, "--limit", "1.5", "--json"},
      {"speed", "husky", path, "--limit", "1.5", "--draws", "20"},
      {"speed", "cart", path, "--limit", "4", "--start", "1", "--tip-margin", "0.3"},
      {"solve", "husky", "--soil", "{asphalt: 0.7, ice: 0.3}", "--speed", "0.5", "--draws", "40"},
      {"solve", "rover", "--soils", "{dry_sand: 3, floor: 1}", "floor", "{floor: 1, dry_sand: 1}",
       "dry_sand", "floor", "floor", "--speed", "0.04", "--json"},
      {"energy", "husky", "--soil", "{asphalt: 0.7, ice: 0.3}", "--speed", "0.5", "--radius", "2"},
      {"speed", "husky", path, "--soil", "{floor: 1, ice: 2}", "--limit", "1.5"},
      {"speed", "husky", bare_path, "--soil", "{asphalt: 1, ice: 2}", "--limit", "1", "--draws",
       "10"},
      {"climb", "husky", "--soil", "{asphalt: 1, floor: 1}", "--json"},
      {"constants", "husky", "--speeds", "0.5", "--radii", "1", "5"}};
  for (std::vector<std::string> call : calls) {
    std::vector<std::string> remote = call;
    remote.insert(remote.end(), {"--server", server_->address()});
    call[1] = FileOf(call[1]);
    const auto ours = testing::RunProgram("grouser-vehicle", call, dir_->path());
    const auto theirs = testing::RunProgram("grouser-vehicle", remote, dir_->path());
    EXPECT_EQ(ours.out, theirs.out) << call[0];
    EXPECT_EQ(ours.err, theirs.err) << call[0];
    EXPECT_EQ(ours.code, theirs.code) << call[0];
    EXPECT_GT(ours.out.size(), 100u) << call[0] << ours.err;
  }
  for (const char* soil : {"{asphalt: 1, mud: 1}", "{asphalt: 1"}) {
    const auto bad = testing::RunProgram(
        "grouser-vehicle",
        {"energy", "husky", "--speed", "1", "--soil", soil, "--server", server_->address()},
        dir_->path());
    EXPECT_EQ(bad.code, 2) << soil;
    EXPECT_THAT(bad.err, HasSubstr(soil == std::string("{asphalt: 1") ? "soil {" : "soil mud"));
  }
  const auto list = testing::RunProgram("grouser-vehicle", {"list", "--server", server_->address()},
                                        dir_->path());
  EXPECT_THAT(list.out, AllOf(HasSubstr("husky"), HasSubstr("rover"), HasSubstr("asphalt")));
  const auto unknown = testing::RunProgram(
      "grouser-vehicle", {"show", "tank", "--server", server_->address()}, dir_->path());
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, AllOf(HasSubstr("NOT_FOUND"), HasSubstr("tank")));
}

TEST_F(VehicleServiceTest, ListsPagesAndLeavesOutWhatItCannotRead) {
  EXPECT_THAT(server_->program().Stderr(),
              AllOf(HasSubstr("bad.vehicle.yaml"), HasSubstr("mass_kg"),
                    HasSubstr("missing.vehicle.yaml"), HasSubstr("no other vehicle has")));
  const auto stub = v1alpha1::VehicleService::NewStub(client::MakeChannel(server_->address()));
  v1alpha1::ListVehiclesRequest request;
  request.set_page_size(2);
  std::vector<std::string> names;
  do {
    const auto page = client::Call(*stub, &v1alpha1::VehicleService::Stub::ListVehicles, request,
                                   {server_->address(), {}}, client::Milliseconds(20000));
    EXPECT_LE(page.vehicles_size(), 2);
    for (const auto& v : page.vehicles()) names.push_back(v.name());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(names,
              ::testing::ElementsAre("atv", "cart", "husky", "rover", "rover_lugged", "warthog"));
  const auto refusal = [&](int size, const char* token) {
    request.set_page_size(size);
    request.set_page_token(token);
    return RefusalOf(grpc::StatusCode::INVALID_ARGUMENT, [&] {
      client::Call(*stub, &v1alpha1::VehicleService::Stub::ListVehicles, request,
                   {server_->address(), {}}, client::Milliseconds(20000));
    });
  };
  EXPECT_THAT(refusal(-1, ""), HasSubstr("page_size: -1"));
  EXPECT_THAT(refusal(1, "rubbish"), HasSubstr("page_token"));
  const auto rover = Client().GetVehicle("rover").vehicle();
  EXPECT_EQ(rover.wheels_size(), 6);
  EXPECT_THAT(rover.sources(0), HasSubstr("dry_sand"));
  EXPECT_TRUE(client::IsServing(server_->address(), "grouser.v1alpha1.VehicleService",
                                client::Milliseconds(20000)));
}

TEST_F(VehicleServiceTest, NamesBadInputByFieldAndIndex) {
  const auto plan = [](const auto& change) {
    v1alpha1::PlanSpeedRequest request = PathRequest("husky", 10);
    change(&request);
    return RefusalOf(grpc::StatusCode::INVALID_ARGUMENT, [&] { Client().PlanSpeed(request); });
  };
  EXPECT_THAT(plan([](auto* r) { r->clear_path(), r->mutable_path()->add_s_m(0); }),
              HasSubstr("path.s_m: 1 entries, expected 2 or more"));
  EXPECT_THAT(plan([](auto* r) { r->clear_path(); }), HasSubstr("path.s_m: 0 entries"));
  EXPECT_THAT(plan([](auto* r) { r->mutable_path()->set_curvature_per_m(4, NAN); }),
              HasSubstr("path.curvature_per_m[4]: nan"));
  EXPECT_THAT(plan([](auto* r) { r->mutable_path()->set_s_m(3, 0.2); }),
              HasSubstr("path.s_m[3]: 0.2"));
  EXPECT_THAT(plan([](auto* r) { r->mutable_path()->set_soil(7, 9); }),
              HasSubstr("path.soil[7]: 9, expected below 3"));
  EXPECT_THAT(plan([](auto* r) { r->mutable_path()->add_soils("mud"); }),
              AllOf(HasSubstr("path.soils[0]: 'mud'"), HasSubstr("asphalt, floor, ice")));
  EXPECT_THAT(plan([](auto* r) { r->mutable_path()->add_grade_rad(0); }),
              HasSubstr("path.grade_rad: 11 entries, expected 10 or none"));
  EXPECT_THAT(plan([](auto* r) { r->clear_speed_limit_m_per_s(); }),
              HasSubstr("speed_limit_m_per_s: 0"));
  EXPECT_THAT(plan([](auto* r) { r->set_worse_by_sd(INFINITY); }), HasSubstr("worse_by_sd"));
  EXPECT_THAT(plan([](auto* r) { r->mutable_margins()->set_tip(1); }), HasSubstr("margins.tip"));
  EXPECT_THAT(plan([](auto* r) { r->set_start_m_per_s(-1); }), HasSubstr("start_m_per_s: -1"));
  EXPECT_THAT(plan([](auto* r) { r->clear_vehicle(); }), HasSubstr("vehicle: empty"));

  const auto solve = [](const auto& change) {
    v1alpha1::SolveRequest request;
    request.set_vehicle("husky");
    for (int i = 0; i < 3; ++i) request.mutable_motions()->mutable_twist()->add_v_x_m_per_s(0.5);
    change(request.mutable_motions());
    return RefusalOf(grpc::StatusCode::INVALID_ARGUMENT, [&] { Client().Solve(request); });
  };
  EXPECT_THAT(solve([](auto* m) { m->Clear(); }), HasSubstr("motions.given: missing"));
  EXPECT_THAT(solve([](auto* m) { m->mutable_twist()->Clear(); }), HasSubstr("motions: none"));
  EXPECT_THAT(solve([](auto* m) { m->add_bank_rad(0); }),
              HasSubstr("motions.bank_rad: 1 entries, expected 3 or none"));
  EXPECT_THAT(solve([](auto* m) { m->mutable_controls()->add_rim_speed_m_per_s(1); }),
              HasSubstr("motions.controls.rim_speed_m_per_s: 1 entries, expected 2"));

  v1alpha1::ConstantsRequest constants;
  constants.set_vehicle("husky");
  constants.add_speeds_m_per_s(0.5);
  EXPECT_THAT(RefusalOf(grpc::StatusCode::INVALID_ARGUMENT, [&] { Client().Constants(constants); }),
              HasSubstr("radii_m: none"));
  constants.add_radii_m(3);
  constants.add_radii_m(0);
  EXPECT_THAT(RefusalOf(grpc::StatusCode::INVALID_ARGUMENT, [&] { Client().Constants(constants); }),
              HasSubstr("radii_m[1]: 0"));
  constants.set_vehicle("cart");
  RefusalOf(grpc::StatusCode::FAILED_PRECONDITION, [&] { Client().Constants(constants); });
  constants.set_vehicle("tank");
  RefusalOf(grpc::StatusCode::NOT_FOUND, [&] { Client().Constants(constants); });
  v1alpha1::GradesRequest grades;
  grades.set_vehicle("husky");
  grades.add_soils("mud");
  EXPECT_THAT(RefusalOf(grpc::StatusCode::INVALID_ARGUMENT, [&] { Client().Grades(grades); }),
              HasSubstr("soils[0]: 'mud'"));
}

TEST_F(VehicleServiceTest, RefusesHostileSizes) {
  const auto exhausted = [](const auto& call) {
    return RefusalOf(grpc::StatusCode::RESOURCE_EXHAUSTED, call);
  };
  EXPECT_THAT(exhausted([] { Client().PlanSpeed(PathRequest("husky", 10001)); }),
              HasSubstr("path.s_m: 10001 entries, at most 10000"));
  v1alpha1::SolveRequest solve;
  solve.set_vehicle("husky");
  for (int i = 0; i < 3001; ++i) solve.mutable_motions()->mutable_twist()->add_v_x_m_per_s(1);
  EXPECT_THAT(exhausted([&] { Client().Solve(solve); }), HasSubstr("3001 entries, at most 3000"));
  v1alpha1::ConstantsRequest constants;
  constants.set_vehicle("husky");
  for (int i = 1; i < 200; ++i) constants.add_speeds_m_per_s(i), constants.add_radii_m(i);
  EXPECT_THAT(exhausted([&] { Client().Constants(constants); }), HasSubstr("at most 1000"));
  v1alpha1::EvaluateTrajectoriesRequest long_ones;
  long_ones.set_vehicle("husky");
  for (int i = 0; i < 31; ++i) long_ones.mutable_trajectories()->add_steps(1000);
  EXPECT_THAT(exhausted([&] { Client().EvaluateTrajectories(long_ones); }),
              HasSubstr("steps of all trajectories: 31000 entries, at most 30000"));
  for (int i = 0; i < 600000; ++i) solve.mutable_motions()->add_bank_rad(0);  // above 4 MB
  exhausted([&] { Client().Solve(solve); });
  // The largest that is taken fits into what a client takes unless told otherwise.
  v1alpha1::SolveRequest largest;
  largest.set_vehicle("rover");
  for (int i = 0; i < 3000; ++i) largest.mutable_motions()->mutable_twist()->add_v_x_m_per_s(0.05);
  const auto answer = Client().Solve(largest);
  EXPECT_EQ(answer.solutions().wheels().load_n_size(), 18000);
  EXPECT_LT(answer.ByteSizeLong() * 8 / 6, 4u << 20);  // with eight wheels
}

}  // namespace
}  // namespace grouser
