#include "server/jobs/request_checks.h"

#include <fmt/core.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/records/sha256.h"
#include "server/core/model_reference.h"
#include "server/core/status.h"
#include "surrogate/models/kinematics.h"

namespace grouser::server {
namespace {

[[noreturn]] void Refuse(const std::string& message) {
  throw StatusError(StatusCode::kInvalidArgument, message);
}

/// Where `right` is false or the value not finite.
void CheckNumber(const char* field, double value, bool right, const std::string& expected) {
  if (right && std::isfinite(value)) return;
  Refuse(fmt::format("{}: {}, expected {}", field, value,
                     std::isfinite(value) ? expected : "a finite number"));
}

/// Text for people: no control characters, bounded.
void CheckText(const char* field, const std::string& text, std::size_t most) {
  std::size_t characters = 0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) Refuse(fmt::format("{}: has a control character", field));
    if ((byte & 0xc0) != 0x80) ++characters;  // not a UTF-8 continuation
  }
  if (characters > most) {
    Refuse(fmt::format("{}: {} characters, expected at most {}", field, characters, most));
  }
}

void CheckRequestId(const std::string& request_id) {
  if (request_id.empty()) Refuse("request_id: empty, expected 1 to 128 characters");
  CheckText("request_id", request_id, kMaxRequestIdCharacters);
}

double PlusZero(double value) { return value == 0.0 ? 0.0 : value; }

}  // namespace

void CheckTestState(const v1alpha1::TestState& state) {
  if (!v1alpha1::RigMode_IsValid(state.mode())) {
    Refuse(fmt::format("state.mode: {}, expected a RigMode", static_cast<int>(state.mode())));
  }
  const double load = state.load_n(), speed = state.speed_m_per_s(), slip = state.slip();
  const double angle = state.attack_angle_rad(), drawbar = state.drawbar_n();
  const bool free_slip = state.mode() == v1alpha1::RIG_MODE_FREE_SLIP;
  const bool sets_slip = !free_slip && state.mode() != v1alpha1::RIG_MODE_TOWED;
  CheckNumber(
      "state.load_n", load, load > 0,
      load == 0 ? "a load above 0 N: a wheel off the ground meets no soil" : "a load above 0 N");
  CheckNumber("state.speed_m_per_s", speed, speed >= 0, "0 (the model's) or more");
  CheckNumber("state.attack_angle_rad", angle, std::abs(angle) <= std::numbers::pi + 1e-9,
              "a value in [-pi, pi]");
  CheckNumber("state.drawbar_n", drawbar, drawbar == 0 || free_slip,
              "0 unless the mode is FREE_SLIP");
  CheckNumber("state.attack_angle_rad", angle, angle == 0 || !free_slip, "0 in mode FREE_SLIP");
  CheckNumber("state.slip", slip, slip == 0 || sets_slip, "0 unless the mode is RIM_SPEED");
  // What no query answers is no job.
  const surrogate::SlipRange range = surrogate::SlipsAt(angle);
  CheckNumber(
      "state.slip", slip, !sets_slip || !std::isnan(surrogate::FromSlip(slip, angle, 1).v_x),
      fmt::format("a value in [{:.6g}, {:.6g}] at this attack angle", range.low, range.high));
}

void CheckEnvelope(const std::string& request_id, int priority,
                   const google::protobuf::Duration* time_limit) {
  CheckRequestId(request_id);
  CheckNumber("priority", priority, priority >= -kMostPriority && priority <= kMostPriority,
              fmt::format("{} to {}", -kMostPriority, kMostPriority));
  if (time_limit == nullptr) return;
  const double limit_s = static_cast<double>(time_limit->seconds()) + 1e-9 * time_limit->nanos();
  CheckNumber("time_limit", limit_s, limit_s >= 1 && limit_s < 1e7, "1 s or more");
}

void CheckSubmit(const v1alpha1::SubmitRefinementRequest& request) {
  CheckEnvelope(request.request_id(), request.priority(),
                request.has_time_limit() ? &request.time_limit() : nullptr);
  CheckText("model", request.model(), 256);
  std::string problem;
  if (!ParseModelReference(request.model(), &problem)) Refuse("model: " + problem);
  if (!request.has_state()) Refuse("state: missing, expected a TestState");
  CheckTestState(request.state());
  CheckNumber("max_time_s", request.max_time_s(),
              request.max_time_s() >= 0 && request.max_time_s() <= kMaxTimeS,
              fmt::format("0 (as the model's rig) to {}", kMaxTimeS));
}

void CheckJobId(const std::string& job_id) {
  if (job_id.empty()) Refuse("job_id: empty, expected the id of a job");
  CheckText("job_id", job_id, 64);
}

void CheckCancel(const v1alpha1::CancelJobRequest& request) {
  CheckJobId(request.job_id());
  CheckRequestId(request.request_id());
}

void CheckPromote(const v1alpha1::PromoteRequest& request) {
  CheckJobId(request.job_id());
  if (!request.alias().empty()) CheckMovableAlias(request.alias());
  if (!request.candidate_digest().empty() && !IsDigestPrefix(request.candidate_digest())) {
    Refuse("candidate_digest: " + Quote(request.candidate_digest()) +
           ", expected 12 to 64 lower-case hex digits, or nothing");
  }
  CheckWhoAndWhy(request.who(), request.why());
}

void CheckPrune(const v1alpha1::PruneRequest& request) {
  constexpr double kMostMb = 1e9, kMostDays = 1e5;
  const auto mb = static_cast<double>(request.max_disk_mb());
  CheckNumber("max_disk_mb", mb, mb <= kMostMb, fmt::format("0 (no limit) to {}", kMostMb));
  CheckNumber("keep_days", request.keep_days(),
              request.keep_days() >= 0 && request.keep_days() <= kMostDays,
              fmt::format("0 (no limit) to {}", kMostDays));
}

void CheckMovableAlias(const std::string& alias) {
  // "previous" is where the repository keeps the way back; "candidate" moves
  // with every job by itself.
  if (alias != kPreviousAlias && alias != kCandidateAlias && IsAliasName(alias)) return;
  Refuse("alias: " + Quote(alias) +
         ", expected a lower-case name such as stable (not previous, not candidate)");
}

void CheckWhoAndWhy(const std::string& who, const std::string& why) {
  CheckText("who", who, 128);
  CheckText("why", why, 1024);
}

v1alpha1::TestState Canonical(const v1alpha1::TestState& state) {
  v1alpha1::TestState out;
  out.set_mode(state.mode() == v1alpha1::RIG_MODE_UNSPECIFIED ? v1alpha1::RIG_MODE_RIM_SPEED
                                                              : state.mode());
  out.set_load_n(state.load_n());
  out.set_attack_angle_rad(PlusZero(state.attack_angle_rad()));
  out.set_speed_m_per_s(PlusZero(state.speed_m_per_s()));
  if (out.mode() == v1alpha1::RIG_MODE_RIM_SPEED) out.set_slip(PlusZero(state.slip()));
  if (out.mode() == v1alpha1::RIG_MODE_FREE_SLIP) out.set_drawbar_n(PlusZero(state.drawbar_n()));
  return out;
}

std::string HashOf(const google::protobuf::Message& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&coded);
  }
  return records::Sha256OfString(bytes);
}

}  // namespace grouser::server
