#pragma once

#include <cstdint>
#include <string>

namespace grouser::records {

// WriteFileDurably stands in model_file.h.

/// Writes aside and renames, without syncing: for what can be made again and bears a checksum, as
/// it may be torn after a crash of the machine. Throws as WriteFileDurably.
void WriteFileUnsynced(const std::string& path, const std::string& bytes);

/// Syncs the folder that holds a file or folder: its name is on disk. Throws std::runtime_error
/// "PATH: cause".
void SyncName(const std::string& path);

/// Makes a folder, and those above it, with names that are on disk. One that is there already may
/// have been made by a program that was killed before its name was. Throws std::runtime_error
/// "PATH: cause"; os::NoSpace where there is none.
void MakeFolderDurably(const std::string& path);

/// Makes what is missing of the folders above a file that a user named as a program's output, so
/// that it may be called as `--out FOLDER` is. Before work that takes long: what cannot be made is
/// known then. Not for files of a state folder, which stands on a disk that may be missing. Throws
/// as MakeFolderDurably.
void MakeFolderFor(const std::string& path);

/// Ending of the temporary file that WriteFileDurably writes aside. A killed
/// writer may leave one behind; nothing ever reads it.
inline constexpr char kTemporarySuffix[] = ".tmp";

/// Renames a folder, all of which is on disk then. Throws std::runtime_error "PATH: cause".
void RenameFolderDurably(const std::string& from, const std::string& to);

/// What a reader of any file takes: far above the largest bed, and small enough
/// to be held in memory.
inline constexpr std::uint64_t kMaxFileBytes = std::uint64_t{2} << 30;

/// All bytes of a regular file. Never waits: a FIFO, socket, device or folder is
/// refused, and so is a file of more than `max_bytes` (a sparse file may claim
/// more than there is memory). Throws std::runtime_error "PATH: cause".
std::string ReadFileBytes(const std::string& path, std::uint64_t max_bytes = kMaxFileBytes);

/// The same of a file that a user named. Throws std::invalid_argument
/// "PATH: cause, expected EXPECTED".
std::string ReadInputFile(const std::string& path, const std::string& expected);

}  // namespace grouser::records
