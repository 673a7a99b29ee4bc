#include <filesystem>
#include <string>

#include "surrogate/fit/fit_model.h"
#include "surrogate/fit/measured.h"
#include "surrogate/fit/plausible.h"
#include "surrogate/ladder/ladder.h"
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
    v1alpha1::Rung rung;
  } rungs[] = {{"bekker", v1alpha1::RUNG_BEKKER},
               {"lookup", v1alpha1::RUNG_LOOKUP},
               {"hybrid", v1alpha1::RUNG_HYBRID}};
  for (const auto& r : rungs) {
    const std::string file = folder + "/" + r.name + ".model";
    request.rung = r.rung;
    request.name = request.set.name;
    if (r.rung != v1alpha1::RUNG_HYBRID) request.name += std::string("-") + r.name;
    WriteTestedModel(file, FitModel(request));
    progress("wrote " + file);
  }
}

}  // namespace grouser::surrogate
