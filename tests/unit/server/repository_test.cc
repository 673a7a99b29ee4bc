#include "server/core/repository.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/inotify.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <set>
#include <thread>

#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "proto/records/os/unique_fd.h"
#include "tests/unit/records/throws.h"
#include "tests/unit/server/fake_model.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RepositoryTest : public ::testing::Test {
 protected:
  RepositoryTest() : repository_(dir_ / "state", dir_ / "shipped") {
    std::filesystem::create_directories(dir_ / "shipped");
  }

  std::string Ship(const std::string& name, double gain, int created_s = 0) {
    auto message = testing::FakeMessage(name, gain);
    message.mutable_create_time()->set_seconds(created_s);
    return records::WriteModelFile(dir_ / ("shipped/" + name + std::to_string(gain) + ".model"),
                                   message);
  }
  std::string Publish(const std::string& name, double gain) {
    const std::string path = dir_ / "new.model";
    records::WriteModelFile(path, testing::FakeMessage(name, gain));
    return repository_.Publish(path);
  }

  testing::TempDir dir_;
  Repository repository_;
};

TEST_F(RepositoryTest, EmptyRepositoryHasNothingAndIsNotCreated) {
  EXPECT_TRUE(repository_.List(nullptr).empty());
  EXPECT_EQ(repository_.ReadAliases().generation, 0u);
  EXPECT_THROW(repository_.Resolve(""), std::out_of_range);
  EXPECT_FALSE(std::filesystem::exists(dir_ / "state"));
}

TEST_F(RepositoryTest, NewestShippedModelIsStableUntilTheStateSaysOtherwise) {
  const auto old_digest = Ship("sand", 0.1, 100);
  const auto new_digest = Ship("sand", 0.2, 200);
  EXPECT_EQ(repository_.Resolve("sand").digest, new_digest);
  EXPECT_TRUE(repository_.Resolve("").shipped);
  repository_.SetAlias("sand", "stable", old_digest, "me", "the old one was better");
  EXPECT_EQ(repository_.Resolve("sand@stable").digest, old_digest);
  EXPECT_EQ(repository_.Resolve("sand@previous").digest, new_digest);
}

TEST_F(RepositoryTest, PublishIsContentAddressedAndIdempotent) {
  const auto digest = Publish("sand", 0.3);
  EXPECT_EQ(Publish("sand", 0.3), digest);
  const auto entries = repository_.List(nullptr);
  ASSERT_EQ(entries.size(), 1u);
  EXPECT_EQ(entries[0].path, dir_ / ("state/models/" + digest + ".model"));
  EXPECT_EQ(repository_.Resolve("sand@sha256:" + digest.substr(0, 12)).digest, digest);
  EXPECT_THROW(repository_.Resolve("sand"), std::out_of_range);  // no alias yet
}

/// How often a file is opened, or opened and closed (`events`), from now on. Equal events that
/// follow each other are one.
class OpenCount {
 public:
  explicit OpenCount(const std::string& path, unsigned events = IN_OPEN) {
    ::inotify_add_watch(fd_.get(), path.c_str(), events);
  }
  int SinceLast() {
    alignas(inotify_event) std::array<char, 4096> events;
    const ssize_t n = ::read(fd_.get(), events.data(), events.size());
    return n < 0 ? 0 : static_cast<int>(n / static_cast<ssize_t>(sizeof(inotify_event)));
  }

 private:
  os::UniqueFd fd_{::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)};
};

