// grouser/mavs.h against MAVS' own header.
#include <gtest/gtest.h>

#include "grouser/mavs.h"

TEST(MavsHeaders, AnswersAsTheModel) {
  const auto model = grouser::Model::Open(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/hybrid.model");
  grouser::MavsSoilVti vti(model);
  mavs::vti::MavsVti& base = vti;
  EXPECT_EQ(base.GetDrawbarPull(), 0);
  base.SetPowered(false);  // not read
  base.Update(100, 24, 0, 0.2, 0);
  const auto answer = grouser::AskVti(model, 0.2, 0, 24);
  EXPECT_EQ(base.GetLongitudinalTraction(), answer.traction);
  EXPECT_EQ(base.GetLongitudinalTraction() - base.GetLongitudinalMotionResistance(), answer.pull);
}
