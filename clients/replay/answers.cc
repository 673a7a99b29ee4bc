#include "clients/replay/answers.h"

#include <fmt/format.h>

#include <map>
#include <new>
#include <utility>
#include <vector>

#include "clients/cpp/client_error.h"
#include "clients/cpp/terrain_client.h"
#include "server/core/model_reference.h"
#include "server/core/repository.h"
#include "server/core/snapshot.h"
#include "server/query/grpc/answer.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::replay {
namespace {

using server::Repository;
using server::Snapshot;
using v1alpha1::EvaluateWheelsRequest;
using v1alpha1::EvaluateWheelsResponse;

std::string ReferenceTo(const std::string& name, const std::string& digest) {
  return name + "@sha256:" + digest;
}

/// The only one of `models` (names and digests) that the digits mean.
std::string OnlyOne(const std::vector<std::pair<std::string, std::string>>& models,
                    const std::string& digits) {
  std::vector<std::string> found;
  for (const auto& [name, digest] : models) {
    if (digest.starts_with(digits)) found.push_back(ReferenceTo(name, digest));
  }
  if (found.size() == 1) return found.front();
  throw NoModel(digits, fmt::format("{} models have a digest that begins with {}, expected one",
                                    found.size(), digits));
}

class InProcess final : public Answers {
 public:
  InProcess(const std::string& state_dir, const std::string& shipped_dir)
      : repository_(state_dir, shipped_dir) {}

  std::string ReferenceOf(const std::string& model) override {
    if (server::IsDigestPrefix(model)) {
      std::vector<std::pair<std::string, std::string>> models;
      for (const auto& entry : repository_.List(nullptr)) {
        models.emplace_back(entry.name, entry.digest);
      }
      return OnlyOne(models, model);
    }
    const Repository::Entry entry = Resolve(model);
    return ReferenceTo(entry.name, entry.digest);
  }

  EvaluateWheelsResponse Answer(const EvaluateWheelsRequest& request) override {
    EvaluateWheelsResponse response;
    const server::ServedModel* model = nullptr;
    const server::Status status =
        server::AnswerFrom(SnapshotOf(request.model()), request, &response, &model);
    if (!status.ok()) throw Refused(status.message);
    return response;
  }

  double TrainingSpeed(const std::string& reference) override {
    return SnapshotOf(reference).models().front()->message.domain().speed_m_per_s();
  }

 private:
  Repository::Entry Resolve(const std::string& reference) const {
    try {
      return repository_.Resolve(reference);
    } catch (const std::out_of_range& e) {
      throw NoModel(reference, e.what());
    }
  }

  /// With that model alone.
  const Snapshot& SnapshotOf(const std::string& reference) {
    const auto known = snapshots_.find(reference);
    if (known != snapshots_.end()) return known->second;
    const auto failed = failures_.find(reference);
    if (failed != failures_.end()) throw NoModel(reference, failed->second);
    const Repository::Entry entry = Resolve(reference);
    try {
      auto model = server::MakeServedModel(surrogate::ReadModel(entry.path).model, entry.digest,
                                           entry.shipped, surrogate::MakeModel);
      return snapshots_.emplace(reference, Snapshot(0, {std::move(model)}, {})).first->second;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& e) {  // the list takes files that make no model
      failures_[reference] = e.what();
      throw NoModel(reference, e.what());
    }
  }

  Repository repository_;
  std::map<std::string, Snapshot> snapshots_;    // by reference
  std::map<std::string, std::string> failures_;  // why, by reference
};

/// What a server's refusals are.
template <class Call>
auto Asked(const std::string& model, Call call) {
  try {
    return call();
  } catch (const client::ClientError& e) {
    if (e.code() == grpc::StatusCode::NOT_FOUND) throw NoModel(model, e.what());
    if (e.code() == grpc::StatusCode::INVALID_ARGUMENT) throw Refused(e.what());
    throw;
  }
}

class OfServer final : public Answers {
 public:
  OfServer(const client::Server& server, int deadline_ms)
      : client_(server, client::Milliseconds(deadline_ms)) {}

  std::string ReferenceOf(const std::string& model) override {
    if (server::IsDigestPrefix(model)) {
      std::vector<std::pair<std::string, std::string>> models;
      for (const auto& info : client_.ListModels().models()) {
        models.emplace_back(info.name(), info.digest());
      }
      return OnlyOne(models, model);
    }
    const auto info = Asked(model, [&] { return client_.GetModel(model); }).model();
    return ReferenceTo(info.name(), info.digest());
  }

  EvaluateWheelsResponse Answer(const EvaluateWheelsRequest& request) override {
    return Asked(request.model(), [&] { return client_.Evaluate(request); });
  }

  double TrainingSpeed(const std::string& reference) override {
    const auto known = speeds_.find(reference);
    if (known != speeds_.end()) return known->second;
    const auto answer = Asked(reference, [&] { return client_.GetModel(reference); });
    return speeds_[reference] = answer.model().domain().speed_m_per_s();
  }

 private:
  client::TerrainClient client_;
  std::map<std::string, double> speeds_;
};

}  // namespace

std::unique_ptr<Answers> AnswersInProcess(const std::string& state_dir,
                                          const std::string& shipped_dir) {
  return std::make_unique<InProcess>(state_dir, shipped_dir);
}

std::unique_ptr<Answers> AnswersOfServer(const client::Server& server, int deadline_ms) {
  return std::make_unique<OfServer>(server, deadline_ms);
}

}  // namespace grouser::replay