TEST_F(RepositoryTest, ADamagedFileIsReadOnceUntilItChanges) {
  const auto digest = Publish("sand", 0.3), good = Publish("mud", 0.2);
  const std::string path = dir_ / ("state/models/" + digest + ".model");
  const std::string whole = records::ReadFileBytes(path);
  std::filesystem::resize_file(path, 100);
  OpenCount opened(path);
  const auto problems = [&] {
    std::vector<std::string> found;
    EXPECT_EQ(repository_.List(&found).size(), 1u);
    return found;
  };
  const auto first = problems();
  ASSERT_EQ(first.size(), 1u);
  EXPECT_GT(opened.SinceLast(), 0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(problems(), first) << "told all the same";
  EXPECT_EQ(repository_.Resolve("mud@sha256:" + good).digest, good);
  EXPECT_EQ(opened.SinceLast(), 0);
  std::filesystem::resize_file(path, 99);
  EXPECT_EQ(problems().size(), 1u);
  EXPECT_GT(opened.SinceLast(), 0) << "it has changed";
  std::ofstream(path, std::ios::binary) << whole;
  EXPECT_EQ(repository_.List(nullptr).size(), 2u) << "mended in place";
  std::filesystem::resize_file(path, 100);
  EXPECT_EQ(problems().size(), 1u) << "and damaged again";
  std::filesystem::remove(path);
  EXPECT_TRUE(problems().empty());
}

// What fails may be the reading, for want of a descriptor, and a second one may succeed.
TEST_F(RepositoryTest, ADamagedFileIsJudgedByTheBytesThatWereRead) {
  const auto digest = Publish("sand", 0.3);
  const std::string path = dir_ / ("state/models/" + digest + ".model");
  std::filesystem::resize_file(path, 100);
  OpenCount opened_and_closed(path, IN_OPEN | IN_CLOSE);
  EXPECT_TRUE(repository_.List(nullptr).empty());
  EXPECT_EQ(opened_and_closed.SinceLast(), 2) << "it was opened once";
}

TEST_F(RepositoryTest, PublishReplacesADamagedCopy) {
  const auto digest = Publish("sand", 0.3);
  std::ofstream(dir_ / ("state/models/" + digest + ".model")) << "damaged";
  std::vector<std::string> problems;
  EXPECT_TRUE(repository_.List(&problems).empty());
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_THAT(problems[0], HasSubstr(digest));
  EXPECT_EQ(Publish("sand", 0.3), digest);
  EXPECT_EQ(repository_.List(nullptr).size(), 1u);
}

TEST_F(RepositoryTest, FileWhoseNameIsNotItsDigestIsAProblem) {
  const auto digest = Publish("sand", 0.3);
  std::filesystem::rename(dir_ / ("state/models/" + digest + ".model"),
                          dir_ / ("state/models/" + std::string(64, '0') + ".model"));
  std::vector<std::string> problems;
  EXPECT_TRUE(repository_.List(&problems).empty());
  EXPECT_THAT(problems, ElementsAre(HasSubstr("expected the digest that names the file")));
}

TEST_F(RepositoryTest, MovesKeepHistoryAndPrevious) {
  const auto a = Publish("sand", 0.1);
  const auto b = Publish("sand", 0.2);
  EXPECT_EQ(repository_.SetAlias("sand", "stable", a, "me", "first").generation, 1u);
  const auto move = repository_.SetAlias("sand", "stable", b, "you", "\"better\" \n");
  EXPECT_EQ(move.generation, 2u);
  const auto aliases = repository_.ReadAliases();
  EXPECT_EQ(aliases.generation, 2u);
  EXPECT_EQ(aliases.by_model.at("sand").at("stable"), b);
  EXPECT_EQ(aliases.by_model.at("sand").at("previous"), a);
  ASSERT_EQ(aliases.history.size(), 2u);
  EXPECT_EQ(aliases.history[1].who, "you");
  EXPECT_EQ(aliases.history[1].why, "\"better\" \n");
  EXPECT_GT(aliases.history[1].unix_s, 1e9);
}

// The shipped model may be exchanged at any time.
TEST_F(RepositoryTest, AMoveWritesNoShippedDefault) {
  const auto shipped = Ship("sand", 0.1), canary = Publish("sand", 0.2);
  repository_.SetAlias("sand", "canary", canary, "me", "");
  EXPECT_EQ(repository_.ReadStateAliases().Find("sand", "stable"), "");
  EXPECT_EQ(repository_.Resolve("sand").digest, shipped);
  std::filesystem::remove_all(dir_ / "shipped");
  std::filesystem::create_directories(dir_ / "shipped");
  const auto upgraded = Ship("sand", 0.3);
  EXPECT_EQ(repository_.Resolve("sand").digest, upgraded);
  repository_.SetAlias("sand", "stable", canary, "me", "");
  EXPECT_EQ(repository_.Resolve("sand@previous").digest, upgraded);
  EXPECT_EQ(repository_.Rollback("sand", "stable", "", "me", "").digest, upgraded);
}

// As earlier versions left it: the shipped model of then, written along with another move.
TEST_F(RepositoryTest, AShippedDefaultThatWasWrittenAlongGivesWayToTheShippedOne) {
  const auto canary = Publish("sand", 0.2), upgraded = Ship("sand", 0.3);
  const std::string gone(64, '0');
  const auto write = [&](const std::string& alias) {
    std::ofstream(dir_ / "state/models/aliases.json")
        << R"({"generation": 1, "aliases": {"sand": {"canary": ")" << canary << R"(", "stable": ")"
        << gone << R"("}}, "history": [{"model": "sand", "alias": ")" << alias
        << R"(", "digest": ")" << (alias == "stable" ? gone : canary)
        << R"(", "generation": 1, "who": "me", "why": "", "unix_s": 1.5e9}]})";
  };
  write("canary");
  EXPECT_EQ(repository_.Resolve("sand").digest, upgraded);
  write("stable");
  EXPECT_THROW(repository_.Resolve("sand"), std::out_of_range) << "somebody chose that one";
}

