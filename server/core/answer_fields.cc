#include "server/core/answer_fields.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <string_view>

#include "server/core/model_reference.h"

namespace grouser::server {
namespace {

using google::protobuf::FieldDescriptor;
using v1alpha1::OutputArray;

/// Bits of parts_ are the numbers of OutputArray's fields.
constexpr std::uint32_t BitOf(int field_number) { return 1U << field_number; }
constexpr std::uint32_t kUncertainty =
    BitOf(OutputArray::kSdFitFieldNumber) | BitOf(OutputArray::kSdPatchFieldNumber) |
    BitOf(OutputArray::kSdFormFieldNumber) | BitOf(OutputArray::kLowFieldNumber) |
    BitOf(OutputArray::kHighFieldNumber) | BitOf(OutputArray::kMeasuredLowFieldNumber) |
    BitOf(OutputArray::kMeasuredHighFieldNumber);

}  // namespace

bool AnswerFields::Add(std::string_view name) {
  if (name == "velocity") return velocity_ = true;
  if (name == "slip") return slip_ = true;
  const std::size_t dot = name.find('.');
  const auto* output = std::ranges::find(surrogate::kOutputFields, name.substr(0, dot),
                                         &surrogate::OutputField::name);
  if (output == std::end(surrogate::kOutputFields)) return false;
  std::uint32_t& parts = parts_[output - surrogate::kOutputFields];
  if (dot == std::string_view::npos) {
    parts = kAll;
    return true;
  }
  const FieldDescriptor* part =
      OutputArray::descriptor()->FindFieldByName(std::string(name.substr(dot + 1)));
  if (part == nullptr) return false;
  parts |= BitOf(part->number());
  return true;
}

Status AnswerFields::Read(const google::protobuf::RepeatedPtrField<std::string>& names) {
  *this = {};
  if (names.empty()) return Status::Ok();
  if (names.size() > kMaxNames) {
    return Status::InvalidArgument(
        fmt::format("fields: {} names, at most {}", names.size(), kMaxNames));
  }
  parts_.fill(0);
  velocity_ = slip_ = false;
  for (int i = 0; i < names.size(); ++i) {
    if (Add(names[i])) continue;
    *this = {};
    return Status::InvalidArgument(fmt::format(
        "fields[{}]: {}, expected velocity, slip or an output (f_x, f_y, f_z, torque, m_z, "
        "sinkage), alone or with a part of it, as f_x.value, f_x.low or f_x.high",
        i, Quote(names[i])));
  }
  return Status::Ok();
}

bool AnswerFields::uncertainty() const {
  return std::ranges::any_of(parts_, [](std::uint32_t p) { return (p & kUncertainty) != 0; });
}

void AnswerFields::DropOthers(v1alpha1::WheelResponses* responses) const {
  const auto arrays = OutputArrays(responses);
  const auto* type = OutputArray::descriptor();
  for (int o = 0; o < surrogate::kOutputs; ++o) {
    if (parts_[o] == kAll) continue;
    for (int f = 0; f < type->field_count(); ++f) {
      const FieldDescriptor* part = type->field(f);
      if ((parts_[o] & BitOf(part->number())) == 0) {
        OutputArray::GetReflection()->ClearField(arrays[o], part);
      }
    }
  }
  // Of these messages Clear() keeps the arrays' memory.
  if (!velocity_) responses->mutable_velocity()->Clear();
  if (!slip_) responses->mutable_slip()->Clear();
}

std::array<v1alpha1::OutputArray*, surrogate::kOutputs> OutputArrays(v1alpha1::WheelResponses* r) {
  return {r->mutable_f_x(),    r->mutable_f_y(), r->mutable_f_z(),
          r->mutable_torque(), r->mutable_m_z(), r->mutable_sinkage()};
}

}  // namespace grouser::server
