#include "surrogate/model_io/self_test.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "proto/records/model_file.h"
#include "surrogate/model_io/load_model.h"

namespace grouser::surrogate {
namespace {

constexpr double kGoldenTolerance = 1e-9;  // relative, as the model format promises

}  // namespace

void SelfTest(const std::string& name, const v1alpha1::Model& message, const WheelModel& model) {
  const auto fail = [&name](int i, const char* field, const std::string& what) {
    throw std::runtime_error(name + ": golden[" + std::to_string(i) + "]." + field + ": " + what);
  };
  if (message.golden_size() == 0) {
    throw std::runtime_error(name + ": golden: none, expected at least one to test the model with");
  }
  for (int i = 0; i < message.golden_size(); ++i) {
    const v1alpha1::GoldenVector& golden = message.golden(i);
    if (golden.value_size() != kOutputs) {
      fail(i, "value",
           std::to_string(golden.value_size()) + " entries, expected " + std::to_string(kOutputs));
    }
    const VelocityState motion{golden.v_x_m_per_s(), golden.v_y_m_per_s(),
                               golden.rim_speed_m_per_s()};
    const auto value = AnswerOf(model, motion, golden.load_n()).value;
    for (int o = 0; o < kOutputs; ++o) {
      const double allowed =
          kGoldenTolerance * std::max(1.0, std::abs(golden.value(o))) +
          model.Tolerance() * OutputScale(o, golden.load_n(), message.wheel().radius_m());
      if (std::abs(value[o] - golden.value(o)) <= allowed) continue;
      std::ostringstream text;
      text.precision(17);
      text << value[o] << ", expected " << golden.value(o) << " to " << allowed;
      fail(i, kOutputFields[o].name, text.str());
    }
  }
}

std::unique_ptr<const WheelModel> MakeTestedModel(const v1alpha1::Model& message) {
  std::unique_ptr<const WheelModel> model = MakeModel(message);
  SelfTest("model " + message.name(), message, *model);
  return model;
}

std::string WriteTestedModel(const std::string& path, const v1alpha1::Model& message) {
  try {
    v1alpha1::Model read_back;
    if (!read_back.ParseFromString(message.SerializeAsString())) {
      throw std::runtime_error("the message cannot be read back");
    }
    MakeTestedModel(read_back);
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": not written, no server would take it: " + error.what());
  }
  return records::WriteModelFile(path, message);
}

}  // namespace grouser::surrogate
