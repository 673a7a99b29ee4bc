#include "surrogate/fit/measured.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "surrogate/fit/error_table.h"
#include "surrogate/soils/csv_cells.h"

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNearSlip = 0.06, kNearAngle = 3 * kDegree, kNearLoad = 0.2;

// Column names by output: value, sd; null where nobody measures it.
struct Columns {
  const char *value, *sd;
};
constexpr std::array<Columns, kOutputs> kColumns = {
    Columns{"f_x_n", "f_x_sd"}, Columns{"f_y_n", "f_y_sd"},
    Columns{nullptr, nullptr},  Columns{"torque_n_m", "torque_sd"},
    Columns{nullptr, nullptr},  Columns{"sinkage_m", "sinkage_sd"}};

/// Columns that are no output: the state, and what is told but not used.
constexpr std::string_view kOtherColumns[] = {"slip",    "attack_angle_deg",  "load_n",
                                              "load_sd", "rim_speed_m_per_s", "speed_m_per_s",
                                              "repeats"};

struct Reader {
  std::string path;
  WheelLimits limits;
  std::vector<std::string> header;
  int line = 0;

  [[noreturn]] void Fail(const std::string& what) const {
    throw std::invalid_argument(path + ":" + std::to_string(line) + ": " + what);
  }

  std::vector<std::string> Cells(const std::string& text) const {
    try {
      return CsvCells(text);
    } catch (const std::invalid_argument& error) {
      Fail(error.what());
    }
  }

  void TakeHeader(const std::vector<std::string>& cells) {
    header = cells;
    for (auto name = header.begin(); name != header.end(); ++name) {
      if (std::find(header.begin(), name, *name) != name) {
        Fail(*name + ": the column stands here twice, expected each once");
      }
    }
    for (const char* name : {"slip", "attack_angle_deg", "load_n"}) {
      if (std::find(header.begin(), header.end(), name) == header.end()) {
        Fail(std::string("no column ") + name + ", expected slip,attack_angle_deg,load_n,...");
      }
    }
    for (const std::string& name : header) {
      bool known = std::find(std::begin(kOtherColumns), std::end(kOtherColumns), name) !=
                   std::end(kOtherColumns);
      for (const Columns& c : kColumns) {
        known |= c.value != nullptr && (name == c.value || name == c.sd);
      }
      if (!known) Fail(name + ": unknown column");
    }
  }

  v1alpha1::MeasuredPoint Point(const std::vector<std::string>& cells) const {
    if (cells.size() != header.size()) {
      Fail(std::to_string(cells.size()) + " fields, expected " + std::to_string(header.size()));
    }
    std::map<std::string, double> values;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (cells[i].empty()) continue;
      char* end = nullptr;
      const double value = std::strtod(cells[i].c_str(), &end);
      if (*end != '\0' || !std::isfinite(value)) {
        Fail(header[i] + ": \"" + cells[i] + "\", expected a number");
      }
      values[header[i]] = value;
    }
    const auto get = [&](const char* name) {
      const auto found = name == nullptr ? values.end() : values.find(name);
      return found == values.end() ? kNaN : found->second;
    };
    v1alpha1::MeasuredPoint p;
    p.set_slip(get("slip"));
    p.set_attack_angle_rad(get("attack_angle_deg") * kDegree);
    p.set_load_n(get("load_n"));
    for (const Columns& c : kColumns) {
      p.add_value(get(c.value));
      p.add_sd(get(c.sd));
    }
    if (!(p.load_n() > 0)) Fail("load_n: expected a positive load");
    if (!std::isfinite(FromSlip(p.slip(), p.attack_angle_rad(), 1).v_x)) {
      Fail("slip: no motion has this slip at this attack angle");
    }
    for (int o = 0; o < kOutputs; ++o) CheckOutput(o, p);
    return p;
  }

  void CheckOutput(int o, const v1alpha1::MeasuredPoint& p) const {
    if (p.sd(o) < 0) Fail(std::string(kColumns[o].sd) + ": expected a number not below 0");
    if (std::isnan(p.value(o))) return;
    const std::string why = ImpossibleOutput(o, p.value(o), p.load_n(), limits);
    if (!why.empty()) Fail(std::string(kColumns[o].value) + ": " + why);
  }

  /// What a single row cannot tell: all of it in another unit.
  void CheckTable(const std::vector<v1alpha1::MeasuredPoint>& points, const std::vector<int>& lines,
                  bool accept_unusual) {
    constexpr double kLeastShare = 1e-3;
    std::size_t widest = 0, strongest = 0;
    double force = -1;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto angle = [&](std::size_t k) { return std::fabs(points[k].attack_angle_rad()); };
      if (angle(i) > angle(widest)) widest = i;
      for (const Output o : {kFx, kFy}) {
        const double share = std::fabs(points[i].value(o)) / points[i].load_n();
        if (share > force) force = share, strongest = i;  // NaN is not
      }
    }
    const double degrees = std::fabs(points[widest].attack_angle_rad()) / kDegree;
    line = lines[widest];
    if (degrees > 0 && degrees <= std::numbers::pi / 2 && !accept_unusual) {
      Fail(
          fmt::format("attack_angle_deg: {:g} is the largest, expected degrees: radians? "
                      "--accept-unusual takes it",
                      degrees));
    }
    line = lines[strongest];
    if (force >= 0 && force < kLeastShare) {
      Fail(fmt::format("f_x_n, f_y_n: at most {:.2g} of the load in every row, expected N: kN?",
                       force));
    }
  }
};

