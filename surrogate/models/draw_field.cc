#include "surrogate/models/draw_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "surrogate/models/isa.h"
#include "surrogate/models/number.h"

namespace grouser::surrogate {
namespace {

using draws::Frequencies, draws::kFeatures, draws::Member;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kCommonEvery = 2;       // of physics: one feature in so many has long lengths
constexpr double kCommonLength = 4;   // over those of the others
constexpr double kLeastGrip = -0.95;  // of c z, hard ground
constexpr std::size_t kBlock = 64;    // states

/// Two independent standard normal numbers of two uniform ones in (0, 1) (Box and Muller 1958), by
/// functions that round alike everywhere.
std::array<double, 2> Normal(double u, double v) {
  const double size = Sqrt<double>(-2 * Log<double>(u));
  const Angle<double> half = SinCos<double>((v - 0.5) * std::numbers::pi);
  return {size * (1 - 2 * half.sin * half.sin), size * 2 * half.sin * half.cos};
}

/// Uniform numbers that follow from a key and their places alone (SplitMix64: Steele et al. 2014).
double Uniform(std::uint64_t key, std::uint64_t place) {
  std::uint64_t z = key + (place + 1) * 0x9e3779b97f4a7c15;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  z ^= z >> 31;
  return (static_cast<double>(z >> 12) + 0.5) * 0x1p-52;
}

/// FNV-1a.
std::uint64_t KeyOf(std::string_view soil) {
  std::uint64_t key = 0xcbf29ce484222325;
  for (const char c : soil) key = (key ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return key;
}

/// Normal frequencies, evenly spread (Kronecker's sequence by powers of 1/root of x^5 = x + 1), the
/// same for all. Every `common`-th feature has long lengths; 0: none.
Frequencies MakeFrequencies(const DrawLengths& lengths, int common) {
  Frequencies w;
  for (int m = 0; m < kFeatures; ++m) {
    double u[4], power = 1;
    for (double& x : u) {
      power *= 0.8566748838545029;
      x = 0.5 + (m + 1) * power;
      x -= static_cast<double>(static_cast<int>(x));
    }
    const std::array<double, 2> plane = Normal(u[0], u[1]), rest = Normal(u[2], u[3]);
    const bool is_common = common > 0 && m % common == 0;
    const double per = 1 / (kTurn * (is_common ? kCommonLength : 1));
    w.v_x[m] = plane[0] * per / lengths.plane;
    w.rim[m] = plane[1] * per / lengths.plane;
    w.v_y[m] = rest[0] * per / lengths.lateral;
    w.load[m] = rest[1] * per / lengths.log_load;
  }
  return w;
}

const Frequencies& FrequenciesOf(const ErrorForm& form) noexcept {
  static const Frequencies of_fit = MakeFrequencies(DrawLengths::OfFit(), 0);
  static const Frequencies of_physics = MakeFrequencies(DrawLengths::OfPhysics(), kCommonEvery);
  return form.of_physics ? of_physics : of_fit;
}

Member MakeMember(std::uint64_t key, std::uint64_t k) {
  Member member;
  constexpr std::uint64_t kPlaces = 2 * (2 * kOutputs * kFeatures + 1);  // numbers of a draw
  std::uint64_t place = k * kPlaces;
  const auto next = [&] {
    place += 2;
    return Normal(Uniform(key, place - 2), Uniform(key, place - 1));
  };
  const auto fill = [&](draws::Coefficients* c) {
    for (int m = 0; m < kFeatures; ++m) {
      const std::array<double, 2> pair = next();
      c->a[m] = pair[0];
      c->b[m] = pair[1];
    }
  };
  for (draws::Coefficients& c : member.own) fill(&c);
  for (draws::Coefficients& c : member.breaking) fill(&c);
  const std::array<double, 2> hard = next();
  member.friction = hard[0];
  member.rolling = hard[1];
  member.which = Uniform(~key, k);
  return member;
}

/// Errors of states `first` on, over their sds, to values.
void AddField(const Frequencies& frequencies, const DrawBatch& b, std::size_t first,
              std::size_t count, draws::BlockFn kernel) {
  double error[kOutputs][kBlock], slope[kOutputs][4][kBlock];
  draws::Block block{static_cast<int>(count),
                     b.v_x.data() + first,
                     b.v_y.data() + first,
                     b.rim_speed.data() + first,
                     b.load.data() + first,
                     b.member.data() + first,
                     {},
                     {}};
  for (int o = 0; o < kOutputs; ++o) {
    if (b.value[o].empty()) continue;
    block.error[o] = error[o];
    for (int k = 0; k < 4 && !b.slope[o][k].empty(); ++k) block.slope[o][k] = slope[o][k];
  }
  kernel(frequencies, block);
  for (int o = 0; o < kOutputs; ++o) {
    if (b.value[o].empty()) continue;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t at = first + i;
      double& value = b.value[o][at];
      if (b.member[at] == nullptr) continue;
      const double sd = (b.high[o][at] - value) / kTwoSided90;
      value += sd * error[o][i];
      if (o == kSinkage && value < 0) value = 0;
      if (b.slope[o][0].empty()) continue;
      for (int k = 0; k < 4; ++k) b.slope[o][k][at] += sd * slope[o][k][i];
      if (b.load[at] > 0) b.slope[o][3][at] += sd * error[o][i] / b.load[at];
    }
  }
}

/// One state of hard ground.
void AddFriction(const DrawBatch& b, std::size_t i, double radius) {
  const Member& member = *b.member[i];
  const auto sd = [&](int o) { return (b.high[o][i] - b.value[o][i]) / kTwoSided90; };
  // c, the same of f_x, f_y and the scrub part of m_z.
  double c = 0;
  for (const int o : {kFx, kFy, kMz}) {
    if (b.value[o].empty() || b.value[o][i] == 0) continue;
    c = sd(o) / std::fabs(b.value[o][i]);
    break;
  }
  const double share = std::max(c * member.friction, kLeastGrip);
  // Of the slopes of `of`, a share is added to those of `to`.
  const auto add = [&](int to, double more, double slope_share, int of) {
    b.value[to][i] += more;
    for (int k = 0; k < 4 && !b.slope[to][k].empty(); ++k) {
      b.slope[to][k][i] += slope_share * b.slope[of][k][i];
    }
  };
  if (!b.value[kTorque].empty()) {
    const double pull = radius * sd(kFx), all = sd(kTorque);
    const double size = std::sqrt(std::max(0.0, all * all - pull * pull)) * member.rolling;
    const double rolling = b.rim_speed[i] < 0 ? -size : size;
    add(kTorque, radius * share * b.value[kFx][i] + rolling, radius * share, kFx);
    if (!b.slope[kTorque][3].empty() && b.load[i] > 0) {
      b.slope[kTorque][3][i] += rolling / b.load[i];
    }
  }
  if (!b.value[kMz].empty()) {
    const double scrub = c > 0 ? sd(kMz) / c : 0;
    const bool left = !b.yaw_rate.empty() && b.yaw_rate[i] > 0;
    add(kMz, share * (left ? -scrub : scrub), share, kMz);
  }
  for (const int o : {kFx, kFy}) {
    if (!b.value[o].empty()) add(o, share * b.value[o][i], share, o);
  }
}

using Members = std::array<const Member*, kBlock>;

/// Values and upper ends where the caller wants none, or those of one soil of several.
struct Rooms {
  std::array<std::array<double, kBlock>, kOutputs> value, high;
  std::array<std::uint32_t, kBlock> flags;
};

/// Moves the draws that are of model `part` from `from` to `to`; false: there are none.
bool Split(const WheelModel& model, const WheelModel& part, std::size_t count, Members* from,
           Members* to) noexcept {
  bool any = false;
  for (std::size_t i = 0; i < count; ++i) {
    Member const*& of = (*from)[i];
    const bool moves = of != nullptr && &model.OfDraw(of->which) == &part;
    (*to)[i] = moves ? of : nullptr;
    if (moves) of = nullptr;
    any = any || moves;
  }
  return any;
}

/// What turns a model's answers into draws. Gives `answers` room for what that needs.
DrawBatch BatchOf(const WheelModel& model, const WheelStatesView& states, const Members& member,
                  ResponsesView* answers, Rooms* rooms) noexcept {
  const std::size_t count = states.load.size();
  DrawBatch batch{states.v_x,
                  states.v_y,
                  states.rim_speed,
                  states.load,
                  states.yaw_rate,
                  std::span(member).first(count),
                  {},
                  {},
                  {}};
  const bool hard = model.Errors().friction_radius_m > 0;
  for (int o = 0; o < kOutputs; ++o) {
    OutputView& view = answers->output[o];
    // On hard ground all errors are those of f_x and f_y.
    if (hard && o <= kFy && view.value.empty())
      view.value = std::span(rooms->value[o]).first(count);
    if (view.value.empty()) continue;
    if (view.high.empty()) view.high = std::span(rooms->high[o]).first(count);
    batch.value[o] = view.value;
    batch.high[o] = view.high;
  }
  return batch;
}

/// Draws of a mixture: each state's value is that of the soil that its draw is of. What is NaN
/// stays so.
void AddSoils(const WheelModel& mixture, const WheelStatesView& states, Members* draws,
              const ResponsesView& out, Rooms* rooms) noexcept {
  const std::size_t count = states.load.size();
  for (std::size_t first = 0; first < count; ++first) {
    if ((*draws)[first] == nullptr) continue;
    const WheelModel& soil = mixture.OfDraw((*draws)[first]->which);
    Members member;
    Split(mixture, soil, count, draws, &member);
    ResponsesView answers;
    answers.flags = std::span(rooms->flags).first(count);
    for (int o = 0; o < kOutputs; ++o) {
      if (out.output[o].value.empty()) continue;
      answers.output[o].value = std::span(rooms->value[o]).first(count);
    }
    const DrawBatch batch = BatchOf(soil, states, member, &answers, rooms);
    soil.Evaluate(states, answers);
    AddErrors(soil, batch);
    for (int o = 0; o < kOutputs; ++o) {
      const std::span<double> value = out.output[o].value;
      for (std::size_t i = first; i < count && !value.empty(); ++i) {
        if (member[i] != nullptr && !std::isnan(value[i])) value[i] = rooms->value[o][i];
      }
    }
  }
}

}  // namespace

Draws::Draws(std::string_view soil, std::size_t count) {
  if (count < 1 || count > kMost) {
    throw std::invalid_argument("draws: got " + std::to_string(count) + ", expected 1 to " +
                                std::to_string(kMost));
  }
  FrequenciesOf({});  // not within a solve
  const std::uint64_t key = KeyOf(soil);
  members_.reserve(count);
  for (std::size_t k = 0; k < count; ++k) members_.push_back(MakeMember(key, k));
}

double UnitErrorOf(const ErrorForm& form, const Member& member, int output, double v_x, double v_y,
                   double rim, double load) noexcept {
  const Frequencies& w = FrequenciesOf(form);
  const double size = std::sqrt(v_x * v_x + v_y * v_y + rim * rim), per = size > 0 ? 1 / size : 0;
  const bool odd_x = kOutputFields[output].parity_x < 0, odd_y = kOutputFields[output].parity_y < 0;
  double own = 0, own2 = 0, broken = 0, even2 = 0;
  for (int m = 0; m < kFeatures; ++m) {
    const double plane = kTurn * per * (w.v_x[m] * v_x + w.rim[m] * rim);
    const double side = kTurn * per * w.v_y[m] * v_y, l = kTurn * w.load[m] * std::log(load);
    const auto with = [&](const draws::Coefficients& c) {
      return c.a[m] * std::cos(l) + c.b[m] * std::sin(l);
    };
    const double s =
        (odd_x ? std::sin(plane) : std::cos(plane)) * (odd_y ? std::sin(side) : std::cos(side));
    const double even = std::cos(plane) * std::cos(side);
    own += s * with(member.own[output]);
    own2 += s * s;
    broken += even * with(member.breaking[output]);
    even2 += even * even;
  }
  const double e = odd_x || odd_y ? draws::kBreaking : 0;
  return (own + e * broken) / std::sqrt(own2 + e * e * even2);
}

void AddErrors(const WheelModel& model, const DrawBatch& batch, draws::BlockFn kernel) noexcept {
  const std::size_t n = batch.load.size();
  const ErrorForm form = model.Errors();
  if (const double radius = form.friction_radius_m; radius > 0) {
    for (std::size_t i = 0; i < n; ++i) {
      if (batch.member[i] != nullptr) AddFriction(batch, i, radius);
    }
    return;
  }
  if (kernel == nullptr) kernel = DrawKernelFor(nullptr);
  for (std::size_t first = 0; first < n; first += kBlock) {
    AddField(FrequenciesOf(form), batch, first, std::min(kBlock, n - first), kernel);
  }
}

void EvaluateDraws(const WheelModel& model, const FormErrors& form, const Draws& draws,
                   std::span<const std::uint32_t> k, const WheelStatesView& in,
                   const ResponsesView& out, const FormView& to) noexcept {
  Rooms rooms;
  for (std::size_t first = 0; first < in.load.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, in.load.size() - first);
    const WheelStatesView states = Cut(in, first, count);
    const ResponsesView answers = Cut(out, first, count);
    Members member, others;
    for (std::size_t i = 0; i < count; ++i) others[i] = &draws[k[first + i]];
    const bool own = Split(model, model, count, &others, &member);
    ResponsesView asked = answers;
    const DrawBatch batch = BatchOf(model, states, member, &asked, &rooms);
    EvaluateWithForm(model, form, states, asked, Cut(to, first, count));
    if (own) AddErrors(model, batch);
    AddSoils(model, states, &others, answers, &rooms);
  }
}

}  // namespace grouser::surrogate
