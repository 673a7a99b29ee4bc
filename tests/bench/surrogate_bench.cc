#include "tests/bench/surrogate_bench.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <new>
#include <random>
#include <stdexcept>
#include <utility>

#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/models/hybrid.h"
#include "surrogate/models/lookup.h"
#include "surrogate/models/state_batch.h"
#include "tests/unit/count_allocations.h"

namespace grouser::bench {
namespace {

using surrogate::HybridModel;
using surrogate::kOutputs;
using Clock = std::chrono::steady_clock;

constexpr int kStates = 10000;
constexpr int kScalarStates = 500;  // of the scalar laws at small batches
constexpr int kModelBatches[] = {1, 100, kStates};

/// Random states inside the model's domain, and room for all answers.
struct States : surrogate::StateBatch {
  States(const v1alpha1::Domain& domain, unsigned seed) : StateBatch(kStates) {
    std::mt19937_64 random(seed);
    const auto draw = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (std::size_t i = 0; i < kStates;) {
      const double angle = draw(-1, 1) * domain.attack_angle_max_rad();
      const auto v = surrogate::FromSlip(draw(domain.slip_min(), domain.slip_max()), angle, 0.1);
      if (!std::isfinite(v.v_x)) continue;  // no motion has this slip
      Set(i++, v, draw(domain.load_min_n(), domain.load_max_n()));
    }
    slip.clear();  // no echoes
    attack_angle.clear();
  }

  surrogate::ResponsesView Some(std::size_t first, std::size_t n, bool gradients) {
    surrogate::ResponsesView view = Out(first, n);
    for (auto& to : view.output) {
      if (!gradients) to.d_v_x = to.d_v_y = to.d_rim_speed = to.d_load = {};
    }
    return view;
  }
};

/// One row and what it runs: a pass over `states` of the states.
struct ModelCell {
  SurrogateRow row;
  int states = kStates;
  std::function<void()> pass;
  std::vector<double> ns;
};

class Bench {
 public:
  Bench(const v1alpha1::Model& message, unsigned seed)
      : states_(message.domain(), seed), model_(surrogate::MakeModel(message)) {
    if (const auto* hybrid = dynamic_cast<const HybridModel*>(model_.get())) {
      exact_ = std::make_unique<HybridModel>(*hybrid);
      HybridModel bekker(hybrid->physics(), {}, hybrid->hull(), {});
      bekker.AnswerByLaw();
      AddTables<HybridModel>("bekker", bekker);
      AddScalar("bekker_exact", [this](std::size_t i) {
        sink_ = sink_ +
                exact_->physics()
                    .Solve(states_.v_x[i], states_.v_y[i], states_.rim_speed[i], states_.load[i])
                    .value[0];
      });
      AddScalar("hybrid_exact", [this](std::size_t i) {
        sink_ = sink_ + exact_
                            ->EvaluateOne(states_.v_x[i], states_.v_y[i], states_.rim_speed[i],
                                          states_.load[i])
                            .value[0];
      });
      AddTables<HybridModel>("hybrid", *hybrid);
    } else if (const auto* lookup = dynamic_cast<const surrogate::LookupModel*>(model_.get())) {
      AddTables<surrogate::LookupModel>("lookup", *lookup);
    }
  }

  std::vector<SurrogateRow> Run(int repetitions) {
    for (ModelCell& cell : cells_) {
      cell.pass();  // page faults
      const long before = g_allocations;
      cell.pass();
      cell.row.allocations = g_allocations - before;
    }
    for (int repetition = 0; repetition < repetitions; ++repetition) {
      for (ModelCell& cell : cells_) {
        const auto start = Clock::now();
        cell.pass();
        const std::chrono::duration<double, std::nano> spent = Clock::now() - start;
        cell.ns.push_back(spent.count() / cell.states);
      }
    }
    std::vector<SurrogateRow> rows;
    for (ModelCell& cell : cells_) {
      std::nth_element(cell.ns.begin(), cell.ns.begin() + cell.ns.size() / 2, cell.ns.end());
      cell.row.ns_per_state = cell.ns[cell.ns.size() / 2];
      rows.push_back(cell.row);
    }
    return rows;
  }

 private:
  void AddScalar(const char* kind, std::function<void(std::size_t)> one) {
    for (const int batch : kModelBatches) {
      ModelCell cell;
      cell.row = {kind, batch, kOutputs, false, "-", 0, 0};
      cell.states = std::max(batch, kScalarStates);
      cell.pass = [one, n = cell.states] {
        for (int i = 0; i < n; ++i) one(static_cast<std::size_t>(i));
      };
      cells_.push_back(std::move(cell));
    }
  }

  template <typename Model>
  void AddTables(const char* kind, const Model& model) {
    for (const char* isa : {"baseline", "avx2", "avx512"}) {
      auto chosen = std::make_shared<Model>(model);
      if (!chosen->SelectIsa(isa)) continue;
      for (const int batch : kModelBatches) {
        for (const bool gradients : {false, true}) {
          ModelCell cell;
          cell.row = {kind, batch, kOutputs, gradients, isa, 0, 0};
          cell.pass = [this, chosen, batch, gradients] {
            for (int first = 0; first < kStates; first += batch) {
              chosen->Evaluate(states_.In(first, batch), states_.Some(first, batch, gradients));
            }
          };
          cells_.push_back(std::move(cell));
        }
      }
    }
  }

  States states_;
  std::unique_ptr<const surrogate::WheelModel> model_;
  std::unique_ptr<const HybridModel> exact_;
  std::vector<ModelCell> cells_;
  volatile double sink_ = 0;  // or the scalar calls would be left out
};

}  // namespace

std::string FindShipped(const std::string& name) {
  namespace fs = std::filesystem;
  if (const char* root = std::getenv("GROUSER_ROOT")) {
    if (fs::exists(fs::path(root) / name)) return fs::path(root) / name;
  }
  for (fs::path at = fs::read_symlink("/proc/self/exe"); at.has_relative_path();
       at = at.parent_path()) {
    if (fs::exists(at.parent_path() / name)) return at.parent_path() / name;
  }
  throw std::runtime_error("no " + name + " in $GROUSER_ROOT or above this program");
}

long Allocations() { return g_allocations; }

std::vector<SurrogateRow> MeasureSurrogate(const SurrogateOptions& options) {
  const std::string path = options.model.empty()
                               ? FindShipped("surrogate/shipped/cmu-smooth-62.5.model")
                               : options.model;
  Bench bench(surrogate::ReadModel(path).model, options.seed);
  return bench.Run(options.repetitions);
}

}  // namespace grouser::bench
