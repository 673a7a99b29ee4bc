#include "dem_offline/campaign/design.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "dem_offline/scenes/run_identity.h"
#include "dem_offline/scenes/scene_yaml.h"
#include "proto/records/yaml/neighbour.h"

namespace grouser::campaign {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr Range kSlip{-2.0, 2.0};
constexpr Range kAngleDeg{-180.0, 180.0};
constexpr std::uint64_t kMaxSeed = 1u << 31;
constexpr std::size_t kMaxRuns = 100000;

v1alpha1::RigMode ReadMode(YamlSection& section, v1alpha1::RigMode otherwise) {
  if (!section.Has("mode")) return otherwise;
  v1alpha1::RigMode mode = otherwise;
  const std::string text = section.Text("mode");
  if (!ParseMode(text, &mode)) section.Fail("mode", "'" + text + "'", "rim, towed or free");
  return mode;
}

v1alpha1::TestState MakeState(v1alpha1::RigMode mode, double axis, double angle_deg, double load) {
  v1alpha1::TestState state;
  state.set_mode(mode);
  if (mode == v1alpha1::RIG_MODE_RIM_SPEED) state.set_slip(axis);
  if (mode == v1alpha1::RIG_MODE_FREE_SLIP) state.set_drawbar_n(axis);
  state.set_attack_angle_rad(angle_deg * kDegree);
  state.set_load_n(load);
  return state;
}

// The key that a mode adds to load and angle, if any.
std::string AxisKey(v1alpha1::RigMode mode) {
  if (mode == v1alpha1::RIG_MODE_RIM_SPEED) return "slip";
  return mode == v1alpha1::RIG_MODE_FREE_SLIP ? "drawbar_n" : "";
}

/// The rig's speed is another state's axis where an entry says so.
void ReadSpeed(YamlSection& entry, v1alpha1::TestState* state) {
  if (entry.Has("speed_m_per_s")) {
    state->set_speed_m_per_s(entry.Number("speed_m_per_s", kPositive));
  }
}

v1alpha1::TestState ReadState(YamlSection& section, v1alpha1::RigMode campaign_mode) {
  const v1alpha1::RigMode mode = ReadMode(section, campaign_mode);
  const std::string axis = AxisKey(mode);
  const double value = axis.empty() ? 0.0 : section.Number(axis, axis == "slip" ? kSlip : Range{});
  const double angle =
      mode == v1alpha1::RIG_MODE_FREE_SLIP ? 0.0 : section.Number("attack_angle_deg", kAngleDeg);
  v1alpha1::TestState state = MakeState(mode, value, angle, section.Number("load_n", kPositive));
  ReadSpeed(section, &state);
  return state;
}

// Collects runs and refuses what would spoil the campaign: one run under two
// roles, and a held-out state that a fitter sees under another seed.
class Plan {
 public:
  Plan(v1alpha1::Campaign* campaign, const std::string& engine_version)
      : campaign_(campaign), engine_version_(engine_version) {}

  void Add(const YamlSection& where, v1alpha1::RunRole role, const v1alpha1::TestState& state,
           std::uint64_t seed) {
    v1alpha1::PlannedRun run;
    run.set_role(role);
    *run.mutable_state() = state;
    run.set_seed(seed);
    const auto spec = SpecOf(*campaign_, run);
    run.set_run_id(RunId(spec, engine_version_));
    if (!ids_.emplace(run.run_id(), role).second) {
      where.Fail("", "the run (" + Describe(state, seed) + ") twice", "every run once");
    }
    auto seedless = spec;
    seedless.clear_seed();
    const bool held_out = role == v1alpha1::RUN_ROLE_TEST;
    const auto [found, fresh] = held_out_.emplace(RunId(seedless, ""), held_out);
    if (!fresh && found->second != held_out) {
      where.Fail("", "the state (" + Describe(state, seed) + ") both held out and not",
                 "all runs of one state on one side");
    }
    if (ids_.size() > kMaxRuns) where.Fail("", "too many runs", fmt::format("{}", kMaxRuns));
    *campaign_->add_runs() = run;
  }

