#include "wheel_fmu.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace grouser::fmi {

void Refuse(const std::string& what, double got, const std::string& expected) {
  std::ostringstream text;
  text << what << ": got " << got << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

namespace {

using Vector = std::array<double, 3>;

static_assert(kTable[at::kDampingRatio].start == ContactOptions{}.damping_ratio &&
              kTable[at::kRelaxationOverRadius].start == ContactOptions{}.relaxation_over_radius &&
              kTable[at::kShearDampingRatio].start == ContactOptions{}.shear_damping_ratio);

// Start values that stand in the FMU instead of the table's.
void ReadParameters(const std::filesystem::path& file, std::array<double, kVariables>* start) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  for (std::string line; std::getline(in, line);) {
    const std::size_t comma = line.find(',');
    unsigned i = 0;
    while (i < kVariables && line.substr(0, comma) != kTable[i].name) ++i;
    // As the C locale has it, whichever the host's is.
    const char* end = line.data() + line.size();
    const char* from = comma == std::string::npos ? end : line.data() + comma + 1;
    double value = 0;
    const auto [to, error] = std::from_chars(from, end, value);
    if (i == kVariables || kTable[i].causality != Causality::kParameter || error != std::errc() ||
        to != end || !std::isfinite(value)) {
      throw std::runtime_error(file.string() + ": got \"" + line +
                               "\", expected a parameter's name, a comma and a number");
    }
    (*start)[i] = value;
  }
}

bool IsFinite(double x) { return std::isfinite(x); }

// The wheel's y axis in the world, of an orientation as a quaternion of any length above 0.
Vector AxleOf(const double* e) {
  const double e0 = e[0], e1 = e[1], e2 = e[2], e3 = e[3];
  return {2 * (e1 * e2 - e0 * e3), e0 * e0 - e1 * e1 + e2 * e2 - e3 * e3, 2 * (e2 * e3 + e0 * e1)};
}

}  // namespace

WheelFmu::WheelFmu(const std::filesystem::path& resources, const std::string& token)
    : model_(std::make_unique<const Model>(Model::Open(resources / "wheel.model"))) {
  if (token != "grouser-" + model_->digest()) {
    throw std::invalid_argument("instantiation token: got \"" + token + "\", expected grouser-" +
                                model_->digest() + ", of the model in " + resources.string());
  }
  for (unsigned i = 0; i < kVariables; ++i) start_.value[i] = kTable[i].start;
  start_.value[at::kWheelRadius] = model_->radius_m();
  start_.value[at::kWheelWidth] = model_->width_m();
  ReadParameters(resources / "parameters.csv", &start_.value);
  Reset();
}

void WheelFmu::Reset() { now_ = start_; }

void WheelFmu::RequireMode(Mode mode, const char* call) const {
  if (now_.mode == mode) return;
  throw std::logic_error(std::string(call) + ": not allowed in this mode of the FMU");
}

void WheelFmu::SetUp(double start_time) {
  RequireMode(Mode::kInstantiated, "setup experiment");
  if (!std::isfinite(start_time)) Refuse("start time", start_time, "a finite one [s]");
  now_.value[at::kTime] = start_time;
  now_.set_up = 1;
}

void WheelFmu::EnterInitialization(double start_time) {
  RequireMode(Mode::kInstantiated, "enter initialization mode");
  SetUp(start_time);
  now_.mode = Mode::kInitialization;
}

void WheelFmu::ExitInitialization() {
  RequireMode(Mode::kInitialization, "exit initialization mode");
  Calculate(0);
  now_.mode = Mode::kStep;
}

void WheelFmu::Terminate() {
  RequireMode(Mode::kStep, "terminate");
  now_.mode = Mode::kTerminated;
}

void WheelFmu::CheckSizes(std::size_t references, std::size_t values) {
  if (references == values) return;
  throw std::invalid_argument(std::to_string(values) + " values, expected " +
                              std::to_string(references) + ", one for each value reference");
}

double WheelFmu::Value(Type type, unsigned reference) const {
  if (reference < kVariables && kTable[reference].type == type) return now_.value[reference];
  throw std::invalid_argument("value reference " + std::to_string(reference) +
                              ": no variable of that type has it");
}

void WheelFmu::Set(std::span<const unsigned> references, std::span<const double> values) {
  CheckSizes(references.size(), values.size());
  const bool begun = now_.mode == Mode::kStep || now_.mode == Mode::kTerminated;
  for (std::size_t i = 0; i < values.size(); ++i) {
    (void)Value(Type::kFloat64, references[i]);  // there is one
    const Variable& variable = kTable[references[i]];
    const bool open = variable.causality == Causality::kInput ||
                      (variable.causality == Causality::kParameter && !begun);
    if (!open) throw std::invalid_argument(std::string(variable.name) + ": cannot be set now");
    if (!std::isfinite(values[i])) Refuse(variable.name, values[i], "a finite number");
  }
  for (std::size_t i = 0; i < values.size(); ++i) now_.value[references[i]] = values[i];
}

ContactOptions WheelFmu::Options() const {
  ContactOptions options;
  const double stiffness = now_.value[at::kTyreStiffness];
  if (stiffness < 0) Refuse("tyre_stiffness", stiffness, "0 N/m (a rigid wheel) or more");
  if (stiffness > 0) options.tyre_stiffness = stiffness;
  options.damping_ratio = now_.value[at::kDampingRatio];
  options.relaxation_over_radius = now_.value[at::kRelaxationOverRadius];
  options.shear_damping_ratio = now_.value[at::kShearDampingRatio];
  return options;
}

