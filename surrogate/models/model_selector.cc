#include "surrogate/models/model_selector.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "surrogate/models/gathered_states.h"

namespace grouser::surrogate {
namespace {

constexpr std::size_t kBlock = ModelSelector::kBlock;
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kNoPromise = kNoEquilibrium | kSlope | kVirginAssumed | kRate;

/// How an answer stands to its tolerance.
struct Standing {
  bool promises = false;
  double ratio = kInf;      // claim over tolerance of the worst output
  double dem_ratio = kInf;  // the same against DEM: tells apart where the ratios are infinite
  int output = 0;

  bool suffices() const { return promises && ratio <= 1; }
  bool BetterThan(const Standing& other) const {
    if (promises != other.promises) return promises;
    return ratio != other.ratio ? ratio < other.ratio : dem_ratio < other.dem_ratio;
  }
};

/// The claim against a measurement: sd_form's half width is added in squares; infinite where it
/// is unknown, as at rest. f_z is the load and is not measured: its claim stays.
double WithForm(double claim, const SelectableModel& selectable, const WheelStatesView& in,
                int output, std::size_t i) {
  if (output == kFz) return claim;
  if (in.v_x[i] == 0 && in.v_y[i] == 0 && in.rim_speed[i] == 0) return kInf;
  const MeasuredRegion at = MeasuredRegionAt(in.v_x[i], in.v_y[i], in.rim_speed[i]);
  const double form = selectable.form.HalfWidth(at, output, in.load[i]);
  return std::isnan(form) ? kInf : std::hypot(claim, form);
}

Standing StandingOf(const SelectableModel& selectable, const AccuracyRequest& accuracy,
                    const WheelStatesView& in, const ResponsesView& out, std::size_t i) {
  Standing s;
  if ((out.flags[i] & kInvalid) != 0) return s;
  const bool turns =
      !in.yaw_rate.empty() && in.yaw_rate[i] != 0 && !selectable.model->UsesYawRate();
  // Friction of a wheel at rest on hard ground is what holds it, anything up to its limit.
  const bool holds = selectable.hard && (out.flags[i] & kStatic) != 0;
  s.promises = (out.flags[i] & kNoPromise) == 0 && !turns && !holds;
  const bool rest = in.v_x[i] == 0 && in.v_y[i] == 0 && in.rim_speed[i] == 0;
  // At rest as rolling freely; the interval, a unit outside the hull, is what counts.
  const ErrorRegion region =
      rest ? ErrorRegion::kTowed : ErrorRegionAt(in.v_x[i], in.v_y[i], in.rim_speed[i]);
  const std::array<double, kOutputs> tolerance = accuracy.At(in.load[i], selectable.radius_m);
  const bool measured = accuracy.target == IntervalTarget::kMeasured;
  s.ratio = s.dem_ratio = 0;
  for (int o = 0; o < kOutputs; ++o) {
    if (tolerance[o] == kInf) continue;
    const OutputView& to = out.output[o];
    double claim = ClaimedError(selectable, region, o, to.low[i], to.high[i], in.load[i]);
    s.dem_ratio = std::max(s.dem_ratio, claim / tolerance[o]);
    if (measured) claim = WithForm(claim, selectable, in, o, i);
    if (claim / tolerance[o] <= s.ratio) continue;
    s.ratio = claim / tolerance[o];
    s.output = o;
  }
  return s;
}

/// One block through the models.
class BlockSelection {
 public:
  BlockSelection(const std::vector<SelectableModel>& models, const AccuracyRequest& accuracy,
                 const WheelStatesView& in, const ResponsesView& out, const FormView& form)
      : models_(models), accuracy_(accuracy), in_(in), out_(out), form_(form), n_(in.load.size()) {
    for (int o = 0; o < kOutputs; ++o) {  // intervals that nobody wants, here
      OutputView& to = out_.output[o];
      if (to.low.empty()) to.low = {interval_[o][0].data(), n_};
      if (to.high.empty()) to.high = {interval_[o][1].data(), n_};
    }
  }

