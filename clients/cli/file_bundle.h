#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "grouser/v1alpha1/jobs_service.pb.h"

namespace grouser::cli {

/// Files that go along with a request: those of the command line, and the .yaml, .yml and .csv
/// files that they name. Names are relative to the deepest folder that holds them all, so that a
/// file names another on the server as it does here.
class FileBundle {
 public:
  /// Throws std::invalid_argument for what cannot be read or is too large for a request.
  void Add(const std::string& file);
  /// What a file that was added is called in the request.
  std::string NameOf(const std::string& file) const;
  void FillInto(google::protobuf::RepeatedPtrField<v1alpha1::NamedFile>* files) const;

 private:
  void AddNamed(const std::filesystem::path& from, const std::string& text);
  std::filesystem::path Root() const;

  std::map<std::filesystem::path, std::string> files_;  ///< absolute -> content
  std::size_t bytes_ = 0;
};

}  // namespace grouser::cli