 private:
  v1alpha1::Campaign* campaign_;
  std::string engine_version_;
  std::map<std::string, v1alpha1::RunRole> ids_;
  std::map<std::string, bool> held_out_;
};

void AddGrid(YamlSection& grid, v1alpha1::RigMode campaign_mode,
             const std::vector<std::uint64_t>& seeds, Plan* plan) {
  const v1alpha1::RigMode mode = ReadMode(grid, campaign_mode);
  const std::string axis = AxisKey(mode);
  const auto values = axis.empty() ? std::vector<double>{0.0}
                                   : grid.Numbers(axis, axis == "slip" ? kSlip : Range{});
  const auto angles = mode == v1alpha1::RIG_MODE_FREE_SLIP
                          ? std::vector<double>{0.0}
                          : grid.Numbers("attack_angle_deg", kAngleDeg);
  const auto loads = grid.Numbers("load_n", kPositive);
  v1alpha1::TestState at_speed;
  ReadSpeed(grid, &at_speed);
  grid.Finish();
  for (const double load : loads) {
    for (const double angle : angles) {
      for (const double value : values) {
        for (const std::uint64_t seed : seeds) {
          v1alpha1::TestState state = MakeState(mode, value, angle, load);
          state.set_speed_m_per_s(at_speed.speed_m_per_s());
          plan->Add(grid, v1alpha1::RUN_ROLE_TRAIN, state, seed);
        }
      }
    }
  }
}

void AddStates(YamlSection& file, const std::string& key, v1alpha1::RunRole role,
               v1alpha1::RigMode mode, const std::vector<std::uint64_t>& seeds, Plan* plan) {
  if (!file.Has(key)) return;
  for (YamlSection& entry : file.Sections(key)) {
    const v1alpha1::TestState state = ReadState(entry, mode);
    std::vector<std::uint64_t> own = seeds;
    if (role == v1alpha1::RUN_ROLE_PATCH) own = entry.Counts("seeds", 1, kMaxSeed);
    if (role != v1alpha1::RUN_ROLE_PATCH && entry.Has("seed")) {
      own = {entry.Count("seed", 1, kMaxSeed)};
    }
    entry.Finish();
    for (const std::uint64_t seed : own) plan->Add(entry, role, state, seed);
  }
}

v1alpha1::Scene SceneOf(YamlSection& file, const std::string& within) {
  const std::string soil = file.Has("soil") ? records::NeighbourOf(file, "soil", within) : "";
  if (!file.IsText("scene")) return ReadScene(file.Section("scene"), soil, within);
  return LoadScene(records::NeighbourOf(file, "scene", within), soil, within);
}

}  // namespace

v1alpha1::Campaign LoadCampaign(const std::string& file_name, const std::string& engine_version,
                                const std::string& within) {
  YamlSection file = YamlSection::Load(file_name);
  v1alpha1::Campaign campaign;
  campaign.set_name(file.Text("name"));
  *campaign.mutable_scene() = SceneOf(file, within);
  const v1alpha1::RigMode mode = ReadMode(file, v1alpha1::RIG_MODE_RIM_SPEED);
  const auto seeds = file.Counts("seeds", 1, kMaxSeed);
  Plan plan(&campaign, engine_version);
  if (file.Has("grid")) {
    for (YamlSection& grid : file.Sections("grid")) AddGrid(grid, mode, seeds, &plan);
  }
  AddStates(file, "extra", v1alpha1::RUN_ROLE_TRAIN, mode, seeds, &plan);
  AddStates(file, "held_out", v1alpha1::RUN_ROLE_TEST, mode, seeds, &plan);
  AddStates(file, "patch", v1alpha1::RUN_ROLE_PATCH, mode, seeds, &plan);
  file.Finish();
  if (campaign.runs().empty()) file.Fail("grid", "no run", "at least one of grid, extra, held_out");
  return campaign;
}

v1alpha1::WheelTestSpec SpecOf(const v1alpha1::Campaign& campaign,
                               const v1alpha1::PlannedRun& run) {
  v1alpha1::WheelTestSpec spec;
  spec.set_scene(campaign.scene().name());
  *spec.mutable_soil() = campaign.scene().soil();
  *spec.mutable_wheel() = campaign.scene().wheel();
  *spec.mutable_rig() = campaign.scene().rig();
  *spec.mutable_state() = run.state();
  if (run.state().speed_m_per_s() > 0) {
    spec.mutable_rig()->set_speed_m_per_s(run.state().speed_m_per_s());
    spec.mutable_state()->clear_speed_m_per_s();  // one place
  }
  spec.set_seed(run.seed());
  return spec;
}

std::string Describe(const v1alpha1::TestState& state, std::uint64_t seed) {
  std::string text;
  if (state.mode() == v1alpha1::RIG_MODE_TOWED) {
    text = "towed";
  } else if (state.mode() == v1alpha1::RIG_MODE_FREE_SLIP) {
    text = fmt::format("drawbar {:.4g} N", state.drawbar_n());
  } else {
    text = fmt::format("slip {:+.3f}", state.slip());
  }
  text += fmt::format(", {:.4g} deg, {:.4g} N", state.attack_angle_rad() / kDegree, state.load_n());
  if (state.speed_m_per_s() > 0) text += fmt::format(", {:.3g} m/s", state.speed_m_per_s());
  return text + fmt::format(", seed {}", seed);
}

bool ParseMode(const std::string& text, v1alpha1::RigMode* mode) {
  if (text == "rim") {
    *mode = v1alpha1::RIG_MODE_RIM_SPEED;
  } else if (text == "towed") {
    *mode = v1alpha1::RIG_MODE_TOWED;
  } else if (text == "free") {
    *mode = v1alpha1::RIG_MODE_FREE_SLIP;
  } else {
    return false;
  }
  return true;
}

}  // namespace grouser::campaign
