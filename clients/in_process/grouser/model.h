#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

/// Grouser in your own process: a fitted model of one wheel on one soil, read
/// from a model file. Nothing but the C++20 library is needed to include this;
/// link the CMake target grouser::model.
///
/// SI and radians; x forward, y left, z up (REP-103). Forces are those of the
/// soil on the wheel, at its centre, in the wheel's contact frame.

#if defined(__GNUC__)
#define GROUSER_PUBLIC __attribute__((visibility("default")))
#else
#define GROUSER_PUBLIC
#endif

namespace grouser {

/// What is answered, in this order everywhere.
enum Output : int {
  kFx = 0,   ///< drawbar pull [N]
  kFy,       ///< lateral force [N]
  kFz,       ///< vertical force [N]
  kTorque,   ///< drive torque, positive when the motor drives [N m]
  kMz,       ///< moment about the vertical at the centre [N m]
  kSinkage,  ///< undisturbed plane to the lowest rim point [m]
};
inline constexpr std::size_t kOutputs = 6;
/// In files, JSON and Python, by Output.
inline constexpr std::array<const char*, kOutputs> kOutputNames = {"f_x",    "f_y", "f_z",
                                                                   "torque", "m_z", "sinkage"};

/// Bits of a state's flags. 0: nothing to say.
enum Flag : std::uint32_t {
  kInvalid = 1,         ///< non-finite input or load < 0; the outputs are NaN
  kClamped = 2,         ///< something was clamped to the model's limits
  kExtrapolated = 4,    ///< outside what the training runs covered
  kStatic = 8,          ///< hub and rim stand still
  kNoEquilibrium = 16,  ///< the soil does not carry the load
  kRate = 32,           ///< faster than the quasi-static range
  kSlope = 64,  ///< not of States: of a vehicle's wheel on a slope, for which no model was run
  kVirginAssumed = 256,
  /// Against a measurement some output's error is unknown here: its measured_low, measured_high
  /// are NaN, and so is its sd_form but in files that have one number for all regions (not counted:
  /// f_z, which is the load).
  kFormUnknown = 512,
  kToleranceUnmet = 1024,
  kAirborne = 2048,  ///< load 0, a wheel off the ground: every output is exactly 0
  kUntuned = 4096,   ///< the model was not fitted to this wheel on this soil
};

/// n wheel states on flat virgin ground, structure of arrays; every span has n
/// entries. With V = hypot(v_x, v_y):
///   slip = (rim_speed - v_x) / max(|rim_speed|, V), attack angle = atan2(v_y, v_x).
struct States {
  std::span<const double> v_x, v_y;   ///< hub velocity [m/s]
  std::span<const double> rim_speed;  ///< radius times spin, r w [m/s]
  std::span<const double> load;       ///< vertical load [N], >= 0; 0: kAirborne
};

/// Where one output goes: each span has n entries, or is empty and costs nothing.
/// The interval [low, high] covers the mean of a fresh DEM run at the model's
/// interval_level().
struct OutputSpans {
  std::span<double> value;
  std::span<double> sd_fit;    ///< standard deviation, surrogate against DEM
  std::span<double> sd_patch;  ///< of one random placement of the bed
  std::span<double> low, high;
  /// Derivatives of the value by v_x, v_y, rim_speed [unit s/m] and load
  /// [unit/N]. A model without gradients leaves NaN here: see has_gradients().
  std::span<double> d_v_x, d_v_y, d_rim_speed, d_load;
  std::span<double> sd_form;  ///< DEM minus measurement in the state's region; NaN: unknown
  /// Covers a measurement at interval_level(); NaN: unknown.
  std::span<double> measured_low, measured_high;
  std::span<double> sd_soil;  ///< which soil it is (Model::Mixture); 0 for one soil that is known
};

/// All spans of OutputSpans with their names, for code that goes through them.
struct OutputSpanField {
  const char* name;
  std::span<double> OutputSpans::*member;
};
inline constexpr std::array<OutputSpanField, 13> kOutputSpanFields = {
    {{"value", &OutputSpans::value},
     {"sd_fit", &OutputSpans::sd_fit},
     {"sd_patch", &OutputSpans::sd_patch},
     {"low", &OutputSpans::low},
     {"high", &OutputSpans::high},
     {"d_v_x", &OutputSpans::d_v_x},
     {"d_v_y", &OutputSpans::d_v_y},
     {"d_rim_speed", &OutputSpans::d_rim_speed},
     {"d_load", &OutputSpans::d_load},
     {"sd_form", &OutputSpans::sd_form},
     {"measured_low", &OutputSpans::measured_low},
     {"measured_high", &OutputSpans::measured_high},
     {"sd_soil", &OutputSpans::sd_soil}}};

/// Where the answers of n states go. No span may overlap another or the states.
struct Answers {
  std::array<OutputSpans, kOutputs> output;  ///< by Output
  std::span<std::uint32_t> flags;            ///< required, n entries; bits of Flag
  std::span<double> slip, attack_angle;      ///< echo [-], [rad]; n entries or empty
};

/// One wheel state and its answer.
struct State {
  double v_x = 0, v_y = 0, rim_speed = 0, load = 0;
};
struct OutputAnswer {
  double value, sd_fit, sd_patch, low, high;
  double d_v_x, d_v_y, d_rim_speed, d_load;     ///< NaN without gradients
  double sd_form, measured_low, measured_high;  ///< NaN: unknown
  double sd_soil;
};
struct Answer {
  std::array<OutputAnswer, kOutputs> output;  ///< by Output
  std::uint32_t flags;
  double slip, attack_angle;
};

/// What the training runs covered; outside it answers are flagged
/// kExtrapolated and their intervals grow. Mirrored in v_x and v_y.
struct Domain {
  double slip_min, slip_max;  ///< [-]
  double attack_angle_max_rad;
  double load_min_n, load_max_n;
  double speed_m_per_s;  ///< of the training runs
};

/// K coherent draws of what models do not know of one soil. Intervals say how far one state's
/// answer may be off, draws how far all answers are off together: draw k of every model of the
/// soil, at every state, belongs together. At each state the draws are normal with the model's
/// value as mean and 5 and 95 % of them where its 90 % interval ends; equations: docs/planning.md,
/// "Draws". Draw k is the same, bit for bit, on every machine and for every count. Immutable;
/// copies share it; may be used from any number of threads at once.
class GROUSER_PUBLIC Draws {
 public:
  static constexpr std::size_t kMost = 1024;
  /// Of a soil by name, say Model::soil(): other names are other, independent draws. Throws
  /// std::invalid_argument "draws: got X, expected 1 to 1024".
  Draws(const std::string& soil, std::size_t count);
  Draws(const Draws& other) noexcept;
  Draws& operator=(const Draws& other) noexcept;
  ~Draws();

