#include "dem_offline/campaign/proposal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "dem_offline/campaign/design.h"
#include "dem_offline/campaign/draw.h"
#include "dem_offline/campaign/progress.h"
#include "dem_offline/engine/rig/kinematics.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/scenes/engine_convert.h"
#include "dem_offline/scenes/scene_yaml.h"
#include "proto/records/yaml/message_yaml.h"

namespace grouser::campaign {
namespace {

constexpr int kLeastRuns = 16, kEnoughRuns = 60, kMostRuns = 400, kPatchRuns = 4;
constexpr double kLeastWidthOverDiameter = 6;

int TilesFor(double runs) { return static_cast<int>(std::clamp(runs / 12, 4.0, 8.0)); }

double Millimetres(double m) { return std::ceil(1e3 * m - 1e-9) / 1e3; }

double TipOf(const v1alpha1::Wheel& wheel) {
  double tip = 0;
  for (const auto& tread : wheel.treads()) tip = std::max(tip, tread.height_m());
  return wheel.radius_m() + tip;
}

/// Largest mean diameter that the rules allow.
double CoarsestFor(const v1alpha1::Wheel& wheel) {
  double most = wheel.width_m() / kLeastWidthOverDiameter;
  for (const auto& tread : wheel.treads()) most = std::min(most, tread.height_m());
  return most;
}

/// The soil file with all its diameters times `factor`.
std::string ScaledSoil(const std::string& file, const v1alpha1::Soil& soil, double factor) {
  YamlSection section = YamlSection::Load(file);
  for (int i = 0; i < soil.grains().sizes_size(); ++i) {
    section.Set(fmt::format("grains.sizes[{}].diameter_m", i),
                fmt::format("{:.6g}", factor * soil.grains().sizes(i).diameter_m()));
  }
  return fmt::format("# {} with its grains times {:.4g}.\n{}\n",
                     std::filesystem::path(file).filename().string(), factor, section.Dump());
}

std::string TreadsText(const v1alpha1::Wheel& wheel) {
  std::string text;
  for (const auto& t : wheel.treads()) {
    text += fmt::format("    - {{count: {}, height_m: {:g}, root_thickness_m: {:g}", t.count(),
                        t.height_m(), t.root_thickness_m());
    if (t.tip_thickness_m() > 0)
      text += fmt::format(", tip_thickness_m: {:g}", t.tip_thickness_m());
    if (t.width_m() > 0) text += fmt::format(", width_m: {:g}", t.width_m());
    if (t.offset_m() != 0) text += fmt::format(", offset_m: {:g}", t.offset_m());
    if (t.lean_rad() != 0) {
      text += fmt::format(", lean_deg: {:g}", t.lean_rad() * 180 / std::numbers::pi);
    }
    text += "}\n";
  }
  return text.empty() ? "" : "  treads:\n" + text;
}

std::string SceneText(const std::string& name, const v1alpha1::Wheel& wheel, double diameter_m) {
  const double r = TipOf(wheel), sinkage = 0.35 * r;
  const double across = std::max(wheel.width_m(), 2 * std::sqrt(sinkage * (2 * r - sinkage)));
  std::string text = fmt::format(
      "# Written by grouser-dem campaign design.\nname: {0}\nsoil: {0}.soil.yaml\nwheel:\n"
      "  name: {1}\n  radius_m: {2:g}\n  width_m: {3:g}\n  restitution: {4:g}\n"
      "  friction: {5:g}\n  rolling_friction: {6:g}\n  source: {7}\n",
      name, wheel.name(), wheel.radius_m(), wheel.width_m(), wheel.restitution(), wheel.friction(),
      wheel.rolling_friction(), wheel.source().empty() ? "own wheel" : wheel.source());
  text += TreadsText(wheel);
  text += fmt::format(
      "rig:\n  bed_length_m: {:g}\n  bed_width_m: {:g}\n  bed_depth_m: {:g}\n"
      "  speed_m_per_s: {:.3g}\n  rayleigh_fraction: 0.2\n  target_relative_error: 0.015\n"
      "  stress_bin_deg: 5\n  width_bins: 5\n  travel: {{least_hub_m: {:g}}}\n"
      "  scene: {{bed: window, freeze: on, largest_step: on}}\n",
      Millimetres(std::max(4.8 * r, 30 * diameter_m)),
      Millimetres(across + 5 * sinkage + 10 * diameter_m),
      Millimetres(std::max(1.8 * r, 12 * diameter_m)), 0.1 * std::sqrt(r / 0.0625),
      Millimetres(4.8 * r));
  return text;
}

std::string CampaignText(const std::string& name, const ProposalRequest& request, int runs) {
  const int held_out = runs / 4, train = runs - held_out - kPatchRuns;
  DrawRequest draw;
  draw.sobol = true;
  draw.states = train;
  draw.slip = request.slip;
  draw.angle_deg = request.angle_deg;
  draw.load_n = request.load_n;
  draw.tiles = {1, static_cast<std::uint64_t>(TilesFor(runs))};
  std::string text = fmt::format(
      "# Written by grouser-dem campaign design: Sobol's points to train on, independent draws to\n"
      "# judge by, and one state on four beds, which shows how much beds differ.\n"
      "name: {0}\nscene: {0}.scene.yaml\nseeds: [1]\nextra:\n",
      name);
  text += DrawStates(draw);
  draw.sobol = false;
  draw.states = held_out;
  draw.seed = 7;
  text += "held_out:\n" + DrawStates(draw);
  const auto middle = [](const std::array<double, 2>& range) { return (range[0] + range[1]) / 2; };
  text += fmt::format(
      "patch:\n  - {{slip: {:.3f}, attack_angle_deg: {:g}, load_n: {:.4g}, seeds: [1, 2, 3, "
      "4]}}\n",
      std::clamp(0.2, request.slip[0], request.slip[1]), request.angle_deg[0],
      middle(request.load_n));
  return text;
}

/// What the wheel file does not state of its contact with grains is that between grains.
void TakeContact(const v1alpha1::Soil& soil, v1alpha1::Wheel* wheel,
                 std::vector<std::string>* notes) {
  const auto& grains = soil.grains();
  if (!(wheel->restitution() > 0)) wheel->set_restitution(grains.restitution());
  if (wheel->friction() > 0) return;
  wheel->set_friction(grains.friction());
  if (!(wheel->rolling_friction() > 0)) wheel->set_rolling_friction(grains.rolling_friction());
  notes->push_back("the wheel file states no friction: that between the grains is taken");
}

/// Grain-steps of a run at most, over slips and angles that have a motion.
double MeanWork(const v1alpha1::WheelTestSpec& spec, const ProposalRequest& request) {
  constexpr int kSlips = 16, kAngles = 4;
  dem::WheelTestSpec test = ToEngine(spec);
  double sum = 0;
  int n = 0;
  for (int i = 0; i < kSlips * kAngles; ++i) {
    const auto at = [](const std::array<double, 2>& range, int k, int of) {
      return range[0] + (range[1] - range[0]) * (k + 0.5) / of;
    };
    test.state.slip = at(request.slip, i % kSlips, kSlips);
    test.state.attack_angle_rad =
        at(request.angle_deg, i / kSlips, kAngles) * std::numbers::pi / 180;
    const dem::SlipRange possible = dem::SlipsAt(test.state.attack_angle_rad);
    if (test.state.slip < possible.low || test.state.slip > possible.high) continue;
    const dem::Work work = dem::WorkOf(test);
    sum += work.grains * work.steps;
    ++n;
  }
  return sum / std::max(n, 1);
}

v1alpha1::Scene ReadProposed(const std::string& text, const std::string& soil) {
  // The soil stands beside the scene only once both are written.
  YamlSection section = YamlSection::OfText(text, "the proposed scene");
  section.Set("soil", soil);
  return ReadScene(std::move(section));
}

}  // namespace

std::string NameOf(const ProposalRequest& request) {
  if (!request.name.empty()) return request.name;
  return records::LoadWheel(request.wheel_file).name() + "-" +
         ReadSoil(YamlSection::Load(request.soil_file)).name();
}

Proposal Propose(const ProposalRequest& request,
                 const std::function<Pace(const v1alpha1::WheelTestSpec&)>& measure) {
  if (!(request.load_n[0] > 0 && request.load_n[1] >= request.load_n[0])) {
    throw InputError(fmt::format("load: got {:g} to {:g} N, expected a range above 0",
                                 request.load_n[0], request.load_n[1]));
  }
  v1alpha1::Wheel wheel = records::LoadWheel(request.wheel_file);
  const v1alpha1::Soil soil = ReadSoil(YamlSection::Load(request.soil_file));
  Proposal out;
  out.name = NameOf(request);
  TakeContact(soil, &wheel, &out.notes);
  v1alpha1::WheelTestSpec spec;
  *spec.mutable_soil() = soil;
  const double own = dem::MeanDiameter(ToEngine(spec).soil), most = CoarsestFor(wheel);
  double pays = 0;
  const auto fill = [&](double diameter) {
    out.diameter_m = diameter;
    out.soil = ScaledSoil(request.soil_file, soil, diameter / own);
    out.scene = SceneText(out.name, wheel, diameter);
    const v1alpha1::Scene scene = ReadProposed(out.scene, out.soil);
    *spec.mutable_soil() = scene.soil();
    *spec.mutable_wheel() = scene.wheel();
    *spec.mutable_rig() = scene.rig();
    spec.set_seed(1);
    spec.mutable_state()->set_mode(v1alpha1::RIG_MODE_RIM_SPEED);
    spec.mutable_state()->set_slip(std::clamp(0.2, request.slip[0], request.slip[1]));
    spec.mutable_state()->set_load_n(request.load_n[1]);
    const Pace pace = measure(spec);
    const double one = MeanWork(spec, request) / pace.grain_steps_per_s;
    const auto with = [&](int tiles) {
      return (request.budget_s * request.cores - tiles * pace.tile_s) / one;
    };
    pays = with(TilesFor(with(TilesFor(0))));
  };
  fill(std::min(own, most));
  if (pays < kEnoughRuns && out.diameter_m < 0.999 * most) {
    out.notes.push_back(
        fmt::format("with grains of {:.3g} mm {:.0f} runs fit, expected {}: coarser "
                    "ones are taken",
                    1e3 * out.diameter_m, std::max(0.0, pays), kEnoughRuns));
    fill(most);
  }
  if (std::abs(out.diameter_m / own - 1) > 1e-6) {
    out.notes.push_back(fmt::format(
        "grains of {:.3g} mm for {:.3g} mm of the soil file: frictions belong to a grain size, and "
        "sinkage moves with it; compare with measured tests (./grouser validate)",
        1e3 * out.diameter_m, 1e3 * own));
  }
  if (pays < kLeastRuns) {
    throw InputError(
        fmt::format("budget: {} on {} cores pays for {:.0f} runs at most, expected at least {}: {}",
                    ForPeople(request.budget_s), request.cores, std::max(0.0, pays), kLeastRuns,
                    ForPeople(request.budget_s * kLeastRuns / std::max(pays, 0.1))));
  }
  out.runs = static_cast<int>(std::min<double>(pays, kMostRuns));
  out.campaign = CampaignText(out.name, request, out.runs);
  return out;
}

}  // namespace grouser::campaign
