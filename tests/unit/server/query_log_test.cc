// The file of logged queries: its form, rotation, what a kill and damage leave; the queue before
// it.
#include "server/query/log/query_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <thread>
#include <vector>

#include "server/query/log/query_log_reader.h"
#include "tests/unit/refusal.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser::server {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using End = QueryLogReader::End;

v1alpha1::QueryLogHeader Header() {
  v1alpha1::QueryLogHeader header;
  header.mutable_server()->set_version("9.9");
  return header;
}

v1alpha1::EvaluateWheelsRequest RequestOf(std::uint64_t sequence, int states = 3) {
  v1alpha1::EvaluateWheelsRequest request;
  request.set_sequence(sequence);
  for (int i = 0; i < states; ++i) request.mutable_states()->add_load_n(20 + i);
  return request;
}

v1alpha1::EvaluateWheelsResponse ResponseOf(std::uint64_t sequence) {
  v1alpha1::EvaluateWheelsResponse response;
  response.set_sequence(sequence);
  response.set_model("sand@sha256:" + std::string(64, 'a'));
  for (const double value : {1.0, -0.0, 0.1}) {
    response.mutable_responses()->mutable_f_x()->add_value(value);
  }
  return response;
}

std::string BytesOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// A record as the queue hands it over.
std::vector<std::uint8_t> Framed(std::uint64_t sequence) {
  v1alpha1::LoggedQuery query;
  *query.mutable_request() = RequestOf(sequence);
  *query.mutable_response() = ResponseOf(sequence);
  std::vector<std::uint8_t> framed(kFrameBytes + query.ByteSizeLong());
  query.SerializeToArray(framed.data() + kFrameBytes,
                         static_cast<int>(framed.size() - kFrameBytes));
  return framed;
}

struct Content {
  std::vector<std::uint64_t> sequences;
  End end;
  std::string problem;
};
Content ContentOf(const std::string& path) {
  QueryLogReader reader(path);
  EXPECT_EQ(reader.header().server().version(), "9.9");
  Content content;
  v1alpha1::LoggedQuery query;
  while (reader.Next(&query)) {
    EXPECT_EQ(query.request().SerializeAsString(),
              RequestOf(query.request().sequence()).SerializeAsString());
    EXPECT_EQ(query.response().SerializeAsString(),
              ResponseOf(query.request().sequence()).SerializeAsString());
    content.sequences.push_back(query.request().sequence());
  }
  EXPECT_FALSE(reader.Next(&query)) << "the end stays the end";
  content.end = reader.end();
  content.problem = reader.problem();
  return content;
}

/// Runs it where no file may have more bytes.
void WithFilesOf(rlim_t most, const std::function<void()>& run) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{most, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  EXPECT_NO_THROW(run());
  ::setrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, handler);
}

class QueryLogTest : public ::testing::Test {
 protected:
  QueryLogOptions Options(std::uint64_t max_bytes = 1'000'000, int files = 5) const {
    return {path_, max_bytes, files};
  }
  /// Appends records of these numbers and ends the file well.
  void Write(std::uint64_t from, std::uint64_t to, const QueryLogOptions& options) {
    QueryLogFile file(options, Header());
    for (std::uint64_t i = from; i < to; ++i) {
      auto framed = Framed(i);
      file.Append(framed);
    }
    file.Flush();
    EXPECT_EQ(file.records(), to - from);
  }

  testing::TempDir dir_;
  std::string path_ = dir_ / "queries";
};

