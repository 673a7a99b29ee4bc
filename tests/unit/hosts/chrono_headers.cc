// grouser/chrono.h against Chrono's own headers: compiles, and a tyre can be made.
#include <gtest/gtest.h>

#include "grouser/chrono.h"

TEST(ChronoHeaders, ATyreCanBeMade) {
  const auto model = grouser::Model::Open(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/hybrid.model");
  const grouser::ChronoSoilTire tire("tyre", model, 1, chrono::ChVector3d(0.1, 0.2, 0.1));
  EXPECT_EQ(tire.GetRadius(), model.radius_m());
  EXPECT_FALSE(tire.ReportTireContactData().in_contact);
}
