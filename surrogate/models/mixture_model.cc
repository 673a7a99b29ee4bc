#include "surrogate/models/mixture_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace grouser::surrogate {
namespace {

constexpr std::size_t kBlock = 64;  // states at a time
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool Differ(double a, double b) { return !(std::fabs(a - b) <= 0.01 * std::fabs(b)); }

[[noreturn]] void Refuse(const std::string& what) {
  throw std::invalid_argument("mixture: " + what);
}

void CheckSame(const char* what, double got, double first) {
  if (!Differ(got, first)) return;
  Refuse(std::string("a model of ") + what + " " + std::to_string(got) + ", expected " +
         std::to_string(first) + ", that of the first");
}

/// What a part answers, and what the parts before it made, of at most kBlock states.
struct Rooms {
  struct OfOutput {
    std::array<std::array<double, kBlock>, kParts> part;
  };
  std::array<OfOutput, kOutputs> answer, sum;
  std::array<std::array<double, kBlock>, kOutputs> between;  // sum of w (m - mean)^2
  std::array<std::uint32_t, kBlock> flags, all_flags;
};

bool IsMean(int part) { return part == kValue || (part >= kDvX && part <= kDLoad); }
bool IsSquare(int part) { return part == kSdFit || part == kSdPatch || part == kHigh; }

/// One more part of weight w: weighted means by West's update (Comm. ACM 22, 1979), so that
/// equal answers keep their bits. kHigh holds half widths.
void Add(double w, double sum_of_weights, std::size_t count,
         const std::array<std::array<bool, kParts>, kOutputs>& wanted, Rooms* r) noexcept {
  const double share = w / sum_of_weights;
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      if (!wanted[o][p] || p == kLow) continue;
      const double* from = r->answer[o].part[p].data();
      double* to = r->sum[o].part[p].data();
      for (std::size_t i = 0; i < count; ++i) {
        if (IsSquare(p)) {
          const double x = p == kHigh ? from[i] - r->answer[o].part[kValue][i] : from[i];
          to[i] += w * x * x;
        } else {
          const double step = from[i] - to[i], before = to[i];
          to[i] = before + share * step;
          if (p == kValue) r->between[o][i] += w * step * (from[i] - to[i]);
        }
      }
    }
  }
  for (std::size_t i = 0; i < count; ++i) r->all_flags[i] |= r->flags[i];
}

void Put(std::span<double> to, std::size_t i, double x) noexcept {
  if (!to.empty()) to[i] = x;
}

void Write(const Rooms& r, std::size_t count, const ResponsesView& out) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    out.flags[i] = r.all_flags[i];
    for (int o = 0; o < kOutputs; ++o) {
      const OutputView& to = out.output[o];
      const auto& of = r.sum[o].part;
      for (int p = 0; p < kParts; ++p) {
        if (IsMean(p)) Put(to.*kPartMembers[p], i, of[p][i]);
      }
      Put(to.sd_fit, i, std::sqrt(of[kSdFit][i]));
      Put(to.sd_patch, i, std::sqrt(of[kSdPatch][i]));
      Put(to.sd_soil, i, std::sqrt(r.between[o][i]));
      if (to.low.empty() && to.high.empty()) continue;
      const double half = std::sqrt(of[kHigh][i] + kTwoSided90 * kTwoSided90 * r.between[o][i]);
      Put(to.low, i, of[kValue][i] - half);
      Put(to.high, i, of[kValue][i] + half);
    }
  }
}

}  // namespace

MixtureModel::MixtureModel(std::vector<MixturePart> parts) {
  if (parts.empty() || parts.size() > kMost) {
    Refuse(std::to_string(parts.size()) + " models, expected 1 to " + std::to_string(kMost));
  }
  double sum = 0;
  for (const MixturePart& part : parts) {
    if (!part.model) Refuse("a part without a model");
    // Its own sd_soil would be lost.
    if (dynamic_cast<const MixtureModel*>(part.model.get())) Refuse("of a mixture");
    if (!(part.weight >= 0) || !std::isfinite(part.weight)) {
      Refuse("weight " + std::to_string(part.weight) + ", expected a finite number, 0 or more");
    }
    CheckSame("radius", part.radius_m, parts[0].radius_m);
    CheckSame("width", part.width_m, parts[0].width_m);
    CheckSame("gravity", part.gravity_m_per_s2, parts[0].gravity_m_per_s2);
    sum += part.weight;
  }
  if (!(sum > 0) || !std::isfinite(sum)) {
    Refuse("weights of sum " + std::to_string(sum) + ", expected a finite one above 0");
  }
  for (MixturePart& part : parts) {
    part.weight /= sum;
    if (part.weight > 0) parts_.push_back(std::move(part));
  }
}