TEST_F(QueryLogTest, GivesBackWhatWasLoggedAndIsTheOwnersAlone) {
  Write(0, 3, Options());
  const Content content = ContentOf(path_);
  EXPECT_EQ(content.sequences, (std::vector<std::uint64_t>{0, 1, 2}));
  EXPECT_EQ(content.end, End::kWhole);
  EXPECT_EQ(content.problem, "");
  for (const std::string& name : {path_, path_ + ".lock"}) {
    struct stat info {};
    ASSERT_EQ(::stat(name.c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777u, 0600u) << name;
  }
}

TEST_F(QueryLogTest, NoLockIsMadeElsewhereNorForAForeignFile) {
  fs::create_symlink(dir_ / "elsewhere", path_ + ".lock");
  EXPECT_THAT(Refusal([this] { QueryLogFile(Options(), Header()); }), HasSubstr(path_ + ".lock"));
  EXPECT_FALSE(fs::exists(dir_ / "elsewhere"));
  fs::remove(path_ + ".lock");
  WriteBytes(path_, "my thesis");
  EXPECT_THROW(QueryLogFile(Options(), Header()), QueryLogRefused);
  EXPECT_FALSE(fs::exists(path_ + ".lock"));
}

TEST_F(QueryLogTest, AFileThatIsCutAnywhereGivesItsWholeRecords) {
  Write(0, 4, Options());
  const std::string whole = BytesOf(path_), cut = dir_ / "cut";
  std::size_t before = 0;
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    WriteBytes(cut, whole.substr(0, size));
    if (size <= kQueryLogMagic.size() + kFrameBytes) {
      EXPECT_THROW(QueryLogReader{cut}, std::runtime_error) << size;
      continue;
    }
    try {
      const Content content = ContentOf(cut);
      EXPECT_GE(content.sequences.size(), before);
      before = content.sequences.size();
      EXPECT_NE(content.end, End::kDamaged) << size;
      EXPECT_EQ(content.problem.empty(), content.end == End::kWhole);
    } catch (const std::runtime_error& e) {  // within the header
      EXPECT_EQ(before, 0u) << size << ": " << e.what();
    }
  }
  EXPECT_EQ(before, 4u);
}

TEST_F(QueryLogTest, AByteThatChangedIsNeverReadAsAnotherQuery) {
  Write(0, 3, Options());
  const std::string whole = BytesOf(path_), damaged = dir_ / "damaged";
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    WriteBytes(damaged, bytes);
    try {
      const Content content = ContentOf(damaged);  // what it gives is as it was logged
      EXPECT_LT(content.sequences.size(), 3u) << at;
      EXPECT_NE(content.end, End::kWhole) << at;
      EXPECT_THAT(content.problem, AllOf(HasSubstr(damaged), HasSubstr(": byte ")));
    } catch (const std::runtime_error&) {  // magic or header
    }
  }
}

TEST_F(QueryLogTest, OldFilesGoByNumberAndTheOldestGoes) {
  const std::uint64_t record = Framed(0).size();
  const QueryLogOptions options = Options(10 * record, 3);
  Write(0, 100, options);
  std::vector<std::uint64_t> kept;
  for (const char* ending : {".2", ".1", ""}) {
    const std::string name = path_ + ending;
    const auto part = ContentOf(name).sequences;
    kept.insert(kept.end(), part.begin(), part.end());
    EXPECT_LE(fs::file_size(name), options.max_bytes) << name;
  }
  EXPECT_FALSE(fs::exists(path_ + ".3"));
  ASSERT_GE(kept.size(), 18u);
  for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(kept[i], 100 - kept.size() + i);

  // One alone is begun anew.
  const testing::TempDir other;
  path_ = other / "one";
  Write(0, 15, Options(10 * record, 1));
  EXPECT_EQ(ContentOf(path_).sequences.back(), 14u);
  EXPECT_EQ(std::distance(fs::directory_iterator(other.path()), {}), 2) << "the file and its lock";
}

TEST_F(QueryLogTest, ANewStartKeepsWhatIsThere) {
  Write(0, 2, Options());
  const std::string whole = BytesOf(path_);
  WriteBytes(path_, whole + whole.substr(kQueryLogMagic.size(), kFrameBytes + 3));  // half a record
  Write(2, 4, Options());
  EXPECT_EQ(ContentOf(path_ + ".1").sequences, (std::vector<std::uint64_t>{0, 1}));
  EXPECT_EQ(ContentOf(path_ + ".1").end, End::kCutOff);
  EXPECT_EQ(ContentOf(path_).sequences, (std::vector<std::uint64_t>{2, 3}));
  // Starts without a query push nothing out.
  for (int i = 0; i < 10; ++i) Write(0, 0, Options());
  EXPECT_EQ(ContentOf(path_ + ".1").sequences, (std::vector<std::uint64_t>{2, 3}));
  EXPECT_EQ(ContentOf(path_ + ".2").sequences, (std::vector<std::uint64_t>{0, 1}));
  EXPECT_FALSE(fs::exists(path_ + ".3"));
}