  /// Spends up to `allowed` beyond what the first model costs; returns what it spent [ns].
  double Run(double allowed) noexcept {
    double spent = models_[0].cost_ns * static_cast<double>(n_);
    First();
    for (std::uint32_t k = 1; k < models_.size() && open_count_ > 0; ++k) {
      const double left = (allowed - spent) / models_[k].cost_ns;
      const std::size_t m = left >= static_cast<double>(open_count_) ? open_count_
                            : left >= 1 ? static_cast<std::size_t>(left)
                                        : 0;
      if (m == 0) continue;
      spent += models_[k].cost_ns * static_cast<double>(m);
      Next(k, m);
    }
    return spent;
  }

  void Finish(std::size_t first, std::span<std::uint32_t> answered_by, Shortfall* worst) noexcept {
    for (std::size_t i = 0; i < open_count_; ++i) {
      const std::uint32_t at = open_[i];
      out_.flags[at] |= kToleranceUnmet;
      const Standing& s = standing_[at];
      const bool mends = s.promises && !models_[answered_by_[at]].hard &&
                         (out_.flags[at] & kStatic) == 0 &&
                         accuracy_.target == IntervalTarget::kDem;
      if (worst && mends && s.ratio > worst->excess) {
        *worst = {first + at, s.ratio, s.output, in_.load[at]};
      }
    }
    AddForms();
    if (!answered_by.empty()) std::copy_n(answered_by_.begin(), n_, answered_by.begin() + first);
  }

 private:
  /// What is known of measurements, of who answered; most blocks have one answerer.
  void AddForms() noexcept {
    const std::span<const std::uint32_t> who(answered_by_.data(), n_);
    if (std::ranges::all_of(who, [&](std::uint32_t k) { return k == who[0]; })) {
      AddForm(models_[answered_by_[0]].form, in_, out_, form_);
      return;
    }
    const bool wanted = form_.WantsAny();
    for (std::size_t i = 0; i < n_; ++i) {
      const FormErrors& form = models_[answered_by_[i]].form;
      if (wanted || form.ClearsFlags()) AddForm(form, in_, out_, form_, i);
    }
  }

  /// The cheapest answers where the answers go.
  void First() noexcept {
    models_[0].model->Evaluate(in_, out_);
    for (std::size_t i = 0; i < n_; ++i) {
      answered_by_[i] = 0;
      if ((out_.flags[i] & (kInvalid | kAirborne)) != 0) continue;
      standing_[i] = StandingOf(models_[0], accuracy_, in_, out_, i);
      if (!standing_[i].suffices()) open_[open_count_++] = static_cast<std::uint32_t>(i);
    }
  }

  /// Model k on the first m open states.
  void Next(std::uint32_t k, std::size_t m) noexcept {
    const WheelStatesView states = room_.Take(in_, open_.data(), m);
    const ResponsesView answers = room_.Room(out_, m);
    models_[k].model->Evaluate(states, answers);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < m; ++i) {
      const std::uint32_t at = open_[i];
      const Standing s = StandingOf(models_[k], accuracy_, states, answers, i);
      if (s.BetterThan(standing_[at])) {
        standing_[at] = s;
        answered_by_[at] = k;
        CopyAnswer(answers, i, out_, at);
      }
      if (!s.suffices()) open_[kept++] = at;
    }
    std::copy(open_.begin() + m, open_.begin() + open_count_, open_.begin() + kept);
    open_count_ -= m - kept;
  }

