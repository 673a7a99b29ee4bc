// Sweeps of experiment files: members, their texts, and what is refused.
#include "dem_offline/scenes/sweep_yaml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace grouser::campaign {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kDrop[] = R"(name: drop
seed: 4
materials: {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.2, width_m: 0.2, height_m: 0.3, material: sand}
grains: {kind: lattice, material: sand, diameter_m: 0.01, count: 20}
bodies:
  - {name: plate, material: sand, parts: {shape: box, size_m: [0.1, 0.1, 0.01]},
     position_m: [0.1, 0.1, 0.2], motion: [{do: lower, speed_m_per_s: 0.1, distance_m: 0.01}]}
)";

Sweep Read(const std::string& sweep, const std::vector<std::string>& sets = {}) {
  return ReadSweep(std::string(kDrop) + sweep, "f", "", sets).value();
}

void Refuses(const std::string& sweep, const std::string& why,
             const std::vector<std::string>& sets = {}) {
  try {
    const Sweep s = Read(sweep, sets);
    for (const SweepMember& m : s.members) ReadMember(s, m, {});
    FAIL() << sweep;
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(why));
  }
}

TEST(Sweep, FileWithoutHasNone) { EXPECT_FALSE(ReadSweep(kDrop, "f", "", {}).has_value()); }

TEST(Sweep, MultipliesAxesAndReplicatesAndStepsZippedAxesTogether) {
  const Sweep s = Read(R"(sweep:
  axes:
    - {key: grains.count, values: [5, 6]}
    - {key: interfaces.friction, values: [0.1, 0.2]}
    - {key: "bodies[0].motion[0].speed_m_per_s", values: [0.2, 0.3], zipped: on}
  replicates: 3
)");
  ASSERT_EQ(s.members.size(), 12u);
  EXPECT_THAT(s.members[0].values, ElementsAre("5", "0.1", "0.2"));
  EXPECT_THAT(s.members[3].values, ElementsAre("5", "0.2", "0.3"));
  EXPECT_THAT(s.members[11].values, ElementsAre("6", "0.2", "0.3"));
  EXPECT_EQ(s.members[2].seed, 6u);
  const auto e = ReadMember(s, s.members[11], {}).experiment;
  EXPECT_EQ(e.grains[0].count, 6);
  EXPECT_EQ(e.interfaces[0].friction, 0.2);
  EXPECT_NEAR(e.bodies[0].motion[0].velocity_m_per_s[2], -0.3, 1e-15);
  EXPECT_EQ(e.seed, 6u);
}

TEST(Sweep, HeldOutMembersTakeTheFilesValuesWhereTheirAxesNameNone) {
  const Sweep s = Read(R"(sweep:
  axes: {key: interfaces.friction, values: [0.1, 0.2]}
  held_out: {axes: {key: grains.count, values: [7]}, replicates: 2}
)");
  ASSERT_EQ(s.members.size(), 4u);
  EXPECT_FALSE(s.members[1].held_out);
  EXPECT_TRUE(s.members[2].held_out);
  EXPECT_THAT(s.members[1].values, ElementsAre("0.2", "20"));
  EXPECT_THAT(s.members[3].values, ElementsAre("0.5", "7"));
}

TEST(Sweep, ValuesMayBeListsAndMappings) {
  const Sweep s = Read(R"(sweep:
  axes:
    - key: bodies[0].parts
      values:
        - {shape: box, size_m: [0.05, 0.05, 0.01]}
        - {shape: disc, radius_m: 0.03}
)");
  EXPECT_EQ(ReadMember(s, s.members[0], {}).experiment.bodies[0].parts[0].size_m[0], 0.05);
  EXPECT_EQ(ReadMember(s, s.members[1], {}).experiment.bodies[0].parts[0].radius_m, 0.03);
}

/// What a member is does not change with the members beside it, and its text alone is the same run.
TEST(Sweep, MembersTextIsAnExperimentByItself) {
  const Sweep two = Read("sweep: {axes: {key: grains.count, values: [5, 6]}}\n");
  const Sweep three = Read("sweep: {axes: {key: grains.count, values: [4, 5, 6]}}\n");
  const auto file = ReadMember(two, two.members[1], {});
  EXPECT_EQ(file.text, ReadMember(three, three.members[2], {}).text);
  EXPECT_NE(file.text, ReadMember(two, two.members[0], {}).text);
  EXPECT_FALSE(ReadSweep(file.text, "g", "", {}).has_value());
  const auto again = ReadExperiment(file.text, "g", "", {});
  EXPECT_EQ(again.experiment.grains[0].count, 6);
  EXPECT_EQ(again.resolved, file.resolved);
}

