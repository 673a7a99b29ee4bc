// What the loader never does: calls out of order, null pointers, states that were tampered with.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdarg>
#include <cstddef>
#include <cstring>
#include <limits>
#include <locale>

#include "clients/fmi/fmi_types.h"
#include "clients/fmi/wheel_fmu.h"
#include "tests/unit/fmi/fmu_fixture.h"

namespace grouser::fmi::testing {
namespace {

using ::testing::HasSubstr;

std::string last_message;
void Note2(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String format, ...) {
  EXPECT_STREQ(format, "%s");
  va_list arguments;
  va_start(arguments, format);
  last_message = va_arg(arguments, const char*);
  va_end(arguments);
}
void Note3(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String message) {
  last_message = message;
}

/// The functions of an FMU by name, on one instance.
struct Raw {
  void *library, *instance = nullptr;
  fmi2CallbackFunctions host{Note2, nullptr, nullptr, nullptr, nullptr};

  explicit Raw(int version) {
    const auto folder = kFmus / (version == 2 ? "fmi2" : "fmi3");
    const auto module =
        folder / "binaries" / (version == 2 ? "linux64" : "x86_64-linux") / "grouser_wheel.so";
    library = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) throw std::runtime_error(dlerror());
    const std::string token = ReadDescription(folder / "modelDescription.xml").token;
    const std::string resources = (folder / "resources").string();
    if (version == 2) {
      auto* make = Find<fmi2Component(fmi2String, fmi2Type, fmi2String, fmi2String,
                                      const fmi2CallbackFunctions*, int, int)>("fmi2Instantiate");
      instance = make("w", fmi2CoSimulation, token.c_str(), resources.c_str(), &host, 0, 0);
    } else {
      auto* make =
          Find<fmi3Instance(fmi3String, fmi3String, fmi3String, bool, bool, bool, bool,
                            const unsigned*, std::size_t, void*, fmi3LogMessageCallback,
                            fmi3IntermediateUpdateCallback)>("fmi3InstantiateCoSimulation");
      instance = make("w", token.c_str(), resources.c_str(), false, false, false, false, nullptr, 0,
                      nullptr, Note3, nullptr);
    }
    if (instance == nullptr) throw std::runtime_error(last_message);
  }
  template <class F>
  F* Find(const std::string& name) const {
    void* found = dlsym(library, name.c_str());
    EXPECT_NE(found, nullptr) << name;
    return reinterpret_cast<F*>(found);
  }
  /// Status of a function that returns one.
  template <class... A>
  int Call(const std::string& name, A... arguments) const {
    return Find<int(void*, A...)>(name)(instance, arguments...);
  }
};

constexpr int kOk = 0, kError = 3;  // in both versions

TEST(FmuCalls, OfFmi2InTheOrderOfTheStandard) {
  Raw fmu(2);
  const auto setup = [&](double start) {
    return fmu.Call<int, double, double, int, double>("fmi2SetupExperiment", 0, 0, start, 0, 0);
  };
  const unsigned damping = at::kDampingRatio, time_of = at::kTime;
  const double ratio = 0.25;
  const auto set = [&] {
    return fmu.Call<const unsigned*, std::size_t, const double*>("fmi2SetReal", &damping, 1,
                                                                 &ratio);
  };
  const auto time = [&] {
    double value = 0;
    EXPECT_EQ((fmu.Call<const unsigned*, std::size_t, double*>("fmi2GetReal", &time_of, 1, &value)),
              kOk);
    return value;
  };
  for (int run = 0; run < 2; ++run) {
    EXPECT_EQ(fmu.Call("fmi2EnterInitializationMode"), kError);  // not set up
    EXPECT_THAT(last_message, HasSubstr("expected a setup of the experiment"));
    EXPECT_EQ(fmu.Call("fmi2ExitInitializationMode"), kError);
    EXPECT_EQ(setup(3), kOk);
    EXPECT_EQ(fmu.Call("fmi2ExitInitializationMode"), kError);  // set up is not initialisation
    EXPECT_THAT(last_message, HasSubstr("exit initialization mode: not allowed"));
    EXPECT_EQ(setup(2), kOk);  // again
    EXPECT_EQ(set(), kOk);
    EXPECT_EQ(fmu.Call("fmi2EnterInitializationMode"), kOk);
    EXPECT_EQ(time(), 2);
    EXPECT_EQ(fmu.Call("fmi2EnterInitializationMode"), kError);  // not twice
    EXPECT_EQ(setup(4), kError);
    EXPECT_EQ(set(), kOk);
    EXPECT_EQ(fmu.Call("fmi2ExitInitializationMode"), kOk);
    EXPECT_EQ(fmu.Call("fmi2EnterInitializationMode"), kError);
    EXPECT_EQ(setup(4), kError);
    EXPECT_EQ(set(), kError);
    EXPECT_EQ(time(), 2);
    EXPECT_EQ(fmu.Call("fmi2Terminate"), kOk);
    EXPECT_EQ(fmu.Call("fmi2EnterInitializationMode"), kError);
    EXPECT_EQ(fmu.Call("fmi2Reset"), kOk);
  }
  fmu.Find<void(void*)>("fmi2FreeInstance")(fmu.instance);
}

class FmuCallsOf : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Versions, FmuCallsOf, ::testing::Values(2, 3));

