// Files that are wrong: what, where, expected.
#include "surrogate/vehicle/vehicle_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/write_model.h"
#include "surrogate/vehicle/mixture_ground.h"

namespace grouser::vehicle {
namespace {

const std::string kFolder = GROUSER_VEHICLES;

std::string TextOfFile(const std::string& path) {
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

using Changes = std::vector<std::pair<std::string, std::string>>;

// A copy of the shipped file with each `first` replaced by `second`; its path.
std::string Changed(const std::string& name, const Changes& changes) {
  std::string text = TextOfFile(kFolder + "/" + name + ".vehicle.yaml");
  for (const auto& [from, to] : changes) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  for (std::size_t p; (p = text.find("../../pairs")) != std::string::npos;) {
    text.replace(p, 11,
                 std::filesystem::path(kFolder).parent_path().parent_path().string() + "/pairs");
  }
  const std::string file = ::testing::TempDir() + "/grouser_vehicle_file_test.yaml";
  std::ofstream(file) << text;
  return file;
}

// What reading a changed file says; "" if it is read.
std::string Refusal(const std::string& name, const Changes& changes) {
  try {
    ReadVehicle(Changed(name, changes));
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}
std::string Refusal(const std::string& name, const std::string& from, const std::string& to) {
  return Refusal(name, Changes{{from, to}});
}

TEST(VehicleFile, ReadsWhatIsShipped) {
  for (const char* name : {"husky", "warthog", "atv", "rover", "rover_lugged", "cart"}) {
    const VehicleFile file = ReadVehicle(kFolder + "/" + name + ".vehicle.yaml");
    EXPECT_EQ(file.vehicle.name, name);
    EXPECT_EQ(file.models.size(), file.sources.size());
  }
  EXPECT_EQ(Refusal("rover", "mass_kg: 7.3", "mass_kg: 7.5"), "");
}

TEST(VehicleFile, ShippedSchemaIsThatOfTheReader) {
  EXPECT_EQ(TextOfFile(kFolder + "/../vehicle.schema.json"), VehicleSchema())
      << "grouser-vehicle schema > surrogate/vehicle/vehicle.schema.json";
}

// A hard ground from a model file is the one that the vehicle file spells out.
TEST(VehicleFile, TakesHardGroundAsAModelFile) {
  const std::string folder = ::testing::TempDir();
  const VehicleFile spelled = ReadVehicle(kFolder + "/husky.vehicle.yaml");
  v1alpha1::Model message;
  message.set_name("tyre-asphalt");
  message.set_kind(v1alpha1::MODEL_KIND_HARD);
  message.mutable_wheel()->set_radius_m(0.165);
  message.mutable_wheel()->set_width_m(0.114);
  message.mutable_soil()->set_gravity_m_per_s2(9.81);
  message.mutable_domain()->set_load_min_n(1);
  message.mutable_domain()->set_load_max_n(1000);
  const auto* asphalt = dynamic_cast<const surrogate::HardGroundModel*>(spelled.grounds.At(0, 0));
  ASSERT_NE(asphalt, nullptr);
  surrogate::SetHard(asphalt->ground(), &message);
  surrogate::SetGoldenVectors(&message);
  surrogate::WriteTestedModel(folder + "/grouser_hard.model", message);
  std::string text = TextOfFile(kFolder + "/husky.vehicle.yaml");
  text.replace(text.find("grounds:\n"), std::string::npos,
               "grounds:\n  - {soil: asphalt, wheel: tyre, model: grouser_hard.model}\n");
  std::ofstream(folder + "/grouser_hard.vehicle.yaml") << text;
  const VehicleFile file = ReadVehicle(folder + "/grouser_hard.vehicle.yaml");
  const Motion motion = Motion::OnPath(0.5, 0.4);
  Solution a, b;
  Solver(spelled.vehicle, spelled.grounds).Solve({&motion, 1}, {&a, 1});
  Solver(file.vehicle, file.grounds).Solve({&motion, 1}, {&b, 1});
  EXPECT_TRUE(b.balanced);
  EXPECT_EQ(b.reasons, a.reasons);
  EXPECT_EQ(b.electric_power_w, a.electric_power_w);
  EXPECT_EQ(b.v_y_m_per_s, a.v_y_m_per_s);
}

const Changes kMoonRover = {{"mass_kg: 7.3", "mass_kg: 7.3\ngravity_m_per_s2: 1.62"},
                            {"radius_m: 0.0625, width_m: 0.05", "radius_m: 0.125, width_m: 0.1"},
                            {"hybrid.model}", "hybrid.model, scaled: true}"}};

// All of a rover twice as large under lunar gravity: the same slips, forces by the units.
TEST(VehicleFile, AScaledGroundMakesASimilarVehicle) {
  const VehicleFile earth = ReadVehicle(kFolder + "/rover.vehicle.yaml");
  const VehicleFile moon = ReadVehicle(Changed("rover", kMoonRover));
  EXPECT_NE(moon.sources[0].find(", scaled"), std::string::npos);
  const double l = 2, g = 1.62 / 9.81, force = g * l * l * l;
  Vehicle similar = moon.vehicle;
  similar.mass_kg *= l * l * l;
  similar.yaw_inertia_kg_m2 *= l * l * l * l * l;
  for (double* x : {&similar.centre_x_m, &similar.centre_y_m, &similar.centre_z_m}) *x *= l;
  for (Wheel& wheel : similar.wheels) {
    wheel.x_m *= l;
    wheel.y_m *= l;
  }
  similar.steering.centre_x_m *= l;
  similar.steering.length_m *= l;
  const Motion motion = Motion::OnPath(0.08, 0.5);
  const Motion likewise = Motion::OnPath(0.08 * std::sqrt(g * l), 0.5 / l);
  Solution a, b;
  const Effort tight{.goal = 1e-10};
  Solver(earth.vehicle, earth.grounds).Solve({&motion, 1}, {&a, 1}, tight);
  Solver(similar, moon.grounds).Solve({&likewise, 1}, {&b, 1}, tight);
  ASSERT_TRUE(a.balanced && b.balanced);
  EXPECT_EQ(a.reasons & kUntrained, b.reasons & kUntrained);
  const double weight = 7.3 * 9.81;
  for (std::size_t i = 0; i < similar.wheels.size(); ++i) {
    EXPECT_NEAR(b.wheel[i].f_x_n / force, a.wheel[i].f_x_n, 1e-5 * weight);
    EXPECT_NEAR(b.wheel[i].torque_n_m / (force * l), a.wheel[i].torque_n_m, 1e-6 * weight);
    EXPECT_NEAR(b.wheel[i].sinkage_m / l, a.wheel[i].sinkage_m, 1e-6);
    EXPECT_NEAR(b.wheel[i].slip, a.wheel[i].slip, 1e-4);
  }
}

TEST(VehicleFile, RefusesAScaledGroundThatIsNotSimilar) {
  Changes wider = kMoonRover;
  wider[1].second = "radius_m: 0.125, width_m: 0.05";
  EXPECT_NE(Refusal("rover", wider).find("the same ratio of both"), std::string::npos);
  Changes plain = kMoonRover;
  plain[2].second = "hybrid.model, scaled: false}";
  EXPECT_NE(Refusal("rover", plain).find("scaled: true"), std::string::npos);
  EXPECT_NE(Refusal("rover", "hard: {friction", "scaled: true, hard: {friction").find("scaled"),
            std::string::npos);
}

// No model of a soil was run on a slope; hard ground is a law of forces over load.
TEST(VehicleFile, WheelsOfSoilOnASlopeSaySo) {
  const VehicleFile file = ReadVehicle(kFolder + "/rover.vehicle.yaml");
  Solver solver(file.vehicle, file.grounds);
  const auto flagged = [&](std::uint8_t soil, double grade, double bank) {
    Motion motion = Motion::OnPath(0.08, 0);
    motion.soil.fill(soil);
    motion.grade_rad = grade;
    motion.bank_rad = bank;
    Solution s;
    solver.Solve({&motion, 1}, {&s, 1});
    EXPECT_TRUE(s.balanced);
    return (s.wheel[0].flags & surrogate::kSlope) != 0;
  };
  EXPECT_FALSE(flagged(0, 0, 0));
  EXPECT_TRUE(flagged(0, 0.02, 0));
  EXPECT_TRUE(flagged(0, 0, -0.02));
  EXPECT_FALSE(flagged(1, 0.02, 0.02));
}

// A soil that is one of others: the solver's own mixture, also where one is certain.
TEST(VehicleFile, MixturesAreSoilsOfTheirOwn) {
  const std::string rover = "mass_kg: 7.3";
  const VehicleFile file = ReadVehicle(Changed(
      "rover", {{rover, rover + "\nmixtures:\n  - {soil: either, of: {dry_sand: 3, floor: 1}}\n"
                                "  - {soil: sand, of: {floor: 0, dry_sand: 0.2}}"}}));
  ASSERT_EQ(file.grounds.soils.size(), 4u);
  EXPECT_EQ(file.grounds.soils[2], "either");
  Motion motion = Motion::OnPath(0.08, 0.5);
  motion.worse_by_sd = 1;
  std::array<Solution, 4> on;
  for (std::size_t s = 0; s < 4; ++s) {
    motion.soil.fill(static_cast<std::uint8_t>(s));
    Solver(file.vehicle, file.grounds).Solve({&motion, 1}, {&on[s], 1});
    ASSERT_TRUE(on[s].balanced) << s;
  }
  EXPECT_NEAR(on[3].shaft_power_w, on[0].shaft_power_w, 1e-6 * std::fabs(on[0].shaft_power_w));
  const double low = std::fmin(on[0].wheel[0].sinkage_m, on[1].wheel[0].sinkage_m);
  const double high = std::fmax(on[0].wheel[0].sinkage_m, on[1].wheel[0].sinkage_m);
  EXPECT_GT(on[2].wheel[0].sinkage_m, low);
  EXPECT_LT(on[2].wheel[0].sinkage_m, high);
  EXPECT_EQ(on[2].wheel[0].flags, on[2].wheel[0].flags | on[0].wheel[0].flags);
}

// A draw of a mixture is that draw of one of its soils under all wheels, to the last bit.
TEST(VehicleFile, ADrawOfAMixtureIsThatOfOneOfItsSoils) {
  VehicleFile file = ReadVehicle(kFolder + "/husky.vehicle.yaml");
  const auto soil = [&](const char* name) {
    const auto& soils = file.grounds.soils;
    return static_cast<std::size_t>(std::ranges::find(soils, name) - soils.begin());
  };
  const std::size_t alone = AddMixture("alone", {{"ice", 0}, {"asphalt", 1}}, &file);
  const std::size_t either = AddMixture("either", {{"asphalt", 3}, {"ice", 1}}, &file);
  constexpr int kCount = 200;
  Solver solver(file.vehicle, file.grounds);
  solver.UseDraws(std::make_shared<const GroundDraws>(file.grounds, kCount));
  const auto on = [&](std::size_t s) {
    std::vector<Motion> motions(kCount, Motion::OnPath(0.5, 0.4));
    for (int k = 0; k < kCount; ++k) {
      motions[static_cast<std::size_t>(k)].draw = k;
      motions[static_cast<std::size_t>(k)].soil.fill(static_cast<std::uint8_t>(s));
    }
    std::vector<Solution> out(kCount);
    solver.Solve(motions, out);
    return out;
  };
  const auto same = [](const Solution& a, const Solution& b) {
    bool all = a.shaft_power_w == b.shaft_power_w && a.v_y_m_per_s == b.v_y_m_per_s;
    for (std::size_t i = 0; i < 4; ++i) {
      all = all && a.wheel[i].torque_n_m == b.wheel[i].torque_n_m &&
            a.wheel[i].f_x_n == b.wheel[i].f_x_n;
    }
    return all;
  };
  const auto asphalt = on(soil("asphalt")), ice = on(soil("ice")), of_alone = on(alone),
             of_either = on(either);
  int firm = 0;
  for (std::size_t k = 0; k < kCount; ++k) {
    EXPECT_TRUE(same(of_alone[k], asphalt[k])) << k;
    const bool is_firm = same(of_either[k], asphalt[k]);
    EXPECT_TRUE(is_firm || same(of_either[k], ice[k])) << k;
    firm += is_firm;
  }
  EXPECT_NEAR(firm, 150, 4.5 * std::sqrt(200 * 0.75 * 0.25));
}

// Hard ground tells no gravity, and needs none: also the first ground of a vehicle that names none.
TEST(VehicleFile, TakesAScaledHardGroundWithoutGravity) {
  const std::string folder = ::testing::TempDir();
  v1alpha1::Model message;
  message.set_name("tyre-floor");
  message.set_kind(v1alpha1::MODEL_KIND_HARD);
  message.mutable_wheel()->set_radius_m(0.33);
  message.mutable_wheel()->set_width_m(0.228);
  message.mutable_domain()->set_load_min_n(1);
  message.mutable_domain()->set_load_max_n(1000);
  surrogate::SetHard({.friction = 0.6,
                      .slip_stiffness = 9,
                      .rolling_resistance = 0.02,
                      .contact_length_m = 0.08,
                      .contact_width_m = 0.1},
                     &message);
  surrogate::SetGoldenVectors(&message);
  surrogate::WriteTestedModel(folder + "/grouser_no_gravity.model", message);
  const std::string text = TextOfFile(kFolder + "/husky.vehicle.yaml");
  const std::string scaled =
      "grounds:\n  - {soil: wood, wheel: tyre, model: grouser_no_gravity.model, scaled: true}\n";
  const std::string file = folder + "/grouser_no_gravity.vehicle.yaml";
  std::ofstream(file) << text.substr(0, text.find("grounds:\n")) << scaled;
  const VehicleFile read = ReadVehicle(file);
  EXPECT_EQ(read.vehicle.gravity_m_per_s2, Vehicle{}.gravity_m_per_s2);
  const surrogate::VelocityState sliding{0.1, 0, 1};
  EXPECT_NEAR(surrogate::AnswerOf(*read.grounds.At(0, 0), sliding, 100).value[surrogate::kFx], 60,
              1e-9);
}

TEST(VehicleFile, NamesWhatIsWrongWithAMixture) {
  const auto expect = [](const std::string& mixture, const char* what) {
    const std::string got =
        Refusal("rover", "mass_kg: 7.3", "mass_kg: 7.3\nmixtures:\n  - {" + mixture + "}");
    EXPECT_NE(got.find(what), std::string::npos) << mixture << "\n  " << got;
    EXPECT_NE(got.find("mixtures"), std::string::npos) << got;
  };
  expect("soil: x, of: {dry_sant: 1}", "dry_sand");
  expect("soil: x, of: {dry_sand: -1}", "-1");
  expect("soil: x, of: {dry_sand: .nan}", "nan");
  expect("soil: x, of: {dry_sand: 0, floor: 0}", "sum 0");
  expect("soil: floor, of: {dry_sand: 1}", "another name");
  expect("soil: x, of: {}", "of");
  expect("soil: x, of: dry_sand", "of");
}

TEST(VehicleFile, NamesWhatIsWrong) {
  const auto expect = [](const std::string& name, const std::string& from, const std::string& to,
                         const std::string& what) {
    const std::string got = Refusal(name, from, to);
    EXPECT_NE(got.find(what), std::string::npos) << to << "\n  " << got;
    EXPECT_NE(got.find("grouser_vehicle_file_test.yaml"), std::string::npos) << got;
  };
  expect("husky", "mass_kg: 70", "mass_kg: -1", "mass_kg");
  expect("husky", "mass_kg: 70", "mass_kg: .nan", "mass_kg");
  expect("husky", "mass_kg: 70", "mas_kg: 70", "mass_kg");
  expect("husky", "coupling: locked", "coupling: chain", "locked, differential or independent");
  expect("husky", "type: tyre, at_m", "type: tyrE, at_m", "such as tyre");
  expect("husky", "hard: {friction: 0.7", "hard: {friction: 0", "friction");
  expect("husky", "[0.256, 0.2854]", "[0.256, -0.2854]", "the place of");
  expect("husky", "centre_m: [0, 0, 0.25]", "centre_m: [2, 0, 0.25]", "between the wheels");
  expect("rover", "radius_m: 0.0625", "radius_m: 0.1", "radius 0.0625");
  expect("rover", "mass_kg: 7.3", "mass_kg: 7.3\ngravity_m_per_s2: 1.62", "gravity 9.8");
  expect("rover", "hybrid.model", "missing.model", "missing.model");
  expect("cart", "soil: ice", "soil: asphalt", "one model for a wheel and soil");
}

}  // namespace
}  // namespace grouser::vehicle
