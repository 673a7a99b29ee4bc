#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "grouser/v1alpha1/explanation.pb.h"
#include "surrogate/models/form_error.h"
#include "surrogate/models/hull.h"
#include "surrogate/models/hull_parts.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// What an explanation knows of its state beyond what it says (explain.cc fills it).
struct StateFacts {
  const v1alpha1::Model* model = nullptr;
  const WheelModel* evaluator = nullptr;
  VelocityState motion{};
  double load = 0, pitch = 0, roll = 0, yaw = 0;
  std::uint32_t pass = 1;
  bool by_slip = false;  ///< the slip form was asked; else the velocity form

  std::uint32_t flags = 0;
  std::array<double, kOutputs> value{};
  FormErrors form;
  std::optional<MeasuredRegion> region;  ///< of a moving wheel with an answer

  std::optional<Canonical> canonical;  ///< of a finite, moving state on the ground
  std::optional<Hull> hull;            ///< of the model of a soil
  double distance = 0, table_distance = 0;
  double share = 0;  ///< of the runs in the answer; the rest is physics'
  ExcessParts excess{};
};

/// Adds the reasons of every flag that is set to *explanation, which has the state's numbers.
void AddReasons(const StateFacts& facts, v1alpha1::Explanation* explanation);

/// Counts the runs of the model's provenance and adds those beside the state, at most `most` of
/// each kind. some_have_stress: whether any run of the file has.
void AddRuns(const StateFacts& facts, int most, bool some_have_stress,
             v1alpha1::Explanation* explanation);

/// A string of a model file, or how long it is where that is over 1000 bytes.
inline std::string Bounded(const std::string& text) {
  if (text.size() <= 1000) return text;
  return "(" + std::to_string(text.size()) + " bytes)";
}

}  // namespace grouser::surrogate
