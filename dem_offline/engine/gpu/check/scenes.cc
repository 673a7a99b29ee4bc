#include <random>
#include <type_traits>

#include "dem_offline/engine/gpu/check/check.h"
#include "dem_offline/engine/laws/settings.h"

namespace grouser::dem::gpu::check {
namespace {

constexpr int kAlong = 16, kAcross = 12;  // grains of a layer
constexpr double kPitch = 0.00214;        // [m]
constexpr double kRadius = 0.00108, kPlay = 4e-5;

std::vector<GrainState> Layers(std::uint64_t seed, int layers) {
  std::mt19937_64 random(seed);
  const auto u = [&] { return 2 * (static_cast<double>(random() >> 11) * 0x1.0p-53) - 1; };
  std::vector<GrainState> grains;
  for (int k = 0; k < kAlong * kAcross * layers; ++k) {
    GrainState g = {};
    g.x_m = (k % kAlong + 0.5) * kPitch + 1e-4 * u();
    g.y_m = (k / kAlong % kAcross + 0.5) * kPitch + 1e-4 * u();
    g.z_m = 0.00197 * (k / (kAlong * kAcross)) + kRadius;
    g.radius_m = kRadius + kPlay * u();
    g.density_kg_per_m3 = 2600;
    g.v_x = 0.02 * u();
    g.v_y = 0.02 * u();
    grains.push_back(g);
  }
  return grains;
}

WorldConfig Config(const ContactModel& contacts) {
  WorldConfig c;
  c.frame = {kAlong * kPitch, kAcross * kPitch, 1.0};
  c.gravity_m_per_s2 = {0, 0, 0};
  c.dt_s = 8e-6;
  c.contacts = contacts;
  return c;
}

const Elastic kSand = {1e7, 0.3};
constexpr int kWheelMaterial = 2;

ContactModel Contacts(const LawChoice& laws, double surface_energy) {
  const ContactProperties f = {.restitution = 0.5,
                               .friction = 0.4,
                               .rolling_friction = 0.1,
                               .surface_energy_j_per_m2 = surface_energy};
  LawSettings settings;
  SettingsOf<HertzOdenMartins>(settings).damping_kg_per_m_s = 1e3;
  return OneMaterial(kSand, f, laws, settings);
}

template <class... R>
void AddCombinations(CombinationList<R...>, std::vector<NamedContacts>* out) {
  int number = 0;
  (out->push_back({CombinationName(number++), Contacts(ChoiceOf<R>(), 0.02)}), ...);
}

/// A bed on a floor.
Contents OnFloor(std::uint64_t seed, int layers) {
  Contents in;
  in.grains = Layers(seed, layers);
  const double up[3] = {0, 0, 1};
  Body floor;
  floor.shape = HalfSpace(up);
  in.bodies = {floor};
  return in;
}
WorldConfig FloorConfig() {
  ContactModel contacts;
  contacts.AddMaterial(kSand);
  contacts.AddMaterial({kRigid, 0.0});
  contacts.SetContactProperties(0, 0, {0.5, 0.5, 0.1});
  contacts.SetContactProperties(0, 1, {0.4, 0.3, 0.1});
  contacts.AddMaterial({kRigid, 0.0});  // the wheel: other numbers than the floor
  LawSettings at_wheel;
  Put(at_wheel, {"hertz_restitution", "critical_damping_share", 0.5});
  contacts.SetContactProperties(0, kWheelMaterial, {0.4, 0.6, 0.2, 0.8}, at_wheel);
  WorldConfig c = Config(contacts);
  c.gravity_m_per_s2 = {0, 0, -9.81};
  return c;
}

}  // namespace

std::unique_ptr<World> Jostling(std::uint64_t seed, const ContactModel& contacts, int layers) {
  std::vector<GrainState> grains = Layers(seed, layers);
  const int layer = kAlong * kAcross;
  for (int k = 0; k < static_cast<int>(grains.size()); ++k) {
    GrainState& g = grains[k];
    const bool low = k < layer, high = k >= layer * (layers - 1);
    g.glued = low || high;
    if (!g.glued) continue;
    g.v_x = low ? -0.1 : 0.1;
    g.v_y = 0;
  }
  return std::make_unique<World>(Config(contacts), grains);
}

std::unique_ptr<World> UnderWheel(std::uint64_t seed, int layers) {
  Contents in = OnFloor(seed, layers);
  Tread t;
  t.count = 9;
  t.height_m = 0.0015;
  t.root_thickness_m = 0.0012;
  Body wheel;
  wheel.shape = TreadedWheel(0.008, 0.012, {t});
  wheel.material = kWheelMaterial;
  wheel.motion = BodyMotion::kPrescribed;
  wheel.position_m = {0.01, 0.5 * kAcross * kPitch, 0.00197 * layers + 0.0095};
  wheel.velocity_m_per_s = {0.25, 0, -0.1};
  wheel.spin_rad_per_s = {0, 45, 0};
  in.bodies.push_back(wheel);
  return std::make_unique<World>(FloorConfig(), in);
}

std::unique_ptr<World> UnderRubble(std::uint64_t seed, int layers) {
  Contents in = OnFloor(seed, layers);
  in.templates = {MakeClump({{{0, 0, 0}, 1e-3}, {{1e-3, 0, 0}, 8e-4}, {{0, 1e-3, 3e-4}, 9e-4}})};
  for (int k = 0; k < 40; ++k) {
    ClumpState s;
    s.density_kg_per_m3 = 2600;
    s.position_m = {0.002 + 0.004 * (k % 8), 0.002 + 0.0045 * (k / 8), 0.00197 * layers + 0.0022};
    s.orientation = {1, 0.1 * k, 0.3, -0.05 * k};
    s.velocity_m_per_s = {0.05, 0, -0.4};
    s.spin_rad_per_s = {3.0 * (k % 5), 0, -20};
    in.clumps.push_back(s);
  }
  return std::make_unique<World>(FloorConfig(), in);
}

std::unique_ptr<World> TwoGrains(double at, const ContactModel& contacts) {
  std::vector<GrainState> grains(2);
  for (int k = 0; k < 2; ++k) {
    GrainState& g = grains[k];
    g.x_m = 0.015 + (k == 0 ? -0.00101 : 0.00101);
    g.y_m = 0.012;
    g.z_m = k == 0 ? 0.0 : at * 0.001;
    g.radius_m = 0.001;
    g.density_kg_per_m3 = 2600;
    g.v_x = k == 0 ? 0.1 : -0.1;
    g.w_y = k == 0 ? 0 : 30;
  }
  return std::make_unique<World>(Config(contacts), grains);
}

std::vector<NamedContacts> AllContacts() {
  std::vector<NamedContacts> out;
  AddCombinations(CompiledCombinations{}, &out);
  const auto add = [&](const char* normal, const char* tangential, const char* rolling,
                       const char* cohesion) {
    const std::string name =
        std::string("generic: ") + normal + ", " + tangential + ", " + rolling + ", " + cohesion;
    out.push_back({name, Contacts(LawsByName(normal, tangential, rolling, cohesion), 0.02)});
  };
  add("hertz_restitution", "mindlin", "epsd", "jkr");
  add("hertz_restitution", "mindlin", "none", "capillary");
  add("walton_braun", "linear_history", "epsd", "none");
  return out;
}

}  // namespace grouser::dem::gpu::check