TEST_P(FmuCallsOf, RefuseNullPointers) {
  Raw fmu(GetParam());
  const std::string fmi = "fmi" + std::to_string(GetParam()),
                    state_of = GetParam() == 2 ? "FMUstate" : "FMUState",
                    back = GetParam() == 2 ? "DeSerialize" : "Deserialize";
  const auto refused = [&](int status, const char* message) {
    EXPECT_EQ(status, kError);
    EXPECT_THAT(last_message, HasSubstr(message));
    last_message.clear();
  };
  void* state = nullptr;
  std::size_t size = 0;
  refused(fmu.Call<void**>(fmi + "Get" + state_of, nullptr), "FMU state: none was given");
  ASSERT_EQ(fmu.Call<void**>(fmi + "Get" + state_of, &state), kOk);
  refused(fmu.Call<void*>(fmi + "Set" + state_of, nullptr), "FMU state: none was given");
  const std::string size_of = fmi + "Serialized" + state_of + "Size";
  refused(fmu.Call<void*, std::size_t*>(size_of, nullptr, &size), "FMU state: none was given");
  refused(fmu.Call<void*, std::size_t*>(size_of, state, nullptr), "size: none was given");
  ASSERT_EQ((fmu.Call<void*, std::size_t*>(size_of, state, &size)), kOk);
  Bytes bytes(size);
  using To = std::uint8_t*;
  using From = const std::uint8_t*;
  const std::string write = fmi + "Serialize" + state_of, read = fmi + back + state_of;
  refused(fmu.Call<void*, To, std::size_t>(write, nullptr, bytes.data(), size), "FMU state: none");
  refused(fmu.Call<void*, To, std::size_t>(write, state, nullptr, size), "serialized state: none");
  ASSERT_EQ((fmu.Call<void*, To, std::size_t>(write, state, bytes.data(), size)), kOk);
  refused(fmu.Call<From, std::size_t, void**>(read, nullptr, size, &state), "state: none was");
  refused(fmu.Call<From, std::size_t, void**>(read, bytes.data(), size, nullptr),
          "FMU state: none");
  const unsigned reference = at::kTime;
  if (GetParam() == 2) {
    refused(fmu.Call<const unsigned*, std::size_t, double*>("fmi2GetReal", &reference, 1, nullptr),
            "values: none was given");
    refused(fmu.Call<const unsigned*, std::size_t, double*>("fmi2GetReal", nullptr, 1, nullptr),
            "none was given");
  } else {
    refused(fmu.Call<const unsigned*, std::size_t, double*, std::size_t>("fmi3GetFloat64",
                                                                         &reference, 1, nullptr, 1),
            "values: none was given");
  }
  EXPECT_EQ(fmu.Call<void**>(fmi + "Free" + state_of, &state), kOk);
  fmu.Find<void(void*)>(fmi + "FreeInstance")(fmu.instance);
}

/// Bytes of a state with one number changed, and a checksum that is right again.
template <class T>
Bytes Tampered(Bytes bytes, std::size_t offset, T value) {
  const std::size_t head = bytes.size() - sizeof(WheelFmu::State);
  std::memcpy(&bytes[head + offset], &value, sizeof value);
  std::uint64_t sum = 14695981039346656037u;
  for (std::size_t i = head; i < bytes.size(); ++i) sum = (sum ^ bytes[i]) * 1099511628211u;
  std::memcpy(&bytes[head - sizeof sum], &sum, sizeof sum);
  return bytes;
}

TEST(FmuState, RefusesValuesThatNoStateHas) {
  Fmu wheel(kFmus / "fmi3");
  wheel.Initialize();
  const Bytes good = wheel.Serialize(wheel.Save());
  const auto message = [&](const Bytes& bytes) -> std::string {
    try {
      wheel.Restore(wheel.Deserialize(bytes));
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  using State = WheelFmu::State;
  const auto with = [&](at::Reference variable, double value) {
    return message(Tampered(good, offsetof(State, value) + sizeof(double) * variable, value));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double radius = wheel.Get("wheel_radius");
  EXPECT_EQ(with(at::kWheelRadius, radius), "");  // the checksum is right
  EXPECT_THAT(with(at::kWheelRadius, 2 * radius), HasSubstr("wheel_radius: got"));
  EXPECT_THAT(with(at::kWheelLoadForceX, nan), HasSubstr("wheel_load.force.x: got nan"));
  EXPECT_THAT(with(at::kWheelStatePosX, INFINITY), HasSubstr("wheel_state.pos.x: got inf"));
  EXPECT_THAT(with(at::kFlags, 1e300), HasSubstr("flags: got"));
  EXPECT_THAT(with(at::kFlags, 0.5), HasSubstr("flags: got"));
  EXPECT_THAT(with(at::kOverload, 2), HasSubstr("overload: got 2"));
  EXPECT_THAT(message(Tampered(good, offsetof(State, contact), nan)),
              HasSubstr("contact: got nan"));
  for (const std::int64_t mode : {-1, 4}) {
    EXPECT_THAT(message(Tampered(good, offsetof(State, mode), mode)), HasSubstr("mode: got"));
  }
  EXPECT_THAT(message(Tampered(good, offsetof(State, set_up), std::int64_t{7})),
              HasSubstr("got 7"));
  Bytes other = good;  // of another table of variables, whose checksum stands before size and sum
  other[good.size() - sizeof(State) - 3 * sizeof(std::uint64_t)] ^= 1;
  EXPECT_THAT(message(other), HasSubstr("another version of the FMU"));
}

class CommaLocale : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
};

// A host may have a decimal comma.
TEST(FmuParameters, AreReadTheSameInAnyLocale) {
  const std::locale before =
      std::locale::global(std::locale(std::locale::classic(), new CommaLocale));
  double damping = 0;
  try {
    damping = Fmu(kFmus / "fmi3").Get("damping_ratio");
  } catch (const std::exception& error) {
    ADD_FAILURE() << error.what();
  }
  std::locale::global(before);
  EXPECT_EQ(damping, 0.5);
}

}  // namespace
}  // namespace grouser::fmi::testing
