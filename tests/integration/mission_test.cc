// The whole mission: a planner, an energy estimate and a calibration job use one pair of servers at
// once, with the real programs; and what a hostile client sends to those programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <sstream>
#include <thread>

#include "clients/cpp/client_error.h"
#include "clients/cpp/jobs_client.h"
#include "clients/cpp/vehicle_client.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using client::ClientError;
using ::testing::HasSubstr;

const std::string kSource = GROUSER_SOURCE;
constexpr char kPlates[] = "surrogate/calibrate/measured/cmu_plates.yaml";
constexpr char kPlatesCsv[] = "surrogate/calibrate/measured/cmu_press_and_plates.csv";
constexpr char kWheelCsv[] = "dem_offline/campaigns/measured/cmu_smooth_wheel.csv";

std::string ReadText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

template <class Request>
void AddFile(Request* request, const std::string& name, const std::string& content) {
  auto* file = request->add_files();
  file->set_name(name);
  file->set_content(content);
}

/// The rows of soil.csv: comments name the command and its files.
std::string RowsOf(const std::string& csv) {
  std::istringstream in(csv);
  std::string rows;
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with('#')) rows += line + "\n";
  }
  return rows;
}

class MissionTest : public ::testing::Test {
 protected:
  MissionTest()
      : server_(dir_.path(), {"--no-lcm", "--vehicles", kSource + "/surrogate/vehicle/shipped"}),
        jobs_(dir_ / "jobs", {"--scripts", kSource}, "grouser-jobs") {}

  client::VehicleClient Vehicles() const {
    return client::VehicleClient(server_.address(), client::Milliseconds(60000));
  }
  client::JobsClient Jobs() const {
    return client::JobsClient({jobs_.address(), {}}, client::Milliseconds(60000));
  }

