// Any datagram is taken apart, answered or refused; an answer that the server
// sends is one that the client takes.
#include <cstdint>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/lcm_response.h"
#include "proto/lcm/datagram.h"
#include "server/query/lcm/lcm_answer.h"
#include "tests/unit/server/fake_model.h"

namespace {

using grouser::lcm_io::Datagram;
using grouser::lcm_io::DatagramKind;
using grouser_lcm::wheel_measured_t;
using grouser_lcm::wheel_output_t;
using grouser_lcm::wheel_response_t;
using Bytes = std::span<const std::uint8_t>;

void Require(bool holds) {
  if (!holds) std::abort();
}

grouser::server::Snapshot MakeSnapshot() {
  namespace server = grouser::server;
  const auto model =
      server::MakeServedModel(grouser::testing::FakeMessage("sand", 0.5), std::string(64, 'a'),
                              false, grouser::testing::MakeFakeModel);
  std::map<std::string, server::Snapshot::Aliases, std::less<>> aliases;
  aliases["sand"]["stable"] = model;
  return {1, {model}, std::move(aliases)};
}

template <class Message>
std::vector<std::uint8_t> Encode(const Message& response) {
  std::vector<std::uint8_t> bytes(response.getEncodedSize());
  const int written = response.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  Require(written == static_cast<int>(bytes.size()));
  return bytes;
}

void CheckArrays(const wheel_response_t& r) {
  const auto n = static_cast<std::size_t>(r.n);
  Require(r.flags.size() == n && r.slip.size() == n && r.attack_angle.size() == n);
  for (const wheel_output_t* o : {&r.f_x, &r.f_y, &r.f_z, &r.torque, &r.m_z, &r.sinkage}) {
    Require(o->value.size() == n && o->sd_fit.size() == n && o->sd_patch.size() == n);
    Require(o->low.size() == n && o->high.size() == n);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const grouser::server::Snapshot snapshot = MakeSnapshot();
  const Bytes bytes(data, size);
  const Datagram datagram = grouser::lcm_io::ParseDatagram(bytes);
  Bytes payload = bytes;  // of what is no message as well: more is reached so
  if (datagram.kind == DatagramKind::kMessage) {
    Require(datagram.channel.size() <= grouser::lcm_io::kMaxChannel);
    Require(8 + datagram.channel.size() + 1 + datagram.payload.size() == size);
    payload = datagram.payload;
  }
  std::string problem;
  wheel_response_t taken;
  wheel_measured_t measured;
  if (const auto answer = grouser::server::AnswerLcm(snapshot, payload, &problem, &measured)) {
    const auto encoded = Encode(*answer);
    Require(encoded.size() < 65499);
    Require(grouser::client::DecodeResponse(encoded, &taken));
    CheckArrays(taken);
  }
  if (grouser::client::DecodeResponse(payload, &taken)) {
    CheckArrays(taken);
    Require(Encode(taken) == std::vector<std::uint8_t>(payload.begin(), payload.end()));
  }
  if (grouser::client::DecodeMeasured(payload, &measured)) {
    Require(Encode(measured) == std::vector<std::uint8_t>(payload.begin(), payload.end()));
  }
  return 0;
}