TEST_F(RepositoryTest, RepeatedMoveChangesNothing) {
  const auto a = Publish("sand", 0.1);
  const auto b = Publish("sand", 0.2);
  repository_.SetAlias("sand", "stable", a, "me", "first");
  repository_.SetAlias("sand", "stable", b, "me", "second");
  EXPECT_EQ(repository_.SetAlias("sand", "stable", b, "me", "again").generation, 2u);
  const auto aliases = repository_.ReadAliases();
  EXPECT_EQ(aliases.by_model.at("sand").at("previous"), a);
  EXPECT_EQ(aliases.history.size(), 2u);
}

TEST_F(RepositoryTest, RefusesUnknownDigestForeignModelAndBadAlias) {
  const auto digest = Publish("sand", 0.1);
  EXPECT_THROW(repository_.SetAlias("sand", "stable", std::string(64, 'f'), "me", ""),
               std::runtime_error);
  EXPECT_THROW(repository_.SetAlias("clay", "stable", digest, "me", ""), std::runtime_error);
  EXPECT_THROW(repository_.SetAlias("sand", "sha256", digest, "me", ""), std::runtime_error);
  EXPECT_THROW(repository_.SetAlias("sand", "../x", digest, "me", ""), std::runtime_error);
  EXPECT_EQ(repository_.ReadAliases().generation, 0u);
}

TEST_F(RepositoryTest, DamagedAliasFileIsNamedWithItsKey) {
  Publish("sand", 0.1);
  const std::string path = dir_ / "state/models/aliases.json";
  const auto what = [&](const std::string& text) -> std::string {
    std::ofstream(path) << text;
    try {
      repository_.ReadAliases();
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(what("{ truncated"), HasSubstr(path));
  EXPECT_THAT(what("{}"), HasSubstr("'generation'"));
  EXPECT_THAT(what(R"({"generation": -1, "aliases": {}, "history": []})"), HasSubstr("whole"));
  EXPECT_THAT(what(R"({"generation": 1, "aliases": {"s": {"stable": 3}}, "history": []})"),
              HasSubstr("'stable'"));
}

TEST_F(RepositoryTest, FingerprintChangesWithFilesAndAliases) {
  std::set<std::string> seen = {repository_.Fingerprint()};
  const auto digest = Publish("sand", 0.1);
  EXPECT_TRUE(seen.insert(repository_.Fingerprint()).second);
  repository_.SetAlias("sand", "stable", digest, "me", "");
  EXPECT_TRUE(seen.insert(repository_.Fingerprint()).second);
  Ship("clay", 0.4);
  EXPECT_TRUE(seen.insert(repository_.Fingerprint()).second);
  EXPECT_EQ(repository_.Fingerprint(), repository_.Fingerprint());
}

TEST_F(RepositoryTest, ConcurrentMovesAreAllKept) {
  const std::vector<std::string> digests = {Publish("sand", 0.1), Publish("sand", 0.2)};
  constexpr int kThreads = 4;
  constexpr int kMoves = 10;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      const std::string alias = "alias" + std::to_string(t);
      for (int i = 0; i < kMoves; ++i) {
        repository_.SetAlias("sand", alias, digests[i % 2], "thread", "");
      }
    });
  }
  for (auto& thread : threads) thread.join();
  const auto aliases = repository_.ReadAliases();
  EXPECT_EQ(aliases.generation, std::uint64_t{kThreads * kMoves});
  ASSERT_EQ(aliases.history.size(), std::size_t{kThreads * kMoves});
  for (std::size_t i = 0; i < aliases.history.size(); ++i) {
    EXPECT_EQ(aliases.history[i].generation, i + 1);
  }
}

