// Paths as people write them: read, or refused by line.
#include "clients/vehicle/path_file.h"

#include <gtest/gtest.h>

#include <fstream>

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

}  // namespace
}  // namespace grouser::cli
