#include "surrogate/fit/migrate.h"

#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/message_json.h"
#include "proto/records/run_file.h"
#include "surrogate/fit/json.h"
#include "surrogate/fit/training_set.h"
#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::surrogate {
namespace {

namespace fs = std::filesystem;

/// A file that was read: how to write it in today's form, and what names its content.
struct Content {
  bool current;
  std::string digest;                                         ///< none for JSON
  std::function<std::string(const std::string& path)> write;  ///< returns the new digest
};

Content ReadModelContent(const std::string& file) {
  records::LoadedModel loaded = ReadModel(file);
  MakeTestedModel(loaded.model);
  loaded.model.mutable_provenance()->set_converted_from(loaded.digest);
  return {
      loaded.version == records::ModelFileVersionOf(loaded.model), loaded.digest,
      [model = loaded.model](const std::string& path) { return WriteTestedModel(path, model); }};
}

Content ReadRunContent(const std::string& file) {
  records::RunFile run = records::ReadAnyRunFile(file);
  return {run.schema == records::kRunFileSchema && run.note.empty(), records::Sha256OfFile(file),
          [run = std::move(run)](const std::string& path) {
            records::WriteRunFile(path, run);
            return records::Sha256OfFile(path);
          }};
}

Content ReadJsonContent(const std::string& file, const std::string& bytes) {
  Json json = Json::parse(bytes);
  // What has gone since: soil.bekker, which nothing used.
  const Json::json_pointer soil("/scene/soil");
  const bool converted = json.contains(soil) && json.at(soil).erase("bekker") > 0;
  const Json::json_pointer planned("/runs/0/state");
  if (!json.contains("scene")) throw std::runtime_error(file + ": JSON of no campaign");
  if (json.contains(planned)) {
    v1alpha1::Campaign campaign;
    records::FromJson(json.dump(), file, &campaign);
    return {!converted, "", [campaign](const std::string& path) {
              records::WriteFileDurably(path, records::ToJson(campaign, /*indented=*/true));
              return std::string();
            }};
  }
  v1alpha1::CampaignSummary summary;
  records::FromJson(json.dump(), file, &summary);
  return {!converted, "", [set = ReadRuns(file)](const std::string& path) {
            WriteSummary(path, set);
            return std::string();
          }};
}

Content ReadContent(const std::string& file, const std::string& bytes) {
  if (bytes.starts_with("GROUSERMODEL")) return ReadModelContent(file);
  if (bytes.starts_with("\x89HDF")) return ReadRunContent(file);
  if (bytes.starts_with('{')) return ReadJsonContent(file, bytes);
  throw std::runtime_error(
      file + ": neither a model file, a run file, a campaign nor a campaign's summary");
}

/// Durably; a run that was ended before it replaced the file may have left the same bytes.
std::string KeepOriginal(const std::string& file, const std::string& bytes) {
  std::string kept = file + ".before";
  if (!fs::exists(kept)) {
    records::WriteFileDurably(kept, bytes);
  } else if (records::ReadFileBytes(kept) != bytes) {
    throw std::runtime_error(kept + ": is there, with another content; move it away first");
  }
  return kept;
}

std::string Convert(const std::string& file, const std::string& out, Migration* result) {
  const std::string bytes = records::ReadFileBytes(file);
  const Content content = ReadContent(file, bytes);
  const bool by_digest = fs::path(file).stem() == content.digest;
  result->result = content.current ? "current" : "converted";
  if (out.empty()) {
    if (content.current) return "already current";
    if (by_digest) {
      throw std::runtime_error(file +
                               ": is named by its digest, which aliases and jobs use, and "
                               "is read as it is; give --out DIR to convert a copy");
    }
    const std::string kept = KeepOriginal(file, bytes);
    result->before = content.digest;
    result->after = content.write(file);
    return "converted; the original is " + kept;
  }
  fs::create_directories(out);
  fs::path target = fs::path(out) / fs::path(file).filename();
  if (fs::exists(target)) throw std::runtime_error(target.string() + ": is there already");
  if (content.current) {
    records::WriteFileDurably(target.string(), bytes);
    return "already current, copied to " + target.string();
  }
  result->before = content.digest;
  result->after = content.write(target.string());
  if (by_digest) {
    const fs::path named = fs::path(out) / (result->after + ".model");
    fs::rename(target, named);
    target = named;
  }
  return "converted to " + target.string();
}

}  // namespace

Migration Migrate(const std::string& file, const std::string& out) {
  Migration result{file, "failed", "", "", ""};
  try {
    result.text = Convert(file, out, &result);
  } catch (const std::exception& error) {
    result = {file, "failed", error.what(), "", ""};
  }
  return result;
}

std::string MigrationText(const std::vector<Migration>& files) {
  std::string text;
  bool renamed = false;
  for (const Migration& m : files) {
    const bool named = m.text.find(m.file) == 0;  // errors begin with the file
    text += (named ? "" : m.file + ": ") + m.text + "\n";
    if (m.after.empty()) continue;
    text += fmt::format("  SHA-256 {} -> {}\n", m.before, m.after);
    renamed = true;
  }
  if (!renamed) return text;
  return text +
         "A converted file has another digest, and what named the old one still does: aliases,\n"
         "NAME@sha256:..., base_digest of refitted models, the runs in a model's provenance. Keep\n"
         "the original where these have to be found; a converted model's provenance names it as\n"
         "converted_from. Files of earlier versions are read as they are, too.\n";
}

std::string MigrationJson(const std::vector<Migration>& files) {
  Json out = Json::array();
  for (const Migration& m : files) {
    out.push_back({{"file", m.file}, {"result", m.result}, {"text", m.text}});
    if (m.after.empty()) continue;
    out.back()["sha256_before"] = m.before;
    out.back()["sha256_after"] = m.after;
  }
  return Text(out);
}

}  // namespace grouser::surrogate
