# cmake -DSOURCE=DIR -DOUT=FILE -P source_commit.cmake: writes the source of SourceCommit(), where
# that changed.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND git -C "${SOURCE}" describe --always --dirty --abbrev=12 "--exclude=*"
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed OR NOT commit MATCHES "^[0-9a-f]+(-dirty)?$")
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT "${OUT}" @ONLY CONTENT
"#include \"server/net/source_commit.h\"
namespace grouser::server {
const char* SourceCommit() { return \"@commit@\"; }
}  // namespace grouser::server
")
