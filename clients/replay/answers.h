#pragma once

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "clients/cpp/access.h"
#include "grouser/v1alpha1/terrain_service.pb.h"

namespace grouser::replay {

/// There is no such model (any more), or its file makes none.
struct NoModel : std::runtime_error {
  NoModel(std::string reference, const std::string& why)
      : std::runtime_error(why), model(std::move(reference)) {}
  std::string model;
};

/// A query that is not answered: why.
struct Refused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Who evaluates logged queries again.
class Answers {
 public:
  virtual ~Answers() = default;
  /// "name@sha256:HEX" of what "name", "name@alias", "name@sha256:HEX" or the first 12 digits or
  /// more of a digest mean. Throws NoModel.
  virtual std::string ReferenceOf(const std::string& model) = 0;
  /// Answers a request that names a model by its digest. Throws NoModel, Refused, and
  /// std::runtime_error where nobody can be asked.
  virtual v1alpha1::EvaluateWheelsResponse Answer(
      const v1alpha1::EvaluateWheelsRequest& request) = 0;
  /// Speed at which a model takes the slip form without one [m/s]. Throws NoModel.
  virtual double TrainingSpeed(const std::string& reference) = 0;
};

/// In this process, by the models of a state folder and a folder of shipped ones.
std::unique_ptr<Answers> AnswersInProcess(const std::string& state_dir,
                                          const std::string& shipped_dir);
/// By a running grouser-server.
std::unique_ptr<Answers> AnswersOfServer(const client::Server& server, int deadline_ms);

}  // namespace grouser::replay
