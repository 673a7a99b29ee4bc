// Campaigns and calibrations: what a request may say, what is run for it, what may be read of it.
#include <gmock/gmock.h>
#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>

#include "server/core/status.h"
#include "server/jobs/work_command.h"
#include "server/jobs/work_request.h"
#include "tests/unit/jobs/jobs_life.h"

namespace grouser::server {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Life;
using ::testing::Not;
using ::testing::StartsWith;
using v1alpha1::SubmitCalibrationRequest;
using v1alpha1::SubmitCampaignRequest;

template <class Request>
void AddFile(Request* request, const std::string& name, const std::string& content = "a: 1\n") {
  auto* file = request->add_files();
  file->set_name(name);
  file->set_content(content);
}

SubmitCampaignRequest Campaign() {
  SubmitCampaignRequest request;
  request.set_request_id("id");
  request.mutable_campaign()->set_file("c.campaign.yaml");
  AddFile(&request, "c.campaign.yaml");
  return request;
}

SubmitCalibrationRequest Calibration(v1alpha1::CalibrationKind kind) {
  SubmitCalibrationRequest request;
  request.set_request_id("id");
  auto* work = request.mutable_calibration();
  work->set_kind(kind);
  work->set_data("data/m.yaml");
  AddFile(&request, "data/m.yaml");
  if (kind != v1alpha1::CALIBRATION_KIND_GRAINS) return request;
  work->set_soil("s.yaml");
  work->set_scene("scene.yaml");
  work->set_budget_hours(2);
  AddFile(&request, "s.yaml");
  AddFile(&request, "scene.yaml");
  return request;
}

/// The refusal of a changed request; "" where it passes.
template <class Request>
std::string Verdict(Request request, const std::function<void(Request&)>& change) {
  change(request);
  try {
    CheckWork(WorkOf(request));
  } catch (const StatusError& e) {
    EXPECT_EQ(e.code(), StatusCode::kInvalidArgument);
    return e.what();
  }
  return "";
}
std::string OfCampaign(const std::function<void(SubmitCampaignRequest&)>& change) {
  return Verdict<SubmitCampaignRequest>(Campaign(), change);
}
std::string OfGrains(const std::function<void(SubmitCalibrationRequest&)>& change) {
  return Verdict(Calibration(v1alpha1::CALIBRATION_KIND_GRAINS), change);
}
std::string OfSoil(const std::function<void(SubmitCalibrationRequest&)>& change) {
  return Verdict(Calibration(v1alpha1::CALIBRATION_KIND_SOIL), change);
}

TEST(WorkRequest, AcceptsGoodOnes) {
  EXPECT_EQ(OfCampaign([](auto&) {}), "");
  EXPECT_EQ(OfGrains([](auto&) {}), "");
  EXPECT_EQ(OfSoil([](auto& r) { r.mutable_calibration()->set_report(true); }), "");
  EXPECT_EQ(OfCampaign([](auto& r) {
              r.clear_files();
              r.mutable_campaign()->set_from_server(true);
            }),
            "");
}

TEST(WorkRequest, NamesThatLeaveTheFolderOrHideAreRefused) {
  for (const std::string bad :
       {"", "/etc/passwd", "../a", "a/../b", "a//b", "a/", ".a", "a/.b", "a/b/c/d/e/f", "-o",
        "a/-o", "a b", "a\n", "a\\b", "a;b", "a$b", "\xc3\xa4"}) {
    EXPECT_THAT(OfCampaign([&](auto& r) { AddFile(&r, bad); }), StartsWith("files.name:")) << bad;
    EXPECT_THAT(OfCampaign([&](auto& r) { r.mutable_campaign()->set_file(bad); }),
                StartsWith("campaign.file:"))
        << bad;
    EXPECT_THAT(OfCampaign([&](auto& r) { r.mutable_campaign()->add_server_files(bad); }),
                StartsWith("campaign.server_files:"))
        << bad;
    EXPECT_THAT(OfSoil([&](auto& r) { r.mutable_calibration()->set_data(bad); }),
                StartsWith("calibration.data:"))
        << bad;
  }
  EXPECT_THAT(OfCampaign([](auto& r) { AddFile(&r, std::string(201, 'a')); }),
              StartsWith("files.name:"));
  EXPECT_THAT(OfCampaign([](auto& r) { AddFile(&r, std::string("a\0b", 3)); }),
              StartsWith("files.name:"));
}

TEST(WorkRequest, SizesAndCountsAreBounded) {
  EXPECT_THAT(OfCampaign([](auto& r) { AddFile(&r, "b", std::string(1 << 20, 'x')); }),
              HasSubstr("expected at most 1048576"));
  EXPECT_THAT(OfCampaign([](auto& r) {
                for (int i = 0; i < 64; ++i) AddFile(&r, "f" + std::to_string(i));
              }),
              StartsWith("files: 65, expected"));
  EXPECT_THAT(OfCampaign([](auto& r) { AddFile(&r, "c.campaign.yaml"); }), HasSubstr("twice"));
  EXPECT_THAT(OfCampaign([](auto& r) {
                AddFile(&r, "a");
                AddFile(&r, "a.b");
                AddFile(&r, "a/b");
              }),
              HasSubstr("is a file and the folder of"));
}

TEST(WorkRequest, NamesTheBadField) {
  EXPECT_THAT(OfCampaign([](auto& r) { r.set_request_id(""); }), StartsWith("request_id:"));
  EXPECT_THAT(OfCampaign([](auto& r) { r.set_priority(11); }), StartsWith("priority:"));
  EXPECT_THAT(OfCampaign([](auto& r) { r.mutable_time_limit()->set_nanos(1); }),
              StartsWith("time_limit:"));
  EXPECT_THAT(OfCampaign([](auto& r) { r.mutable_campaign()->set_runs(1); }),
              StartsWith("campaign.runs:"));
  EXPECT_THAT(OfCampaign([](auto& r) { r.mutable_campaign()->set_from_server(true); }),
              StartsWith("campaign.from_server:"));
  EXPECT_THAT(OfSoil([](auto& r) { r.mutable_calibration()->clear_kind(); }),
              StartsWith("calibration.kind:"));
  EXPECT_THAT(OfSoil([](auto& r) { r.mutable_calibration()->set_budget_hours(1); }),
              HasSubstr("expected none for kind SOIL"));
  EXPECT_THAT(OfGrains([](auto& r) { r.mutable_calibration()->set_vary("v.yaml"); }),
              StartsWith("calibration.vary:"));
  for (const double bad : {0.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(OfGrains([&](auto& r) { r.mutable_calibration()->set_budget_hours(bad); }),
                StartsWith("calibration.budget_hours:"))
        << bad;
  }
  EXPECT_THAT(OfGrains([](auto& r) { r.mutable_calibration()->set_points(1); }),
              StartsWith("calibration.points:"));
}

TEST(WorkRequest, WhatIsUnknownIsNotStoredWithTheJob) {
  auto request = Campaign();
  const std::size_t bytes = WorkOf(request).job.ByteSizeLong();
  auto* campaign = request.mutable_campaign();
  campaign->GetReflection()->MutableUnknownFields(campaign)->AddLengthDelimited(
      900, std::string(1000, 'x'));
  EXPECT_EQ(WorkOf(request).job.ByteSizeLong(), bytes);
}

TEST(WorkRequest, EqualWorkHasEqualKeys) {
  const std::string key = JoinKeyOf(WorkOf(Campaign()));
  auto other = Campaign();
  other.set_request_id("another");
  other.set_priority(3);
  EXPECT_EQ(JoinKeyOf(WorkOf(other)), key);
  EXPECT_EQ(WorkOf(Campaign()).content, WorkOf(Campaign()).content);
  EXPECT_NE(WorkOf(other).content, WorkOf(Campaign()).content);
  other.mutable_files(0)->set_content("a: 2\n");
  EXPECT_NE(JoinKeyOf(WorkOf(other)), key);
  other = Campaign();
  other.mutable_time_limit()->set_seconds(5);
  EXPECT_NE(JoinKeyOf(WorkOf(other)), key) << "nobody's work ends at another's limit";
}

class WorkCommandTest : public ::testing::Test {
 protected:
  WorkPrograms Programs() const {
    WorkPrograms programs{dir_ / "bin", "cpu", {}};
    programs.options.scripts_dir = dir_ / "checkout";
    return programs;
  }
  StatusCode Refusal(const v1alpha1::Job& job, const WorkPrograms& programs, const char* words) {
    try {
      CheckMeans(job, programs);
    } catch (const StatusError& e) {
      EXPECT_THAT(e.what(), HasSubstr(words));
      return e.code();
    }
    return StatusCode::kOk;
  }
  void Make(const std::string& program) {
    std::filesystem::create_directories(dir_ / "bin");
    testing::WriteScript(dir_ / ("bin/" + program), "#!/bin/sh\n");
  }

  testing::TempDir dir_;
};

TEST_F(WorkCommandTest, WhatIsMissingIsSaid) {
  const v1alpha1::Job campaign = WorkOf(Campaign()).job;
  EXPECT_EQ(Refusal(campaign, Programs(), "lacks grouser-dem"), StatusCode::kFailedPrecondition);
  Make("grouser-dem");
  EXPECT_EQ(Refusal(campaign, Programs(), ""), StatusCode::kOk);
  v1alpha1::Job by_name = campaign;
  by_name.mutable_campaign()->set_from_server(true);
  EXPECT_EQ(Refusal(by_name, Programs(), "--campaigns"), StatusCode::kFailedPrecondition);
  auto programs = Programs();
  programs.options.campaigns_dir = dir_.path();
  EXPECT_EQ(Refusal(by_name, programs, "no file 'c.campaign.yaml'"), StatusCode::kNotFound);

  auto soil = WorkOf(Calibration(v1alpha1::CALIBRATION_KIND_SOIL)).job;
  EXPECT_EQ(Refusal(soil, Programs(), "grouser-calibrate"), StatusCode::kFailedPrecondition);
  Make("grouser-calibrate");
  EXPECT_EQ(Refusal(soil, Programs(), "lacks surrogate/soils/bekker_soils.csv"),
            StatusCode::kFailedPrecondition);
  std::filesystem::create_directories(dir_ / "checkout/surrogate/soils");
  testing::WriteText(dir_ / "checkout/surrogate/soils/bekker_soils.csv", "");
  EXPECT_EQ(Refusal(soil, Programs(), ""), StatusCode::kOk);
  soil.mutable_calibration()->set_report(true);
  EXPECT_EQ(Refusal(soil, Programs(), "lacks surrogate/calibrate/calibrate.py"),
            StatusCode::kFailedPrecondition);
  auto grains = WorkOf(Calibration(v1alpha1::CALIBRATION_KIND_GRAINS)).job;
  EXPECT_EQ(Refusal(grains, Programs(), "--scripts"), StatusCode::kFailedPrecondition);
  std::filesystem::create_directories(dir_ / "checkout/dem_offline/calibrate_grains");
  testing::WriteText(dir_ / "checkout/dem_offline/calibrate_grains/calibrate_grains.py", "");
  EXPECT_EQ(Refusal(grains, Programs(), ""), StatusCode::kOk);
  grains.mutable_calibration()->set_budget_hours(25);
  EXPECT_EQ(Refusal(grains, Programs(), "expected at most 24"), StatusCode::kInvalidArgument);
}

/// Checks of requests that wait while hold.check is there.
class ChecksTest : public testing::LivesTest {
 protected:
  ChecksTest() {
    Fake("grouser-dem", R"sh(
      cat input/c.campaign.yaml >> "$bin/checked"
      while [ -e "$bin/hold.check" ]; do sleep 0.02; done
      echo '{"name": "c", "total": 2}')sh");
    testing::WriteText(bin_ + "/hold.check", "");
    workers_ = 0;
  }
  ~ChecksTest() override { std::filesystem::remove(bin_ + "/hold.check"); }

  void Send(Life& life, const std::string& who, const std::string& id) {
    auto request = Campaign();
    request.set_request_id(who + id);
    request.mutable_files(0)->set_content("name: " + who + id + "\n");
    life.Ask([&](JobsApp& app) {
      try {
        app.SubmitWork(WorkOf(request), who, [this, who](std::exception_ptr problem, const auto&) {
          if (!problem) accepted_[who]++;
        });
      } catch (const StatusError& e) {
        refused_[who] += e.code() == StatusCode::kResourceExhausted;
      }
      return 0;
    });
  }
  std::string Checked() const { return testing::ReadText(bin_ + "/checked"); }

  std::map<std::string, int> accepted_, refused_;
};

TEST_F(ChecksTest, OneClientHoldsNotAll) {
  Life life(Options());
  for (const char* id : {"1", "2", "3", "4", "5", "6"}) Send(life, "greedy", id);
  EXPECT_EQ(refused_["greedy"], 2);
  Send(life, "other", "1");
  EXPECT_TRUE(testing::Eventually([&] { return std::ranges::count(Checked(), '\n') == 3; }));
  EXPECT_THAT(Checked(), AllOf(HasSubstr("greedy1"), HasSubstr("greedy2"), HasSubstr("other1")));
  std::filesystem::remove(bin_ + "/hold.check");
  EXPECT_TRUE(testing::Eventually([&] {
    return life.Ask([&](JobsApp&) { return accepted_["greedy"] == 4 && accepted_["other"] == 1; });
  }));
  EXPECT_EQ(refused_["other"], 0);
}

TEST_F(WorkCommandTest, ResultsAreReadByTheirNamesAlone) {
  const JobFiles files(dir_ / "state");
  v1alpha1::Job job = WorkOf(Calibration(v1alpha1::CALIBRATION_KIND_SOIL)).job;
  job.set_job_id("job-1");
  EXPECT_THAT(ResultsOf(job, files), IsEmpty());
  std::filesystem::create_directories(files.Folder("job-1") + "/out");
  const std::string text(600 * 1024, 'x');
  testing::WriteText(files.Result("job-1", "soil.csv"), text);
  testing::WriteText(files.Result("job-1", "secret"), "secret");
  const auto results = ResultsOf(job, files);
  job.mutable_results()->Assign(results.begin(), results.end());
  ASSERT_EQ(results.size(), 1u);
  EXPECT_EQ(results[0].bytes(), text.size());

  v1alpha1::ReadJobFileRequest request;
  request.set_name("soil.csv");
  auto part = ReadResult(job, files, request);
  EXPECT_EQ(part.data().size(), 512u * 1024);
  EXPECT_EQ(part.bytes(), text.size());
  request.set_offset(512 * 1024);
  EXPECT_EQ(ReadResult(job, files, request).data().size(), 88u * 1024);
  request.set_offset(std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(ReadResult(job, files, request).data(), "");
  request.set_offset(0);
  for (const char* bad : {"secret", "../out/soil.csv", "", "/etc/passwd"}) {
    request.set_name(bad);
    EXPECT_THROW(ReadResult(job, files, request), StatusError) << bad;
  }
  request.set_name("soil.csv");
  testing::WriteText(files.Result("job-1", "soil.csv"), "shorter");
  EXPECT_THROW(ReadResult(job, files, request), StatusError);
  std::filesystem::remove(files.Result("job-1", "soil.csv"));
  EXPECT_THROW(ReadResult(job, files, request), StatusError) << "it is gone";
}

}  // namespace
}  // namespace grouser::server
