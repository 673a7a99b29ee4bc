// grouser-vehicle from the command line: exit codes, tables, JSON, refusals.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
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

TEST_F(VehicleCli, EnergyOfADriveIsThatOfItsMotions) {
  const std::string drive = Path(
      "time_s,speed_m_per_s,yaw_rate_rad_per_s,soil\n0,0.5,0,asphalt\n2,0.4,0.8,ice\n3,0.2,0,"
      "ice\n");
  const std::string call = "energy " + kHusky + " --drive " + drive;
  EXPECT_EQ(Run(call), 0) << error_;
  EXPECT_EQ(std::count(out_.begin(), out_.end(), '\n'), 4);
  EXPECT_EQ(out_.rfind("time_s,electric_w,", 0), 0u) << out_;
  const std::string said = error_;
  ASSERT_EQ(Run(call + " --json"), 0);
  const auto all = nlohmann::json::parse(out_);
  const char* motions[] = {"--soil asphalt --speed 0.5", "--soil ice --speed 0.4 --yaw-rate 0.8"};
  double joules = 0;
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(Run("energy " + kHusky + " --json " + motions[i]), 0);
    const auto alone = nlohmann::json::parse(out_);
    EXPECT_EQ(all["rows"][i]["electric_w"], alone["electric_w"]) << "every bit";
    joules += (i == 0 ? 2 : 1) * alone["electric_w"].get<double>();
  }
  EXPECT_DOUBLE_EQ(all["joules"].get<double>(), joules);
  EXPECT_EQ(all["seconds"], 3);
  EXPECT_LE(all["joules_low"].get<double>(), joules);
  EXPECT_GE(all["joules_high"].get<double>(), joules);
  EXPECT_NE(said.find(" J (90 %: "), std::string::npos) << said;
  EXPECT_EQ(Run(call + " --speed 1"), 2) << "either a motion or a drive";
  EXPECT_EQ(Run("energy " + kHusky + " --drive " + Path("speed_m_per_s,grade_deg\n0.3,60\n")), 1);
  EXPECT_NE(out_.find("\nnan,nan,nan,"), std::string::npos) << "no balance, no watts: " << out_;
  EXPECT_EQ(Run("energy " + kHusky + " --drive " + Path("speed_m_per_s\nfast\n")), 2);
  EXPECT_NE(error_.find("path.csv:2: speed_m_per_s: got 'fast'"), std::string::npos) << error_;
}

TEST_F(VehicleCli, EnergyComparesDrives) {
  const std::string first = Path("time_s,speed_m_per_s\n0,0.5\n2,0.4\n3,0\n");
  const std::string second = folder_ / "second.csv";
  std::ofstream(second) << "time_s,speed_m_per_s,grade_deg\n0,0.5,0\n1,0.5,5\n3,0.5,60\n4,0,0\n";
  const std::string call = "energy " + kHusky + " --soil asphalt --drive ";
  ASSERT_EQ(Run(call + first + " --json"), 0) << error_;
  const auto alone = nlohmann::json::parse(out_);
  EXPECT_EQ(Run(call + first + " " + second + " --json"), 1) << "60 degrees are too steep";
  const auto both = nlohmann::json::parse(out_);
  ASSERT_EQ(both.size(), 2u);
  for (const char* sum : {"joules", "joules_low", "joules_high", "seconds", "metres"}) {
    EXPECT_EQ(both[0][sum], alone[sum]) << sum << ": every bit";
  }
  EXPECT_EQ(both[0]["reasons"], "");
  EXPECT_TRUE(both[0]["first_row"].is_null());
  EXPECT_GT(both[0]["least_margin"].get<double>(), 0);
  EXPECT_EQ(both[1]["drive"], second);
  EXPECT_EQ(both[1]["first_row"], 2);
  EXPECT_EQ(both[1]["rows_left_out"], 1);
  EXPECT_EQ(both[1]["seconds"], 3);
  EXPECT_EQ(Run(call + first + " --json"), 0) << "the last row lasts for no time";
  ASSERT_EQ(Run(call + first + " " + first), 0) << error_;
  EXPECT_EQ(out_.rfind("joules,joules_low,", 0), 0u) << out_;
  EXPECT_EQ(std::count(out_.begin(), out_.end(), '\n'), 3);
  EXPECT_EQ(Run("energy --drive " + first + " " + second + " " + kHusky), 1)
      << "the vehicle may stand last: " << error_;
  std::ofstream(second) << "speed_m_per_s\n0.5\n0.5\n";
  EXPECT_EQ(Run(call + first + " " + second), 2);
  EXPECT_NE(error_.find("second.csv: got no column time_s, expected two rows or more with times"),
            std::string::npos)
      << error_;
}

