#pragma once

#include <string>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"

namespace grouser::testing {

/// A real (untrained) model: Bekker physics with default parameters, a CMU-size
/// wheel, made-up uncertainty, true golden vectors. `k_phi` tells models apart.
v1alpha1::Model PhysicsModel(const std::string& name, double k_phi = 6e5);

/// Publishes a model in a state folder and makes it stable; returns its digest.
std::string MakeStable(const std::string& state_dir, const v1alpha1::Model& model);

/// A program of this build as a child process; killed at the end.
class Program {
 public:
  /// `name` in the build's bin/; stdout and stderr go to files in `log_dir`.
  /// `descriptors`: soft and hard limit of open files; 0: this program's.
  Program(const std::string& name, const std::vector<std::string>& arguments,
          const std::string& log_dir, int descriptors = 0);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  int pid() const { return pid_; }
  void Signal(int number);
  /// Exit code, or 128 + the signal that ended it.
  int Wait();
  bool Running();
  std::string Stdout() const;
  std::string Stderr() const;

 private:
  int pid_ = -1;
  int code_ = -1;
  std::string log_;
};

/// Runs a program to its end.
struct Finished {
  int code;
  std::string out, err;
};
Finished RunProgram(const std::string& name, const std::vector<std::string>& arguments,
                    const std::string& log_dir);

/// A server on a free port of the loopback, ready to answer.
class ServerProcess {
 public:
  /// Throws std::runtime_error with its stderr when it does not get ready.
  explicit ServerProcess(const std::string& state_dir, std::vector<std::string> more = {"--no-lcm"},
                         const std::string& program = "grouser-server", int descriptors = 0);
  const std::string& address() const { return address_; }
  /// Of --http; empty where that was not given.
  const std::string& http() const { return http_; }
  Program& program() { return program_; }

 private:
  Program program_;
  std::string address_, http_;
};

/// Waits until `condition` holds; false after a minute.
template <class Condition>
bool Eventually(Condition condition);

void SleepMilliseconds(int ms);

template <class Condition>
bool Eventually(Condition condition) {
  constexpr int kStepMs = 20;
  for (int waited = 0; waited < 60000; waited += kStepMs) {
    if (condition()) return true;
    SleepMilliseconds(kStepMs);
  }
  return false;
}

}  // namespace grouser::testing
