#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "grouser/v1alpha1/trajectory.pb.h"
#include "surrogate/vehicle/messages.h"
#include "surrogate/vehicle/trajectory.h"

/// Trajectories and their costs to messages and back, bit for bit.
namespace grouser::vehicle {

/// How many there are, their steps in all and those of the longest.
struct TrajectoryCounts {
  std::size_t trajectories = 0, steps = 0, longest = 0;
};
/// Throws std::invalid_argument where there is none, or one has no step.
TrajectoryCounts CountOf(const v1alpha1::Trajectories& from);
/// Lengths of all arrays, and which are given; no entry but those of `steps`. Throws
/// std::invalid_argument "trajectories.FIELD: 3 entries, expected ...".
void CheckSizes(const v1alpha1::Trajectories& from);

/// The steps of a message, one by one.
class TrajectoryReader {
 public:
  /// Throws std::invalid_argument as CheckSizes, and "trajectories.FIELD[INDEX]: ..." for numbers
  /// that are not finite, times and lengths that are not above 0, durations above kLongestStepS, a
  /// length without a speed, soils that are none. `from` must outlive it.
  TrajectoryReader(const v1alpha1::Trajectories& from, const DescribedVehicle& vehicle,
                   double worse_by_sd);

  /// Of each trajectory.
  std::span<const std::size_t> steps() const { return steps_; }
  /// The next one, those of the first trajectory first. Precondition: there is one.
  TrajectoryStep Next();

 private:
  double At(const google::protobuf::RepeatedField<double>& numbers) const;
  double DurationOf(double v_x) const;
  void Advance();

  const v1alpha1::Trajectories& from_;
  double worse_by_sd_;
  std::vector<std::uint8_t> soils_;  // of from_.soil(), or the first
  std::vector<std::size_t> steps_;
  std::size_t trajectory_ = 0, step_ = 0, all_ = 0;  // of the next one
  std::size_t n_ = 0;
};

/// Appends a trajectory; all of one message must have got their steps so. Throws
/// std::invalid_argument for rim speeds, draws, worse ground and wheels on different soils, which
/// the message has no room for.
void Append(std::span<const TrajectoryStep> steps, v1alpha1::Trajectories* to);

/// Leaves one entry of arrays whose entries have the same bits: of all steps. The last thing done
/// to a message, which is read as before.
void Shorten(v1alpha1::Trajectories* trajectories);

void Append(const TrajectoryCost& cost, v1alpha1::TrajectoryCosts* to);
/// Entry i. Throws std::invalid_argument where an array is too short.
TrajectoryCost CostAt(const v1alpha1::TrajectoryCosts& from, std::size_t i);
void Append(const PowerInterval& power, v1alpha1::TrajectorySteps* to);

}  // namespace grouser::vehicle