// Alone and beside others the same drives are good and bad.
TEST_F(VehicleCli, ADriveIsGoodAloneIfItIsBesideOthers) {
  const std::string good = folder_ / "good.csv";
  std::ofstream(good) << "time_s,speed_m_per_s\n0,0.5\n1,0.5\n";
  const std::map<std::string, int> drives = {
      {"0,0.3,0\n1,0.3,0\n", 0},
      {"0,0.3,0\n1,0.3,60\n", 0},     // of the last row only the time counts
      {"0,0.3,60\n1,0.3,0\n", 1},     // no balance
      {"0,0.3,5.73\n1,0.3,0\n", 1}};  // none at the worse end of the interval
  for (const auto& [rows, code] : drives) {
    const std::string drive = Path("time_s,speed_m_per_s,grade_deg\n" + rows);
    const std::string call = "energy " + kHusky + " --soil ice --drive " + drive;
    EXPECT_EQ(Run(call), code) << rows;
    EXPECT_EQ(Run(call + " " + good), code) << rows;
    EXPECT_EQ(Run(call + " " + good + " --json"), code) << rows;
  }
  EXPECT_EQ(Run("energy " + kHusky + " --soil ice --speed 0.3 --grade-deg 5.73"), 1);
  const std::string late = Path("time_s,speed_m_per_s\n0,0.5\n1e300,0.5\n");
  EXPECT_EQ(Run("energy " + kHusky + " --drive " + late), 2);
  EXPECT_NE(error_.find("path.csv:3: time_s: got 1e300, expected at most 1e9 s more"),
            std::string::npos)
      << error_;
}

TEST_F(VehicleCli, DrivesMayHaveAnyName) {
  const std::string rows = "time_s,speed_m_per_s\n0,0.5\n1,0.5\n";
  const std::string odd = folder_ / "a,\"b\".csv", latin = folder_ / "caf\xe9.csv";
  std::ofstream(odd) << rows;
  std::ofstream(latin) << rows;
  const std::string call = "energy " + kHusky + " --drive '" + odd + "' '" + latin + "'";
  ASSERT_EQ(Run(call), 0) << error_;
  EXPECT_NE(out_.find(",\"" + folder_.string() + "/a,\"\"b\"\".csv\"\n"), std::string::npos)
      << out_;
  ASSERT_EQ(Run(call + " --json"), 0) << error_;
  const auto costs = nlohmann::json::parse(out_);
  EXPECT_EQ(costs[0]["drive"], odd);
  EXPECT_EQ(costs[1]["drive"], folder_.string() + "/caf\xef\xbf\xbd.csv");
}

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

