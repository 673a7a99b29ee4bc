#pragma once

#include <cstdint>

#include "surrogate/models/outputs.h"

/// What the kernels of each instruction set share: plain numbers and pointers
/// alone, so that a file compiled for a wide set leaves no copy of a library
/// function behind that the linker could take for all.
namespace grouser::surrogate::response {

inline constexpr int kGroup = 8;   // states at a time; also lanes (channels) of a node
inline constexpr int kBlock = 64;  // states per call at most, a multiple of kGroup
/// ln(largest load with an equilibrium/load), interpolated: below 0 there is none.
inline constexpr int kMarginChannel = 7;

/// What a state needs beyond the kernel's answer.
enum Special : std::uint32_t {
  kOff = 1,    // non-finite, at rest, magnitude or load not answered: nonsense was written
  kPole = 2,   // near v_x = rim = 0: gradients by v_x and rim from elsewhere
  kBlend = 4,  // load beyond [blend_low, blend_high]
};

/// The table and the laws of Hull, in the form the kernel reads them.
struct Constants {
  const float* nodes;                    // [direction + 3][lateral + 3][row][kGroup]
  const float* rate;                     // the same per unit of Froude number; null: none
  double froude_per_speed2;              // 1/(g r) [s^2/m^2]
  double froude_high, saturation;        // SpeedAxis
  double scale_reference;                // its s(reference)
  int direction_stride, lateral_stride;  // in floats
  int direction, lateral, load;          // intervals
  float log_load_min, load_per_log;      // node coordinate: (ln load - min) per_log
  double lowest_load, highest_load;      // what the table answers
  double blend_low, blend_high;          // where it does so alone
  double radius, inverse_middle_load;
  // Hull::Outside, rounding slack included; angles by sine and cosine.
  double slip_low, slip_high, angle_sin, angle_cos, load_low, load_high;
  double rim_faster;  // hub/M below which the rim is the faster
  double fastest2;    // M^2 [m^2/s^2] above which kRate is set
  // Hull::Excess.
  float slip_min, slip_max, most_lateral, log_low, log_high;
  float per_slip, per_lateral, per_log_load;
  double inverse_fastest, most_fast;  // by speed
  float per_fast;
  float far, overload;  // kFarFromRuns; kOverloadSinkage
  float inside2[kOutputs], growth2[kOutputs], patch[kOutputs], patch2[kOutputs], factor[kOutputs],
      bulldozing[kOutputs];
  std::uint32_t flags;  // of every state
};

/// Up to kBlock states; where a pointer is null nothing is written.
struct Block {
  int count;       // arrays hold this many, rounded up to kGroup
  bool gradients;  // some of kDvX to kDLoad is wanted
  const double *v_x, *v_y, *rim, *load;
  double* part[kOutputs][kParts];
  std::uint32_t* flags;
  double *slip, *attack_angle;
  std::uint32_t special[kBlock];  // out: Special
};

/// Evaluates a block. Every set gives the same bits: IEEE operations alone,
/// none fused.
using BlockFn = void (*)(const Constants&, Block*);

}  // namespace grouser::surrogate::response
