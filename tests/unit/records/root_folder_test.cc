#include "proto/records/os/root_folder.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/unit/records/temp_folder.h"

namespace grouser::os {
namespace {

namespace fs = std::filesystem;

TEST(RootFolder, IsOfTheInstallationElseOfTheCheckout) {
  const records::TempFolder folder;
  const fs::path installed = folder / "prefix/bin/grouser-soil";
  const fs::path built = folder / "checkout/build/release/bin/grouser-soil";
  EXPECT_EQ(RootOf(installed), "");  // nothing to read is there
  EXPECT_EQ(RootOf(built), "");
  fs::create_directories(folder / "prefix/share/grouser/surrogate/soils");
  fs::create_directories(folder / "checkout/surrogate/soils");
  EXPECT_EQ(RootOf(installed), folder / "prefix/share/grouser");
  EXPECT_EQ(RootOf(built), folder / "checkout");
  EXPECT_EQ(RootOf("/"), "");
}

}  // namespace
}  // namespace grouser::os
