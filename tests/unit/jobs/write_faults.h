#pragma once

#include <map>
#include <random>
#include <string>

#include "tests/unit/jobs/write_faults_control.h"

namespace grouser::server::testing {

/// Faults of writing below a folder, for programs that are started between Enter and Leave, or that
/// call TakeWriteCalls after Enter. The folder's present content counts as synced.
class WriteFaults {
 public:
  /// `program`: whose calls count; its short name. `preload`: write_faults_calls.cc as a library.
  /// Makes the folder `own`.
  WriteFaults(std::string own, std::string root, const std::string& program, std::string preload);
  ~WriteFaults();
  WriteFaults(const WriteFaults&) = delete;
  WriteFaults& operator=(const WriteFaults&) = delete;

  /// Sets the environment of programs that are started, or takes it back.
  void Enter() const;
  static void Leave();

  /// At the `at`-th call from now, of those kinds and with that in its path.
  void Plan(WriteFault fault, long at, unsigned calls = kAnyCall, const std::string& path = "");
  void Clear() { Plan(WriteFault::kNone, 0); }
  bool happened() const { return control_->left <= 0; }
  long seen() const { return control_->seen; }

  /// The folder's present content counts as synced from now on.
  void Settle() { RecordAll(); }

  /// What of all that was not synced is on the disk after a power cut.
  enum class Left {
    kNothing,
    kSome,  ///< of each folder its names or not, of each file any of its blocks
  };
  /// Leaves that in the folder. No program may be at it.
  void CutPower(Left left, std::mt19937& random);

 private:
  void RecordAll() const;
  void Build(const std::string& to, const std::string& key, Left left, std::mt19937& random) const;

  std::string own_, root_, preload_;
  FaultControl* control_ = nullptr;
  std::map<std::string, std::string> now_;  ///< path by key, while the power is cut
};

}  // namespace grouser::server::testing
