#include "clients/in_process/grouser/model.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <exception>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "clients/in_process/parts.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/selectable_model.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/models/draw_field.h"
#include "surrogate/models/wheel_model.h"

namespace grouser {
namespace {

// The public header repeats these; it may not include ours.
static_assert(kOutputs == surrogate::kOutputs);
static_assert(int{kFx} == surrogate::kFx && int{kFy} == surrogate::kFy &&
              int{kFz} == surrogate::kFz && int{kTorque} == surrogate::kTorque &&
              int{kMz} == surrogate::kMz && int{kSinkage} == surrogate::kSinkage);
constexpr bool SameNames() {
  for (std::size_t o = 0; o < kOutputs; ++o) {
    if (std::string_view(kOutputNames[o]) != surrogate::kOutputFields[o].name) return false;
  }
  return true;
}
static_assert(SameNames());
constexpr bool SameBit(Flag ours, surrogate::Flag theirs) {
  return static_cast<std::uint32_t>(ours) == static_cast<std::uint32_t>(theirs);
}
static_assert(SameBit(kInvalid, surrogate::kInvalid) && SameBit(kClamped, surrogate::kClamped) &&
              SameBit(kExtrapolated, surrogate::kExtrapolated) &&
              SameBit(kStatic, surrogate::kStatic) &&
              SameBit(kNoEquilibrium, surrogate::kNoEquilibrium) &&
              SameBit(kRate, surrogate::kRate) && SameBit(kSlope, surrogate::kSlope) &&
              SameBit(kVirginAssumed, surrogate::kVirginAssumed) &&
              SameBit(kFormUnknown, surrogate::kFormUnknown) &&
              SameBit(kToleranceUnmet, surrogate::kToleranceUnmet) &&
              SameBit(kAirborne, surrogate::kAirborne) && SameBit(kUntuned, surrogate::kUntuned) &&
              SameBit(kUntuned, std::end(surrogate::kFlagFields)[-1].flag));

// Spans of length 1 into `answer`.
Answers ViewOf(Answer* answer) noexcept {
  Answers out;
  for (std::size_t o = 0; o < kOutputs; ++o) {
    OutputAnswer& a = answer->output[o];
    const auto one = [](double& x) { return std::span<double>(&x, 1); };
    out.output[o] = {one(a.value),  one(a.sd_fit),  one(a.sd_patch),     one(a.low),
                     one(a.high),   one(a.d_v_x),   one(a.d_v_y),        one(a.d_rim_speed),
                     one(a.d_load), one(a.sd_form), one(a.measured_low), one(a.measured_high),
                     one(a.sd_soil)};
  }
  out.flags = {&answer->flags, 1};
  out.slip = {&answer->slip, 1};
  out.attack_angle = {&answer->attack_angle, 1};
  return out;
}

// "MODEL_KIND_HYBRID" -> "hybrid"; the default of the message is the hybrid.
std::string NameOf(v1alpha1::ModelKind model) {
  if (model == v1alpha1::MODEL_KIND_UNSPECIFIED) model = v1alpha1::MODEL_KIND_HYBRID;
  std::string name = v1alpha1::ModelKind_Name(model);
  constexpr std::string_view kPrefix = "MODEL_KIND_";
  if (name.starts_with(kPrefix)) name.erase(0, kPrefix.size());
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

// What says which wheels are similar.
std::shared_ptr<const v1alpha1::Model> HeadOf(const v1alpha1::Model& message) {
  auto head = std::make_shared<v1alpha1::Model>();
  head->set_name(message.name());
  head->set_kind(message.kind());
  head->set_untuned(message.untuned());
  *head->mutable_soil() = message.soil();
  *head->mutable_wheel() = message.wheel();
  if (message.has_bekker()) *head->mutable_bekker() = message.bekker();
  return head;
}

}  // namespace

// Asks the evaluator itself, so that no list of models has to be kept here.
bool Model::Parts::FillsGradients() const noexcept {
  const double angle = std::min(0.2, domain.attack_angle_max_rad / 2);
  const double speed = domain.speed_m_per_s > 0 ? domain.speed_m_per_s : 0.1;
  const double load = std::sqrt(domain.load_min_n * domain.load_max_n);
  const surrogate::VelocityState v = surrogate::FromSlip(0.1, angle, speed);
  Answer answer{};
  const Answers out = ViewOf(&answer);
  Evaluate({{&v.v_x, 1}, {&v.v_y, 1}, {&v.rim_speed, 1}, {&load, 1}}, out);
  bool filled = true;
  for (const OutputSpans& o : out.output) {
    for (std::size_t f = kFirstGradient; f < kGradientsEnd; ++f) {
      filled &= !std::isnan((o.*kOutputSpanFields[f].member)[0]);
    }
  }
  return filled;
}

Model::Model(std::shared_ptr<const Parts> parts) noexcept : parts_(std::move(parts)) {}
Model::Model(Model&& other) noexcept = default;
Model& Model::operator=(Model&& other) noexcept = default;
Model::~Model() = default;

Model Model::Open(const std::filesystem::path& model_file) try {
  const records::LoadedModel loaded = surrogate::ReadModel(model_file.string());
  const v1alpha1::Model& message = loaded.model;
  auto parts = std::make_unique<Parts>();
  parts->evaluator = surrogate::MakeModel(message);
  parts->name = message.name();
  parts->soil = message.soil().name();
  parts->wheel = message.wheel().name();
  parts->kind = NameOf(message.kind());
  parts->digest = loaded.digest;
  parts->radius_m = message.wheel().radius_m();
  parts->width_m = message.wheel().width_m();
  parts->gravity_m_per_s2 = message.soil().gravity_m_per_s2();
  parts->interval_level = message.interval_level();
  const v1alpha1::Domain& d = message.domain();
  parts->domain = {d.slip_min(),   d.slip_max(),   d.attack_angle_max_rad(),
                   d.load_min_n(), d.load_max_n(), d.speed_m_per_s()};
  parts->has_gradients = parts->FillsGradients();
  parts->as_selectable = surrogate::MakeSelectableModel(message, *parts->evaluator);
  parts->pair = surrogate::PairKey(message);
  parts->head = HeadOf(message);
  return Model(std::move(parts));
} catch (const std::exception& error) {
  const std::string file = model_file.string(), what = error.what();
  throw std::runtime_error(what.starts_with(file) ? what : file + ": " + what);
}

struct Draws::Parts {
  surrogate::Draws draws;
};

static_assert(Draws::kMost == surrogate::Draws::kMost);
Draws::Draws(const std::string& soil, std::size_t count)
    : parts_(std::make_shared<const Parts>(surrogate::Draws(soil, count))) {}
Draws::Draws(const Draws& other) noexcept = default;
Draws& Draws::operator=(const Draws& other) noexcept = default;
Draws::~Draws() = default;
std::size_t Draws::size() const noexcept { return parts_->draws.size(); }

bool Model::EvaluateDraws(const States& in, const Draws& draws, std::span<const std::uint32_t> k,
                          const Answers& out) const noexcept {
  if (parts_ == nullptr || !SizesFit(in, out) || k.size() != in.load.size()) return false;
  if (std::any_of(k.begin(), k.end(), [&](std::uint32_t i) { return i >= draws.size(); })) {
    return false;
  }
  if (!parts_->has_gradients) FillGradients(out, kNaN);
  surrogate::EvaluateDraws(*parts_->evaluator, parts_->as_selectable.form, draws.parts_->draws, k,
                           ToView(in), ToView(out), FormViewOf(out));
  return true;
}

bool Model::Evaluate(const States& in, const Answers& out) const noexcept {
  if (parts_ == nullptr || !SizesFit(in, out)) return false;
  parts_->Evaluate(in, out);
  return true;
}

Answer Model::Evaluate(const State& state) const noexcept {
  Answer answer;
  const Answers out = ViewOf(&answer);
  const States in = {{&state.v_x, 1}, {&state.v_y, 1}, {&state.rim_speed, 1}, {&state.load, 1}};
  if (Evaluate(in, out)) return answer;
  for (OutputAnswer& o : answer.output) {
    o.value = o.sd_fit = o.sd_patch = o.low = o.high = kNaN;
    o.sd_form = o.measured_low = o.measured_high = o.sd_soil = kNaN;
  }
  FillGradients(out, kNaN);
  answer.slip = answer.attack_angle = kNaN;
  answer.flags = kInvalid;
  return answer;
}

std::string Model::SizeProblem(const States& in, const Answers& out) {
  const std::size_t n = in.load.size();
  const auto problem = [n](const std::string& name, std::size_t size, const char* otherwise) {
    return name + ": " + std::to_string(size) + " entries, expected " + std::to_string(n) +
           otherwise;
  };
  if (in.v_x.size() != n) return problem("v_x", in.v_x.size(), " as load");
  if (in.v_y.size() != n) return problem("v_y", in.v_y.size(), " as load");
  if (in.rim_speed.size() != n) return problem("rim_speed", in.rim_speed.size(), " as load");
  if (out.flags.size() != n) return problem("flags", out.flags.size(), "");
  if (!Fits(out.slip, n)) return problem("slip", out.slip.size(), " or none");
  if (!Fits(out.attack_angle, n)) {
    return problem("attack_angle", out.attack_angle.size(), " or none");
  }
  for (std::size_t o = 0; o < kOutputs; ++o) {
    for (const OutputSpanField& field : kOutputSpanFields) {
      const std::span<double> span = out.output[o].*field.member;
      if (Fits(span, n)) continue;
      return problem("output[" + std::to_string(o) + "]." + field.name, span.size(), " or none");
    }
  }
  return "";
}

const std::string& Model::name() const noexcept { return parts_->name; }
const std::string& Model::soil() const noexcept { return parts_->soil; }
const std::string& Model::wheel() const noexcept { return parts_->wheel; }
const std::string& Model::kind() const noexcept { return parts_->kind; }
const std::string& Model::digest() const noexcept { return parts_->digest; }
double Model::radius_m() const noexcept { return parts_->radius_m; }
double Model::width_m() const noexcept { return parts_->width_m; }
double Model::gravity_m_per_s2() const noexcept { return parts_->gravity_m_per_s2; }
double Model::interval_level() const noexcept { return parts_->interval_level; }
bool Model::has_gradients() const noexcept { return parts_->has_gradients; }
const Domain& Model::domain() const noexcept { return parts_->domain; }

}  // namespace grouser
