#include "surrogate/fit/pair_errors.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

using Values = std::function<std::array<double, kOutputs>(const Sample&)>;

void AddPair(const PairFolder& pair, const TrainingSet& set, const Values& answer,
             PairErrors* errors) {
  const double radius = set.scene.wheel().radius_m();
  for (const Sample& test : SamplesOf(set.runs, v1alpha1::RUN_ROLE_TEST)) {
    Sample row = test;
    LeftOut left{};
    left.fold = errors->pairs.size();
    left.prediction.value = answer(test);
    for (int o = 0; o < kOutputs; ++o) {
      const double scale = OutputScale(o, test.load_n, radius);
      row.mean[o] /= scale;
      left.prediction.value[o] /= scale;
    }
    row.load_n = 1;
    row.source = nullptr;  // of a set that ends here
    const double speed = test.source->speed_m_per_s();
    errors->froude_max = std::max(errors->froude_max,
                                  speed * speed / (set.scene.soil().gravity_m_per_s2() * radius));
    errors->samples.push_back(row);
    errors->rows.push_back(left);
  }
  errors->pairs.push_back(pair.name);
}

void Finish(const std::string& what, PairErrors* errors) {
  if (errors->rows.empty()) throw std::invalid_argument("no pair with " + what + ", expected one");
  for (std::size_t i = 0; i < errors->rows.size(); ++i) errors->rows[i].row = &errors->samples[i];
}

}  // namespace

PairErrors ErrorsOfUntuned(const std::vector<PairFolder>& pairs) {
  PairErrors errors;
  for (const PairFolder& pair : pairs) {
    const TrainingSet set = ReadRuns(pair.path + "/runs.json");
    const std::optional<BekkerModel> model = UntunedModel(pair, set.scene);
    if (!model) continue;
    const auto answer = [&](const Sample& at) {
      return model->Solve(at.motion.v_x, at.motion.v_y, at.motion.rim_speed, at.load_n).value;
    };
    AddPair(pair, set, answer, &errors);
  }
  Finish("an untuned.soil", &errors);
  return errors;
}

PairErrors ErrorsOfFitted(const std::vector<PairFolder>& pairs) {
  PairErrors errors;
  for (const PairFolder& pair : pairs) {
    const auto model = MakeScalar(ReadModel(pair.path + "/bekker.model").model);
    const auto answer = [&](const Sample& at) {
      return AnswerOf(*model, at.motion, at.load_n).value;
    };
    AddPair(pair, ReadRuns(pair.path + "/runs.json"), answer, &errors);
  }
  Finish("a bekker.model", &errors);
  return errors;
}

std::vector<BekkerParameters> FittedParameters(const std::vector<PairFolder>& pairs) {
  std::vector<BekkerParameters> all;
  for (const PairFolder& pair : pairs) {
    all.push_back(ReadBekker(ReadModel(pair.path + "/bekker.model").model.bekker()));
  }
  return all;
}

ErrorSpread SpreadOf(const PairErrors& errors) {
  BedVariability none;  // of the bed is in the errors
  ErrorSpread spread;
  spread.bulldozing = none.bulldozing = EstimateBulldozing(errors.rows, none, 1);
  const Calibration calibration = Calibrate(errors.rows, none, 1);
  spread.inside = calibration.inside;
  spread.factor = calibration.factor;
  spread.other_pairs = CrossConformalCoverage(errors.rows, none, 1);
  return spread;
}

}  // namespace grouser::surrogate