TEST_F(VehicleCli, TakesASoilThatIsOneOfSeveral) {
  const auto power = [&](const std::string& soil) {
    EXPECT_EQ(Run("energy " + kHusky + " --speed 0.5 --radius 2 --json --soil '" + soil + "'"), 0)
        << error_;
    return nlohmann::json::parse(out_)["electric_w"].get<double>();
  };
  const double asphalt = power("asphalt"), ice = power("ice");
  EXPECT_NEAR(power("{asphalt: 2, ice: 0}"), asphalt, 1e-9 * asphalt);
  const double either = power("{asphalt: 1, ice: 1}");
  EXPECT_GT(either, std::min(asphalt, ice));
  EXPECT_LT(either, std::max(asphalt, ice));
  const std::string plan = "speed " + kHusky + " " + Path("s_m,curvature_per_m\n0,0\n1,0\n2,0\n") +
                           " --limit 0.8 --json";
  ASSERT_EQ(Run(plan + " --soil '{asphalt: 0.9, ice: 0.1}'"), 0) << error_;
  for (const auto& [soil, what] : std::map<std::string, std::string>{
           {"{asphalt: 1, icy: 1}", "such as"}, {"{asphalt: -1}", "-1"}, {"{asphalt: 1", "soil"}}) {
    EXPECT_EQ(Run(plan + " --soil '" + soil + "'"), 2) << soil;
    EXPECT_NE(error_.find(what), std::string::npos) << error_;
  }
}

// Of each soil, of one, and of a mixture, whose pull lies between those of its soils.
TEST_F(VehicleCli, ConstantsOfOneSoilAndOfAMixture) {
  const std::string call = "constants " + kHusky + " --speeds 0.5 --radii 2";
  const auto pull = [&](const std::string& soil) {
    EXPECT_EQ(Run(call + " --soil '" + soil + "'"), 0) << error_;
    EXPECT_EQ(out_.find("---", 3), std::string::npos) << "one document: " << out_;
    EXPECT_NE(out_.find("# husky on " + soil + ","), std::string::npos) << out_;
    const std::size_t at = out_.find("pull_over_weight: ");
    return at == std::string::npos ? 0 : std::stod(out_.substr(at + 18));
  };
  const double asphalt = pull("asphalt"), ice = pull("ice");
  const double mixed = pull("{asphalt: 0.5, ice: 0.5}");
  EXPECT_GT(mixed, ice + 0.1);
  EXPECT_LT(mixed, asphalt - 0.1);
  EXPECT_EQ(Run(call + " --soil mud"), 2);
  EXPECT_EQ(Run(call + " --soil '{mud: 1}'"), 2);
}

TEST_F(VehicleCli, ClimbSaysTheSteepestGrades) {
  ASSERT_EQ(Run("climb " + kHusky + " --json"), 0) << error_;
  const auto all = nlohmann::json::parse(out_);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[2]["soil"], "ice");
  EXPECT_EQ(all[2]["up_binding"], "TRACTION");
  ASSERT_EQ(Run("climb " + kHusky + " --soil ice --worse-by-sd 0 --speed 0.3 --json"), 0);
  const auto mean = nlohmann::json::parse(out_)[0];
  for (const char* way : {"up_deg", "down_deg"}) {
    EXPECT_NEAR(mean[way].get<double>(), std::atan(0.15) * 57.2958, 0.1) << way;
  }
  EXPECT_LT(all[2]["up_deg"], mean["up_deg"]);
  ASSERT_EQ(Run("climb " + kHusky + " --soil ice"), 0);
  EXPECT_NE(out_.find("ice "), std::string::npos) << out_;
  EXPECT_EQ(Run("climb " + kHusky + " --tip-margin 0.999"), 1);
  EXPECT_NE(out_.find("none"), std::string::npos) << out_;
  EXPECT_EQ(Run("climb " + kHusky + " --soil icy"), 2);
  EXPECT_NE(error_.find("such as ice"), std::string::npos) << error_;
  EXPECT_EQ(Run("climb " + kHusky + " --tip-margin 2"), 2);
  EXPECT_NE(error_.find("tip_margin"), std::string::npos) << error_;
}

TEST_F(VehicleCli, SolveSaysTheProbabilityToGo) {
  const std::string call = "solve " + kHusky + " --soil floor --speed 0.3 --grade-deg ";
  ASSERT_EQ(Run(call + "28 --json"), 0) << error_;
  const auto go = nlohmann::json::parse(out_);
  // Friction needed: tan 28 deg = 0.5317, by 0.854 of 0.08 less than the mean 0.6.
  EXPECT_NEAR(go["go_probability_least"].get<double>(), 0.5 * std::erfc(-0.854 / std::sqrt(2.0)),
              0.02);
  EXPECT_EQ(go["go_probability_least"], go["go_probability_most"]);
  EXPECT_EQ(Run(call + "60"), 1);
  EXPECT_NE(out_.find("probability to go: 0.000"), std::string::npos) << out_;
}

