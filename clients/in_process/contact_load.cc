#include "clients/in_process/contact_load.h"

#include <algorithm>
#include <cmath>

#include "clients/in_process/parts.h"

namespace grouser {

LoadSearch::LoadSearch(const Model& model, double tyre_stiffness)
    : model_(model), compliance_(1 / tyre_stiffness), tolerance_(1e-7 * model.radius_m()) {
  const double least = model.domain().load_min_n, most = 4 * model.domain().load_max_n;
  for (int j = 0; j < kNodes; ++j) {
    node_[j] = least * std::pow(most / least, j / (kNodes - 1.0));
  }
  rest_per_log_ = (kRest - 1) / std::log(most / least);
  for (int j = 0; j < kRest; ++j) {
    load_.push_back(least * std::exp(j / rest_per_log_));
  }
  v_x_ = v_y_ = rim_ = std::vector<double>(kRest, 0.0);
  rest_.resize(kRest);
  Evaluate(rest_);
}

double LoadSearch::AtRest(double load) const {
  const double at = std::clamp(std::log(load / node_[0]) * rest_per_log_, 0.0, kRest - 1.0);
  const int j = std::min(static_cast<int>(at), kRest - 2);
  return rest_[j] + (at - j) * (rest_[j + 1] - rest_[j]);
}

void LoadSearch::Evaluate(std::span<double> out) {
  const std::size_t n = load_.size();
  flags_.resize(n);
  Answers answers;
  answers.flags = flags_;
  answers.output[kSinkage].value = out;
  (void)model_.Evaluate({v_x_, v_y_, rim_, load_}, answers);  // sizes are right
}

void LoadSearch::Ask() {
  const std::size_t n = asked_.size();
  for (std::vector<double>* v : {&v_x_, &v_y_, &rim_, &load_}) v->clear();
  which_.clear();
  depth_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const RelaxedMotion& m = asked_[i];
    depth_[i] = at_load_[i] * compliance_;
    if (m.moving < 1) depth_[i] += (1 - m.moving) * AtRest(at_load_[i]);
    if (m.moving == 0) continue;
    v_x_.push_back(m.v_x);
    v_y_.push_back(m.v_y);
    rim_.push_back(m.rim_speed);
    load_.push_back(at_load_[i]);
    which_.push_back(i);
  }
  if (load_.empty()) return;
  sinkage_.resize(load_.size());
  Evaluate(sinkage_);
  for (std::size_t a = 0; a < which_.size(); ++a) {
    depth_[which_[a]] += asked_[which_[a]].moving * sinkage_[a];
  }
}

// By halving: a deeper target never ends at a lower node, whatever S is, as at the first node where
// two targets part the deeper one goes up.
bool LoadSearch::NextNode(Bracket* b) const {
  if (b->upper - b->lower <= 1) return false;
  b->asked = (b->lower + b->upper) / 2;
  b->guess = node_[b->asked];
  return true;
}

// Regula falsi whose stale end counts half (Illinois), and halving where three rounds have not
// halved the bracket.
bool LoadSearch::Next(Bracket* b) const {
  if (std::fabs(b->off) <= tolerance_) return false;
  if (NextNode(b)) return true;
  b->asked = kNodes;
  if (b->upper == 0) {  // below the loads of the training: in proportion
    b->guess = b->high * (b->target / (b->target + b->above));
    return false;
  }
  if (b->high - b->low <= 1e-12 * b->high) {
    b->guess = b->high;
    return false;
  }
  const double below = b->below * b->below_weight, above = b->above * b->above_weight;
  double guess = b->low - below * ((b->high - b->low) / (above - below));
  if (b->rounds % 3 == 0) {
    if (b->rounds > 0 && b->high - b->low > 0.5 * b->width) guess = 0.5 * (b->low + b->high);
    b->width = b->high - b->low;
  }
  if (!(guess > b->low && guess < b->high)) guess = 0.5 * (b->low + b->high);
  b->guess = guess;
  ++b->rounds;
  return true;
}

void LoadSearch::Narrow(double depth, Bracket* b) const {
  b->off = depth - b->target;
  const bool from_below = b->off < 0;
  if (b->asked == kNodes - 1 && from_below) {
    // Deeper than at the last node: on in proportion, from a load that sinks as deep.
    const double sinkage = b->target;
    *b = {.wheel = b->wheel, .target = depth - 2 * tolerance_, .upper = kNodes - 1};
    b->scale = sinkage / b->target;
    b->high = node_[kNodes - 1];
    b->above = 2 * tolerance_;
    b->below = -b->target;
    if (b->target <= 0) {  // it does not sink
      b->off = 0;
      b->guess = b->high;
      b->scale = HUGE_VAL;
    }
    return;
  }
  if (from_below) {
    b->low = b->guess;
    b->below = b->off;
  } else {
    b->high = b->guess;
    b->above = b->off;
  }
  if (b->asked < kNodes) {
    (from_below ? b->lower : b->upper) = b->asked;
    return;
  }
  // The end that stays a second time in a row.
  double& stale = from_below ? b->above_weight : b->below_weight;
  stale = b->rounds > 1 && b->last_from_below == from_below ? 0.5 * stale : 1;
  (from_below ? b->below_weight : b->above_weight) = 1;
  b->last_from_below = from_below;
}

void LoadSearch::Solve(std::span<const RelaxedMotion> motions, std::span<const double> sinkage,
                       std::span<double> load) {
  open_.clear();
  for (std::size_t i = 0; i < motions.size(); ++i) {
    open_.push_back({.wheel = i, .target = sinkage[i], .below = -sinkage[i]});
  }
  while (!open_.empty()) {
    asked_.clear();
    at_load_.clear();
    std::size_t still = 0;
    for (const Bracket& b : open_) {
      Bracket next = b;
      if (Next(&next)) {
        Add(motions[next.wheel], next.guess);
        open_[still++] = next;
      } else {
        load[next.wheel] = next.guess * next.scale;
      }
    }
    open_.resize(still);
    Ask();
    for (std::size_t a = 0; a < open_.size(); ++a) Narrow(depth_[a], &open_[a]);
  }
}

double LoadAtSinkage(const Model& model, double v_x, double v_y, double rim_speed, double sinkage,
                     double tyre_stiffness) {
  if (!std::isfinite(v_x) || !std::isfinite(v_y) || !std::isfinite(rim_speed) ||
      !std::isfinite(sinkage) || !(tyre_stiffness > 0)) {
    return kNaN;
  }
  if (sinkage <= 0) return 0;
  const RelaxedMotion motion = {v_x, v_y, rim_speed, 1};
  double load = 0;
  LoadSearch(model, tyre_stiffness).Solve({&motion, 1}, {&sinkage, 1}, {&load, 1});
  return load;
}

}  // namespace grouser
