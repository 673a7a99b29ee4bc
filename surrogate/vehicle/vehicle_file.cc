#include "surrogate/vehicle/vehicle_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/similar_wheel.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/vehicle/mixture_ground.h"
#include "surrogate/vehicle/vehicle_keys.h"
#include "surrogate/vehicle/yaml.h"

namespace grouser::vehicle {
namespace {

using yaml::YamlSection;

template <class T>
void ReadNumbers(YamlSection* from, std::span<const NumberKey<T>> keys, T* to) {
  using Range = typename NumberKey<T>::Range;
  for (const NumberKey<T>& k : keys) {
    const yaml::Range range = k.range == Range::kPositive      ? yaml::kPositive
                              : k.range == Range::kNonNegative ? yaml::kNonNegative
                                                               : yaml::Range{};
    if (k.required || from->Has(k.key)) to->*k.member = from->Number(k.key, range);
  }
}

// The index of a named entry; refuses an unknown name with the nearest one.
template <class T>
std::size_t IndexOf(YamlSection* from, const char* key, const std::vector<T>& entries) {
  const std::string name = from->Text(key);
  std::vector<std::string> names;
  for (const T& e : entries) names.push_back(e.name);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  from->Fail(key, name, "one that stands in this file, such as " + yaml::NearestOf(name, names));
}

bool Yes(YamlSection* from, const char* key) {
  if (!from->Has(key)) return false;
  const std::string text = from->Text(key);
  if (text != "true" && text != "false") from->Fail(key, text, "true or false");
  return text == "true";
}

template <class T>
void RefuseTwice(const YamlSection& from, const std::vector<T>& entries) {
  for (const T& e : entries) {
    if (&e != &entries.back() && e.name == entries.back().name) {
      from.Fail("name", e.name, "a name that stands there once");
    }
  }
}

void ReadDrives(YamlSection* file, Vehicle* v) {
  for (YamlSection& s : file->Sections("drives")) {
    Drive drive;
    drive.name = s.Text("name");
    const std::string coupling = s.Text("coupling");
    const auto* found = std::find(std::begin(kCouplingNames), std::end(kCouplingNames), coupling);
    if (found == std::end(kCouplingNames)) {
      s.Fail("coupling", coupling, "locked, differential or independent");
    }
    drive.coupling = static_cast<Coupling>(found - std::begin(kCouplingNames));
    if (s.Has("motor")) {
      YamlSection motor = s.Section("motor");
      ReadNumbers(&motor, MotorKeys(), &drive.motor);
      motor.Finish();
    }
    s.Finish();
    v->drives.push_back(drive);
    RefuseTwice(s, v->drives);
  }
}

void ReadWheels(YamlSection* file, Vehicle* v) {
  std::map<std::string, int> bogies;
  for (YamlSection& s : file->Sections("wheel_types")) {
    WheelType type;
    type.name = s.Text("name");
    ReadNumbers(&s, WheelTypeKeys(), &type);
    s.Finish();
    v->wheel_types.push_back(type);
    RefuseTwice(s, v->wheel_types);
  }
  for (YamlSection& s : file->Sections("wheels")) {
    Wheel wheel;
    wheel.name = s.Text("name");
    wheel.type = IndexOf(&s, "type", v->wheel_types);
    const std::vector<double> at = s.Tuple("at_m", 2);
    wheel.x_m = at[0];
    wheel.y_m = at[1];
    if (s.Has("drive")) wheel.drive = static_cast<int>(IndexOf(&s, "drive", v->drives));
    wheel.steered = Yes(&s, "steered");
    if (s.Has("bogie")) {
      wheel.bogie =
          bogies.try_emplace(s.Text("bogie"), static_cast<int>(bogies.size())).first->second;
    }
    ReadNumbers(&s, WheelKeys(), &wheel);
    s.Finish();
    v->wheels.push_back(wheel);
    RefuseTwice(s, v->wheels);
  }
}

bool Differ(double a, double b) { return std::fabs(a - b) > 0.01 * std::fabs(b); }

// Refuses a model of another wheel. A similar one (key scaled) may be of another radius.
void CheckWheel(YamlSection* s, const v1alpha1::Wheel& own, const WheelType& wheel, bool scaled) {
  const double length = scaled ? wheel.radius_m / own.radius_m() : 1;
  if (!Differ(length * own.radius_m(), wheel.radius_m) &&
      !Differ(length * own.width_m(), wheel.width_m)) {
    return;
  }
  const std::string is = "a wheel of radius " + std::to_string(own.radius_m()) + " m and width " +
                         std::to_string(own.width_m()) + " m";
  s->Fail("model", is,
          scaled ? "one that is similar to type " + wheel.name + ": with the same ratio of both"
                 : "that of type " + wheel.name + "; a similar one: scaled: true");
}

// A model from its file, checked against the wheel and the gravity of the others.
std::unique_ptr<const surrogate::WheelModel> OpenModel(YamlSection* s, const WheelType& wheel,
                                                       bool scaled, double* gravity) {
  const std::filesystem::path file =
      std::filesystem::path(s->file()).parent_path() / s->Text("model");
  try {
    const v1alpha1::Model model = surrogate::ReadModel(file.string()).model;
    CheckWheel(s, model.wheel(), wheel, scaled);
    const double g = model.soil().gravity_m_per_s2();
    const bool any = g == 0 && model.kind() == v1alpha1::MODEL_KIND_HARD;  // gravity will do
    if (!scaled && !any && *gravity > 0 && Differ(g, *gravity)) {
      s->Fail("model", "gravity " + std::to_string(g) + " m/s^2",
              std::to_string(*gravity) +
                  ", that of the vehicle and its other models; of dry soil: scaled: true");
    }
    if (!(*gravity > 0)) *gravity = g;
    if (!scaled) return surrogate::MakeModel(model);
    // Of hard ground, which tells none, gravity does not count.
    const double at = *gravity > 0 ? *gravity : Vehicle{}.gravity_m_per_s2;
    const surrogate::Similarity by = surrogate::SimilarityTo(model, wheel.radius_m, at);
    return surrogate::MakeScaled(model, surrogate::MakeModel(model), by);
  } catch (const yaml::InputError&) {
    throw;
  } catch (const std::exception& error) {
    s->Fail("model", file.string() + " (" + error.what() + ")", "a model file");
  }
}

void ReadGrounds(YamlSection* file, double gravity, VehicleFile* out) {
  struct Entry {
    std::size_t soil, type;
    const surrogate::WheelModel* model;
  };
  std::vector<Entry> entries;
  Grounds& grounds = out->grounds;
  for (YamlSection& s : file->Sections("grounds")) {
    const std::string soil = s.Text("soil");
    const std::size_t type = IndexOf(&s, "wheel", out->vehicle.wheel_types);
    const WheelType& wheel = out->vehicle.wheel_types[type];
    if (s.Has("model") == s.Has("hard")) {
      s.Fail("model", s.Has("model") ? "model and hard" : "neither", "model or hard");
    }
    if (s.Has("scaled") && !s.Has("model")) s.Fail("scaled", "it beside hard", "it beside model");
    std::string what;
    bool scaled = false;
    if (s.Has("model")) {
      what = s.Text("model");
      scaled = Yes(&s, "scaled");
      out->models.push_back(OpenModel(&s, wheel, scaled, &gravity));
    } else {
      YamlSection hard = s.Section("hard");
      surrogate::HardGround ground;
      ReadNumbers(&hard, HardKeys(), &ground);
      hard.Finish();
      what = "hard";
      out->models.push_back(std::make_unique<surrogate::HardGroundModel>(ground, wheel.radius_m));
    }
    s.Finish();
    const auto found = std::find(grounds.soils.begin(), grounds.soils.end(), soil);
    const auto index = static_cast<std::size_t>(found - grounds.soils.begin());
    if (found == grounds.soils.end()) grounds.soils.push_back(soil);
    for (const Entry& e : entries) {
      if (e.soil == index && e.type == type) s.Fail("soil", soil, "one model for a wheel and soil");
    }
    entries.push_back({index, type, out->models.back().get()});
    out->sources.push_back(soil + ": " + wheel.name + ": " + what + (scaled ? ", scaled" : ""));
  }
  if (grounds.soils.size() > kMostSoils) {
    const std::string most = std::to_string(kMostSoils);
    file->Fail("grounds", "over " + most + " soils", most + " at most");
  }
  if (gravity > 0) out->vehicle.gravity_m_per_s2 = gravity;
  grounds.models.assign(out->vehicle.wheel_types.size() * grounds.soils.size(), nullptr);
  for (const Entry& e : entries) grounds.models[e.type * grounds.soils.size() + e.soil] = e.model;
}

}  // namespace

VehicleFile ReadVehicle(const std::string& path) {
  YamlSection file = YamlSection::Load(path);
  VehicleFile out;
  Vehicle& v = out.vehicle;
  v.name = file.Text("name");
  if (file.Has("sources")) file.Values("sources");
  v.gravity_m_per_s2 = 0;
  ReadNumbers(&file, VehicleKeys(), &v);
  const double gravity = v.gravity_m_per_s2;
  v.gravity_m_per_s2 = gravity > 0 ? gravity : Vehicle{}.gravity_m_per_s2;
  const std::vector<double> centre = file.Tuple("centre_m", 3);
  v.centre_x_m = centre[0];
  v.centre_y_m = centre[1];
  v.centre_z_m = centre[2];
  ReadDrives(&file, &v);
  ReadWheels(&file, &v);
  if (file.Has("steering")) {
    YamlSection steering = file.Section("steering");
    ReadNumbers(&steering, SteeringKeys(), &v.steering);
    steering.Finish();
  }
  ReadGrounds(&file, gravity, &out);
  ReadMixtures(&file, &out);
  file.Finish();
  try {
    Check(v);
  } catch (const std::invalid_argument& error) {
    throw yaml::InputError(path + ": " + error.what());
  }
  return out;
}

}  // namespace grouser::vehicle