// On hard ground the draws are of the friction: the share that exceeds what the grade needs.
TEST_F(VehicleCli, SolveAndSpeedTakeDraws) {
  const std::string call = "solve " + kHusky + " --soil floor --speed 0.3 --grade-deg 28 --draws ";
  ASSERT_EQ(Run(call + "1000 --json"), 0) << error_;
  const auto draws = nlohmann::json::parse(out_)["draws"];
  const double p = 0.5 * std::erfc(-0.854 / std::sqrt(2.0));
  EXPECT_NEAR(draws["go_probability_least"].get<double>(), p, 4.5 * std::sqrt(p * (1 - p) / 1000));
  EXPECT_EQ(draws["count"], 1000);
  const auto& slip = draws["quantiles_5_50_95"]["rim_speed_m_per_s.left"];
  EXPECT_GT(slip[2].get<double>(), 1.01 * slip[0].get<double>());
  ASSERT_EQ(Run(call + "50"), 0) << error_;
  EXPECT_NE(out_.find("probability to go on 50 draws of the ground: 0."), std::string::npos)
      << out_;
  EXPECT_EQ(Run(call + "1025"), 2);

  const std::string path = Path("s_m,curvature_per_m,grade_deg,soil\n0,0,26,floor\n1,0,28,floor\n");
  ASSERT_EQ(Run("speed " + kHusky + " " + path +
                " --limit 0.5 --start 0.3 --end 0.3 --worse-by-sd 0 --draws 200 --json"),
            0)
      << error_;
  const auto plan = nlohmann::json::parse(out_);
  const double share = plan[0]["plan_hold_probability"].get<double>();
  EXPECT_NEAR(share, p, 4.5 * std::sqrt(p * (1 - p) / 200));
  EXPECT_EQ(plan[1]["hold_probability"], share);  // the steeper one decides
  EXPECT_GT(plan[0]["hold_probability"].get<double>(), share);
}

TEST_F(VehicleCli, SpeedTakesPlaces) {
  // A circle of radius 4 m to the right, and the same by length and curvature.
  std::string places = "x_m,y_m\n", lengths = "s_m,curvature_per_m\n";
  constexpr int kPoints = 40;
  for (int i = 0; i < kPoints; ++i) {
    const double turn = 0.1 * i;
    places += std::to_string(4 * std::sin(turn)) + "," + std::to_string(4 * std::cos(turn)) + "\n";
    lengths += std::to_string(4 * turn) + ",-0.25\n";
  }
  const auto plan = [&](const std::string& path) {
    EXPECT_EQ(Run("speed " + kHusky + " " + Path(path) + " --limit 3 --json"), 0) << error_;
    return nlohmann::json::parse(out_);
  };
  const auto by_place = plan(places), by_length = plan(lengths);
  for (std::size_t i = 0; i < kPoints; ++i) {
    EXPECT_NEAR(by_place[i]["curvature_per_m"], -0.25, 0.0025) << i;
    EXPECT_EQ(by_length[i]["curvature_per_m"], -0.25) << i;
    EXPECT_NEAR(by_place[i]["s_m"], by_length[i]["s_m"], 0.01 * 0.4 * (i + 1)) << i;
    EXPECT_NEAR(by_place[i]["safe_m_per_s"], by_length[i]["safe_m_per_s"], 0.012) << i;
  }
}

TEST_F(VehicleCli, RefusesPathsByLine) {
  EXPECT_EQ(Run("speed " + kHusky + " " + Path("x_m,y_m\n0,0\n1,nan\n") + " --limit 3"), 2);
  EXPECT_NE(error_.find("path.csv:3: y_m: got 'nan'"), std::string::npos) << error_;
}

}  // namespace
