// Steps of an ensemble, and sorts between them.
#include <algorithm>

#include "dem_offline/engine/gpu/ensemble.h"
#include "dem_offline/engine/gpu/sort_body.h"
#include "dem_offline/engine/world/passes.h"

namespace grouser::dem::gpu {
namespace {

constexpr int kBatch = 64;  // steps between checkpoints

}  // namespace

void Ensemble::Run(std::int64_t steps) {
  std::vector<std::int64_t> until;
  for (const WorldState& s : states_) until.push_back(s.steps + steps);
  RunTo(until);
}

void Ensemble::RunTo(const std::vector<std::int64_t>& until) {
  std::vector<bool> open(worlds_.size(), true);
  while (std::find(open.begin(), open.end(), true) != open.end()) {
    SortDue(until, open);
    std::vector<std::int64_t> stop;
    for (int w = 0; w < size(); ++w) {
      stop.push_back(open[w] ? NextStop(w, until.at(w)) : states_[w].steps);
      states_[w].until = stop.back();
      states_[w].called = 0;
    }
    memory_.states.now.Upload(states_);
    Advance();
    for (int w = 0; w < size(); ++w) {
      const WorldState& s = states_[w];
      open[w] = open[w] && !s.halted && !s.called && s.steps < until[w];
    }
  }
}

std::int64_t Ensemble::NextStop(int world, std::int64_t until) const {
  const std::int64_t every = worlds_[world]->state().config.sort_steps, now = states_[world].steps;
  if (every <= 0 || !MaySort(worlds_[world]->state())) return until;
  return std::min(until, (now / every + 1) * every);
}

void Ensemble::Advance() {
  for (;;) {
    std::int64_t steps = 0;
    for (const WorldState& s : states_) {
      if (!s.halted) steps = std::max(steps, s.until - s.steps);
    }
    if (steps <= 0) return;
    memory_.Checkpoint();
    device_.Steps(View(), combination_, static_cast<int>(std::min<std::int64_t>(steps, kBatch)));
    Fitted();
  }
}

/// Whether all lists were long enough; if not, they are longer now and everything is as
/// at the checkpoint.
bool Ensemble::Fitted() {
  std::int32_t bits;
  if (!Overflowed(&bits)) return true;
  ++regrowths_;
  memory_.Restore();
  Regrow(bits);
  return false;
}

/// Sorts the worlds that stand at a multiple of their sort_steps and go on from
/// there.
void Ensemble::SortDue(const std::vector<std::int64_t>& until, const std::vector<bool>& open) {
  std::vector<std::uint8_t> wanted(worlds_.size(), 0);
  for (int w = 0; w < size(); ++w) {
    const WorldState& s = states_[w];
    const std::int64_t every = worlds_[w]->state().config.sort_steps;
    if (!open[w] || every <= 0 || s.steps == 0 || s.steps % every != 0 || s.steps == sorted_at_[w])
      continue;
    if (s.steps >= until.at(w) || s.halted || !MaySort(worlds_[w]->state())) continue;
    wanted[w] = 1;
    sorted_at_[w] = s.steps;
  }
  if (std::find(wanted.begin(), wanted.end(), 1) == wanted.end()) return;
  ++sorts_;
  do {
    memory_.Checkpoint();
    EnsembleMemory& m = memory_;
    m.sort_wanted.Upload(wanted);
    EnsembleView v = View();
    device_.Sort(v, {m.sort_key[0].data(), m.sort_key[1].data(), m.sort_place[0].data(),
                     m.sort_place[1].data(), m.sort_wanted.data(), m.grains.then.data(),
                     m.loads.then.data(), m.kinetics.then.data()});
    v.was = m.sort_place[1].data();
    device_.Start(v, combination_);
  } while (!Fitted());
}

}  // namespace grouser::dem::gpu
