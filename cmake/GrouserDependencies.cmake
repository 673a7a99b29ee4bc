# Debian 12 packages; see cmake/packages.debian.
find_package(Threads REQUIRED)
find_package(Protobuf MODULE REQUIRED)  # MODULE first, then gRPC CONFIG
find_package(OpenSSL REQUIRED)          # content hashes
find_package(HDF5 REQUIRED COMPONENTS C)
find_package(yaml-cpp REQUIRED)
find_package(SQLiteCpp CONFIG REQUIRED)
find_package(Eigen3 REQUIRED)
find_package(Ceres REQUIRED)
find_package(OpenTURNS CONFIG REQUIRED)  # the yardstick of the ladder
# The core alone: the package's own config would ask for a web server and curl.
find_library(PROMETHEUS_LIBRARY prometheus-cpp-core REQUIRED)
option(GROUSER_MULTIBODY "joints of bodies on grains, where Simbody is found" ON)
if(GROUSER_MULTIBODY)
  find_package(Simbody CONFIG QUIET)
endif()
if(NOT Simbody_FOUND)
  message(STATUS "no joints of bodies: Simbody (libsimbody-dev) was not found or not asked for")
endif()
option(GROUSER_MAPS "maps of what a vehicle can drive, where GDAL is found" ON)
if(GROUSER_MAPS)
  find_package(GDAL CONFIG QUIET)
endif()
if(NOT GDAL_FOUND)
  message(STATUS "no maps: GDAL (libgdal-dev) was not found or not asked for")
endif()
option(GROUSER_PYTHON "the Python package grouser, where pybind11 is found" ON)
if(GROUSER_PYTHON AND NOT GROUSER_SANITIZE)  # a sanitizer would have to be loaded before Python
  set(Python_EXECUTABLE /usr/bin/python3)    # Debian's: it has numpy
  find_package(Python QUIET COMPONENTS Interpreter Development.Module)
  if(Python_FOUND)
    find_package(pybind11 CONFIG QUIET)
  endif()
  set(found OFF)
  if(pybind11_FOUND)
    set(found ON)
  endif()
  set(GROUSER_PYTHON_FOUND ${found} CACHE INTERNAL "read by cmake/frontdoor/common.sh")
endif()
if(NOT pybind11_FOUND)
  message(STATUS "no Python package: pybind11 and Python's headers (pybind11-dev, libpython3-dev) were not found or not asked for")
endif()
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(spdlog REQUIRED)
find_package(Boost 1.74 REQUIRED)
# Asio's own code once, not in every source that uses it.
file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/grouser_asio.cc" CONTENT
  "#include <utility>\n\n#include <boost/asio/impl/src.hpp>\n")
add_library(grouser_asio STATIC EXCLUDE_FROM_ALL "${CMAKE_BINARY_DIR}/grouser_asio.cc")
target_compile_definitions(grouser_asio PUBLIC BOOST_ASIO_SEPARATE_COMPILATION)
target_compile_options(grouser_asio PRIVATE ${GROUSER_QUICK_COMPILE})
target_link_libraries(grouser_asio PUBLIC Boost::headers Threads::Threads PRIVATE grouser_options)
# Boost 1.74 Asio uses std::exchange without including its header (C++20); every set of
# precompiled headers has it.
if(CMAKE_DISABLE_PRECOMPILE_HEADERS)
  target_compile_options(grouser_asio INTERFACE "SHELL:-include utility")
endif()
if(GROUSER_SERVICES)
  find_package(gRPC CONFIG REQUIRED)
  find_library(SYSTEMD_LIBRARY systemd REQUIRED)
  set(required REQUIRED)
endif()
find_library(LCM_LIBRARY lcm ${required})  # lcm.pc would ask for glib
find_program(LCM_GEN lcm-gen ${required})  # without services: for tests of what reads datagrams
if(GROUSER_TESTS)
  find_package(GTest REQUIRED)
  find_package(benchmark)
endif()
