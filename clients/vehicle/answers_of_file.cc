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
    SpeedOptions limits;  // those of the vehicle alone
    limits.tip_margin = 0;
    *go = SpeedPlanner(file_.vehicle, file_.grounds, 1).ProbabilityToGo(motion, limits);
    return solution;
  }
  PowerInterval Energy(const Motion& motion) override {
    Solver solver(file_.vehicle, file_.grounds);
    return PowerOf(&solver, motion);
  }
  std::size_t Plan(std::span<const PathPoint> path, const SpeedOptions& options,
                   std::span<SpeedPoint> out) override {
    return SpeedPlanner(file_.vehicle, file_.grounds, path.size()).Plan(path, options, out);
  }
  GradeRange Grades(double speed, std::uint8_t soil, const SpeedOptions& options) override {
    return SpeedPlanner(file_.vehicle, file_.grounds, 1).Grades(speed, soil, options);
  }
  std::vector<SkidConstants> Constants(std::span<const double> speeds,
                                       std::span<const double> radii) override {
    return ConstantsOf(file_.vehicle, file_.grounds, speeds, radii);
  }

 private:
  VehicleFile file_;
};

}  // namespace

std::unique_ptr<VehicleAnswers> AnswersOfFile(const std::string& file) {
  return std::make_unique<FileAnswers>(file);
}

}  // namespace grouser::cli
