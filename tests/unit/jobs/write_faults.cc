#include "tests/unit/jobs/write_faults.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <vector>

#include "proto/records/os/regular_file.h"
#include "tests/unit/jobs/jobs_fixtures.h"

namespace grouser::server::testing {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlock = 4096;

struct Named {
  bool is_folder = false;
  std::string key, name;
};

std::vector<Named> NamesIn(const std::string& text) {
  std::vector<Named> names;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    const auto space = line.find(' ', 2);
    names.push_back({line[0] == 'd', line.substr(2, space - 2), line.substr(space + 1)});
  }
  return names;
}

std::string KeyAt(const std::string& path) {
  char key[40] = "";
  bool is_folder = false;
  KeyOf(AT_FDCWD, path.c_str(), key, &is_folder);
  return key;
}

bool Coin(std::mt19937& random) { return (random() & 1) != 0; }

/// Any blocks of either, zeros where the chosen one has none.
std::string Mixed(const std::string& synced, const std::string& written, std::mt19937& random) {
  std::string bytes((Coin(random) ? synced : written).size(), '\0');
  for (std::size_t at = 0; at < bytes.size(); at += kBlock) {
    const std::string& from = Coin(random) ? synced : written;
    if (at < from.size()) from.copy(&bytes[at], std::min(kBlock, bytes.size() - at), at);
  }
  return bytes;
}

}  // namespace

WriteFaults::WriteFaults(std::string own, std::string root, const std::string& program,
                         std::string preload)
    : own_(std::move(own)), root_(std::move(root)), preload_(std::move(preload)) {
  fs::create_directory(own_);
  const std::string path = own_ + "/control";
  WriteText(path, std::string(sizeof(FaultControl), '\0'));
  const os::UniqueFd fd = os::OpenRegular(path, O_RDWR);
  void* memory =
      ::mmap(nullptr, sizeof(FaultControl), PROT_READ | PROT_WRITE, MAP_SHARED, fd.get(), 0);
  if (memory == MAP_FAILED) throw std::runtime_error(path + ": cannot be mapped");
  control_ = static_cast<FaultControl*>(memory);
  program.copy(control_->program, sizeof control_->program - 1);
  RecordAll();
}

WriteFaults::~WriteFaults() {
  Leave();
  ::munmap(control_, sizeof(FaultControl));
}

void WriteFaults::Enter() const {
  ::setenv("LD_PRELOAD", preload_.c_str(), 1);
  ::setenv(kFaultsFolder, own_.c_str(), 1);
  ::setenv(kFaultsRoot, root_.c_str(), 1);
}

void WriteFaults::Leave() {
  for (const char* name : {"LD_PRELOAD", kFaultsFolder, kFaultsRoot}) ::unsetenv(name);
}

void WriteFaults::Plan(WriteFault fault, long at, unsigned calls, const std::string& path) {
  control_->fault = WriteFault::kNone;
  control_->full = false;
  control_->seen = 0;
  control_->left = at;
  control_->calls = calls;
  ::memset(control_->path, 0, sizeof control_->path);
  path.copy(control_->path, sizeof control_->path - 1);
  control_->fault = fault;
}

void WriteFaults::RecordAll() const {
  for (const char* kind : {"/data", "/folders"}) {
    fs::remove_all(own_ + kind);
    fs::create_directory(own_ + kind);
  }
  const auto record = [this](const fs::path& path, bool is_folder) {
    const os::UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    (is_folder ? RecordFolder : RecordFile)(own_.c_str(), fd.get());
  };
  record(root_, true);
  for (const auto& entry : fs::recursive_directory_iterator(root_)) {
    if (entry.is_directory() || entry.is_regular_file()) record(entry.path(), entry.is_directory());
  }
}

void WriteFaults::Build(const std::string& to, const std::string& key, Left left,
                        std::mt19937& random) const {
  fs::create_directory(to);
  const auto at = now_.find(key);
  std::vector<Named> names = NamesIn(ReadText(own_ + "/folders/" + key));
  if (left == Left::kSome && at != now_.end() && Coin(random)) {
    names.clear();
    for (const auto& entry : fs::directory_iterator(at->second)) {
      if (!entry.is_directory() && !entry.is_regular_file()) continue;
      names.push_back({entry.is_directory(), KeyAt(entry.path()), entry.path().filename()});
    }
  }
  for (const Named& named : names) {
    const std::string path = to + "/" + named.name;
    if (named.is_folder) {
      Build(path, named.key, left, random);
      continue;
    }
    const auto written = now_.find(named.key);
    std::string bytes = ReadText(own_ + "/data/" + named.key);
    if (left == Left::kSome && written != now_.end()) {
      bytes = Mixed(bytes, ReadText(written->second), random);
    }
    WriteText(path, bytes);
  }
}

void WriteFaults::CutPower(Left left, std::mt19937& random) {
  now_.clear();
  now_[KeyAt(root_)] = root_;
  for (const auto& entry : fs::recursive_directory_iterator(root_)) {
    now_[KeyAt(entry.path())] = entry.path();
  }
  const std::string built = root_ + ".built";
  Build(built, KeyAt(root_), left, random);
  fs::remove_all(root_);
  fs::rename(built, root_);
  RecordAll();
}

}  // namespace grouser::server::testing
