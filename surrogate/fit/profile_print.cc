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

void AddErrors(const PhysicsErrors& errors, const std::array<double, kOutputs>& patch, Json* json) {
  json->Open('{').Key("runs").Value(errors.runs).Key("profiles").Value(errors.profiles);
  for (const Output o : kPredicted) {
    json->Key(std::string(kOutputFields[o].name) + "_over_noise")
        .Value(NoiseRatio(errors, patch, o));
  }
  json->Key("normal").Value(errors.misfit.normal);
  json->Key("tangential").Value(errors.misfit.tangential).Close('}');
}

void AddArray(const char* name, const std::vector<double>& values, double unit, Json* json) {
  json->Key(name).Open('[');
  for (const double v : values) json->Value(v * unit);
  json->Close(']');
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
  Json json;
  const ProfileMisfit pooled = PooledMisfit(rows);
  json.Open('{').Key("model").Value(reference);
  json.Key("normal").Value(pooled.normal).Key("tangential").Value(pooled.tangential);
  json.Key("repeats_normal").Value(repeats.normal);
  json.Key("repeats_tangential").Value(repeats.tangential);
  json.Key("runs").Open('[');
  for (const ProfileRow& p : rows) {
    json.Open('{').Key("run_id").Value(p.row->source->run_id()).Key("slip").Value(p.row->slip);
    json.Key("attack_angle_deg").Value(p.row->attack_angle_rad * kDegPerRad);
    json.Key("load_n").Value(p.row->load_n).Key("share").Value(p.compared.share);
    json.Key("used").Value(p.used).Key("sinkage_m").Value(p.sinkage);
    json.Key("measured_sinkage_m").Value(p.row->mean[kSinkage]);
    json.Key("normal").Value(p.misfit.normal).Key("tangential").Value(p.misfit.tangential);
    std::vector<double> angle;
    for (std::size_t i = 0; i < p.model.size(); ++i) angle.push_back(p.model.MiddleOf(i));
    AddArray("angle_deg", angle, kDegPerRad, &json);
    AddArray("measured_normal_pa", p.compared.measured.normal, 1, &json);
    AddArray("measured_tangential_pa", p.compared.measured.tangential, 1, &json);
    AddArray("model_normal_pa", p.model.normal, 1, &json);
    AddArray("model_tangential_pa", p.model.tangential, 1, &json);
    json.Close('}');
  }
  json.Close(']').Close('}');
  return json.text();
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
  Json json;
  json.Open('[');
  for (const WeightTrial& t : trials) {
    json.Open('{').Key("weight").Value(t.weight).Key("seconds").Value(t.seconds);
    json.Key("left_out");
    AddErrors(t.left_out, patch, &json);
    json.Key("held_out");
    AddErrors(t.test, patch, &json);
    json.Key("parameters").Open('{');
    for (const BekkerField& field : BekkerFields()) {
      json.Key(field.name).Open('{').Key("value").Value(t.parameters.*field.member);
      json.Key("standard_error").Value(t.spread.*field.member).Close('}');
    }
    json.Close('}').Close('}');
  }
  json.Close(']');
  return json.text();
}

}  // namespace grouser::surrogate
