#include "server/query/lcm/lcm_answer.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <utility>

#include "proto/lcm/byte_reader.h"
#include "server/core/evaluator.h"

namespace grouser::server {
namespace {

using grouser_lcm::measured_output_t;
using grouser_lcm::wheel_measured_t;
using grouser_lcm::wheel_output_t;
using grouser_lcm::wheel_query_t;
using grouser_lcm::wheel_response_t;
using lcm_io::ByteReader;

// Longest text that is echoed, so that an answer stays under LCM's limit.
constexpr std::size_t kMaxText = 256;

/// What stands before the arrays.
struct Head {
  std::uint64_t utime = 0, sequence = 0;
  std::string sender, model;
  std::int32_t n = 0;
};

bool ReadHead(ByteReader* bytes, Head* head, std::string* problem) {
  std::uint64_t hash = 0;
  std::uint64_t n = 0;
  if (!bytes->Read(8, &hash) || static_cast<std::int64_t>(hash) != wheel_query_t::getHash()) {
    *problem = "not a wheel_query_t";
    return false;
  }
  if (!bytes->Read(8, &head->utime) || !bytes->Read(8, &head->sequence) ||
      !bytes->ReadString(kMaxText, &head->sender) || !bytes->ReadString(kMaxText, &head->model) ||
      !bytes->Read(4, &n)) {
    *problem =
        "a wheel_query_t that is truncated or has a text that is no text of 255 characters at most";
    return false;
  }
  head->n = static_cast<std::int32_t>(n);
  return true;
}

/// The outputs of a response in the order of surrogate::Output.
std::array<wheel_output_t*, surrogate::kOutputs> OutputsOf(wheel_response_t* r) {
  return {&r->f_x, &r->f_y, &r->f_z, &r->torque, &r->m_z, &r->sinkage};
}

/// `n` zero entries everywhere: the form of every answer.
void Resize(int n, wheel_response_t* response) {
  response->n = n;
  response->flags.resize(n);
  response->slip.resize(n);
  response->attack_angle.resize(n);
  for (wheel_output_t* output : OutputsOf(response)) {
    output->n = n;
    for (auto* values :
         {&output->value, &output->sd_fit, &output->sd_patch, &output->low, &output->high}) {
      values->resize(n);
    }
  }
}

/// Room for what the model knows of measurements; nothing where it knows nothing.
surrogate::FormView Prepare(const surrogate::FormErrors& known, int n, wheel_measured_t* measured) {
  surrogate::FormView view;
  const std::array<measured_output_t*, surrogate::kOutputs> outputs = {
      &measured->f_x,    &measured->f_y, &measured->f_z,
      &measured->torque, &measured->m_z, &measured->sinkage};
  for (int k = 0; k < surrogate::kOutputs; ++k) {
    measured_output_t& to = *outputs[k];
    to.n = known.KnowsInterval(k) ? n : 0;
    for (auto* values : {&to.sd_form, &to.low, &to.high}) values->resize(to.n);
    if (to.n == 0) continue;
    measured->n = n;
    view.output[k] = {to.sd_form, to.low, to.high};
  }
  return view;
}

void EvaluateQuery(const ServedModel& model, const wheel_query_t& query, wheel_response_t* response,
                   wheel_measured_t* measured) {
  surrogate::WheelStatesView in;
  in.v_x = query.v_x;
  in.v_y = query.v_y;
  in.rim_speed = query.rim_speed;
  in.load = query.load;
  std::array<std::uint32_t, kMaxLcmStates> flags{};
  surrogate::ResponsesView out;
  const auto outputs = OutputsOf(response);
  for (int k = 0; k < surrogate::kOutputs; ++k) {
    surrogate::OutputView& to = out.output[k];
    to.value = outputs[k]->value;
    to.sd_fit = outputs[k]->sd_fit;
    to.sd_patch = outputs[k]->sd_patch;
    to.low = outputs[k]->low;
    to.high = outputs[k]->high;
  }
  out.flags = {flags.data(), static_cast<std::size_t>(query.n)};
  out.slip = response->slip;
  out.attack_angle = response->attack_angle;
  EvaluateViews(model, in, out, Prepare(model.choice.form, query.n, measured));
  for (int i = 0; i < query.n; ++i) response->flags[i] = static_cast<std::int32_t>(flags[i]);
}

}  // namespace

std::optional<wheel_response_t> AnswerLcm(const Snapshot& snapshot,
                                          std::span<const std::uint8_t> encoded,
                                          std::string* problem, wheel_measured_t* measured,
                                          LcmOutcome* outcome) {
  measured->n = 0;
  ByteReader bytes(encoded);
  Head head;
  if (!ReadHead(&bytes, &head, problem)) return std::nullopt;
  wheel_response_t response;
  response.utime = static_cast<std::int64_t>(head.utime);
  response.sequence = static_cast<std::int64_t>(head.sequence);
  response.sender = head.sender;
  Resize(0, &response);
  if (head.n < 1 || head.n > kMaxLcmStates) {
    response.error =
        fmt::format("n: {} states, expected 1 to {} in one LCM message", head.n, kMaxLcmStates);
    return response;
  }
  constexpr std::size_t kBytesPerState = 4 * sizeof(double);
  if (bytes.left() != head.n * kBytesPerState) {
    response.error = fmt::format("{} bytes of arrays, expected {} for n = {}", bytes.left(),
                                 head.n * kBytesPerState, head.n);
    return response;
  }
  wheel_query_t query;
  if (query.decode(encoded.data(), 0, static_cast<int>(encoded.size())) < 0) {
    *problem = "a wheel_query_t that does not decode";
    return std::nullopt;
  }
  const ServedModel* model = nullptr;
  if (const Status found = snapshot.Find(head.model, &model); !found.ok()) {
    response.error = found.message;
    if (outcome != nullptr) outcome->code = found.code;
    return response;
  }
  Resize(query.n, &response);
  response.model = model->reference;
  measured->utime = response.utime;
  measured->sequence = response.sequence;
  measured->sender = response.sender;
  measured->model = response.model;
  EvaluateQuery(*model, query, &response, measured);
  if (outcome != nullptr) *outcome = {StatusCode::kOk, model, std::move(query)};
  return response;
}

}  // namespace grouser::server