  std::size_t size() const noexcept;

 private:
  friend class Model;
  struct Parts;
  std::shared_ptr<const Parts> parts_;
};

/// An immutable model. All const members may be called from any number of
/// threads at once. After a move, the object that was moved from may only be
/// assigned to, destroyed, or evaluated (which then refuses).
class GROUSER_PUBLIC Model {
 public:
  /// Reads and checks a model file: its hash, its fields, and that its stored
  /// test vectors are reproduced. Throws std::runtime_error "FILE: cause".
  static Model Open(const std::filesystem::path& model_file);

  /// A model of a geometrically similar wheel on the same dry soil, of another size or under
  /// another gravity. With l = radius_m over radius(), g the ratio of gravities, all lengths l
  /// times as large (width, treads, grains, sinkage), bulk density and frictions as they are, the
  /// response is the same function of load/(density gravity r^2 b), slip, attack angle and the
  /// Froude number v^2/(gravity r). So a state is asked as
  ///   v/sqrt(g l), load/(g l^3)
  /// and answered by forces times g l^3, moments times g l^4, sinkage times l, derivatives by the
  /// chain rule. Flags are those of the state that was asked; domain() and width_m() go along;
  /// name and digest stay. Of grains that keep their Young's modulus the groups are not quite the
  /// same: sd_fit and the intervals grow by what DEM says of that (docs/validation.md, "Another
  /// size or gravity"); of f_z, the load, and on hard ground they do not. Larger grains belong
  /// to a larger wheel: not for one sand under wheels of several sizes.
  ///
  /// Scaled models may be scaled again: from the file's own wheel, so that of several changes the
  /// last counts. Allocates. Throws std::invalid_argument for a soil with cohesion and for numbers
  /// that are not positive and finite. Precondition: not moved from.
  Model Scaled(double radius_m, double gravity_m_per_s2) const;

