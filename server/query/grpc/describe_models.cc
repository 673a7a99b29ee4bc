#include "server/query/grpc/describe_models.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "server/core/page.h"

namespace grouser::server {
namespace {

constexpr std::string_view kDigestMark = "@sha256:";
constexpr std::size_t kDigestDigits = 64;

void Describe(const Snapshot& snapshot, const ServedModel& model, v1alpha1::ModelInfo* info) {
  const auto& message = model.message;
  info->set_name(message.name());
  info->set_digest(model.digest);
  if (const auto it = snapshot.aliases().find(message.name()); it != snapshot.aliases().end()) {
    for (const auto& [alias, target] : it->second) {
      if (target.get() == &model) info->add_aliases(alias);
    }
  }
  *info->mutable_domain() = message.domain();
  info->set_radius_m(message.wheel().radius_m());
  info->set_width_m(message.wheel().width_m());
  info->set_soil(message.soil().name());
  info->set_shipped(model.shipped);
  info->set_runs(static_cast<std::uint32_t>(message.provenance().runs_size()));
}

/// The first model after the one that the token names, which may be gone.
Status FirstOf(const Snapshot& snapshot, const std::string& token, std::size_t* first) {
  *first = 0;
  if (token.empty()) return Status::Ok();
  const std::size_t mark = token.rfind(kDigestMark);
  if (mark == std::string::npos) return BadPageToken(token);
  const std::string name = token.substr(0, mark), digest = token.substr(mark + kDigestMark.size());
  const bool whole = digest.size() == kDigestDigits &&
                     digest.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (!whole) return BadPageToken(token);
  const auto& models = snapshot.models();
  const auto after = std::ranges::find_if(models, [&](const auto& model) {
    return std::tie(model->message.name(), model->digest) > std::tie(name, digest);
  });
  *first = static_cast<std::size_t>(after - models.begin());
  return Status::Ok();
}

}  // namespace

Status ListModels(const Snapshot& snapshot, const v1alpha1::ListModelsRequest& request,
                  v1alpha1::ListModelsResponse* response) {
  if (snapshot.loading()) return Snapshot::StillLoading();
  int size = 0;
  std::size_t next = 0, bytes = 0;
  Status status = ReadPageSize(request.page_size(), kMaxModelsPageSize, &size);
  if (status.ok()) status = FirstOf(snapshot, request.page_token(), &next);
  if (!status.ok()) return status;
  response->set_generation(snapshot.generation());
  const auto& models = snapshot.models();
  for (; next < models.size() && response->models_size() < size; ++next) {
    v1alpha1::ModelInfo info;
    Describe(snapshot, *models[next], &info);
    if (!AddToPage(std::move(info), &bytes, response->mutable_models())) break;
  }
  if (next < models.size()) response->set_next_page_token(models[next - 1]->reference);
  return Status::Ok();
}

Status GetModel(const Snapshot& snapshot, const v1alpha1::GetModelRequest& request,
                v1alpha1::GetModelResponse* response) {
  const ServedModel* model = nullptr;
  if (Status status = snapshot.Find(request.model(), &model); !status.ok()) return status;
  response->set_generation(snapshot.generation());
  Describe(snapshot, *model, response->mutable_model());
  *response->mutable_errors() = model->message.errors();
  *response->mutable_provenance() = model->message.provenance();
  for (auto& run : *response->mutable_provenance()->mutable_runs()) run.clear_stress();
  return Status::Ok();
}

}  // namespace grouser::server