  const std::vector<SelectableModel>& models_;
  const AccuracyRequest& accuracy_;
  WheelStatesView in_;
  ResponsesView out_;
  FormView form_;
  std::array<std::array<std::array<double, kBlock>, 2>, kOutputs> interval_;
  std::size_t n_, open_count_ = 0;
  std::array<std::uint32_t, kBlock> open_, answered_by_;
  std::array<Standing, kBlock> standing_;
  GatheredStates<kBlock> room_;
};

TrainingDomain Around(const std::vector<SelectableModel>& models) {
  TrainingDomain box = models[0].hull;
  for (const SelectableModel& r : models) {
    box.slip_min = std::min(box.slip_min, r.hull.slip_min);
    box.slip_max = std::max(box.slip_max, r.hull.slip_max);
    box.attack_angle_max_rad = std::max(box.attack_angle_max_rad, r.hull.attack_angle_max_rad);
    box.load_min_n = std::min(box.load_min_n, r.hull.load_min_n);
    box.load_max_n = std::max(box.load_max_n, r.hull.load_max_n);
  }
  return box;
}

void Check(const std::vector<SelectableModel>& models) {
  if (models.empty()) throw std::invalid_argument("model selector: no model, expected one or more");
  for (std::size_t k = 0; k < models.size(); ++k) {
    const SelectableModel& r = models[k];
    const std::string where = "model selector: model " + std::to_string(k) + ": ";
    const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
    if (!r.model) throw std::invalid_argument(where + "no model");
    if (!positive(r.cost_ns)) throw std::invalid_argument(where + "cost_ns: expected > 0");
    if (!positive(r.radius_m)) throw std::invalid_argument(where + "radius_m: expected > 0");
    if (r.radius_m == models[0].radius_m) continue;
    throw std::invalid_argument(where + "radius_m: expected that of model 0: one wheel");
  }
}

}  // namespace

ModelSelector::ModelSelector(std::vector<SelectableModel> models) : models_(std::move(models)) {
  Check(models_);
  const TrainingDomain box = Around(models_);
  std::vector<std::pair<double, SelectableModel>> order;
  // One alone is compared with nothing.
  for (const SelectableModel& r : models_) {
    order.emplace_back(models_.size() > 1 ? MeanClaim(r, box) : 0, r);
  }
  std::ranges::stable_sort(order, {}, [](const auto& x) { return x.second.cost_ns; });
  for (auto first = order.begin(); first != order.end();) {
    const double most = kSameCost * first->second.cost_ns;
    const auto end =
        std::find_if(first, order.end(), [&](const auto& x) { return x.second.cost_ns >= most; });
    std::stable_sort(first, end, [](const auto& a, const auto& b) { return a.first < b.first; });
    first = end;
  }
  for (std::size_t k = 0; k < order.size(); ++k) {
    models_[k] = order[k].second;
    mean_claim_.push_back(order[k].first);
    if (mean_claim_[k] < mean_claim_[most_accurate_]) most_accurate_ = k;
  }
}

std::size_t ModelSelector::ByBudget(const AccuracyRequest& accuracy, std::size_t n) const noexcept {
  if (accuracy.budget_ns == 0) return most_accurate_;
  std::size_t best = 0;
  for (std::size_t k = 1; k < models_.size(); ++k) {
    const bool fits = models_[k].cost_ns * static_cast<double>(n) <= accuracy.budget_ns;
    if (fits && mean_claim_[k] < mean_claim_[best]) best = k;
  }
  return best;
}

void ModelSelector::Evaluate(const WheelStatesView& in, const AccuracyRequest& accuracy,
                             const ResponsesView& out, std::span<std::uint32_t> answered_by,
                             Shortfall* worst, const FormView& form) const noexcept {
  const std::size_t n = in.load.size();
  if (worst) *worst = {};
  if (!accuracy.HasTolerance()) {
    const std::size_t k = ByBudget(accuracy, n);
    EvaluateWithForm(*models_[k].model, models_[k].form, in, out, form);
    std::ranges::fill(answered_by, static_cast<std::uint32_t>(k));
    return;
  }
  double spent = 0;
  for (std::size_t first = 0; first < n; first += kBlock) {
    const std::size_t count = std::min(kBlock, n - first);
    const double share = static_cast<double>(first + count) / static_cast<double>(n);
    const double allowed = accuracy.budget_ns > 0 ? accuracy.budget_ns * share - spent : kInf;
    BlockSelection block(models_, accuracy, Cut(in, first, count), Cut(out, first, count),
                         Cut(form, first, count));
    spent += block.Run(allowed);
    block.Finish(first, answered_by, worst);
  }
}

}  // namespace grouser::surrogate
