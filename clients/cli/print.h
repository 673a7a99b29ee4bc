#pragma once

#include <google/protobuf/message.h>

#include <array>
#include <string>
#include <vector>

#include "grouser/v1alpha1/jobs_service.pb.h"
#include "grouser/v1alpha1/terrain_service.pb.h"
#include "surrogate/models/outputs.h"

namespace grouser::cli {

/// Of a digest, as many as name a model.
inline constexpr std::size_t kShownDigits = 12;

/// JSON of a message on stdout: proto field names, zeros included.
void PrintJson(const google::protobuf::Message& message);

/// One table a state: output, value, interval, parts of the uncertainty, unit;
/// flags spelled out. `loads` are the vertical loads that were asked [N].
void PrintResponses(const v1alpha1::EvaluateWheelsResponse& response,
                    const std::vector<double>& loads);
void PrintModels(const v1alpha1::ListModelsResponse& response);
void PrintModel(const v1alpha1::GetModelResponse& response);
void PrintJob(const v1alpha1::Job& job);

/// The outputs of a response in the order of surrogate::Output.
std::array<const v1alpha1::OutputArray*, surrogate::kOutputs> OutputsOf(
    const v1alpha1::WheelResponses& responses);

/// "EXTRAPOLATED|RATE"; "-" for none.
std::string FlagNames(std::uint32_t flags);

}  // namespace grouser::cli
