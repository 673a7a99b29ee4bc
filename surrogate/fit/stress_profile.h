#pragma once

#include <array>
#include <vector>

#include "surrogate/fit/training_set.h"
#include "surrogate/models/bekker.h"

namespace grouser::surrogate {

/// Stresses on a rim by central angle, in bins from straight down, forward
/// positive; mean over the width. Bin k spans first + k step to first + (k + 1)
/// step [rad]. Signs as in RimStress.
struct RimProfile {
  double first_rad = 0, step_rad = 0;
  std::vector<double> normal, tangential;  ///< [Pa], one a bin

  std::size_t size() const { return normal.size(); }
  double MiddleOf(std::size_t bin) const {
    return first_rad + (static_cast<double>(bin) + 0.5) * step_rad;
  }
};

/// The forces of a profile on its wheel: b r sum of (s cos + t sin, t cos - s sin)
/// and b r^2 sum of t, times the step [N, N, N m].
struct RimForces {
  double f_z, f_x, torque;
};
RimForces ForcesOf(const RimProfile& profile, const WheelGeometry& wheel);

/// A summary without bins, or with no stress in any, has no profile; one with
/// bins must have as many of either stress, all finite, a positive step, and go
/// round the wheel once at most. Throws std::invalid_argument "run ID: stress...:
/// what, expected ...".
bool HasProfile(const v1alpha1::RunSummary& run);

/// The profile of a run (HasProfile), in the half-space of its canonical state:
/// a wheel that rolls backward is seen from the other side, so angles and
/// tangential stresses change sign. The summary's first angle is where its first
/// bin starts, as in StressProfile (model.proto calls it that bin's middle, but it
/// is copied from the recorder, whose first edge is -pi).
RimProfile CanonicalProfile(const Sample& row);

/// Where a law is sampled for the bins of a profile. A bed of grains of diameter d has
/// no edges sharper than one grain: the law is averaged over each bin and over
/// smear_rad = d/r around every angle. Bin i: the sum of weight[k] times the stress at
/// angle[i per_bin + k].
struct ProfileSamples {
  int per_bin;
  std::vector<double> angle, weight;
};
ProfileSamples SamplesOf(const RimProfile& like, double smear_rad);

/// What `model` says in the bins of `like`, at a sinkage [m].
RimProfile ModelProfile(const BekkerModel& model, const Canonical& state, double sinkage,
                        const RimProfile& like, double smear_rad);

/// Mean diameter of the scene's grains (by mass) over the wheel's radius [rad]; 0
/// where the scene names none.
double GrainAngle(const v1alpha1::Scene& scene);

/// A recorded profile made ready to compare with a model's. The model lays all
/// of the load on the rim, a recorded rim shares it with the wheel's sides: the
/// recorded stresses are divided by the share of the load that they carry, so
/// that shapes are compared.
struct ComparedProfile {
  RimProfile measured;              ///< canonical, divided by `share`
  double share;                     ///< of the load, carried by the rim
  double sd_normal, sd_tangential;  ///< of a bin [Pa], see kProfileNoise
  int bins;                         ///< in contact: normal stress above 1 % of its peak
};

/// Standard deviation of a bin, over the largest of its stress in the profile
/// (tangential: at least a tenth of the normal's). Repeats on other beds differ by
/// 0.11 to 0.35 (ten states of the CMU campaign, 5-degree bins, 8 mm grains, 12 to
/// 27 bins in contact), most by 0.2.
inline constexpr double kProfileNoise = 0.2;

/// Throws as HasProfile. Precondition: HasProfile.
ComparedProfile MakeCompared(const Sample& row, const WheelGeometry& wheel);

/// Whether the rim carries enough of the load (0.4 to 1.2) for its stresses to be
/// those of the model's rim.
bool IsComparable(const ComparedProfile& profile);

/// Rms of model minus measured over the rms of measured.
struct ProfileMisfit {
  double normal, tangential;
};
ProfileMisfit MisfitOf(const RimProfile& model, const RimProfile& measured);

}  // namespace grouser::surrogate
