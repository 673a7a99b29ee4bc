#pragma once

#include <atomic>

namespace grouser::server::testing {

/// Calls that change files, as bits.
enum WriteCall : unsigned {
  kCreate = 1,  ///< a file or folder
  kWrite = 2,
  kResize = 4,
  kSync = 8,
  kRename = 16,
  kRemove = 32,
  kAnyCall = 63,
};

/// What happens at the call that was counted last.
enum class WriteFault : int {
  kNone,
  kKill,  ///< SIGKILL to its process; half of what it was to write is written
  kTerm,  ///< SIGTERM to its process; the call goes on
  kFull,  ///< it and all later calls that would count fail with ENOSPC, whatever program's
};

/// In memory that a test shares with the programs whose calls write_faults_calls.cc takes.
struct FaultControl {
  std::atomic<WriteFault> fault;
  std::atomic<unsigned> calls;  ///< WriteCall bits that count
  std::atomic<long> left;       ///< calls until the fault
  std::atomic<long> seen;       ///< calls counted
  std::atomic<bool> full;
  char program[32];  ///< whose calls count
  char path[64];     ///< part of the paths that count; empty: any
};

constexpr char kFaultsFolder[] =
    "GROUSER_WRITE_FAULTS";  ///< environment: where control and record are
constexpr char kFaultsRoot[] =
    "GROUSER_WRITE_FAULTS_ROOT";  ///< environment: below it calls are taken

/// Begins to take this process's calls, as the environment says; does nothing where it says
/// nothing.
void TakeWriteCalls();

// The record of what is on disk for certain: FOLDER/data/KEY, the bytes of a file when it was last
// synced; FOLDER/folders/KEY, lines "d KEY NAME" or "f KEY NAME", what a folder held then. KEY:
// inode and time of birth, for inodes are used again.
void RecordFile(const char* record, int fd);
void RecordFolder(const char* record, int fd);
/// KEY of what stands at `name`, relative to `fd`. False where nothing does.
bool KeyOf(int fd, const char* name, char (&key)[40], bool* is_folder);

}  // namespace grouser::server::testing
