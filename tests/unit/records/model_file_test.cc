#include "proto/records/model_file.h"

#include <gtest/gtest.h>

#include <limits>

#include "proto/records/durable_file.h"
#include "proto/records/sha256.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/records/throws.h"

namespace grouser::records {
namespace {

using ::testing::HasSubstr;

v1alpha1::Model SomeModel() {
  v1alpha1::Model model;
  model.set_name("sand-wheel");
  model.mutable_bekker()->set_n(1.1);
  model.add_sd_form(std::numeric_limits<double>::quiet_NaN());
  return model;
}

TEST(ModelFile, RoundTrip) {
  const TempFolder folder;
  const std::string digest = WriteModelFile(folder / "m", SomeModel());
  const LoadedModel loaded = ReadModelFile(folder / "m");
  EXPECT_EQ(loaded.digest, digest);
  EXPECT_EQ(digest.size(), 64u);
  EXPECT_EQ(loaded.model.SerializeAsString().size(), SomeModel().SerializeAsString().size());
  EXPECT_EQ(loaded.model.bekker().n(), 1.1);
  EXPECT_EQ(WriteModelFile(folder / "again", loaded.model), digest);
}

// Programs that know version 002 alone would add to the physics what is a share of the answer.
TEST(ModelFile, AHybridWithAShareHasAVersionOfItsOwn) {
  const TempFolder folder;
  v1alpha1::Model model = SomeModel();
  const auto written = [&] {
    WriteModelFile(folder / "m", model);
    return ReadModelFile(folder / "m").version;
  };
  EXPECT_EQ(written(), 2);
  for (int channel = 0; channel < 7; ++channel) model.mutable_residual()->add_coefficients();
  model.mutable_residual()->mutable_coefficients(0)->add_values(0.5);
  EXPECT_EQ(written(), 2);
  model.mutable_residual()->mutable_coefficients(2)->add_values(1);
  EXPECT_EQ(written(), 3);
  EXPECT_EQ(ReadFileBytes(folder / "m").substr(13, 3), "003");
  model.set_kind(v1alpha1::MODEL_KIND_LOOKUP);  // its table is all of the answer, as ever
  EXPECT_EQ(written(), 2);
}

TEST(ModelFile, EveryTruncationIsRefusedWithThePath) {
  const TempFolder folder;
  WriteModelFile(folder / "m", SomeModel());
  const std::string bytes = ReadFileBytes(folder / "m");
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    WriteFileDurably(folder / "cut", bytes.substr(0, size));
    ASSERT_THAT(MessageOf([&] { ReadModelFile(folder / "cut"); }), HasSubstr(folder / "cut"))
        << size;
  }
}

TEST(ModelFile, ForeignFlippedAndNewerFilesAreRefused) {
  const TempFolder folder;
  WriteModelFile(folder / "m", SomeModel());
  const std::string bytes = ReadFileBytes(folder / "m");
  WriteFileDurably(folder / "x", "PK\x03\x04 some zip file that is long enough to hold a header");
  EXPECT_THAT(MessageOf([&] { ReadModelFile(folder / "x"); }),
              HasSubstr("not a Grouser model file"));
  std::string flipped = bytes;
  flipped.back() ^= 1;
  WriteFileDurably(folder / "x", flipped);
  EXPECT_THAT(MessageOf([&] { ReadModelFile(folder / "x"); }), HasSubstr("corrupted"));
  std::string newer = bytes;
  newer[15] = '9';
  WriteFileDurably(folder / "x", newer);
  EXPECT_THAT(MessageOf([&] { ReadModelFile(folder / "x"); }),
              HasSubstr("expected one up to '003'"));
  WriteFileDurably(folder / "x", bytes + "more");
  EXPECT_THAT(MessageOf([&] { ReadModelFile(folder / "x"); }), HasSubstr("extended"));
  EXPECT_THAT(MessageOf([&] { ReadModelFile(folder / "none"); }), HasSubstr("none: cannot open"));
}

}  // namespace
}  // namespace grouser::records
