#pragma once

#include <functional>
#include <memory>
#include <string>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/hull.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Where the table of a model is kept between processes; both or none.
struct KeptTable {
  /// What was kept under `key`, if it has `size` bytes and is undamaged; else empty.
  std::function<std::string(const std::string& key, std::size_t size)> read = {};
  std::function<void(const std::string& key, const std::string& bytes)> keep = {};
};

/// Builds the evaluator of a model message. Throws std::runtime_error naming
/// the field when the message is incomplete or inconsistent, or when the
/// golden vectors are not reproduced to 1e-9 relative. A hybrid then makes the
/// table that it answers with (HybridModel::Prepare), about 0.2 s, or takes the kept one. The key
/// of that follows from the whole message, HybridModel::kTableVersion, GROUSER_VERSION and how this
/// machine rounds: what was made is equal bit by bit to what would be made.
std::unique_ptr<const WheelModel> MakeModel(const v1alpha1::Model& model,
                                            const KeptTable& kept = {});

/// Compares a model's golden vectors with what `answer` says to a motion and a load;
/// `allowed`: by how much a value may differ, from it and its output's scale. Throws
/// std::runtime_error "NAME: golden[I].OUTPUT: computed ..., expected ...".
void CheckGolden(const std::string& name, const v1alpha1::Model& message,
                 const std::function<WheelAnswer(const VelocityState&, double)>& answer,
                 const std::function<double(double, double)>& allowed);

/// The box of a message's domain, unchecked.
TrainingDomain HullOf(const v1alpha1::Model& model);

}  // namespace grouser::surrogate
