#include "surrogate/accuracy_benchmark/promise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "surrogate/accuracy_benchmark/errors.h"
#include "surrogate/fit/binomial_band.h"
#include "surrogate/fit/error_table.h"
#include "surrogate/fit/json.h"
#include "surrogate/fit/training_set.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/selectable_model.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/models/model_selector.h"
#include "surrogate/models/state_batch.h"

namespace grouser::surrogate {
namespace {

constexpr std::array kModels = {"bekker", "lookup", "hybrid"};

/// The pair's models and the model selector of them.
struct Loaded {
  std::vector<std::unique_ptr<const WheelModel>> models;
  std::vector<std::string> names;  // in the order of the model selector
  std::unique_ptr<const ModelSelector> selector;
  double radius_m = 0;
};

void DropHeldOut(v1alpha1::Model* message) {
  auto& errors = *message->mutable_errors();
  errors.erase(std::remove_if(errors.begin(), errors.end(),
                              [](const auto& row) { return row.set() == "held_out"; }),
               errors.end());
}

Loaded Load(const std::string& folder, const PromiseOptions& options) {
  if (!options.cost_ns.empty() && options.cost_ns.size() != kModels.size()) {
    throw std::invalid_argument(
        fmt::format("costs: {} numbers, expected {} (bekker, lookup, hybrid)",
                    options.cost_ns.size(), kModels.size()));
  }
  Loaded loaded;
  std::vector<SelectableModel> models;
  for (std::size_t k = 0; k < kModels.size(); ++k) {
    const std::string file = folder + "/" + kModels[k] + ".model";
    if (!std::filesystem::exists(file)) throw std::invalid_argument(file + ": not there");
    v1alpha1::Model message = ReadModel(file).model;
    if (options.without_held_out) DropHeldOut(&message);
    loaded.models.push_back(MakeModel(message));
    models.push_back(MakeSelectableModel(message, *loaded.models.back()));
    if (!options.cost_ns.empty()) models.back().cost_ns = options.cost_ns[k];
    loaded.radius_m = message.wheel().radius_m();
  }
  loaded.selector = std::make_unique<const ModelSelector>(std::move(models));
  for (const SelectableModel& model : loaded.selector->models()) {
    for (std::size_t k = 0; k < kModels.size(); ++k) {
      if (model.model == loaded.models[k].get()) loaded.names.emplace_back(kModels[k]);
    }
  }
  return loaded;
}

std::vector<PromiseRow> Questions(double radius_m) {
  std::vector<PromiseRow> rows;
  for (const int percent : {3, 6, 10, 15, 20, 30}) {
    PromiseRow row;
    row.tolerance = fmt::format("{} %", percent);
    row.accuracy.share_of_load = 0.01 * percent;
    row.accuracy.tolerance[kSinkage] = 0.01 * percent * radius_m;
    for (const Output o : kPredicted) row.compared[o] = true;
    rows.push_back(row);
  }
  for (const int mm : {2, 4, 8}) {
    PromiseRow row;
    row.tolerance = fmt::format("sinkage {} mm", mm);
    row.accuracy.tolerance[kSinkage] = 1e-3 * mm;
    row.compared[kSinkage] = true;
    rows.push_back(row);
  }
  return rows;
}

void Ask(const Loaded& loaded, const std::vector<Sample>& states, PromiseRow* row) {
  const std::size_t n = states.size();
  StateBatch batch(n, {kValue});
  std::vector<std::uint32_t> answered_by(n);
  for (std::size_t i = 0; i < n; ++i) batch.Set(i, states[i].motion, states[i].load_n);
  loaded.selector->Evaluate(batch.In(), row->accuracy, batch.Out(), answered_by, nullptr);
  row->n = static_cast<int>(n);
  row->by_model.assign(loaded.names.size(), 0);
  for (std::size_t i = 0; i < n; ++i) {
    if ((batch.flags[i] & (kToleranceUnmet | kInvalid)) != 0) continue;
    ++row->met;
    ++row->by_model[answered_by[i]];
    const auto tolerance = row->accuracy.At(states[i].load_n, loaded.radius_m);
    bool all = true;
    for (std::size_t o = 0; o < kOutputs; ++o) {
      if (!row->compared[o]) continue;
      const bool inside = Covered(states[i].mean[o], batch.part[o][kValue][i], tolerance[o]);
      row->within[o] += inside ? 1 : 0;
      all &= inside;
    }
    row->all_within += all ? 1 : 0;
  }
}

/// The output that keeps its promise least.
int LeastWithin(const PromiseRow& row) {
  int least = row.met;
  for (const Output o : kPredicted) {
    if (row.compared[o]) least = std::min(least, row.within[o]);
  }
  return least;
}

}  // namespace

int FewestWithin(int n) { return BinomialBand(n, 0.9).low; }

Promise MeasurePromise(const std::string& folder, const PromiseOptions& options) {
  const TrainingSet set = ReadRuns(folder + "/runs.json");
  const std::vector<Sample> states = SamplesOf(set.runs, v1alpha1::RUN_ROLE_TEST);
  if (states.empty()) {
    throw std::invalid_argument(folder + "/runs.json: no test state that ran");
  }
  const Loaded loaded = Load(folder, options);
  Promise promise;
  promise.models = loaded.names;
  for (const SelectableModel& model : loaded.selector->models())
    promise.cost_ns.push_back(model.cost_ns);
  promise.rows = Questions(loaded.radius_m);
  for (PromiseRow& row : promise.rows) Ask(loaded, states, &row);
  return promise;
}

std::string PromiseText(const Promise& p) {
  std::string out = "| tolerance | states | met |";
  for (std::size_t k = 0; k < p.models.size(); ++k) {
    out += fmt::format(" {} ({:.0f} ns) |", p.models[k], p.cost_ns[k]);
  }
  out += " f_x | f_y | torque | m_z | sinkage | fewest of a kept promise | all at once |\n|";
  for (std::size_t k = 0; k < 10 + p.models.size(); ++k) out += " --- |";
  out += "\n";
  for (const PromiseRow& row : p.rows) {
    out += fmt::format("| {} | {} | {} |", row.tolerance, row.n, row.met);
    for (const int count : row.by_model) out += fmt::format(" {} |", count);
    for (const Output o : kPredicted) {
      out += row.compared[o] && row.met > 0 ? fmt::format(" {} |", row.within[o]) : " - |";
    }
    if (row.met > 0) {
      const int fewest = FewestWithin(row.met);
      out += fmt::format(" {}{} | {} |\n", fewest, LeastWithin(row) < fewest ? " (broken)" : "",
                         row.all_within);
    } else {
      out += " - | - |\n";
    }
  }
  return out;
}

std::string PromiseJson(const Promise& p) {
  Json out = Json::array();
  for (const PromiseRow& row : p.rows) {
    Json by_model = Json::object(), within = Json::object();
    for (std::size_t k = 0; k < p.models.size(); ++k) by_model[p.models[k]] = row.by_model[k];
    for (const Output o : kPredicted) {
      if (row.compared[o]) within[kOutputFields[o].name] = row.within[o];
    }
    out.push_back({{"tolerance", row.tolerance},
                   {"n", row.n},
                   {"met", row.met},
                   {"by_model", by_model},
                   {"within", within},
                   {"all_within", row.all_within},
                   {"fewest", FewestWithin(row.met)}});
  }
  return Text(out) + "\n";
}

}  // namespace grouser::surrogate
