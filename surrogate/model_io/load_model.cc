#include "surrogate/model_io/load_model.h"

#ifdef __GLIBC__
#include <gnu/libc-version.h>
#endif

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "proto/records/model_file.h"
#include "surrogate/model_io/form_message.h"
#include "surrogate/model_io/model_parts.h"
#include "surrogate/model_io/write_model.h"
#include "surrogate/models/hard_ground.h"
#include "surrogate/models/lookup.h"

namespace grouser::surrogate {
namespace {

[[noreturn]] void Fail(const v1alpha1::Model& model, const std::string& what) {
  const std::string name = model.name().empty() ? "(no name)" : model.name().substr(0, 128);
  throw std::runtime_error("model " + name + ": " + what);
}

std::array<double, kOutputs> Six(const v1alpha1::Model& model, const char* field,
                                 const google::protobuf::RepeatedField<double>& values) {
  if (values.size() != kOutputs) {
    Fail(model, std::string(field) + ": " + std::to_string(values.size()) +
                    " numbers, expected 6 (one an output)");
  }
  std::array<double, kOutputs> result{};
  for (int o = 0; o < kOutputs; ++o) {
    if (!(values[o] >= 0) || !std::isfinite(values[o])) {
      Fail(model, std::string(field) + "[" + std::to_string(o) +
                      "]: expected a finite number, not negative");
    }
    result[o] = values[o];
  }
  return result;
}

// Uniform ascending nodes; returns the number of intervals.
int Intervals(const v1alpha1::Model& model, const char* field,
              const google::protobuf::RepeatedField<double>& nodes) {
  if (nodes.size() < 2) Fail(model, std::string("residual.") + field + ": expected 2 or more");
  const double first = nodes[0], step = (nodes[nodes.size() - 1] - first) / (nodes.size() - 1);
  for (int i = 0; i < nodes.size(); ++i) {
    if (!(step > 0) || !(std::fabs(nodes[i] - (first + i * step)) <= 1e-6 * step)) {
      Fail(model, std::string("residual.") + field + "[" + std::to_string(i) +
                      "]: expected uniform ascending nodes");
    }
  }
  return nodes.size() - 1;
}

using Channels = std::array<std::span<const double>, ResidualTable::kChannels>;

Channels ChannelsOf(const v1alpha1::Model& model, const char* field,
                    const google::protobuf::RepeatedPtrField<v1alpha1::DoubleArray>& arrays) {
  if (arrays.size() != ResidualTable::kChannels) {
    Fail(model, std::string("residual.") + field + ": " + std::to_string(arrays.size()) +
                    " channels, expected " + std::to_string(ResidualTable::kChannels));
  }
  Channels channels;
  for (int c = 0; c < ResidualTable::kChannels; ++c) {
    const auto& values = arrays[c].values();
    channels[c] = {values.data(), static_cast<std::size_t>(values.size())};
  }
  return channels;
}

/// Calls make(axes, channels) with the table of a message that has one.
template <class Make>
auto WithTable(const v1alpha1::Model& model, const Make& make) {
  const v1alpha1::ResidualTable& message = model.residual();
  TableAxes axes;
  axes.direction = Intervals(model, "direction_knots_rad", message.direction_knots_rad());
  axes.lateral = Intervals(model, "lateral_knots_rad", message.lateral_knots_rad());
  axes.load = Intervals(model, "log_load_knots", message.log_load_knots());
  axes.log_load_min = message.log_load_knots(0);
  axes.log_load_max = message.log_load_knots(axes.load);
  return make(axes, ChannelsOf(model, "coefficients", message.coefficients()));
}

/// The speed axis; none where the message has no rates.
struct Speed {
  SpeedAxis axis;
  Channels rates;
};
Speed SpeedOf(const v1alpha1::Model& model) {
  const v1alpha1::ResidualTable& message = model.residual();
  if (message.rate_coefficients().empty()) return {};
  if (!(message.froude_max() > 0)) {
    Fail(model, "residual.froude_max: expected a positive number beside rate_coefficients");
  }
  return {{message.froude_reference(), message.froude_max(), message.froude_saturation()},
          ChannelsOf(model, "rate_coefficients", message.rate_coefficients())};
}

/// The residual's table with the hull distance; no table: all 0.
ResidualTable TableOf(const v1alpha1::Model& model) {
  if (model.residual().coefficients().empty()) return {};
  return WithTable(model, [](const TableAxes& axes, const Channels& channels) {
    return ResidualTable(axes, channels);
  });
}

Uncertainty MakeUncertainty(const v1alpha1::Model& model) {
  Uncertainty u;
  u.fit_inside = Six(model, "sd_fit_inside", model.sd_fit_inside());
  u.fit_growth = Six(model, "sd_fit_growth", model.sd_fit_growth());
  u.patch = Six(model, "sd_patch", model.sd_patch());
  u.interval_factor = Six(model, "interval_factor", model.interval_factor());
  if (!model.sd_bulldozing().empty()) {
    u.bulldozing = Six(model, "sd_bulldozing", model.sd_bulldozing());
  }
  u.form_unknown = !FormErrorsOf(model).KnowsAll();
  u.untuned = model.untuned();
  return u;
}

}  // namespace

void CheckGolden(const std::string& name, const v1alpha1::Model& message,
                 const std::function<WheelAnswer(const VelocityState&, double)>& answer,
                 const std::function<double(double, double)>& allowed) {
  const auto fail = [&](int i, const std::string& what) {
    throw std::runtime_error(name + ": golden[" + std::to_string(i) + "]" + what);
  };
  if (message.golden().empty()) {
    throw std::runtime_error(name + ": golden: none, expected at least one to test the model with");
  }
  for (int i = 0; i < message.golden_size(); ++i) {
    const v1alpha1::GoldenVector& g = message.golden(i);
    const VelocityState motion{g.v_x_m_per_s(), g.v_y_m_per_s(), g.rim_speed_m_per_s()};
    const bool usable = std::isfinite(motion.v_x) && std::isfinite(motion.v_y) &&
                        std::isfinite(motion.rim_speed) && std::isfinite(g.load_n()) &&
                        g.load_n() > 0 && g.value_size() == kOutputs;
    if (!usable) fail(i, ": expected finite input, a load and 6 values");
    const auto value = answer(motion, g.load_n()).value;
    for (int o = 0; o < kOutputs; ++o) {
      const double scale = OutputScale(o, g.load_n(), message.wheel().radius_m());
      const double limit = allowed(g.value(o), scale);
      if (std::fabs(value[o] - g.value(o)) <= limit) continue;
      std::ostringstream text;
      text.precision(17);
      text << "." << kOutputFields[o].name << ": computed " << value[o] << ", expected "
           << g.value(o) << " to " << limit;
      fail(i, text.str());
    }
  }
}

Hull TrainedHull(const v1alpha1::Model& model) {
  try {
    return Hull(HullOf(model), MakeUncertainty(model));
  } catch (const std::invalid_argument& error) {
    Fail(model, error.what());
  }
}

namespace {

double ChannelAt(const v1alpha1::Model& model, int channel, const Canonical& state, double load) {
  if (model.residual().coefficients().empty()) return 0;
  try {
    return WithTable(model, [&](const TableAxes& axes, const Channels& channels) {
      return ResidualTable::EvaluateChannel(axes, channels[channel], ToChart(state),
                                            std::log(load));
    });
  } catch (const std::invalid_argument& error) {
    Fail(model, error.what());
  }
}

}  // namespace

double TrainedDistance(const v1alpha1::Model& model, const Canonical& state, double load) {
  return ChannelAt(model, ResidualTable::kDistance, state, load);
}

double TrainedShare(const v1alpha1::Model& model, const Canonical& state, double load) {
  return ChannelAt(model, ResidualTable::kShare, state, load);
}

BekkerModel TrainedPhysics(const v1alpha1::Model& model) {
  try {
    return BekkerModel(ReadBekker(model.bekker()),
                       {model.wheel().radius_m(), model.wheel().width_m()});
  } catch (const std::invalid_argument& error) {
    Fail(model, error.what());
  }
}

SpeedAxis TrainedSpeeds(const v1alpha1::Model& model) { return SpeedOf(model).axis; }

TrainingDomain HullOf(const v1alpha1::Model& model) {
  const v1alpha1::Domain& d = model.domain();
  TrainingDomain hull;
  hull.slip_min = d.slip_min();
  hull.slip_max = d.slip_max();
  hull.attack_angle_max_rad = d.attack_angle_max_rad();
  hull.load_min_n = d.load_min_n();
  hull.load_max_n = d.load_max_n();
  hull.froude_max = d.froude_max();
  hull.gravity_m_per_s2 = model.soil().gravity_m_per_s2();
  return hull;
}

namespace {

// Most bytes of names: the model's goes into requests beside its digest, both into lists.
constexpr std::size_t kMostName = 128, kMostSoilName = 1000;

void CheckLength(const v1alpha1::Model& model, const char* field, const std::string& text,
                 std::size_t most) {
  if (text.size() <= most) return;
  Fail(model, std::string(field) + ": " + std::to_string(text.size()) +
                  " bytes, expected at most " + std::to_string(most));
}

void CheckHead(const v1alpha1::Model& model) {
  if (model.name().empty()) Fail(model, "name: expected one");
  CheckLength(model, "name", model.name(), kMostName);
  // "NAME@ALIAS" and "NAME@sha256:HEX" address a model: what follows the first @ is no name.
  if (model.name().find('@') != std::string::npos) Fail(model, "name: expected one without '@'");
  CheckLength(model, "soil.name", model.soil().name(), kMostSoilName);
  if (!v1alpha1::ModelKind_IsValid(model.kind())) Fail(model, "kind: not known to this version");
}

void CheckLoads(const v1alpha1::Model& model) {
  const double least = model.domain().load_min_n(), most = model.domain().load_max_n();
  if (least > 0 && least <= most && std::isfinite(most)) return;
  std::ostringstream text;
  text << "domain: loads " << least << " to " << most
       << " N, expected 0 < load_min_n <= load_max_n, finite";
  Fail(model, text.str());
}

std::unique_ptr<const WheelModel> MakeHard(const v1alpha1::Model& model) {
  CheckHead(model);
  CheckLoads(model);
  if (!model.has_hard()) Fail(model, "hard: expected parameters");
  if (model.has_bekker() || model.has_residual()) {
    Fail(model, "kind: hard, expected neither bekker nor residual");
  }
  const bool form_unknown = !FormErrorsOf(model).KnowsAll();
  try {
    return std::make_unique<HardGroundModel>(
        ReadHard(model.hard()), model.wheel().radius_m(),
        (model.untuned() ? kUntuned : 0u) | (form_unknown ? kFormUnknown : 0u));
  } catch (const std::invalid_argument& error) {
    Fail(model, error.what());
  }
}

std::unique_ptr<TabulatedModel> MakeLookup(const v1alpha1::Model& model) {
  CheckHead(model);
  if (model.residual().coefficients().empty()) Fail(model, "residual: expected a table");
  try {
    const Speed speed = SpeedOf(model);
    return WithTable(model, [&](const TableAxes& axes, const Channels& channels) {
      return std::make_unique<LookupModel>(
          axes, channels, HullOf(model), MakeUncertainty(model),
          WheelGeometry{model.wheel().radius_m(), model.wheel().width_m()}, speed.axis,
          speed.rates);
    });
  } catch (const std::invalid_argument& error) {
    Fail(model, error.what());
  }
}

}  // namespace

HybridModel MakeHybrid(const v1alpha1::Model& model) {
  CheckHead(model);
  if (model.kind() == v1alpha1::MODEL_KIND_LOOKUP)
    Fail(model, "kind: lookup, expected one with physics");
  if (model.kind() == v1alpha1::MODEL_KIND_HARD) {
    Fail(model, "kind: hard, expected a model of a soil");
  }
  try {
    const BekkerModel physics = TrainedPhysics(model);
    const Speed speed = SpeedOf(model);
    if (!speed.axis.present()) {
      return HybridModel(physics, TableOf(model), HullOf(model), MakeUncertainty(model));
    }
    ResidualTable rates = WithTable(model, [&](const TableAxes& axes, const Channels&) {
      return ResidualTable(axes, speed.rates);
    });
    return HybridModel(physics, TableOf(model), std::move(rates), speed.axis, HullOf(model),
                       MakeUncertainty(model));
  } catch (const std::invalid_argument& error) {
    Fail(model, error.what());
  }
}

std::unique_ptr<TabulatedModel> MakeScalar(const v1alpha1::Model& model) {
  if (model.kind() == v1alpha1::MODEL_KIND_LOOKUP) return MakeLookup(model);
  return std::make_unique<HybridModel>(MakeHybrid(model));
}

std::unique_ptr<const WheelModel> MakeLaw(const v1alpha1::Model& model) {
  if (model.kind() == v1alpha1::MODEL_KIND_HARD) return MakeHard(model);
  return MakeScalar(model);
}

namespace {

/// Tables are made by logarithms, sines and the like, which each C library rounds in its own way,
/// and glibc in another where there is FMA. All else rounds alike everywhere.
std::string Rounding() {
  std::string rounding = "other";
#ifdef __GLIBC__
  rounding = std::string("glibc ") + gnu_get_libc_version();
#endif
#ifdef __x86_64__
  rounding += __builtin_cpu_supports("fma") ? " fma" : " no fma";
#endif
  return rounding;
}

void PrepareByKept(const v1alpha1::Model& message, const KeptTable& kept, HybridModel* model) {
  const std::size_t size = kept.read ? model->TableSize() : 0;
  if (size == 0) return model->Prepare();
  const std::string key = "table " + std::to_string(HybridModel::kTableVersion) +
                          ", " GROUSER_VERSION ", " + Rounding() + ", " +
                          records::DigestOf(message);
  if (const std::string bytes = kept.read(key, size); bytes.size() == size) {
    return model->TakeTable(bytes);
  }
  model->Prepare();
  kept.keep(key, model->TableBytes());
}

}  // namespace

std::unique_ptr<const WheelModel> MakeModel(const v1alpha1::Model& model, const KeptTable& kept) {
  if (model.kind() == v1alpha1::MODEL_KIND_HARD) {
    std::unique_ptr<const WheelModel> hard = MakeHard(model);
    CheckGolden(
        "model " + model.name(), model,
        [&](const VelocityState& v, double load) { return AnswerOf(*hard, v, load); },
        [](double value, double scale) { return 1e-9 * std::fmax(std::fabs(value), scale); });
    return hard;
  }
  std::unique_ptr<TabulatedModel> made = MakeScalar(model);
  // Tables answer in single precision.
  const double share = model.kind() == v1alpha1::MODEL_KIND_LOOKUP ? 1e-5 : 1e-9;
  CheckGolden(
      "model " + model.name(), model,
      [&](const VelocityState& v, double load) {
        return made->EvaluateOne(v.v_x, v.v_y, v.rim_speed, load);
      },
      [&](double value, double scale) { return share * std::fmax(std::fabs(value), scale); });
  // The fitter's many models do without.
  if (auto* hybrid = dynamic_cast<HybridModel*>(made.get())) PrepareByKept(model, kept, hybrid);
  return made;
}

}  // namespace grouser::surrogate