TEST_F(QueryLogTest, QueriesBehindADamagedHeaderAreKept) {
  Write(0, 3, Options());
  const std::string whole = BytesOf(path_);
  const std::size_t header_end = whole.size() - 3 * Framed(0).size();
  for (std::size_t at = kQueryLogMagic.size(); at < header_end; ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    WriteBytes(path_, bytes);
    Write(7, 8, Options());
    ASSERT_TRUE(fs::exists(path_ + ".1")) << at;
    EXPECT_EQ(BytesOf(path_ + ".1"), bytes) << at;
    EXPECT_EQ(ContentOf(path_).sequences, std::vector<std::uint64_t>{7});
  }
}

TEST_F(QueryLogTest, WhatAPowerCutLeavesOfAFileEndsNoStart) {
  Write(0, 0, Options());
  const std::string header = BytesOf(path_);
  for (const std::string& bytes :
       {std::string(), header.substr(0, 5), header.substr(0, kQueryLogMagic.size() + kFrameBytes),
        header, std::string(9, '\0'), std::string(10'000, '\0')}) {
    WriteBytes(path_, bytes);
    Write(0, 2, Options());
    EXPECT_EQ(ContentOf(path_).sequences.size(), 2u);
    EXPECT_FALSE(fs::exists(path_ + ".1")) << bytes.size() << ": it held no query";
  }
  WriteBytes(path_, header.substr(0, header.size() - 1));
  Write(0, 2, Options());
  EXPECT_TRUE(fs::exists(path_ + ".1")) << "it may hold some";
  WriteBytes(path_, std::string(10'000, '\0') + "thesis");
  EXPECT_THROW(QueryLogFile(Options(), Header()), QueryLogRefused);
}

TEST_F(QueryLogTest, EachFileSaysWhenItWasBegun) {
  const auto now = [] { return static_cast<std::int64_t>(std::time(nullptr)); };
  const std::int64_t before = now();
  Write(0, 15, Options(10 * Framed(0).size()));
  std::vector<std::int64_t> times = {before};
  for (const char* ending : {".1", ""}) {
    times.push_back(QueryLogReader(path_ + ending).header().open_time().seconds());
  }
  times.push_back(now());
  for (std::size_t i = 1; i < times.size(); ++i) EXPECT_GE(times[i], times[i - 1]) << i;
}

TEST_F(QueryLogTest, ALogThatCannotBeBegunIsNoneAndQueriesAreCounted) {
  WithFilesOf(10, [this] {
    QueryLog log(Options(), Header());
    for (int i = 0; i < 3; ++i) log.Offer(Transport::kUnary, RequestOf(i), ResponseOf(i));
    EXPECT_EQ(log.dropped(), 3u);
    EXPECT_EQ(log.written(), 0u);
    MetricPage page;
    log.AddTo(&page);
    EXPECT_THAT(page.Text(), HasSubstr("grouser_query_log_writing 0"));
  });
  Write(0, 1, Options());
  EXPECT_FALSE(fs::exists(path_ + ".1")) << "the failed start left no query";
  WriteBytes(path_, "my thesis");
  EXPECT_THROW(QueryLog(Options(), Header()), QueryLogRefused);
}

TEST_F(QueryLogTest, WhatIsNoQueryLogIsRefusedAndStaysAsItIs) {
  const auto refusal = [this] { return Refusal([this] { QueryLogFile(Options(), Header()); }); };
  for (const std::string& name : {path_, path_ + ".1", path_ + ".4"}) {
    WriteBytes(name, "my thesis");
    EXPECT_THAT(refusal(), HasSubstr(name + ": is no query log of Grouser"));
    EXPECT_EQ(BytesOf(name), "my thesis");
    fs::remove(name);
    fs::create_directory(name);
    EXPECT_THAT(refusal(), HasSubstr(name + ": is no query log"));
    fs::remove(name);
    ASSERT_EQ(::mkfifo(name.c_str(), 0600), 0);
    EXPECT_THAT(refusal(), HasSubstr(name + ": is no query log"));
    fs::remove(name);
    fs::create_symlink(dir_ / "elsewhere", name);
    EXPECT_THAT(refusal(), HasSubstr(name + ": is no query log"));
    fs::remove(name);
  }
  EXPECT_THAT(Refusal([this] {
                QueryLogFile({dir_ / "none/queries", 1'000'000, 5}, Header());
              }),
              HasSubstr("none/queries"));
  const QueryLogFile first(Options(), Header());
  EXPECT_THAT(refusal(), HasSubstr("is written by another process"));

  for (const std::string bytes : {"", "my thesis", "grouser-query-log/2\n and more of it"}) {
    WriteBytes(dir_ / "foreign", bytes);
    EXPECT_THAT(Refusal([this] { QueryLogReader(dir_ / "foreign"); }),
                HasSubstr("foreign: is no query log, expected"));
  }
  EXPECT_THAT(Refusal([this] { QueryLogReader(dir_ / "missing"); }), HasSubstr("missing"));
  EXPECT_THAT(Refusal([this] { QueryLogReader(dir_.path()); }), HasSubstr(dir_.path()));
}

TEST_F(QueryLogTest, AFullDeviceKeepsTheWholeRecords) {
  QueryLogFile file(Options(), Header());
  auto framed = Framed(0);
  file.Append(framed);
  file.Flush();
  // The next write fails half way.
  WithFilesOf(fs::file_size(path_) + framed.size() / 2, [&] {
    file.Append(framed);
    EXPECT_THROW(file.Flush(), std::runtime_error);
  });
  EXPECT_EQ(file.records(), 1u);
  const Content content = ContentOf(path_);
  EXPECT_EQ(content.sequences.size(), 1u);
  EXPECT_EQ(content.end, End::kWhole) << content.problem;
}

TEST_F(QueryLogTest, ManyThreadsOfferAndEachQueryIsWrittenOrCounted) {
  constexpr std::uint64_t kThreads = 4, kEach = 4000;
  std::uint64_t written = 0;
  {
    QueryLog log(Options(100'000'000), Header());
    std::vector<std::jthread> threads;
    for (std::uint64_t t = 0; t < kThreads; ++t) {
      threads.emplace_back([&log, t] {
        for (std::uint64_t i = 0; i < kEach; ++i) {
          const std::uint64_t sequence = t * kEach + i;
          log.Offer(Transport::kStream, RequestOf(sequence), ResponseOf(sequence));
        }
      });
    }
    threads.clear();
    const auto all = [&log] { return log.written() + log.dropped(); };
    for (int wait = 0; wait < 6000 && all() < kThreads * kEach; ++wait) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_EQ(all(), kThreads * kEach);
    written = log.written();
    EXPECT_GT(written, 0u) << "an empty queue takes the first ones";
  }
  auto sequences = ContentOf(path_).sequences;
  EXPECT_EQ(sequences.size(), written);
  std::ranges::sort(sequences);
  EXPECT_EQ(std::ranges::adjacent_find(sequences), sequences.end()) << "none twice";
}

TEST_F(QueryLogTest, WhatWaitsIsWrittenAtTheEndAndTooMuchIsDropped) {
  {
    QueryLog log(Options(), Header());
    log.Offer(Transport::kUnary, RequestOf(7), ResponseOf(7));
  }
  EXPECT_EQ(ContentOf(path_).sequences, std::vector<std::uint64_t>{7});
  QueryLogReader reader(path_);
  v1alpha1::LoggedQuery query;
  ASSERT_TRUE(reader.Next(&query));
  EXPECT_EQ(query.transport(), v1alpha1::QUERY_TRANSPORT_UNARY);
  EXPECT_GT(query.time().seconds(), 1'700'000'000);

  QueryLogOptions little = Options();
  little.most_waiting_bytes = 1;  // one query at a time
  QueryLog log(little, Header());
  std::uint64_t offered = 0;
  for (; log.dropped() == 0 && offered < 1'000'000; ++offered) {
    log.Offer(Transport::kUnary, RequestOf(offered), ResponseOf(offered));
  }
  EXPECT_EQ(log.dropped(), 1u);
  EXPECT_GE(offered, 2u) << "the first one fits";
}

}  // namespace
}  // namespace grouser::server
