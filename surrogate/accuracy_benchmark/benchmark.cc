// Every kind of model, timed and compared on the test states of a pair.
#include "surrogate/accuracy_benchmark/benchmark.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>

#include "surrogate/accuracy_benchmark/kriging.h"
#include "surrogate/accuracy_benchmark/on_measured.h"
#include "surrogate/accuracy_benchmark/timing.h"
#include "surrogate/fit/calibration.h"
#include "surrogate/fit/fit_model.h"
#include "surrogate/fit/measured.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/model_io/write_model.h"
#include "surrogate/models/hybrid.h"

namespace grouser::surrogate {
namespace {

namespace fs = std::filesystem;

/// What a pair's rows are compared by.
struct Ground {
  std::string pair;
  double radius_m = 0;
  WheelLimits limits{};
  std::vector<Sample> train, test, repeats;
  BedVariability patch;
  std::vector<v1alpha1::MeasuredPoint> measured;  ///< empty: none
  double speed = 0;                               ///< of the training runs [m/s]
};

using Answerer = std::function<Answer(const Sample&)>;

std::vector<Compared> OnTests(const Ground& ground, const Answerer& answer) {
  std::vector<Compared> out;
  for (const Sample& row : ground.test) {
    const Answer a = answer(row);
    out.push_back({row.slip, row.attack_angle_rad, row.load_n, row.mean, a.value, a.half_width});
  }
  return out;
}

/// Adds the rows of a kind whose answers were compared.
void Add(const Ground& ground, const std::string& kind, double ns,
         const std::vector<Compared>& compared, std::vector<BenchmarkRow>* rows,
         const char* reference = "dem") {
  BenchmarkRow head;
  head.pair = ground.pair;
  head.kind = kind;
  head.reference = reference;
  head.ns_per_answer = ns;
  const bool noisy = head.reference == "dem";
  const auto more = MeasureErrors(
      head, compared, noisy ? ground.patch.sd : std::array<double, kOutputs>{}, ground.radius_m);
  rows->insert(rows->end(), more.begin(), more.end());
}

/// The same of a kind that answers any state: on the test states and on the measured ones.
void AddBoth(const Ground& ground, const std::string& kind, double ns, const Answerer& answer,
             std::vector<BenchmarkRow>* rows) {
  Add(ground, kind, ns, OnTests(ground, answer), rows);
  if (ground.measured.empty()) return;
  Add(ground, kind, ns, OnMeasured(ground.measured, ground.speed, answer), rows, "measured");
}

void BenchmarkUntuned(const PairFolder& pair, const v1alpha1::Scene& scene, const Ground& ground,
                      double seconds, std::vector<BenchmarkRow>* rows) {
  const std::optional<BekkerModel> physics = UntunedModel(pair, scene);
  if (!physics) return;
  TrainingDomain anywhere;
  anywhere.load_min_n = anywhere.load_max_n = 1;
  HybridModel model(*physics, {}, anywhere, Uncertainty{});  // as users ask it
  model.AnswerByLaw();
  const double ns = TimeOfModel(model, ground.test, seconds);
  const auto answer = [&](const Sample& row) {
    return Answer{AnswerOf(model, row.motion, row.load_n).value, {}};
  };
  AddBoth(ground, "bekker_untuned", ns, answer, rows);
}

void BenchmarkModels(const PairFolder& pair, const Ground& ground, double seconds,
                     std::vector<BenchmarkRow>* rows) {
  for (const char* kind : {"bekker", "lookup", "hybrid"}) {
    const std::string file = pair.path + "/" + kind + ".model";
    if (!fs::exists(file)) {
      throw std::invalid_argument(file + ": not there; `grouser-ladder fit " + pair.path +
                                  "` makes it");
    }
    const std::unique_ptr<const WheelModel> model = MakeModel(ReadModel(file).model);
    const double ns = TimeOfModel(*model, ground.test, seconds);
    const auto answer = [&](const Sample& row) {
      const WheelAnswer a = AnswerOf(*model, row.motion, row.load_n);
      return Answer{a.value, a.half_width};
    };
    AddBoth(ground, kind, ns, answer, rows);
  }
}

void BenchmarkKriging(const Ground& ground, double seconds, std::vector<BenchmarkRow>* rows) {
  const Kriging kriging(ground.train, ground.patch.sd, ground.radius_m);
  std::size_t next = 0;
  const double ns =
      TimeOf([&] { kriging.At(ground.test[next++ % ground.test.size()]); }, 1, seconds);
  AddBoth(
      ground, "kriging", ns, [&](const Sample& row) { return kriging.At(row); }, rows);
}

/// What a single run is off by: its own error and the patch's.
std::array<double, kOutputs> HalfWidthOf(const Sample& row, const Ground& ground) {
  std::array<double, kOutputs> half{};
  for (int o = 0; o < kOutputs; ++o) {
    half[o] = kTwoSided90 * std::sqrt(2.0) * ground.patch.sd[o] *
              OutputScale(o, row.load_n, ground.radius_m);
  }
  return half;
}

void BenchmarkCoarse(const std::string& file, const Ground& ground,
                     std::vector<BenchmarkRow>* rows) {
  if (!fs::exists(file)) return;
  const TrainingSet coarse = ReadRuns(file);
  std::map<StateKey, Sample> by_state;
  double wall = 0;
  for (const Sample& row : SamplesOf(coarse.runs, v1alpha1::RUN_ROLE_TEST)) {
    by_state.emplace(KeyOf(row), row);
    wall += row.source->wall_s();
  }
  std::vector<Compared> compared;
  for (const Sample& row : ground.test) {
    const auto found = by_state.find(KeyOf(row));
    if (found == by_state.end()) continue;
    compared.push_back({row.slip, row.attack_angle_rad, row.load_n, row.mean, found->second.mean,
                        HalfWidthOf(row, ground)});
  }
  if (compared.empty())
    throw std::invalid_argument(file + ": none of the test states of runs.json");
  Add(ground, "coarse_dem", wall / static_cast<double>(by_state.size()) * 1e9, compared, rows);
}

void BenchmarkDem(const Ground& ground, std::vector<BenchmarkRow>* rows) {
  std::map<StateKey, std::vector<const Sample*>> states;
  double wall = 0;
  for (const Sample& row : ground.repeats) states[KeyOf(row)].push_back(&row);
  for (const Sample& row : ground.test) wall += row.source->wall_s();
  std::vector<Compared> compared;
  for (const auto& [key, repeats] : states) {
    if (repeats.size() < 2) continue;
    for (const Sample* one : repeats) {
      Compared j{one->slip, one->attack_angle_rad,    one->load_n, {},
                 one->mean, HalfWidthOf(*one, ground)};
      for (const Sample* other : repeats) {
        for (int o = 0; o < kOutputs && other != one; ++o) {
          j.truth[o] += other->mean[o] / static_cast<double>(repeats.size() - 1);
        }
      }
      compared.push_back(j);
    }
  }
  if (compared.empty()) return;
  Add(ground, "dem", wall / static_cast<double>(ground.test.size()) * 1e9, compared, rows);
}

/// DEM runs of a campaign that were made at measured states, and those of `grouser validate`.
void BenchmarkDemOnMeasured(const PairFolder& pair, const TrainingSet& set, const Ground& ground,
                            std::vector<BenchmarkRow>* rows) {
  if (ground.measured.empty()) return;
  const auto add = [&](const std::string& kind, const DemOnMeasured& dem) {
    if (dem.compared.empty()) return;
    Add(ground, kind, dem.wall_s * 1e9, dem.compared, rows, "measured");
  };
  const std::string coarse = pair.path + "/coarse.json";
  if (fs::exists(coarse)) add("coarse_dem", RunsAtStates(ground.measured, ReadRuns(coarse).runs));
  add("dem", RunsAtStates(ground.measured, set.runs));
  for (const std::string& file : ValidatedFiles(pair.path)) {
    const DemOnMeasured dem = ReadValidated(file);
    add(dem.kind, dem);
  }
}

Ground GroundOf(const PairFolder& pair, const TrainingSet& set) {
  Ground g;
  g.pair = pair.name;
  g.radius_m = set.scene.wheel().radius_m();
  g.limits = LimitsOf(set.scene);
  g.train = SamplesOf(set.runs, v1alpha1::RUN_ROLE_TRAIN);
  g.test = SamplesOf(set.runs, v1alpha1::RUN_ROLE_TEST);
  g.repeats = ReplicateSamples(set.runs);
  g.patch = EstimateBedVariability(g.repeats, g.train, g.radius_m);
  if (!g.train.empty()) g.speed = g.train.front().source->speed_m_per_s();
  const std::string measured = pair.path + "/measured.csv";
  if (fs::exists(measured)) g.measured = ReadMeasured(measured, g.limits, pair.accept_unusual);
  if (g.test.empty()) throw std::invalid_argument(pair.path + "/runs.json: no test state that ran");
  return g;
}

}  // namespace

std::vector<BenchmarkRow> RunAccuracyBenchmark(const PairFolder& pair, double seconds) {
  const TrainingSet set = ReadRuns(pair.path + "/runs.json");
  const Ground ground = GroundOf(pair, set);
  std::vector<BenchmarkRow> rows;
  BenchmarkUntuned(pair, set.scene, ground, seconds, &rows);
  BenchmarkModels(pair, ground, seconds, &rows);
  BenchmarkKriging(ground, seconds, &rows);
  BenchmarkCoarse(pair.path + "/coarse.json", ground, &rows);
  BenchmarkDem(ground, &rows);
  BenchmarkDemOnMeasured(pair, set, ground, &rows);
  return rows;
}

}  // namespace grouser::surrogate
