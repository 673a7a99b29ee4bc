#pragma once

#include <google/protobuf/repeated_field.h>

#include <array>
#include <cstdint>
#include <string>

#include "grouser/v1alpha1/state.pb.h"
#include "server/core/status.h"
#include "surrogate/models/outputs.h"

namespace grouser::server {

/// Which arrays of WheelResponses are wanted; at first all.
class AnswerFields {
 public:
  /// Most names in one message: more than there are.
  static constexpr int kMaxNames = 128;

  /// Names as of EvaluateWheelsRequest.fields; none: all arrays. INVALID_ARGUMENT naming the first
  /// that no answer has; all are wanted then.
  Status Read(const google::protobuf::RepeatedPtrField<std::string>& names);

  bool output(int o) const { return parts_[o] != 0; }  ///< any part of it
  bool uncertainty() const;                            ///< any part of any output but its values
  bool velocity() const { return velocity_; }
  bool slip() const { return slip_; }

  /// Empties the arrays that are not wanted; their memory is kept.
  void DropOthers(v1alpha1::WheelResponses* responses) const;

 private:
  bool Add(std::string_view name);

  static constexpr std::uint32_t kAll = ~0U;
  std::array<std::uint32_t, surrogate::kOutputs> parts_ = {kAll, kAll, kAll, kAll, kAll, kAll};
  bool velocity_ = true, slip_ = true;
};

/// The wire's output arrays in the order of surrogate::Output.
std::array<v1alpha1::OutputArray*, surrogate::kOutputs> OutputArrays(
    v1alpha1::WheelResponses* responses);

}  // namespace grouser::server