TEST_F(RepositoryTest, RollbackGoesBackStepByStepAndByName) {
  const auto shipped = Ship("sand", 0.1);
  const std::vector<std::string> d = {shipped, Publish("sand", 0.2), Publish("sand", 0.3),
                                      Publish("sand", 0.4)};
  for (int i = 1; i < 4; ++i) repository_.SetAlias("sand", "stable", d[i], "me", "next");
  const auto back = [&](const std::string& to) {
    return repository_.Rollback("sand", "stable", to, "op", "worse").digest;
  };
  const auto move = repository_.Rollback("sand", "stable", "", "op", "worse");
  EXPECT_EQ(move.digest, d[2]);
  EXPECT_EQ(move.from, d[3]);
  EXPECT_EQ(move.generation, 4u);
  EXPECT_TRUE(repository_.ReadAliases().history.back().rollback) << "read back";
  EXPECT_EQ(repository_.Resolve("sand@previous").digest, d[3]);
  EXPECT_EQ(back(""), d[1]) << "not forth again";
  EXPECT_EQ(back(""), d[0]) << "the shipped one was there before any move";
  EXPECT_THAT(MessageOf([&] { back(""); }),
              HasSubstr("model: sand@stable named no model before " + d[0]));
  EXPECT_EQ(back(d[3].substr(0, 12)), d[3]);
  EXPECT_EQ(back("2"), d[2]) << "what it named at generation 2";
  EXPECT_EQ(back("2"), d[2]) << "asked again";
  EXPECT_EQ(repository_.ReadAliases().generation, 8u) << "asking again moves nothing";
  repository_.SetAlias("sand", "stable", d[3], "me", "after all");
  EXPECT_EQ(back(""), d[2]);
}

TEST_F(RepositoryTest, RollbackLeadsOnlyToWhatTheAliasNamedAndWhatIsThere) {
  const auto a = Publish("sand", 0.1), b = Publish("sand", 0.2), never = Publish("sand", 0.3);
  repository_.SetAlias("sand", "stable", a, "me", "");
  repository_.SetAlias("sand", "stable", b, "me", "");
  const auto back = [&](const std::string& alias, const std::string& to) {
    return MessageOf([&] { repository_.Rollback("sand", alias, to, "op", ""); });
  };
  EXPECT_THAT(back("stable", never), HasSubstr("named, oldest first: " + a + ", " + b));
  EXPECT_THAT(back("stable", "0"), HasSubstr("to: '0' is nothing"));
  EXPECT_THAT(back("stable", "abc"), HasSubstr("to: 'abc' is nothing"));
  EXPECT_THAT(back("canary", ""), HasSubstr("names none now"));
  EXPECT_THAT(back("stable", "9999"), HasSubstr("generation 9999 never was, expected at most 2"));
  EXPECT_THAT(MessageOf([&] { repository_.Rollback("sad", "stable", "", "op", ""); }),
              HasSubstr("no model 'sad'; known models: sand"));
  EXPECT_THAT(MessageOf([&] { repository_.Resolve("sand@canary"); }),
              HasSubstr("has no alias 'canary'; it has: previous, stable"));
  std::filesystem::remove(dir_ / ("state/models/" + a + ".model"));
  EXPECT_THAT(back("stable", ""), HasSubstr("has no readable model file"));
  EXPECT_EQ(repository_.Resolve("sand").digest, b);
}

