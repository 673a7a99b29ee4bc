// Interfaces of experiment files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/scenes/experiment_yaml.h"

namespace grouser::campaign {
namespace {

using ::testing::HasSubstr;

TEST(ExperimentInterfaces, HaveLawsOfTheirOwn) {
  const std::string text = R"(name: two laws
materials: [{name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}, {name: rubber}]
interfaces:
  - {between: [sand, any], restitution: 0.5, friction: 0.5}
  - {between: [sand, rubber], restitution: 0.5, friction: 0.5, normal: linear_spring,
     tangential: linear_history, rolling: none, linear_spring: {stiffness_n_per_m: 1.0e4}}
box: {length_m: 0.2, width_m: 0.2, height_m: 0.3, material: rubber}
grains: {kind: lattice, material: sand, diameter_m: 0.01, count: 20}
duration_s: 0.1
)";
  const auto read = [&](const std::vector<std::string>& sets) {
    return ReadExperiment(text, "e.yaml", "", {}, sets);
  };
  const dem::ContactModel model = dem::experiment::ContactsOf(read({}).experiment);
  EXPECT_EQ(dem::Describe(model.laws(0, 0)),
            "normal=hertz_restitution, tangential=mindlin, rolling=epsd, cohesion=none");
  EXPECT_EQ(dem::Describe(model.laws(0, 1)),
            "normal=linear_spring, tangential=linear_history, rolling=none, cohesion=none");
  const auto refusal = [&](const std::vector<std::string>& sets) -> std::string {
    try {
      read(sets);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::string misfit = refusal({"interfaces[1].cohesion=jkr"});
  EXPECT_THAT(misfit,
              HasSubstr(":5: key 'interfaces[1]': got sand and rubber: laws: cohesion law 'jkr' "
                        "needs an elastic part that is exactly Hertz, which normal law "
                        "'linear_spring' does not have"));
  EXPECT_THAT(
      refusal({"interfaces[1].normal=springs"}),
      HasSubstr("key 'interfaces[1]': got sand and rubber: normal law: 'springs', expected one of "
                "hertz_restitution, linear_spring"));
}

}  // namespace
}  // namespace grouser::campaign