  /// One soil of several, and it is not known which: model i, of that wheel on soil i, with weight
  /// w_i >= 0 (divided by their sum). With the models' answers m_i, sds s_i and half widths h_i:
  ///   value = sum w_i m_i (derivatives likewise), sd_soil = sqrt(sum w_i (m_i - value)^2),
  ///   sd_fit, sd_patch, sd_form = sqrt(sum w_i s_i^2),
  ///   interval = value +- sqrt(sum w_i h_i^2 + (1.645 sd_soil)^2)
  /// the mean and the variance of a mixture; the interval is that of a normal distribution, which
  /// soils far apart do not make. The flags are those of all models with a weight above 0, domain()
  /// is what they share; kind() is "mixture", digest() empty. It keeps what it needs: the models
  /// may go. Allocates. Throws std::invalid_argument "mixture: ..." for no model, another number of
  /// weights, weights that are negative, not finite or all 0, models of another radius, width,
  /// gravity (by over 1 %) or interval_level(), and models that share no load or no slip.
  ///
  /// Draw k (EvaluateDraws) is draw k of one of the models at all states, the same for all mixtures
  /// of these weights under one name of Draws: over the draws, value and interval are those above.
  static Model Mixture(std::span<const Model* const> models, std::span<const double> weights);

  Model(Model&& other) noexcept;
  Model& operator=(Model&& other) noexcept;
  ~Model();

  /// Answers all states: no allocation, lock or system call. A bad state gets
  /// kInvalid and NaN outputs, and harms no other.
  ///
  /// Returns false, having written nothing, if a span has the wrong size (or
  /// the model was moved from). So a mistake can neither write out of bounds
  /// nor end the process from within a control loop, and it shows at the first
  /// call: sizes are compared once a call, not once a state. SizeProblem says
  /// which span it was.
  [[nodiscard]] bool Evaluate(const States& in, const Answers& out) const noexcept;

  /// One state. A batch is cheaper by the state.
  Answer Evaluate(const State& state) const noexcept;

  /// The same with `value` of draw k[i] at state i (a sinkage no less than 0); all other answers
  /// are as of Evaluate. Also refuses a k that has another size than the states, or an entry that
  /// is no draw.
  [[nodiscard]] bool EvaluateDraws(const States& in, const Draws& draws,
                                   std::span<const std::uint32_t> k,
                                   const Answers& out) const noexcept;

  /// Which span makes Evaluate refuse, e.g. "output[2].low: 5 entries, expected
  /// 8 or none"; empty if none does. Allocates: not for the loop.
  static std::string SizeProblem(const States& in, const Answers& out);

  const std::string& name() const noexcept;
  const std::string& soil() const noexcept;    ///< name of the soil
  const std::string& wheel() const noexcept;   ///< name of the wheel
  const std::string& kind() const noexcept;    ///< kind of model, e.g. "hybrid", "bekker"
  const std::string& digest() const noexcept;  ///< SHA-256 of the content, lower-case hex
  double radius_m() const noexcept;            ///< r of rim_speed
  double width_m() const noexcept;
  double gravity_m_per_s2() const noexcept;
  double interval_level() const noexcept;  ///< e.g. 0.9
  bool has_gradients() const noexcept;     ///< of all outputs
  const Domain& domain() const noexcept;

 private:
  friend class ModelSelector;
  struct Parts;
  explicit Model(std::shared_ptr<const Parts> parts) noexcept;
  std::shared_ptr<const Parts> parts_;
};

}  // namespace grouser
