#include "server/core/table_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "server/core/snapshot_store.h"
#include "tests/unit/server/fake_model.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser::server {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::uint64_t kPlenty = 1'000'000'000;

class TableCacheTest : public ::testing::Test {
 protected:
  static std::string Key(char c) { return std::string(64, c); }
  std::string FileOf(const std::string& digest) const { return folder_ + "/" + digest + ".table"; }
  static void Write(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }
  std::size_t Count() const {
    if (!fs::exists(folder_)) return 0;
    return static_cast<std::size_t>(std::count_if(
        fs::directory_iterator(folder_), fs::directory_iterator(),
        [](const auto& entry) { return entry.path().filename().string().front() != '.'; }));
  }
  static void Age(const std::string& path, int seconds) {
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::seconds(seconds));
  }

  testing::TempDir dir_;
  std::string folder_ = dir_ / "state/tables";
  std::string numbers_ = std::string(100'000, 'n');
};

TEST_F(TableCacheTest, GivesBackWhatWasKeptUnderTheSameKeyAndSizeAlone) {
  TableCache cache(folder_, kPlenty);
  const auto a = cache.Of("a");
  EXPECT_EQ(a.read(Key('1'), numbers_.size()), "");
  a.keep(Key('1'), numbers_);
  EXPECT_TRUE(TableCache(folder_, kPlenty).Of("a").read(Key('1'), numbers_.size()) == numbers_);
  EXPECT_EQ(a.read(Key('2'), numbers_.size()), "") << "of another version of the program";
  EXPECT_EQ(cache.Of("b").read(Key('1'), numbers_.size()), "");
  EXPECT_THAT(cache.TakeNews(), IsEmpty()) << "nothing of that is damage";
  a.keep(Key('2'), numbers_);
  EXPECT_TRUE(a.read(Key('2'), numbers_.size()) == numbers_) << "replaced";
  EXPECT_EQ(Count(), 1u);
}

