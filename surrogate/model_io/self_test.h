#pragma once

#include <memory>
#include <string>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Whether an evaluator reproduces its message's golden vectors: to 1e-9
/// (relative, but absolute below 1) and the evaluator's Tolerance(). Also faults
/// its pages in. Throws std::runtime_error "NAME: golden[I].OUTPUT: ..., expected ...".
void SelfTest(const std::string& name, const v1alpha1::Model& message, const WheelModel& model);

/// MakeModel and SelfTest: what a model has to pass before it may answer. The
/// server does it before it serves a model, whoever makes one before it writes it.
/// Throws std::runtime_error as both do.
std::unique_ptr<const WheelModel> MakeTestedModel(const v1alpha1::Model& message);

/// Writes a model file (records::WriteModelFile) that the server will take: the
/// message's bytes are read back and pass MakeTestedModel first. Returns the digest.
/// Throws std::runtime_error "FILE: not written: ..."; `path` is then as it was.
std::string WriteTestedModel(const std::string& path, const v1alpha1::Model& message);

}  // namespace grouser::surrogate