TEST_F(RepositoryTest, HistoryIsBoundedAnAliasAtATime) {
  const std::vector<std::string> d = {Publish("sand", 0.1), Publish("sand", 0.2)};
  repository_.SetAlias("sand", "keep", d[0], "me", "rarely moved");
  for (std::size_t i = 0; i < kMovesKept + 5; ++i) {
    repository_.SetAlias("sand", "stable", d[i % 2], "me", "");
  }
  const auto aliases = repository_.ReadAliases();
  EXPECT_EQ(aliases.history.size(), kMovesKept + 1);
  EXPECT_EQ(aliases.history.front().alias, "keep");
  EXPECT_EQ(aliases.history.back().generation, aliases.generation);
  EXPECT_EQ(aliases.history.back().digest, aliases.Find("sand", "stable"));
}

TEST_F(RepositoryTest, AliasFileOfAnEarlierVersionCanBeRolledBack) {
  const auto a = Publish("sand", 0.1), b = Publish("sand", 0.2);
  const auto move = [](int generation, const std::string& digest) {
    return R"({"model": "sand", "alias": "stable", "digest": ")" + digest + R"(", "generation": )" +
           std::to_string(generation) + R"(, "who": "me", "why": "", "unix_s": 1.5e9})";
  };
  std::ofstream(dir_ / "state/models/aliases.json")
      << R"({"generation": 2, "aliases": {"sand": {"stable": ")" << b << R"(", "previous": ")" << a
      << R"("}}, "history": [)" << move(1, a) << "," << move(2, b) << "]}";
  EXPECT_EQ(repository_.ReadAliases().history[1].from, a);
  EXPECT_EQ(repository_.Rollback("sand", "stable", "", "op", "").digest, a);
  std::ofstream(dir_ / "state/models/aliases.json")  // moved once, from the shipped one
      << R"({"generation": 2, "aliases": {"sand": {"stable": ")" << b << R"(", "previous": ")" << a
      << R"("}}, "history": [)" << move(2, b) << "]}";
  EXPECT_EQ(repository_.Rollback("sand", "stable", "", "op", "").digest, a);
}

TEST_F(RepositoryTest, ListReadsAChangedFileAgain) {
  const auto a = Publish("sand", 0.1);
  EXPECT_EQ(repository_.List(nullptr).size(), 1u);
  std::ofstream(dir_ / ("state/models/" + a + ".model")) << "damaged";
  EXPECT_TRUE(repository_.List(nullptr).empty());
  EXPECT_THROW(repository_.SetAlias("sand", "stable", a, "me", ""), std::runtime_error);
  std::filesystem::remove(dir_ / ("state/models/" + a + ".model"));
  EXPECT_EQ(Publish("sand", 0.1), a);
  EXPECT_EQ(repository_.List(nullptr).size(), 1u);
}

// A process killed at any moment leaves a readable file and no lock.
TEST_F(RepositoryTest, KilledWriterLeavesAWholeAliasFile) {
  const std::vector<std::string> digests = {Publish("sand", 0.1), Publish("sand", 0.2)};
  for (int round = 0; round < 5; ++round) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      for (int i = 0;; ++i) repository_.SetAlias("sand", "stable", digests[i % 2], "child", "");
    }
    const auto before = repository_.ReadAliases().generation;
    while (repository_.ReadAliases().generation < before + 3) usleep(500);
    usleep(137 * round);
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const auto aliases = repository_.ReadAliases();
    EXPECT_EQ(aliases.history.back().generation, aliases.generation);
    EXPECT_EQ(aliases.history.size(), std::min<std::size_t>(aliases.generation, kMovesKept));
  }
  const auto last = repository_.ReadAliases();
  const auto other = last.by_model.at("sand").at("stable") == digests[0] ? digests[1] : digests[0];
  EXPECT_EQ(repository_.SetAlias("sand", "stable", other, "me", "").generation,
            last.generation + 1);
}

}  // namespace
}  // namespace grouser::server