TEST_F(TableCacheTest, WhatIsDamagedIsNeverGivenAndToldOnce) {
  TableCache cache(folder_, kPlenty);
  const auto kept = cache.Of("a");
  kept.keep(Key('1'), numbers_);
  const std::string path = FileOf("a"), whole = records::ReadFileBytes(path);
  std::vector<std::string> damaged = {"", "foreign", whole + "x", std::string(whole.size(), '\0')};
  for (const std::size_t size : {1u, 15u, 16u, 80u, 144u, 5000u}) {
    damaged.push_back(whole.substr(0, size));
  }
  damaged.push_back(whole.substr(0, whole.size() - 1));
  for (const std::size_t at : {3u, 20u, 100u, 144u, 60'000u}) {
    damaged.push_back(whole);
    damaged.back()[at] ^= 1;
  }
  for (const std::string& bytes : damaged) {
    Write(path, bytes);
    EXPECT_EQ(kept.read(Key('1'), numbers_.size()), "") << bytes.size();
  }
  EXPECT_THAT(cache.TakeNews(), ElementsAre(HasSubstr(path))) << "once a file";
  // Far more than there is memory, by its size alone.
  fs::resize_file(path, std::uint64_t{1} << 40);
  EXPECT_EQ(kept.read(Key('1'), numbers_.size()), "");
  fs::remove(path);
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(kept.read(Key('1'), numbers_.size()), "") << "does not wait for a writer";
  kept.keep(Key('1'), numbers_);
  EXPECT_TRUE(kept.read(Key('1'), numbers_.size()) == numbers_);
}

TEST_F(TableCacheTest, WhereNothingCanBeWrittenThatIsToldOnce) {
  fs::create_directories(dir_ / "state");
  Write(folder_, "a file");  // root may write into any folder
  TableCache cache(folder_, kPlenty);
  cache.Of("a").keep(Key('1'), numbers_);
  cache.Of("b").keep(Key('1'), numbers_);
  EXPECT_THAT(cache.TakeNews(), ElementsAre(HasSubstr("cannot be kept")));
  EXPECT_EQ(cache.Of("a").read(Key('1'), numbers_.size()), "");
}

TEST_F(TableCacheTest, TakesNoMoreThanItsBound) {
  auto first = std::make_unique<TableCache>(folder_, 250'000);
  TableCache& cache = *first;
  for (const char* digest : {"a", "b", "c", "d"}) cache.Of(digest).keep(Key('1'), numbers_);
  EXPECT_EQ(Count(), 2u);
  EXPECT_THAT(cache.TakeNews(), ElementsAre(HasSubstr("no room")));
  cache.Of("b").keep(Key('2'), numbers_);
  EXPECT_EQ(cache.Of("b").read(Key('2'), numbers_.size()).size(), numbers_.size())
      << "one that is replaced makes room";
  Age(FileOf("a"), 10);
  auto second = std::make_unique<TableCache>(folder_, 150'000);
  TableCache& smaller = *second;
  smaller.Prune({"a", "b"});
  EXPECT_TRUE(fs::exists(FileOf("a"))) << "while another server may use it";
  first.reset();
  smaller.Prune({"a", "b"});
  EXPECT_FALSE(fs::exists(FileOf("a"))) << "the older one";
  EXPECT_TRUE(fs::exists(FileOf("b")));
  {
    TableCache none(folder_, 0);
    none.Prune({"b"});
    EXPECT_EQ(Count(), 1u) << "kept by another";
  }
  second.reset();
  TableCache none(folder_, 0);
  EXPECT_FALSE(none.Of("b").read);
  none.Prune({"b"});
  EXPECT_EQ(Count(), 0u);
}

TEST_F(TableCacheTest, PrunesWhatIsOfNoModelAndNothingElse) {
  TableCache cache(folder_, kPlenty);
  for (const char* digest : {"a", "b"}) cache.Of(digest).keep(Key('1'), numbers_);
  Write(folder_ + "/notes.txt", "kept");
  Write(folder_ + "/old.tmp", "");
  Write(folder_ + "/new.tmp", "");
  Age(folder_ + "/old.tmp", 7200);
  cache.Prune({"b"});
  EXPECT_FALSE(fs::exists(FileOf("a")));
  EXPECT_FALSE(fs::exists(folder_ + "/old.tmp"));
  for (const char* left : {"b.table", "notes.txt", "new.tmp"}) {
    EXPECT_TRUE(fs::exists(folder_ + "/" + left)) << left;
  }
}

// Servers on one state folder with other models: neither makes the other's anew at each start.
TEST_F(TableCacheTest, TwoServersLeaveEachOthersTables) {
  TableCache one(folder_, kPlenty);
  one.Of("a").keep(Key('1'), numbers_);
  {
    TableCache other(folder_, kPlenty);
    EXPECT_EQ(other.Of("b").read(Key('1'), numbers_.size()), "");
    other.Of("b").keep(Key('1'), numbers_);
    other.Prune({"b"});
    one.Prune({"a"});
    EXPECT_EQ(Count(), 2u);
    one.Prune({"a"});
    other.Prune({"b"});
    EXPECT_EQ(Count(), 2u) << "a claim in vain gives nothing up";
  }
  one.Prune({"a"});
  EXPECT_TRUE(fs::exists(FileOf("a")));
  EXPECT_FALSE(fs::exists(FileOf("b"))) << "once the other has ended";
  TableCache third(folder_, kPlenty);
  EXPECT_EQ(third.Of("a").read(Key('1'), numbers_.size()).size(), numbers_.size());
}

TEST_F(TableCacheTest, TwoServersThatPruneInTheSameInstantLeaveEachOthersTables) {
  constexpr int kTimes = 20'000;
  TableCache one(folder_, kPlenty), other(folder_, kPlenty);
  one.Of("a").keep(Key('1'), numbers_);
  other.Of("b").keep(Key('1'), numbers_);
  {
    const std::jthread thread([&] {
      for (int i = 0; i < kTimes; ++i) other.Prune({"b"});
    });
    for (int i = 0; i < kTimes; ++i) one.Prune({"a"});
  }
  EXPECT_TRUE(fs::exists(FileOf("a")));
  EXPECT_TRUE(fs::exists(FileOf("b")));
}

// The whole way: repository, model file, table.
TEST_F(TableCacheTest, ASnapshotKeepsTheTablesOfItsModelsAndPrunesThemWithThese) {
  Repository repository(dir_ / "state", "");
  const std::string shipped = GROUSER_SMALL_MODEL;
  const std::string digest = repository.Publish(shipped);
  auto message = records::ReadModelFile(shipped).model;
  message.set_name("other");
  records::WriteModelFile(dir_ / "other.model", message);
  const std::string other = repository.Publish(dir_ / "other.model");
  const auto load = [&] {
    TableCache cache(folder_, kPlenty);
    SnapshotStore store(repository, surrogate::MakeModel, std::chrono::hours(1), &cache);
    const auto outcome = store.Refresh();
    EXPECT_THAT(outcome.problems, IsEmpty());
    EXPECT_THAT(store.Current()->models(), SizeIs(2));
    return outcome.news;
  };
  EXPECT_THAT(load(), IsEmpty());
  ASSERT_EQ(Count(), 2u);
  const auto written = fs::last_write_time(FileOf(digest));
  EXPECT_THAT(load(), IsEmpty());
  EXPECT_EQ(fs::last_write_time(FileOf(digest)), written) << "read, not made";
  // Another model's table under this one's name: its key says so.
  fs::copy_file(FileOf(other), FileOf(digest), fs::copy_options::overwrite_existing);
  EXPECT_THAT(load(), IsEmpty());
  EXPECT_TRUE(records::ReadFileBytes(FileOf(digest)) != records::ReadFileBytes(FileOf(other)));
  std::fstream(FileOf(digest), std::ios::in | std::ios::out | std::ios::binary).seekp(5000) << "?";
  EXPECT_THAT(load(), ElementsAre(HasSubstr(FileOf(digest))));
  EXPECT_THAT(load(), IsEmpty()) << "replaced by a whole one";
  TableCache cache(folder_, kPlenty);
  SnapshotStore store(repository, surrogate::MakeModel, std::chrono::hours(1), &cache);
  store.Refresh();
  fs::remove(dir_ / ("state/models/" + other + ".model"));
  store.Refresh();
  EXPECT_FALSE(fs::exists(FileOf(other)));
  EXPECT_TRUE(fs::exists(FileOf(digest)));
}

}  // namespace
}  // namespace grouser::server
