// grouser-vehicle from the command line: exit codes, tables, JSON, refusals.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace {

const std::string kHusky = std::string(GROUSER_VEHICLES) + "/husky.vehicle.yaml";

class VehicleCli : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("vehicle_cli_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string Read(const char* name) const {
    std::stringstream text;
    text << std::ifstream(folder_ / name).rdbuf();
    return text.str();
  }
  /// Exit code; what was said is in `out_` and `error_`.
  int Run(const std::string& arguments) {
    const std::string in = folder_.string();
    const int status = std::system(
        (std::string(GROUSER_VEHICLE) + " " + arguments + " >" + in + "/out 2>" + in + "/error")
            .c_str());
    out_ = Read("out");
    error_ = Read("error");
    return WEXITSTATUS(status);
  }
  std::string Path(const std::string& text) const {
    const std::string file = folder_ / "path.csv";
    std::ofstream(file) << text;
    return file;
  }

  std::filesystem::path folder_;
  std::string out_, error_;
};

TEST_F(VehicleCli, SpeedSaysWhereThePlanDoesNotHold) {
  std::string text = "s_m,curvature_per_m,bank_deg,soil\n";
  for (int i = 0; i < 20; ++i) {
    text += std::to_string(0.5 * i) + ",0," + (i > 9 && i < 13 ? "12" : "0") + ",ice\n";
  }
  const std::string call = "speed " + kHusky + " " + Path(text) + " --limit 1";
  EXPECT_EQ(Run(call), 1);
  EXPECT_NE(error_.find("does not hold at 3 of 20 points, at 3 of them at no speed; first at s = 5 "
                        "m (LATERAL_GRIP)"),
            std::string::npos)
      << error_;
  EXPECT_NE(out_.find("  NO  "), std::string::npos) << out_;
  EXPECT_EQ(Run(call + " --json"), 1);
  const auto plan = nlohmann::json::parse(out_);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(plan[i]["holds"], i < 10 || i > 12) << i;

  EXPECT_EQ(
      Run("speed " + kHusky + " " + Path("s_m,curvature_per_m\n0,0\n1,0\n2,0\n") + " --limit 0.8"),
      0);
  EXPECT_EQ(error_, "");
  EXPECT_EQ(out_.find("NO"), std::string::npos) << out_;
}

}  // namespace