WheelAnswer At(const TabulatedModel& model, const v1alpha1::MeasuredPoint& p, double speed) {
  const VelocityState v = FromSlip(p.slip(), p.attack_angle_rad(), speed > 0 ? speed : 0.1);
  return model.EvaluateOne(v.v_x, v.v_y, v.rim_speed, p.load_n());
}

const v1alpha1::RunSummary* Nearest(const v1alpha1::MeasuredPoint& p,
                                    const std::vector<v1alpha1::RunSummary>& runs) {
  const v1alpha1::RunSummary* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const v1alpha1::RunSummary& run : runs) {
    if (run.status() != v1alpha1::RUN_STATUS_STEADY || run.mean_size() != kOutputs) continue;
    const double slip = std::fabs(run.slip() - p.slip()) / kNearSlip;
    const double angle = std::fabs(run.attack_angle_rad() - p.attack_angle_rad()) / kNearAngle;
    const double load = std::fabs(run.load_n() / p.load_n() - 1) / kNearLoad;
    const double distance = slip + angle + load;
    if (slip > 1 || angle > 1 || load > 1 || distance >= least) continue;
    least = distance;
    best = &run;
  }
  return best;
}

}  // namespace

std::vector<v1alpha1::MeasuredPoint> ReadMeasured(const std::string& path,
                                                  const WheelLimits& limits, bool accept_unusual) {
  std::istringstream file(records::ReadInputFile(path, "a CSV of measured tests"));
  Reader reader{path, limits, {}};
  const std::string source = path.substr(path.find_last_of('/') + 1);
  std::vector<v1alpha1::MeasuredPoint> points;
  std::vector<int> lines;
  std::string line;
  while (std::getline(file, line)) {
    ++reader.line;
    if (line.empty() || line[0] == '#' || line == "\r") continue;
    if (reader.header.empty()) {
      reader.TakeHeader(reader.Cells(line));
      continue;
    }
    points.push_back(reader.Point(reader.Cells(line)));
    points.back().set_source(source);
    lines.push_back(reader.line);
  }
  if (points.empty()) reader.Fail("no measured row, expected a header line and rows");
  reader.CheckTable(points, lines, accept_unusual);
  return points;
}

namespace {

// Whether the model stands for DEM there: slip and angle within the domain,
// the load within a third of it.
bool InDomain(const v1alpha1::Domain& d, const v1alpha1::MeasuredPoint& p) {
  return p.slip() >= d.slip_min() - kNearSlip && p.slip() <= d.slip_max() + kNearSlip &&
         std::fabs(p.attack_angle_rad()) <= d.attack_angle_max_rad() + kNearAngle &&
         p.load_n() * 1.33 >= d.load_min_n() && p.load_n() <= 1.33 * d.load_max_n();
}

}  // namespace

void SetFormError(const TabulatedModel& model, v1alpha1::Model* message) {
  message->clear_sd_form();
  for (int o = 0; o < kOutputs; ++o) {
    double square = 0;
    int n = 0;
    for (const v1alpha1::MeasuredPoint& p : message->measured()) {
      const bool known = p.value_size() == kOutputs && !std::isnan(p.value(o));
      if (!known || !InDomain(message->domain(), p)) continue;
      const double miss = At(model, p, message->domain().speed_m_per_s()).value[o] - p.value(o);
      square += miss * miss;
      ++n;
    }
    message->add_sd_form(n < 3 ? kNaN : std::sqrt(square / n));
  }
}

std::vector<MeasuredRow> MatchMeasured(const TabulatedModel& model, double speed,
                                       const std::vector<v1alpha1::MeasuredPoint>& points,
                                       const std::vector<v1alpha1::RunSummary>& runs) {
  std::vector<MeasuredRow> rows;
  for (const v1alpha1::MeasuredPoint& p : points) {
    rows.push_back({&p, At(model, p, speed), Nearest(p, runs)});
  }
  return rows;
}

std::vector<MeasuredError> MeasuredErrors(const std::vector<MeasuredRow>& rows) {
  std::vector<MeasuredError> errors;
  for (const v1alpha1::Region region : kRegions) {
    for (const Output o : kMeasurable) {
      MeasuredError e{region, o, 0, 0, 0, 0, 0};
      for (const MeasuredRow& row : rows) {
        const v1alpha1::MeasuredPoint& p = *row.measured;
        if (!IsIn(region, p.slip(), p.attack_angle_rad()) || std::isnan(p.value(o))) continue;
        ++e.n;
        e.rmse += std::pow(row.model.value[o] - p.value(o), 2);
        e.mean_measured += p.value(o);
        if (row.dem == nullptr) continue;
        ++e.n_dem;
        e.rmse_dem += std::pow(row.dem->mean(o) - p.value(o), 2);
      }
      if (e.n == 0) continue;
      e.mean_measured /= e.n;
      e.rmse = std::sqrt(e.rmse / e.n);
      e.rmse_dem = e.n_dem == 0 ? kNaN : std::sqrt(e.rmse_dem / e.n_dem);
      errors.push_back(e);
    }
  }
  return errors;
}

}  // namespace grouser::surrogate
