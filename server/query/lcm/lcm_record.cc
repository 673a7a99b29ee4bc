#include "server/query/lcm/lcm_record.h"

#include <array>
#include <cstdint>
#include <vector>

#include "server/core/answer_fields.h"

namespace grouser::server {
namespace {

using Numbers = google::protobuf::RepeatedField<double>;

void Copy(const std::vector<double>& from, Numbers* to) { *to = {from.begin(), from.end()}; }

}  // namespace

LcmRecord RecordOf(const grouser_lcm::wheel_query_t& query,
                   const grouser_lcm::wheel_response_t& response,
                   const grouser_lcm::wheel_measured_t& measured) {
  LcmRecord record;
  v1alpha1::EvaluateWheelsRequest& request = record.request;
  request.set_sequence(static_cast<std::uint64_t>(query.sequence));
  request.set_model(query.model);
  v1alpha1::VelocityForm& velocity = *request.mutable_states()->mutable_velocity();
  Copy(query.v_x, velocity.mutable_v_x_m_per_s());
  Copy(query.v_y, velocity.mutable_v_y_m_per_s());
  Copy(query.rim_speed, velocity.mutable_rim_speed_m_per_s());
  Copy(query.load, request.mutable_states()->mutable_load_n());

  record.response.set_sequence(request.sequence());
  record.response.set_model(response.model);
  v1alpha1::WheelResponses& to = *record.response.mutable_responses();
  for (const std::int32_t flags : response.flags) {
    to.add_flags(static_cast<std::uint32_t>(flags));
  }
  Copy(response.slip, to.mutable_slip()->mutable_slip());
  Copy(response.attack_angle, to.mutable_slip()->mutable_attack_angle_rad());
  const auto arrays = OutputArrays(&to);
  const std::array<const grouser_lcm::wheel_output_t*, surrogate::kOutputs> outputs = {
      &response.f_x,    &response.f_y, &response.f_z,
      &response.torque, &response.m_z, &response.sinkage};
  const std::array<const grouser_lcm::measured_output_t*, surrogate::kOutputs> known = {
      &measured.f_x,    &measured.f_y, &measured.f_z,
      &measured.torque, &measured.m_z, &measured.sinkage};
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    Copy(outputs[k]->value, arrays[k]->mutable_value());
    Copy(outputs[k]->sd_fit, arrays[k]->mutable_sd_fit());
    Copy(outputs[k]->sd_patch, arrays[k]->mutable_sd_patch());
    Copy(outputs[k]->low, arrays[k]->mutable_low());
    Copy(outputs[k]->high, arrays[k]->mutable_high());
    if (measured.n == 0 || known[k]->n == 0) continue;
    Copy(known[k]->sd_form, arrays[k]->mutable_sd_form());
    Copy(known[k]->low, arrays[k]->mutable_measured_low());
    Copy(known[k]->high, arrays[k]->mutable_measured_high());
  }
  return record;
}

}  // namespace grouser::server
