#include "surrogate/model_io/self_test.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "proto/records/model_file.h"
#include "surrogate/model_io/load_model.h"

namespace grouser::surrogate {
namespace {

constexpr double kGoldenTolerance = 1e-9;  // relative, as the model format promises

}  // namespace

void SelfTest(const std::string& name, const v1alpha1::Model& message, const WheelModel& model) {
  CheckGolden(
      name, message,
      [&](const VelocityState& motion, double load) { return AnswerOf(model, motion, load); },
      [&](double value, double scale) {
        return kGoldenTolerance * std::max(1.0, std::abs(value)) + model.Tolerance() * scale;
      });
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
