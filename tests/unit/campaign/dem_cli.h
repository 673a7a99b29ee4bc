#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

/// grouser-dem from the command line, in a folder of its own.
class DemCli : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("dem_cli_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::string Read(const std::string& name) const {
    std::stringstream text;
    text << std::ifstream(folder_ / name).rdbuf();
    return text.str();
  }
  /// Exit code; what was said is in `said_`.
  int Run(const std::string& arguments) {
    const std::string log = folder_ / "log";
    const int status =
        std::system((std::string(GROUSER_DEM) + " " + arguments + " >" + log + " 2>&1").c_str());
    said_ = Read("log");
    return WEXITSTATUS(status);
  }
  std::string In(const std::string& name) const { return folder_ / name; }

  std::filesystem::path folder_;
  std::string said_;
};
