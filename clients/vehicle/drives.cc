#include "clients/vehicle/drives.h"

#include <algorithm>
#include <iostream>
#include <vector>

#include "clients/vehicle/motion_log.h"
#include "clients/vehicle/motion_options.h"
#include "clients/vehicle/print.h"

namespace grouser::cli {
namespace {

using vehicle::TrajectoryStep;

MotionLog ReadDrive(const DescribedVehicle& described, const std::string& drive,
                    const std::string& soil) {
  return ReadMotionLog(drive, described.soils, soil.empty() ? 0 : SoilOption(described, soil));
}

bool PrintRows(VehicleAnswers* answers, const MotionLog& log, bool json) {
  const std::vector<PowerInterval> powers = answers->Energies(log.motions);
  std::cout << (json ? JsonOf(answers->described().vehicle, log, powers) : CsvOf(log, powers));
  if (!json) std::cerr << SumOf(log, powers);
  const bool last_lasts = log.time_s.size() < 2;
  return AreGood(std::span(powers).first(powers.size() - (last_lasts ? 0 : 1)));
}

bool Compare(VehicleAnswers* answers, std::span<const std::string> drives, const std::string& soil,
             bool json) {
  std::vector<std::vector<TrajectoryStep>> trajectories;
  for (const std::string& drive : drives) {
    trajectories.push_back(StepsOf(drive, ReadDrive(answers->described(), drive, soil)));
  }
  const std::vector<TrajectoryCost> costs = answers->Costs(trajectories);
  std::cout << (json ? JsonOf(drives, costs) : CsvOf(drives, costs));
  return std::all_of(costs.begin(), costs.end(), IsGood);
}

}  // namespace

bool IsGood(const TrajectoryCost& cost) {
  return (cost.reasons & ~vehicle::kUntrained) == 0 && cost.energy.left_out == 0;
}

bool AreGood(std::span<const PowerInterval> powers) {
  TrajectoryCost cost;
  for (const PowerInterval& power : powers) cost.Add(0, 1, power);
  return IsGood(cost);
}

bool PrintEnergies(VehicleAnswers* answers, std::span<const std::string> drives,
                   const std::string& soil, bool json) {
  if (drives.size() > 1) return Compare(answers, drives, soil, json);
  return PrintRows(answers, ReadDrive(answers->described(), drives.front(), soil), json);
}

}  // namespace grouser::cli
