// Tables of measured vehicles that are wrong are refused.
#include <gmock/gmock.h>

#include <sstream>

#include "surrogate/measured_vehicles/rows.h"
#include "tests/unit/refusal.h"

namespace grouser::measured {
namespace {

using ::testing::HasSubstr;

TEST(MeasuredRows, TablesAreRefusedByLineAndColumn) {
  const auto windows = [](const std::string& text) {
    std::istringstream in(text);
    return Refusal([&] { ReadDriveWindows(in, "w.csv"); });
  };
  const std::string head = "robot,steady,v_left_mps,v_right_mps,vx_mps,vy_mps,omega_radps\n";
  EXPECT_EQ(windows(head + "husky,1,0.1,0.2,0.1,0,0.1\n"), "");
  EXPECT_THAT(windows(head + "# made\nhusky,1,0.1,,0.1,0,0.1\n"),
              HasSubstr("w.csv:3: v_right_mps: got nothing, expected a number from -20 to 20"));
  EXPECT_THAT(windows(head + "husky,1,0.1,nan,0.1,0,0.1\n"), HasSubstr("v_right_mps: got nan"));
  EXPECT_THAT(windows(head + "husky,1,0.1,1000,0.1,0,0.1\n"), HasSubstr("got 1000"));
  EXPECT_THAT(windows(head + "husky,1,0.1\n"), HasSubstr("w.csv:2: 3 cells, expected 7"));
  EXPECT_THAT(windows(head), HasSubstr("no row"));
  EXPECT_THAT(windows(""), HasSubstr("no line"));
  EXPECT_THAT(windows("robot,steady\nhusky,1\n"), HasSubstr("no column v_left_mps"));
  std::istringstream currents("time,velL,velR,curL,curR\n0,0.5,0.5,-3,2\n");
  EXPECT_THAT(Refusal([&] { ReadCurrents(currents, "c.csv"); }),
              HasSubstr("c.csv:2: curL: got -3"));
}

}  // namespace
}  // namespace grouser::measured
