#include "dem_offline/engine/rig/window.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace grouser::dem {

Window::Window(const BedFeed& feed, const WindowSettings& settings, double hub_x_m)
    : feed_(feed), settings_(settings) {
  const double least = 2 * settings.band_m + 2 * settings.slab_m;
  if (!(settings.slab_m > 0) || !(settings.band_m > 0) || !(settings.length_m > least)) {
    throw std::invalid_argument("rig.scene.window_length_m: " + std::to_string(settings.length_m) +
                                ", expected more than " + std::to_string(least) +
                                " (two frozen bands and two slabs)");
  }
  to_ = hub_x_m + settings.ahead * settings.length_m;
  from_ = to_ - settings.length_m;
}

const BedPiece& Window::Fill() {
  first_ = feed_.Between(from_, to_);
  Register(first_, 0);
  return first_;
}

void Window::Register(const BedPiece& piece, std::int32_t first_id) {
  for (std::size_t p = 0; p < piece.tile_places.size(); ++p) {
    const TilePlace& h = piece.tile_places[p];
    if (h.grain >= static_cast<std::int32_t>(newest_.size())) newest_.resize(h.grain + 1);
    if (h.copy >= newest_[h.grain].copy) {
      newest_[h.grain] = {h.copy, first_id + static_cast<std::int32_t>(p)};
    }
  }
}

bool Window::Due(double hub_x_m) const {
  return hub_x_m + settings_.ahead * settings_.length_m >= to_ + settings_.slab_m;
}

double Window::Unwrapped(std::int32_t x) const {
  const double in_frame = static_cast<std::uint32_t>(x) / 4294967296.0 * settings_.length_m;
  const double past = std::fmod(in_frame - from_, settings_.length_m);
  return from_ + (past < 0 ? past + settings_.length_m : past);
}

bool Window::InBand(std::int32_t x) const {
  const double at = Unwrapped(x);
  return at < from_ + settings_.band_m || at >= to_ - settings_.band_m;
}

void Window::Advance(World& world) {
  const double next_from = from_ + settings_.slab_m, next_to = to_ + settings_.slab_m;
  GrainExchange change;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const Grain& g = world.grains()[i];
    if (Unwrapped(g.x) < next_from) change.out.push_back(g.id);
  }
  // By id, not by place in memory: the order must not depend on sorting.
  std::sort(change.out.begin(), change.out.end());
  const BedPiece slab = feed_.Between(to_, next_to);
  change.in = slab.grains;
  const auto words = static_cast<std::size_t>(world.config().contacts.layout().words);
  const auto copy_words = [&](const float* from, auto* touch) {
    std::copy(from, from + words, touch->words.begin());
  };
  // -1 - id of a resident; 0 for one that is not there (yet).
  const auto index_of = [&](std::int32_t in, const TilePlace& place) -> std::int32_t {
    if (in >= 0) return in;
    const bool known = place.grain < static_cast<std::int32_t>(newest_.size()) &&
                       newest_[place.grain].copy == place.copy;
    return known ? -1 - newest_[place.grain].id : INT32_MAX;
  };
  for (const BedTouch& t : slab.touches) {
    GrainExchange::Touch touch = {};
    touch.a = index_of(t.in_a, t.a);
    touch.b = index_of(t.in_b, t.b);
    if (touch.a == INT32_MAX || touch.b == INT32_MAX) continue;  // soil of the slab to come
    copy_words(t.words, &touch);
    change.touches.push_back(touch);
  }
  for (const FloorTouch& t : slab.floor) {
    GrainExchange::BodyTouch touch = {};
    touch.a = t.in;
    touch.body = 0;
    touch.key = 0;
    copy_words(t.words, &touch);
    change.body_touches.push_back(touch);
  }
  Register(slab, world.Exchange(change));
  from_ = next_from;
  to_ = next_to;
  ++slabs_;
}

}  // namespace grouser::dem
