// Files that are wrong: what, where, expected.
#include "surrogate/vehicle/vehicle_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/write_model.h"

namespace grouser::vehicle {
namespace {

const std::string kFolder = GROUSER_VEHICLES;

std::string TextOfFile(const std::string& path) {
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

// What reading the shipped file says with `from` replaced by `to`; "" if it is read.
std::string Refusal(const std::string& name, const std::string& from, const std::string& to) {
  std::string text = TextOfFile(kFolder + "/" + name + ".vehicle.yaml");
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  for (std::size_t p; (p = text.find("../../pairs")) != std::string::npos;) {
    text.replace(p, 11,
                 std::filesystem::path(kFolder).parent_path().parent_path().string() + "/pairs");
  }
  const std::string file = ::testing::TempDir() + "/grouser_vehicle_file_test.yaml";
  std::ofstream(file) << text;
  try {
    ReadVehicle(file);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(VehicleFile, ReadsWhatIsShipped) {
  for (const char* name : {"husky", "warthog", "atv", "rover", "cart"}) {
    const VehicleFile file = ReadVehicle(kFolder + "/" + name + ".vehicle.yaml");
    EXPECT_EQ(file.vehicle.name, name);
    EXPECT_EQ(file.models.size(), file.sources.size());
  }
  EXPECT_EQ(Refusal("rover", "mass_kg: 14.7", "mass_kg: 15"), "");
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
  expect("rover", "mass_kg: 14.7", "mass_kg: 14.7\ngravity_m_per_s2: 1.62", "gravity 9.8");
  expect("rover", "hybrid.model", "missing.model", "missing.model");
  expect("cart", "soil: ice", "soil: asphalt", "one model for a wheel and soil");
}

}  // namespace
}  // namespace grouser::vehicle
