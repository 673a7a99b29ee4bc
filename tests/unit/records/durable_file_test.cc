#include "proto/records/durable_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>

#include "proto/records/model_file.h"
#include "proto/records/sha256.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/records/throws.h"

namespace grouser::records {
namespace {

using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

TEST(WriteFileDurably, WritesAndReplaces) {
  const TempFolder folder;
  WriteFileDurably(folder / "a", "one");
  WriteFileDurably(folder / "a", std::string("t\0wo", 4));
  EXPECT_EQ(ReadFileBytes(folder / "a"), std::string("t\0wo", 4));
  EXPECT_THAT(folder.List(), UnorderedElementsAre("a"));
}

TEST(WriteFileDurably, MissingFolderNamesThePath) {
  const TempFolder folder;
  const std::string message = MessageOf([&] { WriteFileDurably(folder / "no/a", "x"); });
  EXPECT_THAT(message, HasSubstr(folder / "no/a"));
  EXPECT_THAT(message, HasSubstr("No such file"));
}

TEST(MakeFolderFor, MakesWhatIsMissingAboveAFile) {
  const TempFolder folder;
  MakeFolderFor(folder / "a/b/c");
  MakeFolderFor(folder / "a/b/c");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "a/b"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a/b/c"));
  MakeFolderFor("a-file-of-the-working-folder");
  EXPECT_FALSE(std::filesystem::exists("a-file-of-the-working-folder"));
}

TEST(MakeFolderFor, NamesTheFolderThatCannotBeMade) {
  const TempFolder folder;
  WriteFileDurably(folder / "a", "x");
  EXPECT_THAT(MessageOf([&] { MakeFolderFor(folder / "a/b"); }),
              HasSubstr(folder / "a: cannot be made: File exists"));
  EXPECT_THAT(MessageOf([&] { MakeFolderFor(folder / "a/b/c"); }),
              HasSubstr("a/b: cannot be made: Not a directory"));
}

// A limit on the file size stops write() half-way, as a full disk does.
TEST(WriteFileDurably, FullDiskLeavesTheOldFileAndNothingElse) {
  const TempFolder folder;
  WriteFileDurably(folder / "a", "old");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit tight = before;
  tight.rlim_cur = 4096;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tight), 0);
  const std::string message =
      MessageOf([&] { WriteFileDurably(folder / "a", std::string(100000, 'x')); });
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_THAT(message, HasSubstr(folder / "a"));
  EXPECT_THAT(message, HasSubstr("cannot write"));
  EXPECT_EQ(ReadFileBytes(folder / "a"), "old");
  EXPECT_THAT(folder.List(), UnorderedElementsAre("a"));
}

TEST(WriteFileDurably, RenameOntoAFolderFailsCleanly) {
  const TempFolder folder;
  std::filesystem::create_directory(folder / "a");
  EXPECT_THAT(MessageOf([&] { WriteFileDurably(folder / "a", "x"); }), HasSubstr("rename"));
  EXPECT_THAT(folder.List(), UnorderedElementsAre("a"));
}

TEST(ReadFileBytes, RefusesFoldersAndMissingFiles) {
  const TempFolder folder;
  EXPECT_THAT(MessageOf([&] { ReadFileBytes(folder / "gone"); }), HasSubstr("gone: cannot open"));
  EXPECT_THAT(MessageOf([&] { ReadFileBytes(folder / "."); }), HasSubstr("not a regular file"));
}

// A reader that waits hangs the test; CTest's time limit then ends it.
TEST(ReadFileBytes, RefusesWhatIsNoRegularFileWithoutWaiting) {
  const TempFolder folder;
  ASSERT_EQ(mkfifo((folder / "fifo").c_str(), 0600), 0);
  EXPECT_THAT(MessageOf([&] { ReadFileBytes(folder / "fifo"); }), HasSubstr("fifo: not a regular"));
  EXPECT_THAT(MessageOf([&] { ReadFileBytes("/dev/zero"); }), HasSubstr("a device"));
  std::filesystem::create_symlink("/dev/zero", folder / "link");
  EXPECT_THAT(MessageOf([&] { ReadFileBytes(folder / "link"); }), HasSubstr("link: not a regular"));
}

TEST(ReadFileBytes, RefusesFilesOfMoreThanTheLimit) {
  const TempFolder folder;
  WriteFileDurably(folder / "a", "1234");
  EXPECT_EQ(ReadFileBytes(folder / "a", 4), "1234");
  EXPECT_THAT(MessageOf([&] { ReadFileBytes(folder / "a", 3); }),
              HasSubstr("a: 4 bytes, expected at most 3"));
  std::filesystem::resize_file(folder / "a", std::uint64_t{1} << 40);  // sparse
  EXPECT_THAT(MessageOf([&] { ReadFileBytes(folder / "a"); }), HasSubstr("expected at most"));
}

TEST(Sha256, KnownVectors) {  // FIPS 180-2, appendix B
  EXPECT_EQ(Sha256OfString("abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256OfString(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const TempFolder folder;
  WriteFileDurably(folder / "a", "abc");
  EXPECT_EQ(Sha256OfFile(folder / "a"), Sha256OfString("abc"));
}

}  // namespace
}  // namespace grouser::records
