#include "server/core/alias_file.h"

#include <fcntl.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"

namespace grouser::server {
namespace {

using google::protobuf::Struct;
using google::protobuf::Value;

/// Some 100,000 moves; parsed JSON takes several times its text in memory.
constexpr std::uint64_t kMaxAliasFileBytes = std::uint64_t{32} << 20;

/// Typed access to a JSON object; every error names file and key.
class Reader {
 public:
  Reader(const std::string& path, const Struct& object) : path_(path), object_(object) {}

  const Value& Get(const std::string& key, Value::KindCase kind, const char* expected) const {
    const auto it = object_.fields().find(key);
    if (it == object_.fields().end() || it->second.kind_case() != kind) {
      throw std::runtime_error(path_ + ": key '" + key + "': expected " + expected);
    }
    return it->second;
  }
  const std::string& Text(const std::string& key) const {
    return Get(key, Value::kStringValue, "a string").string_value();
  }
  double Number(const std::string& key) const {
    return Get(key, Value::kNumberValue, "a number").number_value();
  }
  std::uint64_t Count(const std::string& key) const {
    const double x = Number(key);
    if (!(x >= 0 && x < 9e15 && x == std::floor(x))) {
      throw std::runtime_error(path_ + ": key '" + key + "': expected a whole number >= 0");
    }
    return static_cast<std::uint64_t>(x);
  }

 private:
  const std::string& path_;
  const Struct& object_;
};

AliasMove MoveFrom(const std::string& path, const Struct& object) {
  const Reader reader(path, object);
  AliasMove move;
  move.model = reader.Text("model");
  move.alias = reader.Text("alias");
  move.digest = reader.Text("digest");
  move.generation = reader.Count("generation");
  move.who = reader.Text("who");
  move.why = reader.Text("why");
  move.unix_s = reader.Number("unix_s");
  return move;
}

Struct StructFrom(const AliasMove& move) {
  Struct object;
  auto& fields = *object.mutable_fields();
  fields["model"].set_string_value(move.model);
  fields["alias"].set_string_value(move.alias);
  fields["digest"].set_string_value(move.digest);
  fields["generation"].set_number_value(static_cast<double>(move.generation));
  fields["who"].set_string_value(move.who);
  fields["why"].set_string_value(move.why);
  fields["unix_s"].set_number_value(move.unix_s);
  return object;
}

Repository::Aliases AliasesFrom(const std::string& path, const Struct& root) {
  const Reader reader(path, root);
  Repository::Aliases aliases;
  aliases.generation = reader.Count("generation");
  const auto& by_model = reader.Get("aliases", Value::kStructValue, "an object").struct_value();
  for (const auto& [model, value] : by_model.fields()) {
    const Reader models(path, by_model);
    const auto& of_model =
        models.Get(model, Value::kStructValue, "an object of alias: digest").struct_value();
    for (const auto& [alias, digest] : of_model.fields()) {
      aliases.by_model[model][alias] = Reader(path, of_model).Text(alias);
    }
  }
  const auto& history = reader.Get("history", Value::kListValue, "a list").list_value();
  for (const auto& value : history.values()) {
    if (!value.has_struct_value()) {
      throw std::runtime_error(path + ": key 'history': expected a list of objects");
    }
    aliases.history.push_back(MoveFrom(path, value.struct_value()));
  }
  return aliases;
}

}  // namespace

Repository::Aliases ReadAliasFile(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    if (error) throw std::runtime_error(path + ": " + error.message());
    return {};
  }
  Struct root;
  const auto status = google::protobuf::util::JsonStringToMessage(
      records::ReadFileBytes(path, kMaxAliasFileBytes), &root);
  if (!status.ok()) {
    throw std::runtime_error(path + ": not an alias file, expected JSON: " + status.ToString());
  }
  return AliasesFrom(path, root);
}

void WriteAliasFile(const std::string& path, const Repository::Aliases& aliases) {
  Struct root;
  auto& fields = *root.mutable_fields();
  fields["generation"].set_number_value(static_cast<double>(aliases.generation));
  auto& by_model = *fields["aliases"].mutable_struct_value();
  for (const auto& [model, of_model] : aliases.by_model) {
    auto& target = *(*by_model.mutable_fields())[model].mutable_struct_value();
    for (const auto& [alias, digest] : of_model) {
      (*target.mutable_fields())[alias].set_string_value(digest);
    }
  }
  auto& history = *fields["history"].mutable_list_value();
  for (const AliasMove& move : aliases.history) {
    *history.add_values()->mutable_struct_value() = StructFrom(move);
  }
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(root, &text, options);
  if (!status.ok()) {
    // A name that is not UTF-8 ends here: nothing has been written yet.
    throw std::runtime_error(path + ": " + status.ToString());
  }
  records::WriteFileDurably(path, text);
}

FileLock::FileLock(const std::string& path) {
  fd_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd_ < 0) throw std::runtime_error(path + ": " + std::strerror(errno));
  while (::flock(fd_, LOCK_EX) != 0) {
    if (errno == EINTR) continue;
    const int cause = errno;
    ::close(fd_);
    throw std::runtime_error(path + ": cannot be locked: " + std::strerror(cause));
  }
}

FileLock::~FileLock() { ::close(fd_); }

}  // namespace grouser::server
