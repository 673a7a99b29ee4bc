#include "clients/cli/file_bundle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace grouser::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 1 << 20;  // what the server takes

fs::path WholePath(const std::string& file) { return fs::absolute(file).lexically_normal(); }

bool IsYaml(const fs::path& path) {
  return path.extension() == ".yaml" || path.extension() == ".yml";
}

std::string ReadAll(const fs::path& path) {
  if (!fs::is_regular_file(path)) {
    throw std::invalid_argument(path.string() + ": no such file");
  }
  if (fs::file_size(path) > kMostBytes) {
    throw std::invalid_argument(fmt::format("{}: {} bytes, expected at most {} in a request",
                                            path.string(), fs::file_size(path), kMostBytes));
  }
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  if (!in) throw std::invalid_argument(path.string() + ": cannot be read");
  return out.str();
}

/// A line of YAML up to its comment.
std::string WithoutComment(const std::string& line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '#' && (i == 0 || std::isspace(static_cast<unsigned char>(line[i - 1])) != 0)) {
      return line.substr(0, i);
    }
  }
  return line;
}

}  // namespace

void FileBundle::Add(const std::string& file) {
  const fs::path path = WholePath(file);
  if (files_.contains(path)) return;
  std::string text = ReadAll(path);
  bytes_ += text.size();
  if (bytes_ > kMostBytes) {
    throw std::invalid_argument(
        fmt::format("{}: with it and the files before there are {} bytes, "
                    "expected at most {} in a request",
                    file, bytes_, kMostBytes));
  }
  files_[path] = text;
  if (IsYaml(path)) AddNamed(path, text);
}

void FileBundle::AddNamed(const fs::path& from, const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line = WithoutComment(line);
    std::ranges::replace_if(
        line,
        [](unsigned char c) {
          return std::isalnum(c) == 0 && c != '.' && c != '_' && c != '-' && c != '/';
        },
        ' ');
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      const fs::path named = from.parent_path() / word;
      const bool kind = IsYaml(named) || named.extension() == ".csv";
      std::error_code ignored;
      if (kind && fs::is_regular_file(named, ignored)) Add(named.string());
    }
  }
}

fs::path FileBundle::Root() const {
  fs::path root;
  for (const auto& [path, content] : files_) {
    const fs::path folder = path.parent_path();
    if (root.empty()) {
      root = folder;
      continue;
    }
    const auto differ = std::ranges::mismatch(root, folder).in1;
    fs::path common;
    for (auto part = root.begin(); part != differ; ++part) common /= *part;
    root = common;
  }
  return root;
}

std::string FileBundle::NameOf(const std::string& file) const {
  return WholePath(file).lexically_relative(Root()).generic_string();
}

void FileBundle::FillInto(google::protobuf::RepeatedPtrField<v1alpha1::NamedFile>* files) const {
  const fs::path root = Root();
  for (const auto& [path, content] : files_) {
    auto* file = files->Add();
    file->set_name(path.lexically_relative(root).generic_string());
    file->set_content(content);
  }
}

}  // namespace grouser::cli
