#pragma once

#include <sched.h>
#include <sys/types.h>

#include <string>
#include <vector>

namespace grouser::bench {

/// A program of this build's folder.
std::string Beside(const std::string& name);

/// This thread runs on one core as long as this lives; -1: where it ran before.
class Pinned {
 public:
  explicit Pinned(int core);
  ~Pinned();
  Pinned(const Pinned&) = delete;
  Pinned& operator=(const Pinned&) = delete;

 private:
  cpu_set_t before_;
};

/// A folder of its own, removed at the end.
class TempFolder {
 public:
  TempFolder();
  ~TempFolder();
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/// A program that listens (--grpc, --port-file), as a child of this measurement; it ends with it.
class ChildProgram {
 public:
  /// `words`: the program, then its options. `grpc`: HOST:PORT, port 0 for a free one, or
  /// unix:PATH; `core` -1: any. Returns when it listens; throws std::runtime_error with what it
  /// said where it does not.
  ChildProgram(std::vector<std::string> words, const std::string& grpc, int core);
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  const std::string& address() const { return address_; }
  /// Throws std::runtime_error with what it said where it has ended.
  double RssMib();

 private:
  TempFolder folder_;
  std::string program_, address_;
  pid_t pid_ = -1;
};

/// The words of a grouser-server with the shipped models and an empty state folder.
std::vector<std::string> ServerWords(const TempFolder& folder, const std::string& program = "");

}  // namespace grouser::bench
