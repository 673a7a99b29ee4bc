# Compile settings of every target, and two small functions.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")

# Half of a compiler's time goes into headers and the templates they bring; this reads them
# once for several sources. Every name of a target is therefore distinct, and the preset tidy
# compiles each source alone.
set(CMAKE_UNITY_BUILD ${GROUSER_UNITY})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 24)

add_library(grouser_options INTERFACE)
target_include_directories(grouser_options INTERFACE "${PROJECT_SOURCE_DIR}")
# One rounding everywhere: results must not depend on the instruction set.
target_compile_options(grouser_options INTERFACE -Wall -Wextra -ffp-contract=off)
target_compile_definitions(grouser_options INTERFACE
  GROUSER_VERSION="${PROJECT_VERSION}")
# Precompiled headers alone exceed what g++ fills before it collects garbage (128 MiB): it would
# begin at once, for a tenth of its time. [KiB]
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
  target_compile_options(grouser_options INTERFACE
    "$<$<COMPILE_LANGUAGE:CXX>:SHELL:--param ggc-min-heapsize=393216>")
endif()
if(GROUSER_SANITIZE)
  target_compile_options(grouser_options INTERFACE
    -fsanitize=${GROUSER_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  if(GROUSER_SANITIZE MATCHES "address")  # ASan sees the access; a quarter of the compile time
    target_compile_options(grouser_options INTERFACE -fno-sanitize=null,object-size)
    if(NOT GROUSER_MORE_CHECKS)  # another quarter
      target_compile_options(grouser_options INTERFACE
        -fno-sanitize=alignment,vptr,return,nonnull-attribute,returns-nonnull-attribute)
    endif()
  endif()
  target_link_options(grouser_options INTERFACE -fsanitize=${GROUSER_SANITIZE})
  if(GROUSER_SANITIZE MATCHES "thread")
    # protobuf's map_field.h lays its maps out otherwise under this macro, which
    # Debian's libprotobuf was built without; libstdc++ still needs to know. The
    # evaluators keep it: they have no protobuf, and drop their target_clones
    # where they see it (a resolver in a shared library runs before TSan does).
    target_compile_options(grouser_options INTERFACE -D_GLIBCXX_TSAN=1
      $<$<NOT:$<STREQUAL:$<TARGET_PROPERTY:NAME>,grouser_models>>:-U__SANITIZE_THREAD__>)
  endif()
endif()

# gold (of Debian's binutils) links in a third of the time of the usual ld; 150 programs are linked.
include(CheckLinkerFlag)
check_linker_flag(CXX -fuse-ld=gold GROUSER_HAS_GOLD)
if(GROUSER_HAS_GOLD)
  add_link_options(-fuse-ld=gold)
endif()

# grouser_headers(NAME [OPTIONS o ...] [LINK x] HEADERS <a> ...): headers that the targets of one
# kind precompile together (`target_precompile_headers(x REUSE_FROM NAME)`). A source still
# includes what it uses: CMAKE_DISABLE_PRECOMPILE_HEADERS, as in the preset tidy, turns all off.
function(grouser_headers name)
  cmake_parse_arguments(ARG "" "" "OPTIONS;LINK;HEADERS" ${ARGN})
  set(source "${CMAKE_BINARY_DIR}/${name}.cc")
  file(CONFIGURE OUTPUT "${source}" CONTENT "// Only its precompiled headers are used.\n")
  add_library(${name} OBJECT "${source}")
  target_compile_options(${name} PRIVATE ${ARG_OPTIONS})
  target_link_libraries(${name} PRIVATE grouser_options ${ARG_LINK})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
endfunction()

# Code that need not be fast costs two fifths less to compile so, code that only reads files half;
# the sources of tests cost half as much again without any optimisation.
set(GROUSER_QUICK_COMPILE $<$<CONFIG:Release>:-O1>)
set(GROUSER_TEST_COMPILE $<$<CONFIG:Release>:-O0>)
if(GROUSER_SANITIZE MATCHES "address")  # all checks stay; to optimise them takes most of the compile time
  set(GROUSER_QUICK_COMPILE -O0)
  set(GROUSER_TEST_COMPILE -O0)
endif()
# grouser_library(NAME [FAST] SOURCES a.cc ... LINK x y [HEADERS name]): a static library. FAST:
# what runs often; the rest need not be fast. HEADERS: the precompiled headers of another kind, or
# NONE. (g++ takes some of its optimisation from the precompiled headers: theirs must be the same.)
function(grouser_library name)
  cmake_parse_arguments(ARG "FAST" "HEADERS" "SOURCES;LINK" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  set(headers grouser_common_headers)
  if(NOT ARG_FAST)
    target_compile_options(${name} PRIVATE ${GROUSER_QUICK_COMPILE})
    set(headers grouser_quick_headers)
  endif()
  target_link_libraries(${name} PUBLIC grouser_options ${ARG_LINK})
  if(ARG_HEADERS)
    set(headers ${ARG_HEADERS})
  endif()
  if(NOT headers STREQUAL "NONE")
    target_precompile_headers(${name} REUSE_FROM ${headers})
  endif()
endfunction()

# CLI11 gives every source that includes it the code of all its classes: optimising that
# takes longer than all else.
set(GROUSER_COMMAND_LINE_COMPILE $<$<CONFIG:Release>:-O0>)

# grouser_program(NAME SOURCES a.cc ... LINK x y): an executable in bin/. COMMAND_LINE: its
# sources read the command line, no more.
function(grouser_program name)
  cmake_parse_arguments(ARG "COMMAND_LINE" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  if(ARG_COMMAND_LINE)
    target_compile_options(${name} PRIVATE ${GROUSER_COMMAND_LINE_COMPILE})
    target_precompile_headers(${name} REUSE_FROM grouser_command_line_headers)
    target_link_libraries(${name} PRIVATE grouser_command_line)
  endif()
  target_link_libraries(${name} PRIVATE grouser_options ${ARG_LINK})
endfunction()

# grouser_test(NAME [COMPUTES] SOURCES a.cc ... LINK x LABELS unit [TIMEOUT s] [COST s]): a
# GoogleTest program, one CTest entry. Label "hostile": it reads what an outsider can send (files,
# packets, requests, states) and needs no engine, which takes long to compile there; it also runs
# under ASan. The other "unit" and "verify" tests run there with ./grouser test --full. COMPUTES: its own sources, or headers that they
# bring, run so long that optimising them is the cheaper. COST: about its seconds, for those that would
# end last: CTest starts the costliest first.
function(grouser_test name)
  cmake_parse_arguments(ARG "COMPUTES" "TIMEOUT;COST" "SOURCES;LINK;LABELS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  if(ARG_COMPUTES)
    target_compile_options(${name} PRIVATE ${GROUSER_QUICK_COMPILE})
  else()
    target_compile_options(${name} PRIVATE ${GROUSER_TEST_COMPILE})
    target_precompile_headers(${name} REUSE_FROM grouser_test_headers)
  endif()
  target_link_libraries(${name} PRIVATE grouser_options ${ARG_LINK}
    GTest::gmock GTest::gtest GTest::gtest_main)
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)  # a guard against hanging; fsyncs are slow on a busy disk
  endif()
  add_test(NAME ${name} COMMAND ${name})
  if(NOT ARG_COST)
    set(ARG_COST 0)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT} COST ${ARG_COST})
  if("hostile" IN_LIST ARG_LABELS)  # all that the ASan stage of ./grouser test needs
    if(NOT TARGET hostile_tests)
      add_custom_target(hostile_tests)
    endif()
    add_dependencies(hostile_tests ${name})
  endif()
endfunction()

# grouser_slow_cases(NAME CASES [TIMEOUT s]): these cases of a test (as in GTEST_FILTER) run with
# `--full` alone, as NAME_slow; under sanitizers with the others. It sets the tests' ENVIRONMENT.
function(grouser_slow_cases name cases)
  if(GROUSER_SANITIZE)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 2 ARG "" "TIMEOUT" "")
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)
  endif()
  set_tests_properties(${name} PROPERTIES ENVIRONMENT "GTEST_FILTER=-${cases}")
  add_test(NAME ${name}_slow COMMAND ${name})
  set_tests_properties(${name}_slow PROPERTIES LABELS slow TIMEOUT ${ARG_TIMEOUT}
    ENVIRONMENT "GTEST_FILTER=${cases}" FAIL_REGULAR_EXPRESSION "Running 0 tests")
endfunction()
