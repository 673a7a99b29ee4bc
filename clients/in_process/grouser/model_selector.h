#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grouser/model.h"

namespace grouser {

/// What a tolerance is about: a fresh DEM run's mean, or a measurement.
enum class IntervalTarget { kDem, kMeasured };

/// How good an answer has to be, or how little it may cost. What is 0 asks for
/// nothing; numbers are finite and not negative.
struct AccuracyRequest {
  std::array<double, kOutputs> tolerance{};  ///< largest errors to accept [N, N m, m]
  double share_of_load = 0;  ///< the same of forces over load, moments over load r [-]
  double budget_us = 0;      ///< for all states of a call, by cost_ns(), not by a clock
  /// kMeasured: the half width that sd_form stands for is added in squares to what a model claims;
  /// states where it is unknown are unmet. Not for f_z, which is the load; share_of_load then
  /// leaves m_z out: nobody measures it. Without a tolerance it changes nothing.
  IntervalTarget target = IntervalTarget::kDem;
};

/// Several models of one wheel on one soil, say hybrid, lookup and
/// Bekker, the cheapest first. With a tolerance the cheapest model that suffices
/// answers a state: the larger of its 90 % interval against DEM there and of
/// 1.645 rms errors of its error table is within the tolerance on every output
/// that has one. Where none does, the one that exceeds least answers with
/// kToleranceUnmet. An answer without that flag is then within the tolerance of
/// a fresh DEM run's mean, per output, as often as interval_level() says.
///
/// Slopes and passes cannot be asked here; states faster than a model covers
/// (kRate) or that the soil does not carry are always unmet. A budget is spent in
/// order: the cheapest model always answers, dearer ones as far as it lasts.
/// Without a tolerance the most accurate model that fits the budget answers all.
///
/// Immutable; const members may be called from any number of threads at once.
class GROUSER_PUBLIC ModelSelector {
 public:
  /// Opens each file as Model::Open and measures what each costs here. Throws
  /// std::runtime_error "FILE: cause" also where a model is of another wheel or
  /// soil than the first, std::invalid_argument for no file.
  static ModelSelector Open(const std::vector<std::filesystem::path>& model_files);

  ModelSelector(ModelSelector&& other) noexcept;
  ModelSelector& operator=(ModelSelector&& other) noexcept;
  ~ModelSelector();

  /// Answers all states: no allocation, lock or system call. answered_by: which
  /// model() answered; n entries or empty. Returns false, having written nothing,
  /// where Problem says something (or the model selector was moved from).
  [[nodiscard]] bool Evaluate(const States& in, const AccuracyRequest& accuracy, const Answers& out,
                              std::span<std::uint32_t> answered_by = {}) const noexcept;

  /// Which span or number makes Evaluate refuse; empty if none does. Allocates.
  static std::string Problem(const States& in, const AccuracyRequest& accuracy, const Answers& out,
                             std::span<const std::uint32_t> answered_by = {});

  std::size_t size() const noexcept;
  /// The cheapest first. Precondition: k < size().
  const Model& model(std::size_t k) const noexcept;
  double cost_ns(std::size_t k) const noexcept;  ///< of one state in a batch, as measured

 private:
  struct Parts;
  explicit ModelSelector(std::unique_ptr<const Parts> parts) noexcept;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace grouser
