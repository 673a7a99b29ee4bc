// States of the FMU as bytes and behind the pointers of a host.
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <type_traits>

#include "wheel_fmu.h"

namespace grouser::fmi {
namespace {

static_assert(std::is_trivially_copyable_v<WheelFmu::State> &&
              sizeof(WheelFmu::State) == 8 * (kVariables + 3 + 2));  // no padding

// Bytes of a state: this, then the state.
struct Head {
  char format[8];
  char digest[64];
  std::uint64_t variables, size, checksum;  // of the table, of all bytes, of the state
};
constexpr char kFormat[8] = {'G', 'R', 'S', 'W', 'F', 'M', 'U', '2'};

// FNV-1a, going on from `sum`.
template <class Bytes>
constexpr std::uint64_t ChecksumOf(const Bytes& bytes, std::uint64_t sum = 14695981039346656037u) {
  for (const auto byte : bytes) sum = (sum ^ static_cast<std::uint8_t>(byte)) * 1099511628211u;
  return sum;
}

// Names, types and causalities in their order.
constexpr std::uint64_t ChecksumOfTable() {
  std::uint64_t sum = ChecksumOf(std::string_view());
  for (const Variable& v : kTable) {
    const char kinds[3] = {0, static_cast<char>(v.type), static_cast<char>(v.causality)};
    sum = ChecksumOf(kinds, ChecksumOf(std::string_view(v.name), sum));
  }
  return sum;
}

}  // namespace

std::vector<std::uint8_t> WheelFmu::Serialize(const State& state) const {
  std::vector<std::uint8_t> bytes(sizeof(Head) + sizeof(State));
  std::memcpy(&bytes[sizeof(Head)], &state, sizeof(State));
  Head head{};
  std::memcpy(head.format, kFormat, sizeof kFormat);
  model_->digest().copy(head.digest, sizeof head.digest);
  head.variables = ChecksumOfTable();
  head.size = bytes.size();
  head.checksum = ChecksumOf(std::span(bytes).subspan(sizeof(Head)));
  std::memcpy(bytes.data(), &head, sizeof head);
  return bytes;
}

WheelFmu::State WheelFmu::Deserialize(std::span<const std::uint8_t> bytes) const {
  Head head;
  if (bytes.size() != sizeof(Head) + sizeof(State)) {
    Refuse("serialized state, bytes", static_cast<double>(bytes.size()),
           std::to_string(sizeof(Head) + sizeof(State)));
  }
  std::memcpy(&head, bytes.data(), sizeof head);
  if (std::memcmp(head.format, kFormat, sizeof kFormat) != 0 || head.size != bytes.size() ||
      head.variables != ChecksumOfTable() ||
      head.checksum != ChecksumOf(bytes.subspan(sizeof(Head)))) {
    throw std::invalid_argument("serialized state: damaged, or of another version of the FMU");
  }
  if (std::string(head.digest, sizeof head.digest) != model_->digest()) {
    throw std::invalid_argument("serialized state: of another model");
  }
  State state;
  std::memcpy(&state, &bytes[sizeof(Head)], sizeof state);
  CheckState(state);
  return state;
}

void WheelFmu::CheckState(const State& state) const {
  for (unsigned i = 0; i < kVariables; ++i) {
    const double x = state.value[i];
    const auto require = [&](bool good, const char* expected) {
      if (!good) Refuse(std::string("serialized state: ") + kTable[i].name, x, expected);
    };
    require(std::isfinite(x), "a finite number");
    if (kTable[i].causality == Causality::kCalculatedParameter) {
      require(x == start_.value[i], "that of the model");
    }
    if (kTable[i].type == Type::kBoolean) require(x == 0 || x == 1, "0 or 1");
    if (kTable[i].type == Type::kInt32) {
      require(x >= 0 && x <= std::numeric_limits<std::int32_t>::max() && x == std::trunc(x),
              "a whole number of 0 to 2^31 - 1");
    }
  }
  for (const double u : {state.contact.v_x, state.contact.v_y, state.contact.rim}) {
    if (!std::isfinite(u)) Refuse("serialized state: contact", u, "a finite number");
  }
  const auto mode = static_cast<std::int64_t>(state.mode);
  if (mode < 0 || mode > static_cast<std::int64_t>(Mode::kTerminated)) {
    Refuse("serialized state: mode", static_cast<double>(mode), "0 to 3");
  }
  if (state.set_up != 0 && state.set_up != 1) {
    Refuse("serialized state: set up", static_cast<double>(state.set_up), "0 or 1");
  }
}

namespace {

const WheelFmu::State& StateOf(const void* state) {
  return *static_cast<const WheelFmu::State*>(Given(state, "FMU state"));
}

void Put(const WheelFmu::State& state, void** to) {
  if (*to == nullptr) *to = new WheelFmu::State;
  *static_cast<WheelFmu::State*>(*to) = state;
}

}  // namespace

void SaveState(const WheelFmu& fmu, void** to) { Put(fmu.state(), Given(to, "FMU state")); }

void RestoreState(const void* from, WheelFmu* fmu) { fmu->SetState(StateOf(from)); }

void SerializedSize(const WheelFmu& fmu, const void* state, std::size_t* size) {
  *Given(size, "size") = fmu.Serialize(StateOf(state)).size();
}

void SerializeState(const WheelFmu& fmu, const void* state, void* to, std::size_t size) {
  const auto bytes = fmu.Serialize(StateOf(state));
  if (size < bytes.size()) {
    Refuse("serialized state, bytes of room", static_cast<double>(size),
           std::to_string(bytes.size()));
  }
  std::memcpy(Given(to, "serialized state"), bytes.data(), bytes.size());
}

void DeserializeState(const WheelFmu& fmu, const void* from, std::size_t size, void** to) {
  Given(to, "FMU state");
  Put(fmu.Deserialize({static_cast<const std::uint8_t*>(Given(from, "serialized state")), size}),
      to);
}

}  // namespace grouser::fmi
