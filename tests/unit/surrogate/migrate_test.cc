#include "surrogate/fit/migrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>

#include "proto/records/durable_file.h"
#include "proto/records/message_json.h"
#include "proto/records/run_file.h"
#include "surrogate/fit/training_set.h"
#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/upgrade.h"
#include "tests/unit/records/temp_folder.h"

namespace grouser::surrogate {
namespace {

namespace fs = std::filesystem;
using records::ReadFileBytes;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

const std::string kEarlier = GROUSER_EARLIER "/";
const std::string kRun = "5b15eb07a0396110.run.h5";
const std::vector<std::string> kFiles = {"bekker.model", kRun, "campaign.json",
                                         "earlier.runs.json"};

/// Copies of files of model version 001 and run schema 1.
class MigrateTest : public testing::Test {
 protected:
  MigrateTest() {
    for (const std::string& name : kFiles) fs::copy(kEarlier + name, folder_ / name);
  }
  void ExpectFails(const std::string& name, const std::string& why, const std::string& out = "") {
    const std::string path = folder_ / name;
    const bool readable = fs::is_regular_file(path);
    const std::string bytes = readable ? ReadFileBytes(path) : "";
    const auto before = folder_.List();
    const Migration result = Migrate(path, out);
    EXPECT_EQ(result.result, "failed") << name;
    EXPECT_THAT(result.text, HasSubstr(why));
    if (readable) {
      EXPECT_EQ(ReadFileBytes(path), bytes);
    }
    EXPECT_THAT(folder_.List(), testing::UnorderedElementsAreArray(before)) << name;
  }
  records::TempFolder folder_;
};

TEST_F(MigrateTest, ConvertsInPlaceAndKeepsEveryByteOfTheOriginals) {
  for (const std::string& name : kFiles) {
    const Migration result = Migrate(folder_ / name, "");
    EXPECT_EQ(result.result, "converted") << result.text;
    EXPECT_THAT(result.text, HasSubstr(name + ".before"));
    EXPECT_EQ(ReadFileBytes(folder_ / (name + ".before")), ReadFileBytes(kEarlier + name));
    const std::string bytes = ReadFileBytes(folder_ / name);
    EXPECT_NE(bytes, ReadFileBytes(kEarlier + name));
    const Migration again = Migrate(folder_ / name, "");
    EXPECT_EQ(again.result, "current") << again.text;
    EXPECT_EQ(again.text, "already current");
    EXPECT_EQ(ReadFileBytes(folder_ / name), bytes);
  }
}

TEST_F(MigrateTest, AModelAnswersBitwiseAsBeforeAndNamesWhatItWas) {
  const records::LoadedModel was = ReadModel(folder_ / "bekker.model");
  const Migration result = Migrate(folder_ / "bekker.model", "");
  records::LoadedModel is = records::ReadModelFile(folder_ / "bekker.model");
  EXPECT_EQ(result.before, was.digest);
  EXPECT_EQ(result.after, is.digest);
  EXPECT_NE(is.digest, was.digest);
  EXPECT_EQ(is.version, 2);
  EXPECT_EQ(is.model.provenance().converted_from(), was.digest);
  EXPECT_THAT(MigrationText({result}),
              testing::AllOf(HasSubstr(was.digest), HasSubstr(is.digest), HasSubstr("aliases")));
  const auto old_model = MakeTestedModel(was.model), model = MakeTestedModel(is.model);
  for (const v1alpha1::GoldenVector& g : was.model.golden()) {
    for (const double factor : {0.5, 1.0, 3.0}) {
      const VelocityState motion{g.v_x_m_per_s(), factor * g.v_y_m_per_s(), g.rim_speed_m_per_s()};
      const auto a = AnswerOf(*old_model, motion, factor * g.load_n());
      const auto b = AnswerOf(*model, motion, factor * g.load_n());
      EXPECT_EQ(a.value, b.value);
      EXPECT_EQ(a.half_width, b.half_width);
      EXPECT_EQ(a.flags, b.flags);
    }
  }
  is.model.mutable_provenance()->clear_converted_from();
  EXPECT_EQ(is.model.SerializeAsString(), was.model.SerializeAsString());
}

TEST_F(MigrateTest, ARunKeepsItsRecordAndSeries) {
  const records::RunFile was = records::ReadRunFile(folder_ / kRun);
  EXPECT_EQ(was.schema, 1);
  Migrate(folder_ / kRun, "");
  const records::RunFile is = records::ReadRunFile(folder_ / kRun);
  EXPECT_EQ(is.schema, records::kRunFileSchema);
  EXPECT_EQ(records::ToJson(is.record), records::ToJson(was.record));
  EXPECT_EQ(is.series, was.series);
  EXPECT_EQ(is.record.run_id() + ".run.h5", kRun);
  EXPECT_GT(is.record.create_time().seconds(), 1'700'000'000);
}

TEST_F(MigrateTest, CampaignsKeepAllThatIsReadOfThem) {
  const TrainingSet was = ReadRuns(folder_ / "earlier.runs.json");
  Migrate(folder_ / "campaign.json", "");
  Migrate(folder_ / "earlier.runs.json", "");
  const TrainingSet is = ReadRuns(folder_ / "earlier.runs.json");
  EXPECT_EQ(is.scene.SerializeAsString(), was.scene.SerializeAsString());
  ASSERT_EQ(is.runs.size(), 1u);
  EXPECT_EQ(is.runs[0].SerializeAsString(), was.runs[0].SerializeAsString());
  v1alpha1::Campaign campaign;
  records::FromJson(ReadFileBytes(folder_ / "campaign.json"), "campaign.json", &campaign);
  EXPECT_EQ(campaign.runs(0).run_id() + ".run.h5", kRun);
}

TEST_F(MigrateTest, WritesToAFolderAndOverwritesNothing) {
  const std::string out = folder_ / "new/er";
  for (const std::string& name : kFiles) {
    EXPECT_EQ(Migrate(folder_ / name, out).result, "converted");
    EXPECT_EQ(ReadFileBytes(folder_ / name), ReadFileBytes(kEarlier + name));
    EXPECT_EQ(Migrate(out + "/" + name, folder_ / "third").result, "current");
    EXPECT_EQ(ReadFileBytes(folder_ / ("third/" + name)), ReadFileBytes(out + "/" + name));
    ExpectFails(name, "is there already", out);
    ExpectFails(name, "is there already", folder_ / ".");
  }
}

TEST_F(MigrateTest, AFileNamedByItsDigestStaysUnderItsName) {
  const std::string digest = records::ReadModelFile(folder_ / "bekker.model").digest;
  fs::rename(folder_ / "bekker.model", folder_ / (digest + ".model"));
  ExpectFails(digest + ".model", "is named by its digest");
  const Migration result = Migrate(folder_ / (digest + ".model"), folder_ / "out");
  EXPECT_EQ(result.result, "converted");
  EXPECT_EQ(records::ReadModelFile(folder_ / ("out/" + result.after + ".model")).digest,
            result.after);
}

TEST_F(MigrateTest, SaysWhatIsWrongAndLeavesTheFile) {
  const std::string model = ReadFileBytes(folder_ / "bekker.model");
  records::WriteFileDurably(folder_ / "bekker.model", model.substr(0, model.size() / 2));
  ExpectFails("bekker.model", "truncated");
  records::WriteFileDurably(folder_ / kRun, ReadFileBytes(folder_ / kRun).substr(0, 9000));
  ExpectFails(kRun, kRun);
  records::WriteFileDurably(folder_ / "campaign.json", R"({"scene": {}, "rnus": []})");
  ExpectFails("campaign.json", "rnus");
  records::WriteFileDurably(folder_ / "earlier.runs.json", "{\"scene\": ");
  ExpectFails("earlier.runs.json", "parse error");
  records::WriteFileDurably(folder_ / "x", "hello");
  ExpectFails("x", "neither a model file");
  ExpectFails("none", "cannot open");
  fs::create_directory(folder_ / "folder");
  ExpectFails("folder", "a folder");
  ASSERT_EQ(mkfifo((folder_ / "fifo.model").c_str(), 0600), 0);
  ExpectFails("fifo.model", "a FIFO");
}

TEST_F(MigrateTest, AnOriginalThatWasKeptBeforeIsNeverOverwritten) {
  records::WriteFileDurably(folder_ / "campaign.json.before", "precious");
  ExpectFails("campaign.json", "is there, with another content");
  EXPECT_EQ(ReadFileBytes(folder_ / "campaign.json.before"), "precious");
  // What a run leaves that was killed between keeping and replacing.
  fs::copy_file(folder_ / "bekker.model", folder_ / "bekker.model.before");
  EXPECT_EQ(Migrate(folder_ / "bekker.model", "").result, "converted");
}

TEST_F(MigrateTest, TheVerbEndsWith2WhereAFileCouldNotBeConverted) {
  const auto run = [&](const std::string& files) {
    return WEXITSTATUS(std::system((GROUSER_FIT " migrate " + files + " >/dev/null").c_str()));
  };
  EXPECT_EQ(run(folder_ / "bekker.model"), 0);
  EXPECT_EQ(run((folder_ / "none") + " " + (folder_ / "campaign.json")), 2);
  EXPECT_TRUE(fs::exists(folder_ / "campaign.json.before")) << "the others are converted";
}

}  // namespace
}  // namespace grouser::surrogate
