// Tables of measured wheels, as people write them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "surrogate/fit/measured.h"
#include "tests/unit/records/temp_folder.h"

namespace grouser::surrogate {
namespace {

using testing::HasSubstr;

constexpr WheelLimits kLimits{0.0625};

std::string Write(const records::TempFolder& folder, const std::string& text) {
  const std::string path = folder / "m.csv";
  std::ofstream(path) << text;
  return path;
}

TEST(MeasuredTable, IsReadWithItsGaps) {
  const records::TempFolder folder;
  const auto points = ReadMeasured(Write(folder,
                                         "# source\n"
                                         "slip,attack_angle_deg,load_n,f_x_n,f_x_sd,sinkage_m\n"
                                         "-0.1,0,24,-2.5,0.3,0.02\n"
                                         "0.25, 30,23,0.5,,\n"),
                                   kLimits);
  ASSERT_EQ(points.size(), 2u);
  EXPECT_DOUBLE_EQ(points[0].value(kFx), -2.5);
  EXPECT_TRUE(std::isnan(points[1].value(kSinkage)));
}

TEST(MeasuredTable, ErrorsNameFileLineAndColumn) {
  const records::TempFolder folder;
  const auto complaint = [&](const std::string& text) {
    try {
      ReadMeasured(Write(folder, text), kLimits);
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const std::string head = "slip,attack_angle_deg,load_n,f_x_n\n";
  EXPECT_THAT(complaint("slip,load_n\n"), HasSubstr("m.csv:1: no column attack_angle_deg"));
  EXPECT_THAT(complaint("slip,attack_angle_deg,load_n,fx\n"), HasSubstr("fx: unknown column"));
  EXPECT_THAT(complaint(head + "0.1,0,24,abc\n"), HasSubstr("m.csv:2: f_x_n: \"abc\""));
  EXPECT_THAT(complaint(head + "0.1,0,24\n"), HasSubstr("m.csv:2: 3 fields, expected 4"));
  EXPECT_THAT(complaint(head + "0.1,0,-4,1\n"), HasSubstr("load_n"));
  EXPECT_THAT(complaint(head + "1.7,0,24,1\n"), HasSubstr("no motion"));
  EXPECT_THAT(complaint(head), HasSubstr("no measured row"));
}

TEST(MeasuredTable, IsRefusedByCellInOtherUnits) {
  const records::TempFolder folder;
  bool unusual = false;
  const auto complaint = [&](const std::string& text) {
    try {
      ReadMeasured(Write(folder, text), kLimits, unusual);
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const std::string head = "slip,attack_angle_deg,load_n,f_x_n,torque_n_m,sinkage_m\n";
  const std::string good = "0.1,30,24,5,0.4,0.02\n";
  EXPECT_EQ(complaint(head + good), "accepted");
  EXPECT_THAT(complaint(head + good + "0.1,0,24,5,400,0.02\n"),  // N mm
              HasSubstr("m.csv:3: torque_n_m: 400 N m, expected -2.25 to 2.25 N m"));
  EXPECT_THAT(complaint(head + good + "0.1,0,24,5,0.4,20\n"),  // mm
              HasSubstr("m.csv:3: sinkage_m: 20 m, expected -0.00625 to 0.125 m"));
  EXPECT_THAT(complaint(head + good + "0.1,0,0.024,5,,\n"),  // load in kN
              HasSubstr("m.csv:3: f_x_n: 5 N, expected -0.24 to 0.24 N"));
  EXPECT_THAT(complaint(head + "0.1,30,24,0.005,,\n0.2,30,24,0.006,,\n"),  // forces in kN
              HasSubstr("m.csv:3: f_x_n, f_y_n: at most 0.00025 of the load in every row"));
  EXPECT_THAT(complaint("slip,attack_angle_deg,load_n,load_n\n"),
              HasSubstr("m.csv:1: load_n: the column stands here twice"));
  EXPECT_THAT(complaint("slip,attack_angle_deg,load_n,f_x_n,f_x_sd\n0.1,0,24,5,-1\n"),
              HasSubstr("m.csv:2: f_x_sd: expected a number not below 0"));
  const std::string radians = head + "0.1,0,24,5,,\n0.1,0.5236,24,5,,\n";
  EXPECT_THAT(complaint(radians), HasSubstr("m.csv:3: attack_angle_deg: 0.5236"));
  unusual = true;
  EXPECT_EQ(complaint(radians), "accepted");
}

}  // namespace
}  // namespace grouser::surrogate
