// The harness of verify and torture: what it must never do is pass by accident.
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <stdexcept>

#include "dem_offline/engine/verify/suite.h"

namespace grouser::dem::verify {
namespace {

Suite Small() {
  return {"verify",
          "about",
          {{"good", Level::kQuick, [](Rows& r) { r.Relative("x [m]", 2, 2.01, 0.01, "me"); }},
           {"bad", Level::kQuick, [](Rows& r) { r.Absolute("y [-]", 1, 1.2, 0.1, "me"); }},
           {"throws", Level::kDefault,
            [](Rows& r) {
              r.AtMost("z [-]", 1, 0.5, "me");
              throw std::runtime_error("lost \"it\"");
            }},
           {"silent", Level::kFull, [](Rows&) {}}}};
}

SuiteOptions Options(Level level) {
  SuiteOptions o;
  o.level = level;
  o.progress = false;
  return o;
}

TEST(VerifySuite, LevelsChooseAndOrderStays) {
  const SuiteResult quick = RunSuite(Small(), Options(Level::kQuick));
  ASSERT_EQ(quick.rows.size(), 2u);
  EXPECT_TRUE(quick.rows[0].pass);
  EXPECT_FALSE(quick.rows[1].pass);
  EXPECT_EQ(quick.Failed(), 1);
  EXPECT_EQ(RunSuite(Small(), Options(Level::kDefault)).rows[0].name, "good");
}

TEST(VerifySuite, ThrowingAndSilentCasesFailARow) {
  const SuiteResult all = RunSuite(Small(), Options(Level::kFull));
  ASSERT_EQ(all.rows.size(), 5u);
  EXPECT_TRUE(all.rows[2].pass);  // what came before the throw stays
  EXPECT_FALSE(all.rows[3].pass);
  EXPECT_NE(all.rows[3].got.text.find("lost"), std::string::npos);
  EXPECT_FALSE(all.rows[4].pass);
  EXPECT_EQ(all.Failed(), 3);
}

TEST(VerifySuite, NumbersThatAreNoneFail) {
  Rows rows("case");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  rows.Relative("a", 1, nan, 1e9, "");
  rows.AtMost("b", 1, nan, "");
  rows.AtLeast("c", 1, std::numeric_limits<double>::infinity(), "");
  rows.Holds("d", true, nan);
  for (const Row& r : rows.rows()) EXPECT_FALSE(r.pass) << r.quantity;
}

TEST(VerifySuite, OneCaseByName) {
  SuiteOptions o = Options(Level::kQuick);
  o.only = "throws";
  EXPECT_EQ(RunSuite(Small(), o).rows.size(), 2u);
  o.only = "nobody";
  EXPECT_THROW(RunSuite(Small(), o), std::invalid_argument);
}

TEST(VerifySuite, JsonIsEscapedAndNamed) {
  const std::string json = Json(Small(), RunSuite(Small(), Options(Level::kDefault)));
  EXPECT_NE(json.find("lost \\\"it\\\""), std::string::npos) << json;
  for (const char* key :
       {"case", "quantity", "expected", "source", "got", "tolerance", "pass", "seconds"}) {
    EXPECT_NE(json.find('"' + std::string(key) + "\":"), std::string::npos) << key;
  }
}

TEST(VerifySuite, TablesAreLongEnoughAndNamesUnique) {
  for (const Suite& suite : {VerifySuite(), TortureSuite()}) {
    std::set<std::string> names;
    for (const Case& c : suite.cases) EXPECT_TRUE(names.insert(c.name).second) << c.name;
    EXPECT_GE(suite.cases.size(), 20u);
  }
}

}  // namespace
}  // namespace grouser::dem::verify
