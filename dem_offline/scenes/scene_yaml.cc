#include "dem_offline/scenes/scene_yaml.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "dem_offline/scenes/engine_convert.h"
#include "proto/records/yaml/message_yaml.h"
#include "proto/records/yaml/neighbour.h"

namespace grouser::campaign {
namespace {

using records::ReadNumbers;
using records::ReadOptional;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::uint64_t kMostCount = 1000000000;

void ReadSizes(YamlSection& grains, v1alpha1::GrainSoil* out) {
  for (YamlSection& bin : grains.Sections("sizes")) {
    ReadNumbers(bin, {"diameter_m", "mass_fraction"}, out->add_sizes());
    bin.Finish();
  }
}

/// Settings of single laws stand under the law's name.
template <class Message>
void ReadSettings(YamlSection& contact, Message* out) {
  for (const dem::LawEntry& law : dem::LawRegistry()) {
    if (law.settings.empty() || !contact.Has(law.name)) continue;
    YamlSection section = contact.Section(law.name);
    for (const dem::NamedSetting& known : law.settings) {
      if (!section.Has(known.name)) continue;
      auto* setting = out->add_settings();
      setting->set_law(law.name);
      setting->set_name(known.name);
      setting->set_value(section.Number(known.name));
    }
    section.Finish();
  }
}

/// What differs at the wheel or the floor.
void ReadInterface(YamlSection section, v1alpha1::InterfaceLaws* out) {
  ReadOptional(section, {"rolling_damping", "surface_energy_j_per_m2"}, out);
  ReadSettings(section, out);
  section.Finish();
}

/// Laws by name; those left out keep the defaults of the engine.
void ReadContact(YamlSection contact, v1alpha1::ContactLaws* out) {
  const dem::ContactChoice usual;
  out->set_normal(contact.TextOr("normal", usual.normal));
  out->set_tangential(contact.TextOr("tangential", usual.tangential));
  out->set_rolling(contact.TextOr("rolling", usual.rolling));
  out->set_cohesion(contact.TextOr("cohesion", usual.cohesion));
  out->set_rolling_damping(contact.NumberOr("rolling_damping", usual.rolling_damping));
  out->set_surface_energy_j_per_m2(
      contact.NumberOr("surface_energy_j_per_m2", usual.surface_energy_j_per_m2));
  using Changed = dem::HertzOdenMartins;
  if (out->normal() == Changed::kName &&
      !(contact.Has(Changed::kName) && contact.Section(Changed::kName).Has("damping_kg_per_m_s"))) {
    // Here and not by the engine alone: an old file's settings are unknown keys by now.
    contact.Fail("normal", out->normal() + " without its damping_kg_per_m_s", Changed::kChanged);
  }
  ReadSettings(contact, out);
  if (contact.Has("wheel")) ReadInterface(contact.Section("wheel"), out->mutable_wheel());
  if (contact.Has("floor")) ReadInterface(contact.Section("floor"), out->mutable_floor());
  if (contact.Has("rolling_damping") && out->rolling() != "epsd") {
    contact.Fail("rolling_damping", "it with rolling: " + out->rolling(), "rolling: epsd");
  }
  contact.Finish();
}

/// Of a section that has it.
void ReadPreparation(YamlSection& section, v1alpha1::BedPreparation* out) {
  YamlSection preparation = section.Section("preparation");
  ReadOptional(preparation, {"friction", "rolling_friction"}, out);
  preparation.Finish();
}

void ReadGrains(YamlSection grains, double bulk_density, v1alpha1::GrainSoil* out) {
  ReadNumbers(grains,
              {"grain_density_kg_per_m3", "youngs_modulus_pa", "poisson_ratio", "restitution",
               "friction", "rolling_friction", "solid_fraction"},
              out);
  ReadSizes(grains, out);
  if (grains.Has("preparation")) ReadPreparation(grains, out->mutable_preparation());
  if (grains.Has("top_layer")) {
    YamlSection top = grains.Section("top_layer");
    ReadNumbers(top, {"thickness_m", "solid_fraction"}, out->mutable_top_layer());
    if (top.Has("preparation")) {
      ReadPreparation(top, out->mutable_top_layer()->mutable_preparation());
    }
    top.Finish();
  }
  if (grains.Has("contact")) ReadContact(grains.Section("contact"), out->mutable_contact());
  grains.Finish();
  const double bulk = out->grain_density_kg_per_m3() * out->solid_fraction();
  if (std::abs(bulk / bulk_density - 1.0) > 0.01) {
    grains.Fail("grain_density_kg_per_m3",
                fmt::format("{} (times solid_fraction {} = {:.1f})", out->grain_density_kg_per_m3(),
                            out->solid_fraction(), bulk),
                fmt::format("{:.1f}, so that the product is soil.bulk_density_kg_per_m3 = {}",
                            bulk_density / out->solid_fraction(), bulk_density));
  }
}

void TakeSoil(YamlSection soil, v1alpha1::Soil* out) {
  out->set_name(soil.Text("name"));
  out->set_bulk_density_kg_per_m3(soil.Number("bulk_density_kg_per_m3", kPositive));
  out->set_gravity_m_per_s2(soil.Number("gravity_m_per_s2"));
  out->set_source(soil.Text("source"));
  ReadGrains(soil.Section("grains"), out->bulk_density_kg_per_m3(), out->mutable_grains());
  soil.Finish();
}

v1alpha1::SceneBed ReadBed(YamlSection& section, const std::string& key) {
  const std::string word = section.Text(key);
  if (word == "periodic") return v1alpha1::SCENE_BED_PERIODIC;
  if (word == "full") return v1alpha1::SCENE_BED_FULL;
  if (word == "window") return v1alpha1::SCENE_BED_WINDOW;
  section.Fail(key, "'" + word + "'", "one of: periodic, full, window");
}

bool ReadSwitch(YamlSection& section, const std::string& key, bool otherwise) {
  const std::string word = section.TextOr(key, otherwise ? "on" : "off");
  if (word != "on" && word != "off") section.Fail(key, "'" + word + "'", "on or off");
  return word == "on";
}

/// `scene: window`, or a mapping with `bed` and more; what is left out keeps
/// the defaults of the engine.
void ReadSceneChoice(YamlSection& rig, v1alpha1::SceneChoice* out) {
  const dem::SceneSettings usual;
  out->set_window_ahead(usual.window_ahead);
  out->set_freeze_box(usual.freeze_box);
  out->set_freeze_speed(usual.freeze_speed);
  out->set_look_steps(static_cast<std::uint32_t>(usual.look_steps));
  if (rig.IsText("scene")) {
    out->set_bed(ReadBed(rig, "scene"));
    return;
  }
  YamlSection scene = rig.Section("scene");
  out->set_bed(ReadBed(scene, "bed"));
  if (out->bed() == v1alpha1::SCENE_BED_WINDOW) {
    out->set_window_length_m(scene.NumberOr("window_length_m", 0));
    out->set_window_ahead(scene.NumberOr("window_ahead", usual.window_ahead));
  }
  out->set_freeze(ReadSwitch(scene, "freeze", usual.freeze));
  const auto needs = [&](const char* key, bool used, const char* what) {
    if (scene.Has(key) && !used) scene.Fail(key, "it without its use", what);
  };
  needs("freeze_box", out->freeze(), "freeze: on beside it");
  needs("freeze_speed", out->freeze(), "freeze: on beside it");
  needs("look_steps", out->freeze() || out->bed() == v1alpha1::SCENE_BED_WINDOW,
        "freeze: on or bed: window beside it");
  out->set_freeze_box(scene.NumberOr("freeze_box", usual.freeze_box));
  out->set_freeze_speed(scene.NumberOr("freeze_speed", usual.freeze_speed));
  out->set_look_steps(
      static_cast<std::uint32_t>(scene.CountOr("look_steps", usual.look_steps, 0, kMostCount)));
  out->set_largest_step(ReadSwitch(scene, "largest_step", usual.largest_step));
  scene.Finish();
}

void ReadRig(YamlSection rig, v1alpha1::RigSettings* out) {
  ReadNumbers(rig,
              {"bed_length_m", "bed_width_m", "bed_depth_m", "speed_m_per_s", "rayleigh_fraction",
               "target_relative_error"},
              out);
  ReadOptional(rig, {"max_time_s", "most_sinkage_m"}, out);
  if (rig.Has("travel")) {
    YamlSection travel = rig.Section("travel");
    ReadOptional(travel, {"least_hub_m", "compare_from_hub_m", "compare_to_hub_m"},
                 out->mutable_travel());
    travel.Finish();
  }
  out->set_stress_bin_rad(rig.Number("stress_bin_deg") * kDegree);
  out->set_width_bins(static_cast<std::uint32_t>(rig.Count("width_bins", 0, kMostCount)));
  if (rig.Has("scene")) ReadSceneChoice(rig, out->mutable_scene());
  rig.Finish();
}

/// The engine knows the ranges and what fits what; its complaint goes to the line of
/// the field it names. How much work is too much is said where runs are started.
void CheckWithEngine(const YamlSection& section, const v1alpha1::Scene& scene) {
  v1alpha1::WheelTestSpec spec;
  *spec.mutable_soil() = scene.soil();
  *spec.mutable_wheel() = scene.wheel();
  *spec.mutable_rig() = scene.rig();
  constexpr double kAny = std::numeric_limits<double>::max();
  try {
    dem::ValidateRig(ToEngine(spec), {.bytes = kAny, .steps = kAny, .grain_steps = kAny});
  } catch (const dem::SpecError& error) {
    section.FailAtPath(error.field(), error.got(), error.expected());
  }
}

}  // namespace

v1alpha1::Soil ReadSoil(YamlSection section) {
  v1alpha1::Soil soil;
  TakeSoil(std::move(section), &soil);
  return soil;
}

v1alpha1::Scene ReadScene(YamlSection section, const std::string& soil_file,
                          const std::string& within) {
  v1alpha1::Scene scene;
  scene.set_name(section.Text("name"));
  std::string soil = soil_file;
  if (soil.empty() && section.IsText("soil")) soil = records::NeighbourOf(section, "soil", within);
  if (soil.empty()) {
    TakeSoil(section.Section("soil"), scene.mutable_soil());
  } else {
    section.Has("soil");  // known, though another stands for it
    TakeSoil(YamlSection::Load(soil), scene.mutable_soil());
  }
  records::ReadWheel(section.Section("wheel"), /*with_contact=*/true, scene.mutable_wheel());
  ReadRig(section.Section("rig"), scene.mutable_rig());
  section.Finish();
  CheckWithEngine(section, scene);
  return scene;
}

v1alpha1::Scene LoadScene(const std::string& file, const std::string& soil_file,
                          const std::string& within) {
  return ReadScene(YamlSection::Load(file), soil_file, within);
}

}  // namespace grouser::campaign