  static v1alpha1::PlanSpeedRequest Path() {
    v1alpha1::PlanSpeedRequest request;
    request.set_vehicle("husky");
    request.set_speed_limit_m_per_s(1);
    for (int i = 0; i < 200; ++i) {
      request.mutable_path()->add_s_m(0.1 * i);
      request.mutable_path()->add_curvature_per_m(0.3 * std::sin(0.05 * i));
      request.mutable_path()->add_grade_rad(0.06 * std::cos(0.03 * i));
    }
    return request;
  }
  static v1alpha1::EnergyRequest Motions() {
    v1alpha1::EnergyRequest request;
    request.set_vehicle("husky");
    for (int i = 0; i < 50; ++i) {
      request.mutable_motions()->mutable_twist()->add_v_x_m_per_s(0.5);
      request.mutable_motions()->mutable_twist()->add_yaw_rate_rad_per_s(0.02 * i);
    }
    return request;
  }
  static v1alpha1::SubmitCalibrationRequest Calibration() {
    v1alpha1::SubmitCalibrationRequest request;
    request.set_request_id("mission");
    request.mutable_calibration()->set_kind(v1alpha1::CALIBRATION_KIND_SOIL);
    request.mutable_calibration()->set_data(kPlates);
    for (const char* name : {kPlates, kPlatesCsv, kWheelCsv}) {
      AddFile(&request, name, ReadText(kSource + "/" + name));
    }
    return request;
  }
  std::string Plan() const {
    auto response = Vehicles().PlanSpeed(Path());
    response.clear_latency();
    return response.SerializeAsString();
  }
  std::string Energy() const {
    auto response = Vehicles().Energy(Motions());
    response.clear_latency();
    return response.SerializeAsString();
  }
  /// The refusal of a request, which must be INVALID_ARGUMENT.
  template <class Request>
  std::string Refusal(const Request& request) {
    try {
      Jobs().Submit(request);
    } catch (const ClientError& error) {
      EXPECT_EQ(error.code(), grpc::StatusCode::INVALID_ARGUMENT) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "accepted";
    return "";
  }

  testing::TempDir dir_;
  testing::ServerProcess server_, jobs_;
};

TEST_F(MissionTest, APlannerAnEnergyEstimateAndACalibrationAtOnceAnswerAsAlone) {
  const std::string plan = Plan(), energy = Energy();
  ::setenv("GROUSER_ROOT", kSource.c_str(),
           1);  // of what runs alone; the jobs program knows by itself
  const auto alone = testing::RunProgram(
      "grouser-calibrate", {"soil", kSource + "/" + kPlates, "--out", dir_ / "alone"}, dir_.path());
  ASSERT_EQ(alone.code, 0) << alone.err;
  const std::string rows = RowsOf(ReadText(dir_ / "alone/soil.csv"));
  ASSERT_NE(rows, "");

  const auto submitted = Jobs().Submit(Calibration());
  const std::string id = submitted.job().job_id();
  std::atomic<bool> calibrating{true};
  int plans = 0, estimates = 0, wrong_plans = 0, wrong_estimates = 0;
  std::thread planner([&] {
    do {
      wrong_plans += Plan() != plan;
      ++plans;
    } while (calibrating);
  });
  std::thread estimator([&] {
    do {
      wrong_estimates += Energy() != energy;
      ++estimates;
    } while (calibrating);
  });
  v1alpha1::Job done;
  try {
    done = Jobs().Watch(id, [](const v1alpha1::Job&) { return true; });
  } catch (const ClientError& error) {
    ADD_FAILURE() << error.what();
  }
  calibrating = false;
  planner.join();
  estimator.join();
  ASSERT_EQ(done.job_state(), v1alpha1::JOB_STATE_DONE) << done.message();
  EXPECT_GT(plans, 1);
  EXPECT_GT(estimates, 1);
  EXPECT_EQ(wrong_plans, 0) << "of " << plans;
  EXPECT_EQ(wrong_estimates, 0) << "of " << estimates;
  std::string csv;
  Jobs().ReadFile(id, "soil.csv", [&](const std::string& part) { csv += part; });
  EXPECT_EQ(RowsOf(csv), rows);
  std::printf("beside a calibration job: %d plans and %d energy estimates, all as alone\n", plans,
              estimates);
}

TEST_F(MissionTest, TheCommandLineSubmitsAndFetches) {
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.end(), {"--jobs", jobs_.address()});
    return testing::RunProgram("grouser-client", words, dir_.path());
  };
  const auto sent = run({"calibrate", "soil", kSource + "/" + kPlates, "--watch", "--json"});
  ASSERT_EQ(sent.code, 0) << sent.err;
  const auto at = sent.err.find("job-");
  ASSERT_NE(at, std::string::npos) << sent.err;
  const std::string id = sent.err.substr(at, 20);
  const auto fetched = run({"fetch", id, "--out", dir_ / "fetched"});
  EXPECT_EQ(fetched.code, 0) << fetched.err;
  EXPECT_THAT(ReadText(dir_ / "fetched/soil.csv"), HasSubstr("k_phi"));
  EXPECT_THAT(run({"jobs"}).out, HasSubstr("calibration of SOIL from"));
  const std::string smoke = kSource + "/dem_offline/campaigns/smoke.campaign.yaml";
  const auto campaign = run({"submit-campaign", smoke});
  ASSERT_EQ(campaign.code, 0) << campaign.err;
  EXPECT_THAT(campaign.out, HasSubstr("campaign smoke.campaign.yaml"));
  const std::string started = campaign.err.substr(campaign.err.find("job-"), 20);
  const auto request = campaign.err.substr(8, campaign.err.find(':') - 8);
  const auto cancelled = run({"cancel", started, "--request-id", request});
  EXPECT_THAT(cancelled.out, HasSubstr("CANCELLED")) << cancelled.err;
  const auto watched =
      run({"watch"});  // no terminal: a line a job, the oldest first, until none works
  EXPECT_EQ(watched.code, 0) << watched.err;
  const auto done = watched.out.find(id), last = watched.out.find(started);
  ASSERT_NE(done, std::string::npos) << watched.out;
  ASSERT_NE(last, std::string::npos) << watched.out;
  EXPECT_LT(done, last);
  EXPECT_THAT(watched.out.substr(done, last - done), HasSubstr("DONE"));
  EXPECT_THAT(watched.out.substr(last), HasSubstr("CANCELLED"));
  EXPECT_THAT(watched.out, ::testing::Not(HasSubstr("\x1b")))
      << "no cursor movements outside a terminal";
}

