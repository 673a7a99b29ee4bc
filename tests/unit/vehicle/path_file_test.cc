// Paths and drives as people write them: read, or refused by line.
#include "clients/vehicle/path_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "clients/vehicle/motion_log.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/records/throws.h"

namespace grouser::cli {
namespace {

std::string Complaint(const std::string& text) {
  const records::TempFolder folder;
  const std::string path = folder / "path.csv";
  std::ofstream(path) << text;
  return MessageOf([&] { ReadPath(path, {"sand", "loam"}); });
}

TEST(PathFile, IsReadInAnyOrderOfColumns) {
  const records::TempFolder folder;
  const std::string path = folder / "path.csv";
  std::ofstream(path) << "# by hand\nsoil, s_m ,curvature_per_m,grade_deg\nloam,0,0.25,30\n"
                         "sand,2,-0.25,0\n";
  const std::vector<vehicle::PathPoint> points = ReadPath(path, {"sand", "loam"});
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[1].s_m, 2);
  EXPECT_EQ(points[0].curvature_per_m, 0.25);
  EXPECT_NEAR(points[0].grade_rad, 0.5236, 1e-4);
  EXPECT_EQ(points[0].soil, 1);
  EXPECT_EQ(points[1].soil, 0);
}

TEST(PathFile, IsRefusedByLine) {
  const auto expect = [](const std::string& text, const std::string& what) {
    EXPECT_NE(Complaint(text).find(what), std::string::npos) << text << Complaint(text);
  };
  expect("x_m,y_m\n0,0\n1,0\n1,0\n2,0\n", "path.csv:4: x_m, y_m: got the place of the line before");
  expect("x_m,y_m\n0,0\n1,0\n0,0\n", "path.csv:4: x_m, y_m: got a way straight back");
  expect("x_m,y_m\n0,0\n1,nan\n", "path.csv:3: y_m: got 'nan'");
  expect("x_m,y_m\n0,0\n", "fewer than two points");
  expect("x_m\n0\n1\n", "path.csv:1: no column y_m");
  expect("x_m,y_m,s_m\n0,0,0\n1,0,1\n", "path.csv:1: got places besides s_m");
  expect("x_m,y_m,z_m\n0,0,0\n1,0,1\n", "path.csv:1: column z_m: expected s_m");
  expect("x_m,y_m,x_m\n0,0,0\n1,0,1\n", "path.csv:1: column x_m");
  expect("s_m,curvature_per_m\n0,0\n0,0\n", "path.csv:3: s_m");
  expect("x_m,y_m\n0,0,1\n1,0\n", "path.csv:2: got 3 cells, expected 2");
}

MotionLog LogOf(const std::string& text) {
  const records::TempFolder folder;
  const std::string file = folder / "drive.csv";
  std::ofstream(file) << text;
  return ReadMotionLog(file, {"sand", "loam"}, 1);
}

TEST(MotionLogFile, IsReadInAnyOrderOfColumns) {
  const MotionLog log = LogOf(
      "# a log\nyaw_rate_rad_per_s,speed_m_per_s,time_s,grade_deg\n0.5,1,10,30\n-1,0,10.5,0\n");
  ASSERT_EQ(log.motions.size(), 2u);
  EXPECT_EQ(log.motions[0].v_x_m_per_s, 1);
  EXPECT_EQ(log.motions[0].yaw_rate_rad_per_s, 0.5);
  EXPECT_NEAR(log.motions[0].grade_rad, 0.5236, 1e-4);
  EXPECT_EQ(log.motions[1].yaw_rate_rad_per_s, -1);
  EXPECT_EQ(log.motions[1].soil[0], 1) << "the one that was asked for";
  EXPECT_EQ(log.time_s, (std::vector<double>{10, 10.5}));
  const MotionLog timeless = LogOf("speed_m_per_s,soil\n1,sand\n");
  EXPECT_TRUE(timeless.time_s.empty());
  EXPECT_EQ(timeless.motions[0].soil[0], 0);
}

TEST(MotionLogFile, IsRefusedByLine) {
  const auto expect = [](const std::string& text, const std::string& what) {
    const std::string said = MessageOf([&] { LogOf(text); });
    EXPECT_NE(said.find(what), std::string::npos) << text << said;
  };
  expect("speed_m_per_s,time_s\n1,0\n1,0\n", "drive.csv:3: time_s: got 0, expected more than");
  expect("speed_m_per_s\ninf\n", "drive.csv:2: speed_m_per_s: got 'inf'");
  expect("speed_m_per_s,soil\n1,lome\n",
         "drive.csv:2: soil: got lome, expected one of the vehicle, such as loam");
  expect("time_s\n0\n", "drive.csv:1: no column speed_m_per_s");
  expect("v\n0\n", "drive.csv:1: column v: expected speed_m_per_s and at most");
  expect("speed_m_per_s\n", "got no row, expected a drive");
  expect("", "got no row, expected a drive");
  expect("speed_m_per_s\n1,2\n", "drive.csv:2: got 2 cells, expected 1");
}

TEST(MotionLogFile, EnergyIsThatOfEachRowUntilTheNext) {
  const auto power = [](double watts, double low, double high, bool balanced) {
    vehicle::PowerInterval p;
    p.mean.electric = watts, p.electric_low = low, p.electric_high = high;
    p.solution.balanced = balanced;
    p.speed_m_per_s = 2;
    return p;
  };
  MotionLog log;
  log.time_s = {0, 1, 3, 4, 5, 7};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<vehicle::PowerInterval> powers = {
      power(10, 8, 12, true), power(20, 10, 40, true), power(5, 5, 5, false),
      power(5, nan, 5, true), power(-3, -4, -2, true), power(1e9, 0, 1e9, true)};
  const vehicle::DriveEnergy sum = EnergyOf(log, powers);  // the last row has no time of its own
  EXPECT_EQ(sum.joules, 10 + 2 * 20 - 2 * 3);
  EXPECT_EQ(sum.low, 8 + 2 * 10 - 2 * 4);
  EXPECT_EQ(sum.high, 12 + 2 * 40 - 2 * 2);
  EXPECT_EQ(sum.seconds, 5);
  EXPECT_EQ(sum.metres, 10);
  EXPECT_EQ(sum.left_out, 2u);
  EXPECT_EQ(sum.left_out_s, 2);
}

}  // namespace
}  // namespace grouser::cli