double MixtureModel::Tolerance() const noexcept {
  double most = 0;
  for (const MixturePart& part : parts_) most = std::max(most, part.model->Tolerance());
  return most;
}

bool MixtureModel::UsesYawRate() const noexcept {
  return std::ranges::any_of(parts_, [](const MixturePart& p) { return p.model->UsesYawRate(); });
}

bool MixtureModel::HoldsOnSlopes() const noexcept {
  return std::ranges::all_of(parts_, [](const MixturePart& p) { return p.model->HoldsOnSlopes(); });
}

double MixtureModel::FastestOfRuns() const noexcept {
  double fastest = std::numeric_limits<double>::infinity();
  for (const MixturePart& p : parts_) fastest = std::min(fastest, p.model->FastestOfRuns());
  return fastest;
}

void MixtureModel::Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept {
  std::array<std::array<bool, kParts>, kOutputs> wanted;
  for (int o = 0; o < kOutputs; ++o) {
    const OutputView& to = out.output[o];
    for (int p = 0; p < kParts; ++p) wanted[o][p] = !(to.*kPartMembers[p]).empty();
    wanted[o][kHigh] |= wanted[o][kLow];
    wanted[o][kValue] |= wanted[o][kHigh] || !to.sd_soil.empty();
  }
  Rooms rooms;
  for (std::size_t first = 0; first < in.load.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, in.load.size() - first);
    const WheelStatesView states = Cut(in, first, count);
    const ResponsesView to = Cut(out, first, count);
    rooms.sum = {};
    rooms.between = {};
    rooms.all_flags = {};
    double weights = 0;
    for (const MixturePart& part : parts_) {
      ResponsesView answer;
      for (int o = 0; o < kOutputs; ++o) {
        for (int p = 0; p < kParts; ++p) {
          if (!wanted[o][p] || p == kLow) continue;
          answer.output[o].*kPartMembers[p] = {rooms.answer[o].part[p].data(), count};
        }
      }
      answer.flags = {rooms.flags.data(), count};
      answer.slip = to.slip;
      answer.attack_angle = to.attack_angle;
      part.model->Evaluate(states, answer);
      weights += part.weight;
      Add(part.weight, weights, count, wanted, &rooms);
    }
    Write(rooms, count, to);
  }
}

FormErrors Mixed(std::span<const FormErrors> forms, std::span<const double> weights) {
  FormErrors mixed;
  const double middle = forms[0].middle_load_n;
  if (std::ranges::any_of(
          forms, [&](const FormErrors& f) { return (f.middle_load_n == 0) != (middle == 0); })) {
    return mixed;
  }
  mixed.middle_load_n = middle;
  for (std::size_t k = 0; k < kMeasuredRegions; ++k) {
    for (int o = 0; o < kOutputs; ++o) {
      double sd = 0, half = 0;
      for (std::size_t i = 0; i < forms.size(); ++i) {
        const bool by_load = middle > 0 && o != kSinkage;
        const double of =
            forms[i].region[k].sd[o] * (by_load ? middle / forms[i].middle_load_n : 1);
        const double wide = of * forms[i].region[k].factor[o];
        sd += weights[i] * of * of;
        half += weights[i] * wide * wide;
      }
      mixed.region[k].sd[o] = std::sqrt(sd);
      mixed.region[k].factor[o] = sd > 0 ? std::sqrt(half / sd) : half + (sd == 0 ? 0 : kNaN);
    }
  }
  return mixed;
}

}  // namespace grouser::surrogate
