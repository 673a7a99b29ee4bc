#pragma once

namespace grouser::server {

/// The commit of the source that this was built from, "-dirty" where that was changed;
/// "unknown" without git. Its source is written by cmake/source_commit.cmake in every build.
const char* SourceCommit();

}  // namespace grouser::server
