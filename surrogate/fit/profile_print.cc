// What profile_report.h says, as text and as JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surrogate/fit/json.h"
#include "surrogate/fit/profile_report.h"

namespace grouser::surrogate {
namespace {

double NoiseRatio(const PhysicsErrors& errors, const std::array<double, kOutputs>& patch, int o) {
  return errors.rmse[o] / patch[o];
}

Json ErrorsJson(const PhysicsErrors& errors, const std::array<double, kOutputs>& patch) {
  Json json = {{"runs", errors.runs}, {"profiles", errors.profiles}};
  for (const Output o : kPredicted) {
    json[std::string(kOutputFields[o].name) + "_over_noise"] = NoiseRatio(errors, patch, o);
  }
  json["normal"] = errors.misfit.normal;
  json["tangential"] = errors.misfit.tangential;
  return json;
}

}  // namespace

std::string ProfilesText(const std::vector<ProfileRow>& rows, const ProfileMisfit& repeats) {
  std::string text = fmt::format("{:<18}{:>7}{:>8}{:>8}{:>8}{:>9}{:>9}\n", "run", "slip", "angle",
                                 "load", "share", "normal", "shear");
  for (const ProfileRow& p : rows) {
    text +=
        fmt::format("{:<18}{:>7.2f}{:>8.1f}{:>8.1f}{:>8.2f}", p.row->source->run_id(), p.row->slip,
                    p.row->attack_angle_rad * kDegPerRad, p.row->load_n, p.compared.share);
    text += p.used ? fmt::format("{:>9.2f}{:>9.2f}\n", p.misfit.normal, p.misfit.tangential)
                   : std::string("  not compared: the sides carry too much of the load\n");
  }
  const ProfileMisfit pooled = PooledMisfit(rows);
  const auto line = [&](const char* name, const ProfileMisfit& m) {
    text += fmt::format("{:<49}{:>9.2f}{:>9.2f}\n", name, m.normal, m.tangential);
  };
  line("all: model - DEM over DEM, rms, each run alike", pooled);
  if (repeats.normal > 0) line("DEM: one bed against another", repeats);
  return text;
}

std::string ProfilesJson(const std::vector<ProfileRow>& rows, const ProfileMisfit& repeats,
                         const std::string& reference) {
  const ProfileMisfit pooled = PooledMisfit(rows);
  Json runs = Json::array();
  for (const ProfileRow& p : rows) {
    Json angles = Json::array();
    for (std::size_t i = 0; i < p.model.size(); ++i) {
      angles.push_back(p.model.MiddleOf(i) * kDegPerRad);
    }
    runs.push_back({{"run_id", p.row->source->run_id()},
                    {"slip", p.row->slip},
                    {"attack_angle_deg", p.row->attack_angle_rad * kDegPerRad},
                    {"load_n", p.row->load_n},
                    {"share", p.compared.share},
                    {"used", p.used},
                    {"sinkage_m", p.sinkage},
                    {"measured_sinkage_m", p.row->mean[kSinkage]},
                    {"normal", p.misfit.normal},
                    {"tangential", p.misfit.tangential},
                    {"angle_deg", angles},
                    {"measured_normal_pa", p.compared.measured.normal},
                    {"measured_tangential_pa", p.compared.measured.tangential},
                    {"model_normal_pa", p.model.normal},
                    {"model_tangential_pa", p.model.tangential}});
  }
  return Text({{"model", reference},
               {"normal", pooled.normal},
               {"tangential", pooled.tangential},
               {"repeats_normal", repeats.normal},
               {"repeats_tangential", repeats.tangential},
               {"runs", runs}});
}

std::string WeightsText(const std::vector<WeightTrial>& trials,
                        const std::array<double, kOutputs>& patch) {
  std::string text =
      "rmse over the noise of one placement; profiles: rms of model - DEM over "
      "rms of DEM\n";
  text +=
      fmt::format("{:>7} {:<9}{:>5}{:>8}{:>8}{:>8}{:>8}{:>8}{:>9}{:>9}{:>9}\n", "weight", "runs",
                  "n", "f_x", "f_y", "torque", "m_z", "sinkage", "normal", "shear", "fit [s]");
  for (const WeightTrial& t : trials) {
    for (const bool test : {false, true}) {
      const PhysicsErrors& e = test ? t.test : t.left_out;
      if (e.runs == 0) continue;
      text += fmt::format("{:>7.3g} {:<9}{:>5}", t.weight, test ? "held out" : "left out", e.runs);
      for (const Output o : kPredicted) text += fmt::format("{:>8.2f}", NoiseRatio(e, patch, o));
      text += fmt::format("{:>9.2f}{:>9.2f}", e.misfit.normal, e.misfit.tangential);
      text += test ? "\n" : fmt::format("{:>9.2f}\n", t.seconds);
    }
  }
  text += fmt::format("\n{:<20}", "weight");
  for (const WeightTrial& t : trials) text += fmt::format("{:>24.3g}", t.weight);
  for (const BekkerField& field : BekkerFields()) {
    const bool fitted = std::any_of(trials.begin(), trials.end(), [&](const WeightTrial& t) {
      return t.spread.*field.member > 1e-9 * std::fabs(t.parameters.*field.member);
    });
    if (!fitted) continue;
    text += fmt::format("\n{:<20}", field.name);
    for (const WeightTrial& t : trials) {
      text +=
          fmt::format("{:>12.4g} +- {:<8.2g}", t.parameters.*field.member, t.spread.*field.member);
    }
  }
  return text + "\n";
}

std::string WeightsJson(const std::vector<WeightTrial>& trials,
                        const std::array<double, kOutputs>& patch) {
  Json out = Json::array();
  for (const WeightTrial& t : trials) {
    Json parameters;
    for (const BekkerField& field : BekkerFields()) {
      parameters[field.name] = {{"value", t.parameters.*field.member},
                                {"standard_error", t.spread.*field.member}};
    }
    out.push_back({{"weight", t.weight},
                   {"seconds", t.seconds},
                   {"left_out", ErrorsJson(t.left_out, patch)},
                   {"held_out", ErrorsJson(t.test, patch)},
                   {"parameters", parameters}});
  }
  return Text(out);
}

}  // namespace grouser::surrogate
