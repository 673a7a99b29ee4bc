// A planner's inner loop: one message per cycle with every wheel state along a
// set of candidate paths, over one long-lived stream.
//
//   planner_loop [HOST:PORT] [CYCLES]
#include <charconv>
#include <chrono>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "clients/cpp/terrain_client.h"
#include "clients/cpp/wheel_states.h"

namespace {

constexpr int kPaths = 100;
constexpr int kWheels = 4;
constexpr double kWheelLoadN = 24.0;
constexpr double kMaxSlip = 0.5;

/// Each candidate path asks for a little more slip than the one before.
void FillCandidates(grouser::v1alpha1::WheelStates* states) {
  states->Clear();
  for (int path = 0; path < kPaths; ++path) {
    const double slip = kMaxSlip * path / (kPaths - 1);
    for (int wheel = 0; wheel < kWheels; ++wheel) {
      grouser::client::AddSlipState(slip, /*attack_angle_rad=*/0.0, kWheelLoadN, states);
    }
  }
}

/// The first path whose drawbar pull is positive for certain: the lower end of
/// the interval decides, not the value. -1: no traction on any.
int FirstSafePath(const grouser::v1alpha1::WheelResponses& responses) {
  for (int path = 0; path < kPaths; ++path) {
    bool safe = true;
    for (int i = path * kWheels; i < (path + 1) * kWheels; ++i) {
      safe = safe && responses.f_x().low(i) > 0;  // false for NaN as well
    }
    if (safe) return path;
  }
  return -1;
}

int CyclesOf(std::string_view text) {
  int cycles = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), cycles);
  if (error != std::errc() || end != text.data() + text.size() || cycles < 1) {
    throw std::invalid_argument("CYCLES: got '" + std::string(text) +
                                "', expected a whole number of 1 or more");
  }
  return cycles;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc > 3) throw std::invalid_argument("expected planner_loop [HOST:PORT] [CYCLES]");
  const int cycles = argc > 2 ? CyclesOf(argv[2]) : 10;
  const grouser::client::TerrainClient client(argc > 1 ? argv[1] : "127.0.0.1:50151");
  const auto stream = client.OpenStream();
  grouser::v1alpha1::EvaluateWheelsRequest request;
  grouser::v1alpha1::EvaluateWheelsResponse response;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    const auto start = std::chrono::steady_clock::now();
    request.set_sequence(cycle);
    FillCandidates(request.mutable_states());
    if (!stream->Send(request) || !stream->Receive(&response)) break;
    if (response.has_error()) {
      std::fprintf(stderr, "cycle %d: %s\n", cycle, response.error().message().c_str());
      continue;  // the stream goes on
    }
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - start;
    const int path = FirstSafePath(response.responses());
    std::printf("cycle %d: %d states in %.2f ms, ", cycle, kPaths * kWheels, spent.count());
    path < 0 ? std::printf("no traction\n")
             : std::printf("slip %.2f pulls\n", kMaxSlip * path / (kPaths - 1));
  }
  stream->Finish();
  return 0;
} catch (const std::invalid_argument& e) {
  std::fprintf(stderr, "planner_loop: %s\n", e.what());
  return 2;
} catch (const std::exception& e) {
  std::fprintf(stderr, "planner_loop: %s\n", e.what());
  return 1;
}