TEST(Sweep, SetsStandUnderTheAxesAndMayChangeTheSweepItself) {
  const std::string sweep = "sweep: {axes: {key: grains.count, values: [5, 6]}}\n";
  const Sweep s = Read(sweep, {"interfaces.friction=0.9", "sweep.replicates=2"});
  EXPECT_EQ(s.members.size(), 4u);
  EXPECT_EQ(ReadMember(s, s.members[0], {}).experiment.interfaces[0].friction, 0.9);
  Refuses(sweep, "an axis of the sweep varies grains.count", {"grains.count=9"});
}

TEST(Sweep, SeedMayBeAnAxis) {
  const Sweep s = Read("sweep: {axes: {key: seed, values: [11, 12]}}\n");
  EXPECT_EQ(s.members[1].seed, 12u);
  EXPECT_TRUE(s.keys.empty());
  EXPECT_EQ(ReadMember(s, s.members[1], {}).experiment.seed, 12u);
  Refuses("sweep: {axes: {key: seed, values: [1]}, replicates: 2}\n", "beside replicates");
}

TEST(Sweep, RefusesBadInput) {
  Refuses("sweep: {axes: {key: grains.cuont, values: [5]}}\n", "nearest is 'count'");
  Refuses("sweep: {axes: {key: \"bodies[3].name\", values: [5]}}\n", "no such key as 'bodies[3]'");
  Refuses("sweep: {axes: {key: grains.count, values: [5, none]}}\n", "member grains.count=none");
  Refuses("sweep: {axes: {key: grains.count, values: []}}\n", "non-empty list");
  Refuses("sweep: {axes: {key: sweep.replicates, values: [5]}}\n", "of the experiment itself");
  Refuses("sweep: {axes: {key: seed, values: [5], zipped: on}}\n", "an axis above");
  Refuses("sweep: {replicates: 0}\n", "1 or more");
  Refuses("sweep: {replicates: 10001}\n", "whole number");
  Refuses("sweep: {axes: {key: seed, values: [1, 2]}, replicates: 9999}\n", "at most 10000");
  Refuses("sweep: {held_out: {replicates: 2}}\n", "key 'sweep.held_out.axes'");
  Refuses("sweep: {axes: {key: seed, values: [1, &z [*z]]}}\n", "more than 100 levels");
  Refuses(
      "sweep: {replicates: 9999, axes: {key: name, values: [" + std::string(9999, 'a') + "]}}\n",
      "in all");
  Refuses(R"(sweep:
  axes:
    - {key: grains.count, values: [1, 2]}
    - {key: interfaces.friction, values: [0.1], zipped: on}
)",
          "1 of them, expected 2");
  EXPECT_THROW(ReadExperiment(std::string(kDrop) + "sweep: {replicates: 2}\n", "f", "", {}),
               InputError);
}

TEST(Sweep, ResultsAreOfAWindow) {
  const Sweep s = Read(R"(sweep:
  results:
    - {column: f, of: mean, from_s: 1}
    - {column: f, of: last, to_s: 2}
    - {column: f, of: most, from_s: -1}
    - {column: f, of: sd, name: spread}
    - {column: f, from_s: 7}
)");
  const std::map<std::string, std::vector<double>> series = {{"time_s", {0, 1, 2, 3}},
                                                             {"f", {1, 2, 4, 9}}};
  EXPECT_DOUBLE_EQ(ValueOf(s.results[0], series), 5);
  EXPECT_DOUBLE_EQ(ValueOf(s.results[1], series), 4);
  EXPECT_DOUBLE_EQ(ValueOf(s.results[2], series), 9);
  EXPECT_NEAR(ValueOf(s.results[3], series), std::sqrt(38.0 / 3), 1e-12);
  EXPECT_TRUE(std::isnan(ValueOf(s.results[4], series)));
  EXPECT_EQ(s.results[0].name, "f.mean");
  EXPECT_EQ(s.results[3].name, "spread");
  EXPECT_THROW(CheckResults(s, {"time_s", "g"}), InputError);
}

}  // namespace
}  // namespace grouser::campaign