TEST_F(MissionTest, HostileFilesAreRefusedBeforeTheyAreAccepted) {
  auto bad = Calibration();
  const std::string plates = bad.files(0).content();
  const auto with = [&](const std::string& text) {
    bad.mutable_files(0)->set_content(text);
    return Refusal(bad);
  };
  const std::string secret = dir_ / "secret.csv";
  std::ofstream(secret) << "z_mm,F_N\n1,2\n";
  const auto test_of = [](const std::string& file) {
    return "soil: a\ntests:\n  - kind: plate\n    file: " + file +
           "\n    columns: {sinkage: z_mm, force: F_N}\n    constants: {diameter: 60 mm}\n";
  };
  EXPECT_THAT(with(test_of(secret)), HasSubstr("does not leave the folder"));
  EXPECT_THAT(with(test_of("../../../../../../../../../.." + secret)),
              HasSubstr("does not leave the folder"));
  EXPECT_THAT(with(test_of("\"\\x2e\\x2e/\\x2e./../../check.0.log\"")),
              HasSubstr("does not leave the folder"));
  EXPECT_THAT(with("soil: [\n"), HasSubstr("malformed YAML"));
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string one = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) bomb += one + (k < 9 ? ", " : "]\n");
  }
  EXPECT_THAT(with(bomb), HasSubstr("aliases written out"));
  EXPECT_THAT(with(std::string(100000, '[')), HasSubstr("YAML"));

  v1alpha1::SubmitCampaignRequest campaign;
  campaign.set_request_id("campaign");
  campaign.mutable_campaign()->set_file("c.yaml");
  const std::string folder = kSource + "/dem_offline/campaigns/";
  AddFile(&campaign, "c.yaml", "");
  AddFile(&campaign, "smoke.scene.yaml", ReadText(folder + "smoke.scene.yaml"));
  const auto of_campaign = [&](const std::string& text) {
    campaign.mutable_files(0)->set_content("name: c\nseeds: [1]\n" + text);
    return Refusal(campaign);
  };
  EXPECT_THAT(of_campaign("scene: " + folder + "smoke.scene.yaml\n"),
              HasSubstr("does not leave the folder"));
  EXPECT_THAT(of_campaign("scene: smoke.scene.yaml\nsoil: /etc/passwd\n"),
              HasSubstr("does not leave the folder"));
  EXPECT_THAT(of_campaign("scene: smoke.scene.yaml\n"), HasSubstr("no run"));
  std::string scene = campaign.files(1).content();
  campaign.mutable_files(1)->set_content(
      scene.replace(scene.find("bed_length_m: 0.12"), 18, "bed_length_m: 9999"));
  EXPECT_THAT(of_campaign("scene: smoke.scene.yaml\nextra: [{slip: 0.2, attack_angle_deg: 0, "
                          "load_n: 1}]\n"),
              HasSubstr("campaign 'c', run (slip +0.200"))
      << "the engine's own limits";
  campaign.mutable_files(1)->set_content(ReadText(folder + "smoke.scene.yaml"));
  std::string slips;
  for (int i = 0; i < 600; ++i) slips += (i > 0 ? ", " : "") + std::to_string(0.001 * i);
  EXPECT_THAT(of_campaign("scene: smoke.scene.yaml\ngrid: {slip: [" + slips +
                          "], attack_angle_deg: [0], load_n: [1]}\n"),
              HasSubstr("600 runs, expected at most 500"));
  EXPECT_EQ(Jobs().List(10).jobs_size(), 0);
}

}  // namespace
}  // namespace grouser
