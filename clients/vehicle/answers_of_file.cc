#include <algorithm>

#include "clients/vehicle/answers.h"
#include "surrogate/vehicle/mixture_ground.h"
#include "surrogate/vehicle/vehicle_file.h"

namespace grouser::cli {
namespace {

using namespace vehicle;

class FileAnswers final : public VehicleAnswers {
 public:
  explicit FileAnswers(const std::string& file) : file_(ReadVehicle(file)) {
    described_ = {file_.vehicle, file_.grounds.soils, file_.sources};
  }

  void AddMixture(const std::string& text) override {
    vehicle::AddMixture(text, ReadSoilWeights(text), &file_);
    described_.soils = file_.grounds.soils;
    described_.sources = file_.sources;
  }
  Solution Solve(const Motion& motion, GoProbability* go) override {
    Solution solution;
    Solver(file_.vehicle, file_.grounds).Solve({&motion, 1}, {&solution, 1});
    *go = SpeedPlanner(file_.vehicle, file_.grounds, 1).ProbabilityToGo(motion, Limits());
    return solution;
  }
  MotionOnDraws SolveOnDraws(const Motion& motion, std::size_t count) override {
    const auto draws = std::make_shared<const GroundDraws>(file_.grounds, count);
    std::vector<Motion> motions(count, motion);
    for (std::size_t k = 0; k < count; ++k) motions[k].draw = static_cast<int>(k);
    MotionOnDraws out;
    out.solutions.resize(count);
    Solver solver(file_.vehicle, file_.grounds);
    solver.UseDraws(draws);
    solver.Solve(motions, out.solutions);
    SpeedPlanner planner(file_.vehicle, file_.grounds, 1);
    planner.UseDraws(draws);
    out.go = planner.ProbabilityByDraws(motion, Limits());
    return out;
  }
  std::vector<PowerInterval> Energies(std::span<const Motion> motions) override {
    Solver solver(file_.vehicle, file_.grounds);
    PowerBatch batch(&solver);
    std::vector<PowerInterval> powers;
    auto next = motions.begin();
    batch.ForEach(
        motions.size(), SpeedOptions{}.worse_by_sd, {}, [&] { return *next++; },
        [&](const PowerInterval& power) { powers.push_back(power); });
    return powers;
  }
  std::vector<TrajectoryCost> Costs(
      std::span<const std::vector<TrajectoryStep>> trajectories) override {
    Solver solver(file_.vehicle, file_.grounds);
    TrajectoryEvaluator evaluator(&solver);
    std::vector<TrajectoryCost> costs;
    for (const auto& trajectory : trajectories) {
      const std::size_t steps = trajectory.size();
      auto next = trajectory.begin();
      costs.push_back(evaluator
                          .CostsOf(
                              {&steps, 1}, [&] { return *next++; }, SpeedOptions{}.worse_by_sd)
                          .front());
    }
    return costs;
  }
  std::size_t Plan(std::span<const PathPoint> path, const SpeedOptions& options,
                   std::span<SpeedPoint> out, PlanOnDraws* on_draws) override {
    SpeedPlanner planner(file_.vehicle, file_.grounds, path.size());
    const std::size_t not_held = planner.Plan(path, options, out);
    if (on_draws->draws == 0) return not_held;
    planner.UseDraws(std::make_shared<const GroundDraws>(file_.grounds, on_draws->draws));
    on_draws->at.resize(path.size());
    on_draws->holds = planner.PlanByDraws(path, options, out, on_draws->at);
    return not_held;
  }
  GradeRange Grades(double speed, std::uint8_t soil, const SpeedOptions& options) override {
    return SpeedPlanner(file_.vehicle, file_.grounds, 1).Grades(speed, soil, options);
  }
  std::vector<SkidConstants> Constants(std::span<const double> speeds,
                                       std::span<const double> radii,
                                       std::span<const std::uint8_t> soils) override {
    return ConstantsOf(file_.vehicle, file_.grounds, speeds, radii, {}, soils);
  }

 private:
  /// Those of the vehicle alone.
  static SpeedOptions Limits() {
    SpeedOptions limits;
    limits.tip_margin = 0;
    return limits;
  }
  VehicleFile file_;
};

}  // namespace

std::unique_ptr<VehicleAnswers> AnswersOfFile(const std::string& file) {
  return std::make_unique<FileAnswers>(file);
}

}  // namespace grouser::cli
