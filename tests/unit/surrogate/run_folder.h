#pragma once

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "proto/records/run_file.h"
#include "tests/unit/surrogate/synthetic.h"

namespace grouser::surrogate::synthetic {

/// A folder of a campaign: what a test writes there is gone after it.
class RunFolder : public ::testing::Test {
 protected:
  RunFolder()
      : folder_(std::filesystem::temp_directory_path() /
                ("grouser-fit-test-" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_ / "runs");
  }
  ~RunFolder() override { std::filesystem::remove_all(folder_); }

  std::string Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  // A run file that holds what a summary says.
  std::string WriteRun(const v1alpha1::RunSummary& s) {
    records::RunFile run;
    v1alpha1::RunRecord& r = run.record;
    r.set_run_id(s.run_id());
    *r.mutable_spec()->mutable_wheel() = MakeScene().wheel();
    *r.mutable_spec()->mutable_soil() = MakeScene().soil();
    r.mutable_spec()->mutable_state()->set_load_n(s.load_n());
    r.mutable_spec()->set_seed(s.seed());
    r.set_status(s.status());
    r.set_slip(s.slip());
    r.set_attack_angle_rad(s.attack_angle_rad());
    const VelocityState v = FromSlip(s.slip(), s.attack_angle_rad(), s.speed_m_per_s());
    r.set_v_x_m_per_s(v.v_x);
    r.set_v_y_m_per_s(v.v_y);
    r.set_rim_speed_m_per_s(v.rim_speed);
    r.set_travel_m(s.travel_m());
    for (int o = kOutputs - 1; o >= 0; --o) {  // order must not matter
      v1alpha1::OutputMean* mean = r.add_outputs();
      mean->set_name(kOutputFields[o].name);
      mean->set_mean(s.mean(o));
      mean->set_standard_error(s.standard_error(o));
    }
    run.series["time_s"] = {0, 1};
    const std::string path = (folder_ / "runs" / (s.run_id() + ".run.h5")).string();
    records::WriteRunFile(path, run);
    return path;
  }

  void WriteCampaign(const std::vector<v1alpha1::RunSummary>& runs) {
    v1alpha1::Campaign campaign;
    *campaign.mutable_scene() = MakeScene();
    for (const v1alpha1::RunSummary& run : runs) {
      v1alpha1::PlannedRun* planned = campaign.add_runs();
      planned->set_run_id(run.run_id());
      planned->set_role(run.role());
    }
    std::string json;
    ASSERT_TRUE(google::protobuf::util::MessageToJsonString(campaign, &json).ok());
    Write("campaign.json", json);
  }

  std::filesystem::path folder_;
};

}  // namespace grouser::surrogate::synthetic
