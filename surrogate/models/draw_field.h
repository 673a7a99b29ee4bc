#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "surrogate/models/draw_field_kernel.h"
#include "surrogate/models/form_error.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// K coherent draws of what is not known of a soil. An interval says how far one state's answer may
/// be off; a draw says how far all of them are off together:
///
///   answer_k(state) = value(state) + sd(state) g_k(state),   sd = (high - value)/1.645
///
/// for each output, low and high being the model's interval for a DEM run. The unit error g_k is a
/// normal field over the states: at every state it has mean 0 and standard deviation 1 over the
/// draws, so that 5 and 95 % of the draws are the model's interval, and at two states it is
/// correlated by how near they are. One set of draws belongs to one soil: all wheels on it and all
/// points of a path take the same k. The same soil, k and state give the same bits on every machine
/// and instruction set, whatever K is.
///
/// Soils. With d = (v_x, v_y, r w) over its length, l = ln(load/1 N), and features m = 1..32 of
/// frequency w_m (random Fourier features: Rahimi and Recht 2007, NIPS 20):
///
///   S_m = t_x(w_x v_x + w_r r w) t_y(w_y v_y),  t: cos where the output is even in the mirror, or
///   sin own  = sum S_m (a_m cos(w_l l) + b_m sin(w_l l)),  a, b ~ N(0, 1), for each k and output
///   g = (own + e broken)/sqrt(sum S_m^2 + e^2 sum E_m^2),   e = 0.1
///
/// The mirrors of a wheel are mirrors of its errors. Where symmetry would make an output 0 (a
/// lateral force straight on) its interval is not 0, as a bed of grains is not symmetric: `broken`
/// is the same sum over even features E_m with numbers of its own; within 5 degrees of the plane of
/// symmetry it takes over; at 35 degrees a state and its mirror are correlated by 0.9. Outputs that
/// are even in both mirrors have no such term. w is normal with standard deviations 1/DrawLengths,
/// so that the correlation falls as exp(-distance^2/2), distances over the lengths. Two kinds of
/// models differ (ErrorForm), as the errors at held-out runs of the models in surrogate/pairs do
/// (draw_lengths_test.cc):
///   with a fit to runs beside its physics, or without physics: DrawLengths::OfFit;
///   physics alone: DrawLengths::OfPhysics, and every second feature's lengths are four times as
///   long. That half of the variance is the bias of the form, which all states have in common.
/// Not told apart are sd_fit and sd_patch: of the two the sum alone is calibrated (Hull). A patch
/// is taken to be the same under all wheels, which is on the safe side. sd_form is no part: it is
/// not in the interval for DEM runs. The speed is no axis: states that differ in it alone have one
/// error. At rest d = 0.
/// Outputs of one state are independent, as models say nothing else. (At those held-out runs f_x
/// and sinkage are correlated by -0.6 to -0.8, others by no common sign.)
///
/// Hard ground has two unknown numbers: with z, z' ~ N(0, 1) for each k, all of its states have
/// 1 + c z times the friction, c = sd/|f| that of each state: f_x, f_y, the scrub part of m_z
/// (whose sign is that of -yaw rate), and torque = r f_x + the rolling resistance's with z'. c z is
/// kept from -0.95 on.
///
/// Of a mixture (mixture_model.h) draw k is draw k of one of its soils, at all states: that in
/// whose share of the weights a uniform number of k and of the mixture's name lies.
struct DrawLengths {
  double plane, lateral, log_load;  ///< along (v_x, r w) and v_y of d, in ln load
  /// Of the residual that fits take where runs tell nothing (surrogate/fit/trained.cc), and half.
  static constexpr DrawLengths OfPhysics() { return {0.45, 0.45, 0.7}; }
  static constexpr DrawLengths OfFit() { return {0.225, 0.225, 0.35}; }
};

class Draws {
 public:
  static constexpr std::size_t kMost = 1024;  ///< 6 KiB each

  /// Throws std::invalid_argument "draws: got X, expected 1 to 1024".
  Draws(std::string_view soil, std::size_t count);

  std::size_t size() const noexcept { return members_.size(); }
  const draws::Member& operator[](std::size_t k) const noexcept { return members_[k]; }

 private:
  std::vector<draws::Member> members_;
};

/// g of one state and output by the formulas above with the standard library; for tests, which
/// compare the kernels with it. Precondition: finite, load > 0.
double UnitErrorOf(const ErrorForm& form, const draws::Member& member, int output, double v_x,
                   double v_y, double rim_speed, double load) noexcept;

/// States whose answers become draws.
struct DrawBatch {
  std::span<const double> v_x, v_y, rim_speed, load;
  std::span<const double> yaw_rate;              ///< empty: 0; counts on hard ground alone
  std::span<const draws::Member* const> member;  ///< by state; null: the mean
  /// By output: answers, to which errors are added, and upper ends of their intervals. Empty: not
  /// asked for. On hard ground f_x and f_y are.
  std::array<std::span<double>, kOutputs> value;
  std::array<std::span<const double>, kOutputs> high;
  /// By output: derivatives of the answers by v_x, v_y, rim speed and load, to which those of the
  /// errors are added, sd taken as in proportion to the load (hard ground: to the answer) and else
  /// the same at other states. All four, or empty.
  std::array<std::array<std::span<double>, 4>, kOutputs> slope;
};

/// Turns means into draws. A sinkage is no less than 0. No allocation. `kernel` null: the best.
/// Precondition: no mixture; its draws are those of its soils' models (WheelModel::OfDraw).
void AddErrors(const WheelModel& model, const DrawBatch& batch,
               draws::BlockFn kernel = nullptr) noexcept;

/// EvaluateWithForm, with `value` of draw k[i] at state i; all other parts are those of the mean.
/// Precondition: k has as many entries as there are states, each below draws.size(). No allocation.
void EvaluateDraws(const WheelModel& model, const FormErrors& form, const Draws& draws,
                   std::span<const std::uint32_t> k, const WheelStatesView& in,
                   const ResponsesView& out, const FormView& to) noexcept;

}  // namespace grouser::surrogate
