#include "dem_offline/engine/rig/packing.h"

#include <algorithm>
#include <cmath>

namespace grouser::dem {

PackingSearch::PackingSearch(const BedPreparation& given, const GrainFriction& own, bool rolls,
                             double first_friction)
    : next_{given.friction.value_or(std::clamp(first_friction, kLeastFriction, kMostFriction)),
            given.rolling_friction.value_or(own.rolling_friction)},
      may_roll_(rolls && !given.rolling_friction) {
  if (!given.friction) {
    searched_ = &next_.friction;
  } else if (may_roll_) {
    searched_ = &next_.rolling_friction;
    next_.rolling_friction = std::max(next_.rolling_friction, kLeastFriction);
  }
}

bool PackingSearch::Tried(double error) {
  if (!searched_) return false;
  if (std::abs(error) <= kFractionTolerance) {
    tried_.push_back({std::log(*searched_), error});
    return false;
  }
  const bool at_end = error > 0 ? *searched_ >= Most() : *searched_ <= kLeastFriction;
  if (at_end && error > 0 && searched_ == &next_.friction && may_roll_) {
    searched_ = &next_.rolling_friction;
    *searched_ = std::max(*searched_, kLeastFriction);
    tried_.clear();
  } else if (at_end) {
    return false;
  }
  tried_.push_back({std::log(*searched_), error});
  if (tried_.size() >= kTries) return false;
  *searched_ = std::clamp(std::exp(NextLog()), kLeastFriction, Most());
  return true;
}

void PackingSearch::AimLower(double by) {
  if (!searched_ || tried_.empty()) return;
  if (tried_.size() > 2) tried_.erase(tried_.begin(), tried_.end() - 2);
  for (Try& t : tried_) t.error += by;
  *searched_ = std::clamp(std::exp(NextLog()), kLeastFriction, Most());
}

double PackingSearch::Most() const {
  return searched_ == &next_.friction ? kMostFriction : kMostRollingFriction;
}

double PackingSearch::NextLog() const {
  const Try& last = tried_.back();
  double slope = -0.012;
  if (tried_.size() > 1) {
    const Try& before = tried_[tried_.size() - 2];
    const double seen = (last.error - before.error) / (last.log_friction - before.log_friction);
    if (seen < -0.003) slope = seen;
  }
  return last.log_friction - std::clamp(last.error / slope, -1.2, 1.2);
}

bool Rolls(const LawChoice& laws) { return laws.rolling != RollingLaws::IndexOf<RollingNone>(); }

}  // namespace grouser::dem