void WheelFmu::DoStep(double time, double step) {
  RequireMode(Mode::kStep, "do step");
  if (!std::isfinite(time)) Refuse("current communication point", time, "a finite one [s]");
  if (!(step >= 0 && std::isfinite(step))) {
    Refuse("communication step size", step, "0 s or more");
  }
  Calculate(step);
  now_.value[at::kTime] = time + step;
}

void WheelFmu::Calculate(double step) {
  const ContactOptions options = Options();
  const auto same = [&](double ContactOptions::*m) { return options.*m == made_with_.*m; };
  if (contact_ == nullptr || !same(&ContactOptions::tyre_stiffness) ||
      !same(&ContactOptions::damping_ratio) || !same(&ContactOptions::relaxation_over_radius) ||
      !same(&ContactOptions::shear_damping_ratio)) {
    contact_ = std::make_unique<WheelContact>(*model_, options);
    made_with_ = options;
  }
  const auto vector = [this](unsigned first) {
    return Vector{now_.value[first], now_.value[first + 1], now_.value[first + 2]};
  };
  WheelMotion motion;
  motion.centre = vector(at::kWheelStatePosX);
  motion.axle = AxleOf(&now_.value[at::kWheelStateRotE0]);
  motion.velocity = vector(at::kWheelStateLinVelX);
  motion.angular_velocity = vector(at::kWheelStateAngVelX);
  motion.ground_point = {motion.centre[0], motion.centre[1], now_.value[at::kTerrainHeight]};
  motion.ground_normal = vector(at::kTerrainNormalX);
  motion.time_step = step;
  const State before = now_;
  const WheelForce force = contact_->Evaluate(motion, &now_.contact);
  for (unsigned k = 0; k < 3; ++k) {
    now_.value[at::kWheelLoadPointX + k] = now_.value[at::kQueryPointX + k] = motion.centre[k];
    now_.value[at::kWheelLoadForceX + k] = force.force[k];
    now_.value[at::kWheelLoadMomentX + k] = force.moment[k];
  }
  WriteContact(force);
  WriteHalfWidths(force);
  if ((force.flags & kInvalid) != 0 || !std::ranges::all_of(now_.value, IsFinite)) {
    now_ = before;
    const auto text = [](const char* name, const Vector& v) {
      std::ostringstream all;
      all << name << " (" << v[0] << ", " << v[1] << ", " << v[2] << ")";
      return all.str();
    };
    throw std::invalid_argument(
        "no answer: " + text("axle of wheel_state.rot", motion.axle) + ", " +
        text("terrain_normal", motion.ground_normal) + ", " +
        text("wheel_state.lin_vel", motion.velocity) +
        "; expected lengths above 0 of the first two, and numbers that do not overflow");
  }
}

void WheelFmu::WriteContact(const WheelForce& force) {
  auto& value = now_.value;
  const double fastest = std::max(std::fabs(force.rim_speed), std::hypot(force.v_x, force.v_y));
  value[at::kContactLoad] = force.load;
  value[at::kContactSinkage] = force.sinkage;
  value[at::kContactSlip] = fastest > 0 ? (force.rim_speed - force.v_x) / fastest : 0;
  value[at::kContactSlipAngle] = std::atan2(force.v_y, force.v_x);
  value[at::kContactVX] = force.v_x;
  value[at::kContactVY] = force.v_y;
  value[at::kContactRimSpeed] = force.rim_speed;
  value[at::kContactMobilised] = force.mobilised;
  value[at::kContactFX] = force.f_x;
  value[at::kContactFY] = force.f_y;
  value[at::kContactTorque] = force.torque;
  value[at::kContactMZ] = force.m_z;
  value[at::kFlags] = force.flags;
  value[at::kExtrapolated] = (force.flags & kExtrapolated) != 0;
  value[at::kOverload] = (force.flags & kNoEquilibrium) != 0;
}

// Of the model at what it was asked, unscaled: what a wheel that is held feels is known no better
// than what it feels once it moves. Its sinkage is that of a wheel at rest by 1 - mobilised.
void WheelFmu::WriteHalfWidths(const WheelForce& force) {
  const std::array<double, 2> v_x = {force.v_x, 0}, v_y = {force.v_y, 0},
                              rim = {force.rim_speed, 0}, load = {force.load, force.load};
  std::array<std::array<double, 2>, kOutputs> low{}, high{};
  std::array<std::uint32_t, 2> flags{};
  const double m = force.mobilised;
  const std::size_t n = m < 1 ? 2 : 1;  // at rest too, where it counts
  const auto first = [n](auto& both) { return std::span(both.data(), n); };
  Answers answers;
  answers.flags = first(flags);
  for (std::size_t o = 0; o < kOutputs; ++o) {
    answers.output[o].low = first(low[o]);
    answers.output[o].high = first(high[o]);
  }
  (void)model_->Evaluate({first(v_x), first(v_y), first(rim), first(load)},
                         answers);  // sizes are right
  const auto half = [&](Output o, std::size_t i = 0) { return 0.5 * (high[o][i] - low[o][i]); };
  now_.value[at::kHalfWidthFX] = half(kFx);
  now_.value[at::kHalfWidthFY] = half(kFy);
  now_.value[at::kHalfWidthTorque] = half(kTorque);
  now_.value[at::kHalfWidthMZ] = half(kMz);
  now_.value[at::kHalfWidthSinkage] = m * half(kSinkage) + (1 - m) * half(kSinkage, 1);
}

void WheelFmu::SetState(const State& state) { now_ = state; }

}  // namespace grouser::fmi
