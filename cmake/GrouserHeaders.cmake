# What the sources of each kind of target precompile: headers of libraries and of C++ that
# most of them include. Their macros must be the same in all of these targets.
target_compile_options(grouser_options INTERFACE -pthread)
target_compile_definitions(grouser_options INTERFACE
  $<TARGET_PROPERTY:fmt::fmt,INTERFACE_COMPILE_DEFINITIONS>
  $<TARGET_PROPERTY:spdlog::spdlog,INTERFACE_COMPILE_DEFINITIONS>
  $<TARGET_PROPERTY:grouser_asio,INTERFACE_COMPILE_DEFINITIONS>)

set(standard <algorithm> <array> <atomic> <chrono> <cmath> <cstdint> <cstring> <filesystem> <fstream>
  <functional> <limits> <map> <memory> <mutex> <numbers> <optional> <random> <set> <span> <sstream>
  <stdexcept> <string> <thread> <unordered_map> <utility> <vector>)
set(messages <fmt/format.h> <google/protobuf/generated_message_reflection.h>
  <google/protobuf/repeated_field.h> <google/protobuf/map_field.h>)
if(GROUSER_SERVICES)
  set(services <grpcpp/grpcpp.h> <grpcpp/support/server_callback.h> <boost/asio/io_context.hpp>
    <boost/asio/steady_timer.hpp> <spdlog/spdlog.h>)
endif()

grouser_headers(grouser_common_headers HEADERS ${standard} ${messages})
grouser_headers(grouser_quick_headers OPTIONS ${GROUSER_QUICK_COMPILE}
  HEADERS ${standard} ${messages})
grouser_headers(grouser_command_line_headers OPTIONS ${GROUSER_COMMAND_LINE_COMPILE}
  HEADERS ${standard} ${messages} <CLI/CLI.hpp>)
if(GROUSER_SERVICES)
  grouser_headers(grouser_service_headers OPTIONS ${GROUSER_QUICK_COMPILE} HEADERS ${standard} ${messages} ${services})
endif()
if(GROUSER_TESTS)
  grouser_headers(grouser_test_headers OPTIONS ${GROUSER_TEST_COMPILE} LINK GTest::gtest
    HEADERS ${standard} ${messages} <gmock/gmock.h> <gtest/gtest.h>)
endif()
