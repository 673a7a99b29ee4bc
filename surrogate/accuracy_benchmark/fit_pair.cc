#include <filesystem>
#include <string>

#include "surrogate/accuracy_benchmark/benchmark.h"
#include "surrogate/fit/fit_model.h"
#include "surrogate/fit/measured.h"
#include "surrogate/fit/plausible.h"
#include "surrogate/model_io/self_test.h"

namespace grouser::surrogate {

void FitPair(const std::string& folder, const std::string& command, bool accept_unusual,
             const std::function<void(const std::string&)>& progress) {
  FitRequest request;
  request.set = ReadRuns(folder + "/runs.json");
  request.reason = "campaign";
  request.command = command;
  const std::string measured = folder + "/measured.csv";
  if (std::filesystem::exists(measured)) {
    request.measured = ReadMeasured(measured, LimitsOf(request.set.scene), accept_unusual);
  }
  const struct {
    const char* name;
    v1alpha1::ModelKind kind;
  } models[] = {{"bekker", v1alpha1::MODEL_KIND_BEKKER},
                {"lookup", v1alpha1::MODEL_KIND_LOOKUP},
                {"hybrid", v1alpha1::MODEL_KIND_HYBRID}};
  for (const auto& r : models) {
    const std::string file = folder + "/" + r.name + ".model";
    request.kind = r.kind;
    request.name = request.set.name;
    if (r.kind != v1alpha1::MODEL_KIND_HYBRID) request.name += std::string("-") + r.name;
    WriteTestedModel(file, FitModel(request));
    progress("wrote " + file);
  }
}

}  // namespace grouser::surrogate
