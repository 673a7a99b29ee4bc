#include "surrogate/accuracy_benchmark/on_measured.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "surrogate/fit/json.h"

namespace grouser::surrogate {
namespace {

constexpr double kAtState = 0.1;  // slip to 0.006, or 0.3 degrees, or 2 % of load: rounding

Compared At(const v1alpha1::MeasuredPoint& p) {
  Compared c{p.slip(), p.attack_angle_rad(), p.load_n(), {}, {}, {}};
  for (int o = 0; o < kOutputs; ++o) {
    c.truth[o] = o < p.value_size() ? p.value(o) : std::numeric_limits<double>::quiet_NaN();
  }
  return c;
}

// A row of rows.json; false where no bed gave a mean.
bool ReadRow(const Json& row, Compared* c) {
  *c = {row.at("slip").get<double>(),
        row.at("attack_angle_deg").get<double>() / kDegPerRad,
        row.at("load_n").get<double>(),
        {},
        {},
        {}};
  c->truth.fill(std::numeric_limits<double>::quiet_NaN());
  bool found = false;
  for (const Output o : kMeasurable) {
    const Json& measured = row.at("measured");
    const Json& dem = row.at("dem").at("outputs");
    const char* name = kOutputFields[o].name;
    if (!measured.contains(name) || !dem.contains(name)) continue;
    c->truth[o] = measured.at(name).at("value").get<double>();
    c->value[o] = dem.at(name).at("value").get<double>();
    found = true;
  }
  return found;
}

}  // namespace

std::vector<Compared> OnMeasured(const std::vector<v1alpha1::MeasuredPoint>& points, double speed,
                                 const std::function<Answer(const Sample&)>& answer) {
  std::vector<Compared> out;
  for (const v1alpha1::MeasuredPoint& p : points) {
    Sample state{};
    state.motion = FromSlip(p.slip(), p.attack_angle_rad(), speed);
    state.slip = p.slip();
    state.attack_angle_rad = p.attack_angle_rad();
    state.load_n = p.load_n();
    const Answer a = answer(state);
    out.push_back(At(p));
    out.back().value = a.value;
    out.back().half_width = a.half_width;
  }
  return out;
}

DemOnMeasured RunsAtStates(const std::vector<v1alpha1::MeasuredPoint>& points,
                           const std::vector<v1alpha1::RunSummary>& runs) {
  std::vector<Sample> samples = SamplesOf(runs, v1alpha1::RUN_ROLE_TRAIN);
  const std::vector<Sample> tests = SamplesOf(runs, v1alpha1::RUN_ROLE_TEST);
  samples.insert(samples.end(), tests.begin(), tests.end());
  DemOnMeasured out;
  for (const v1alpha1::MeasuredPoint& p : points) {
    const auto nearest = std::ranges::min_element(
        samples, {}, [&](const Sample& s) { return DistanceOf(*s.source, p); });
    if (nearest == samples.end() || DistanceOf(*nearest->source, p) > kAtState) continue;
    out.compared.push_back(At(p));
    out.compared.back().value = nearest->mean;
    out.wall_s += nearest->source->wall_s();
  }
  if (!out.compared.empty()) out.wall_s /= static_cast<double>(out.compared.size());
  return out;
}

std::vector<std::string> ValidatedFiles(const std::string& folder) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("measured_dem") && name.ends_with(".json")) {
      files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

DemOnMeasured ReadValidated(const std::string& path) try {
  const Json file = Json::parse(records::ReadInputFile(path, "rows.json of grouser validate"));
  DemOnMeasured out;
  int timed = 0;
  out.kind = fmt::format("dem {:.3g} mm", 1e3 * file.at("mean_diameter_m").get<double>());
  for (const Json& row : file.at("rows")) {
    Compared c;
    if (!ReadRow(row, &c)) continue;
    out.compared.push_back(c);
    const Json& wall = row.at("dem").at("wall_s");
    if (wall.is_null()) continue;  // no time is told
    out.wall_s += wall.get<double>();
    ++timed;
  }
  out.wall_s = timed > 0 ? out.wall_s / timed : std::numeric_limits<double>::quiet_NaN();
  return out;
} catch (const Json::exception& problem) {
  throw std::invalid_argument(path + ": " + problem.what() +
                              ", expected rows.json of grouser validate");
}

}  // namespace grouser::surrogate
