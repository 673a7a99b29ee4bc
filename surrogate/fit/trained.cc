#include "surrogate/fit/trained.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "surrogate/models/spline.h"

namespace grouser::surrogate {
namespace {

constexpr double kLoadMargin = 3.0;  // the table ends at this factor beyond the runs
// Of the variance of one placement, what goes with a run's own squared standard error: beds
// scatter as blocks within a bed do, tenfold more sideways than straight on.
constexpr double kOwnNoise = 0.75;
// Hull distances over the fields' lengths: those at which runs left out are off by more.
constexpr double kDistanceLengths = 0.4;
// Hull distances of FieldShare. Nine tenths of the CMU and ATV pairs' domains are within 0.26 of
// runs; motions that no run has are at 0.45 to 0.9.
constexpr double kFieldAlone = 0.3, kPhysicsAlone = 0.6;
// Where no field has lengths: by direction and ln load alone.
constexpr Lengths kNoField = {0.45, 0.45, 0.45, 0.7, 1e9, 1e9, 1e9};

double FroudeOf(const Sample& row, double radius_m, double gravity_m_per_s2) {
  const Canonical state = row.state();
  return state.speed * state.speed / (gravity_m_per_s2 * radius_m);
}

FieldPoint PointOf(const Sample& row, const WheelGeometry& wheel, const SpeedAxis& speed,
                   double gravity) {
  FieldPoint point = MakeFieldPoint(row.state(), row.load_n);
  if (speed.present()) point.u = speed.At(FroudeOf(row, wheel.radius_m, gravity));
  return point;
}

// Means of a mirrored state as those of its canonical one.
double CanonicalSign(int output, const Canonical& state) {
  const OutputField& field = kOutputFields[output];
  const double x = field.parity_x < 0 && state.sign_x != 0 ? state.sign_x : 1;
  const double y = field.parity_y < 0 && state.sign_y != 0 ? state.sign_y : 1;
  return x * y;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Of the fields in the answer, beside (1 - it) of physics.
double ShareOf(const Trained& trained, const FieldPoint& at) {
  if (!trained.whole) return 0;
  return trained.with_physics ? FieldShare(trained.distance->At(at)) : 1;
}

}  // namespace

double FieldShare(double distance) {
  return 1 - SmoothStep((distance - kFieldAlone) / (kPhysicsAlone - kFieldAlone));
}

SpeedAxis SpeedAxisOf(const std::vector<Sample>& rows, double radius_m, double gravity_m_per_s2) {
  constexpr double kSameSpeed = 1.1 * 1.1;  // in Froude numbers
  double low = std::numeric_limits<double>::infinity(), high = 0, sum = 0;
  for (const Sample& row : rows) {
    const double froude = FroudeOf(row, radius_m, gravity_m_per_s2);
    low = std::min(low, froude);
    high = std::max(high, froude);
    sum += froude;
  }
  if (rows.empty() || !(high > kSameSpeed * low)) return {};
  return {sum / static_cast<double>(rows.size()), high};
}

namespace {

/// What physics leaves of the rows, over OutputScale.
struct Residuals {
  Eigen::MatrixXd value, noise;  // row by output
};

Residuals ResidualsOf(const std::vector<Sample>& rows, const TrainOptions& options,
                      const BekkerModel& model) {
  const auto n = static_cast<Eigen::Index>(rows.size());
  Residuals r{Eigen::MatrixXd(n, kOutputs), Eigen::MatrixXd(n, kOutputs)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sample& row = rows[i];
    const Canonical state = row.state();
    BekkerModel::Answer answer{};
    const bool on_physics = options.with_physics && !options.whole;
    if (on_physics) answer = model.SolveCanonical(state, row.load_n);
    for (int o = 0; o < kOutputs; ++o) {
      const double scale = OutputScale(o, row.load_n, options.wheel.radius_m);
      r.value(i, o) = (CanonicalSign(o, state) * row.mean[o] - answer.value[o]) / scale;
      if (o == kFz) r.value(i, o) = 0;
      r.noise(i, o) = row.standard_error[o] / scale;
    }
  }
  for (int o = 0; o < kOutputs; ++o) {
    const double own2 = r.noise.col(o).squaredNorm() / static_cast<double>(n);
    if (!(own2 > 0)) {
      r.noise.col(o).setConstant(options.physics.patch[o]);
      continue;
    }
    r.noise.col(o) = options.physics.patch[o] *
                     (1 - kOwnNoise + kOwnNoise / own2 * r.noise.col(o).array().square()).sqrt();
  }
  return r;
}

std::vector<FieldPoint> PointsOf(const std::vector<Sample>& rows, const TrainOptions& options,
                                 const SpeedAxis& speed) {
  std::vector<FieldPoint> points;
  points.reserve(rows.size());
  for (const Sample& row : rows) {
    points.push_back(PointOf(row, options.wheel, speed, options.gravity_m_per_s2));
  }
  return points;
}

/// Field settings by output, and the speed axis' saturation: what all outputs
/// together find likeliest, or that of `warm`.
void SelectSettings(const std::vector<Sample>& rows, const TrainOptions& options,
                    const Residuals& rest, const Trained* warm, Trained* result) {
  double best = -std::numeric_limits<double>::infinity();
  std::vector<double> saturations = {0, 1, 3, 10};
  if (warm || !options.speed.present()) saturations = {result->speed.saturation};
  for (const double saturation : saturations) {
    SpeedAxis speed = options.speed;
    speed.saturation = saturation;
    const std::vector<FieldPoint> points = PointsOf(rows, options, speed);
    std::array<FieldSettings, kOutputs> settings;
    double likelihood = 0;
    for (const Output o : kPredicted) {
      const SelectedField selected =
          SelectField(points, rest.value.col(o), rest.noise.col(o), ResidualTable::ParityOf(o));
      settings[o] = selected.settings;
      likelihood += selected.likelihood;
    }
    if (likelihood > best) {
      best = likelihood;
      result->settings = settings;
      if (options.speed.present()) result->speed = speed;
    }
  }
}

}  // namespace

Trained Train(const std::vector<Sample>& rows, const TrainOptions& options, const Trained* warm) {
  Trained result;
  result.with_physics = options.with_physics;
  result.whole = options.whole || !options.with_physics;
  result.speed = warm ? warm->speed : options.speed;
  result.gravity_m_per_s2 = options.gravity_m_per_s2;
  if (options.with_physics) {
    result.physics =
        FitBekker(rows, options.wheel, options.physics, warm ? &warm->physics : nullptr).parameters;
  }
  const Residuals rest = ResidualsOf(rows, options, BekkerModel(result.physics, options.wheel));
  if (options.with_residual) SelectSettings(rows, options, rest, warm, &result);
  const std::vector<FieldPoint> points = PointsOf(rows, options, result.speed);
  std::array<std::vector<double>, Lengths::kAxes> lengths;
  for (int o = 0; o < kOutputs; ++o) {
    const FieldSettings& settings = result.settings[o];
    result.fields.emplace_back(points, rest.value.col(o), rest.noise.col(o),
                               ResidualTable::ParityOf(o), settings);
    if (settings.amplitude == 0) continue;
    const auto all = settings.lengths.All();
    for (int a = 0; a < Lengths::kAxes; ++a) lengths[a].push_back(all[a]);
  }
  const auto none = kNoField.All();
  std::array<double, Lengths::kAxes> near;
  for (int a = 0; a < Lengths::kAxes; ++a) {
    near[a] = lengths[a].empty() ? none[a] : kDistanceLengths * Median(lengths[a]);
  }
  result.distance = std::make_shared<const HullDistance>(points, Lengths::Of(near));
  return result;
}

Prediction Predict(const Trained& trained, const WheelGeometry& wheel, const Sample& at) {
  const Canonical state = at.state();
  const FieldPoint point = PointOf(at, wheel, trained.speed, trained.gravity_m_per_s2);
  Prediction result;
  result.physics = {};
  if (trained.with_physics) {
    result.physics = BekkerModel(trained.physics, wheel).SolveCanonical(state, at.load_n).value;
  } else {
    result.physics[kFz] = at.load_n;
  }
  result.distance = trained.distance->At(point);
  const double share = ShareOf(trained, point);
  for (int o = 0; o < kOutputs; ++o) {
    const double scale = OutputScale(o, at.load_n, wheel.radius_m);
    const double field = (trained.whole ? share : 1) * trained.fields[o].Mean(point);
    result.value[o] = (1 - share) * result.physics[o] + scale * (o == kFz ? share : field);
  }
  ApplyMirrors(state, &result.physics);
  ApplyMirrors(state, &result.value);
  return result;
}

Table Tabulate(const Trained& trained, double load_min_n, double load_max_n) {
  const double low = std::log(load_min_n), high = std::log(load_max_n);
  const double margin = trained.with_physics ? std::log(kLoadMargin) : 0;
  Table table;
  // What physics leaves: 6 degrees, a slip of 0.2 near slip 0, and 10. The whole answer: half of
  // that, since it turns within few degrees where the attack angle does (to 0.1 % of the load).
  table.axes.direction = trained.whole ? 60 : 30;
  table.axes.lateral = trained.whole ? 18 : 9;
  table.axes.load =
      std::clamp(static_cast<int>(std::ceil((high - low + 2 * margin) / 0.45)), 4, 16);
  table.axes.log_load_min = low - margin;
  table.axes.log_load_max = high + margin;
  const std::vector<TableNode> nodes = TableNodes(table.axes);
  std::array<std::vector<double>, ResidualTable::kChannels> values, rates;
  for (const TableNode& node : nodes) {
    const FieldPoint point = MakeFieldPoint(node.chart, node.log_load);
    const double fade = margin == 0
                            ? 1
                            : SmoothStep((node.log_load - table.axes.log_load_min) / margin) *
                                  SmoothStep((table.axes.log_load_max - node.log_load) / margin);
    const double distance = trained.distance->At(point);
    const double share = fade * ShareOf(trained, point);
    for (int o = 0; o < kOutputs; ++o) {
      const double weight = trained.whole ? share : fade;
      const ResidualField::Terms field = trained.fields[o].At(point);
      values[o].push_back(o == ResidualTable::kShare ? share : weight * field.table);
      rates[o].push_back(weight * field.rate);
    }
    values[ResidualTable::kDistance].push_back(1 - fade * (1 - distance));
  }
  for (int c = 0; c < ResidualTable::kChannels; ++c) {
    for (const auto& [from, to] :
         {std::pair{&values[c], &table.coefficients[c]}, std::pair{&rates[c], &table.rates[c]}}) {
      const bool zero = std::all_of(from->begin(), from->end(), [](double v) { return v == 0; });
      if (zero) continue;  // an empty channel
      *to = InterpolateTable(table.axes, ResidualTable::ParityOf(c), *from);
    }
  }
  return table;
}

}  // namespace grouser::surrogate
