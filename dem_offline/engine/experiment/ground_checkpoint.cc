// The box as bytes, and back.
#include <stdexcept>

#include "dem_offline/engine/core/byte_archive.h"
#include "dem_offline/engine/experiment/ground.h"
#include "dem_offline/engine/experiment/validate.h"

namespace grouser::dem::experiment {
namespace {

template <class Archive>
void Walk(Archive& a, DeviceState& h) {
  a(h.grains);
  a(h.loads);
  a(h.kinetics);
  a(h.pairs);
  a(h.words);
  auto bodies = static_cast<std::uint64_t>(h.bodies.size());
  a(bodies);
  h.bodies.resize(bodies);
  for (DeviceBodyState& b : h.bodies) {
    a(b.body);
    a(b.track);
    a(b.slots.per_grain);
    a(b.slots.near);
    a(b.slots.key);
    a(b.slots.words);
  }
  a(h.clumps);
  a(h.energy);
  a(h.steps);
  a(h.started);
}

}  // namespace

void CheckCheckpoints(const Experiment& e) {
  CheckWithin("output.checkpoint_every_s", e.checkpoint_every_s, 0, 1e300);
  if (!(e.checkpoint_every_s > 0)) return;
  CheckWithin("output.checkpoint_every_s", e.checkpoint_every_s, ProgramTime(e) / kMostFrames,
              1e300);
  for (const Grains& g : e.grains) {
    if (g.bonds.fragments > 0) {
      throw SpecError("output.checkpoint_every_s", "it with bonded grains",
                      "none: not possible yet");
    }
  }
  if (!e.box.follow.body.empty()) {
    throw SpecError("output.checkpoint_every_s", "it with a window that follows a body",
                    "none: not possible yet");
  }
  if (!e.joints.empty() || !e.springs.empty()) {
    throw SpecError("output.checkpoint_every_s", "it with joints", "none: not possible yet");
  }
  for (const Probe& p : e.probes) {
    if (p.kind == Probe::Kind::kRings) {
      throw SpecError("output.checkpoint_every_s", "it with a probe 'rings'",
                      "none: not possible yet");
    }
  }
}

void Ground::Save(ByteWriter& out) const {
  std::vector<GrainState> grains;
  if (world_->clumps() == 0) {
    for (std::int64_t i = 0; i < world_->count(); ++i) grains.push_back(world_->State(i));
  }
  out(world_->config().dt_s);
  out(grains);
  out(surface_);
  out(level_);
  out(top_solid_fraction_);
  out(solid_fraction_);
  DeviceState state = world_->ExportState();
  Walk(out, state);
}

void Ground::Load(ByteReader& in) {
  Contents contents;
  in(config_.dt_s);
  in(contents.grains);
  in(surface_);
  in(level_);
  in(top_solid_fraction_);
  in(solid_fraction_);
  DeviceState state;
  Walk(in, state);
  // Clumps are made as at the beginning; such worlds take no grains in or out.
  random_ = RandomOfSeed(e_.seed);
  if (contents.grains.empty()) contents = First();
  const bool energy = world_ && world_->config().energy;
  body_number_.assign(e_.bodies.size(), -1);
  walls_ = 0;
  if (e_.grains[0].filling == Filling::kBed) PlaceAsTile();
  OpenWith(contents);
  for (std::size_t b = 0; b < e_.bodies.size(); ++b) {
    if (body_number_[b] < 0) AddBodyOf(b);
  }
  const auto count = static_cast<std::size_t>(world_->count());
  const auto words = static_cast<std::size_t>(world_->list().words());
  bool good = state.grains.size() == count && state.loads.size() == count &&
              state.kinetics.size() == count && state.words.size() == state.pairs.size() * words &&
              state.clumps.size() == world_->state().clumps.size() &&
              state.bodies.size() == world_->state().bodies.size();
  for (const Grain& g : state.grains) good = good && g.id >= 0;
  if (!good) throw std::invalid_argument("checkpoint: it is of another experiment");
  world_->SetEnergy(energy);
  world_->ImportState(state);
}

}  // namespace grouser::dem::experiment
