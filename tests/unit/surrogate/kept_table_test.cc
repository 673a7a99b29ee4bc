// Tables that are kept between processes: the key says what a table was made of, and the bits are
// those that would be made.
#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "proto/records/sha256.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/upgrade.h"
#include "tests/unit/surrogate/tabulated.h"

namespace grouser::surrogate {
namespace {

/// Tables by key, as a cache would keep them.
struct Shelf {
  std::map<std::string, std::string> kept;
  int found = 0;

  KeptTable Of() {
    return {[this](const std::string& key, std::size_t size) {
              const auto it = kept.find(key);
              const bool is = it != kept.end() && it->second.size() == size;
              found += is;
              return is ? it->second : "";
            },
            [this](const std::string& key, const std::string& bytes) { kept[key] = bytes; }};
  }
};

/// All numbers of all answers, as bytes.
std::string BitsOf(const WheelModel& model) {
  StateBatch b = testing::Anywhere(3000, 5);
  b.Set(0, 0, 0, 0, 24);
  b.Set(1, 0.1, 0, 0.12, 0);
  model.Evaluate(b.In(), b.Out());
  std::string bits;
  const auto add = [&](const auto& numbers) {
    bits.append(reinterpret_cast<const char*>(numbers.data()),
                numbers.size() * sizeof(numbers.front()));
  };
  for (const auto& of_output : b.part) {
    for (const auto& part : of_output) add(part);
  }
  add(b.flags);
  return bits;
}

v1alpha1::Model WithSpeed() {
  return ReadModel(GROUSER_PAIRS "/atv-20x10-lugged-20mm/hybrid.model").model;
}

TEST(KeptTable, AnswersBitByBitAsAFreshOne) {
  for (const v1alpha1::Model& message : {testing::SmallMessage(), WithSpeed()}) {
    Shelf shelf;
    const auto made = MakeModel(message, shelf.Of());
    ASSERT_EQ(shelf.kept.size(), 1u);
    ASSERT_EQ(shelf.found, 0);
    const auto taken = MakeModel(message, shelf.Of());
    EXPECT_EQ(shelf.found, 1);
    const std::string fresh = BitsOf(*MakeModel(message));
    EXPECT_TRUE(fresh == BitsOf(*made));
    EXPECT_TRUE(fresh == BitsOf(*taken));
    std::string& bytes = shelf.kept.begin()->second;  // where it differs, so do the answers
    for (std::size_t i = 2; i < bytes.size(); i += 32) bytes[i] ^= 1;
    EXPECT_FALSE(fresh == BitsOf(*MakeModel(message, shelf.Of())));
  }
}

TEST(KeptTable, AnythingInTheMessageChangesTheKey) {
  Shelf shelf;
  v1alpha1::Model message = testing::SmallMessage();
  MakeModel(message, shelf.Of());
  message.set_name("other");
  MakeModel(message, shelf.Of());
  message.mutable_domain()->set_load_max_n(message.domain().load_max_n() * 1.01);
  MakeModel(message, shelf.Of());
  EXPECT_EQ(shelf.kept.size(), 3u);
  EXPECT_EQ(shelf.found, 0);
}

TEST(KeptTable, OfAnotherSizeIsRefused) {
  HybridModel model = MakeHybrid(testing::SmallMessage());
  const std::string bytes = testing::Small().TableBytes();
  EXPECT_EQ(bytes.size(), model.TableSize());
  EXPECT_THROW(model.TakeTable(bytes + "x"), std::invalid_argument);
  EXPECT_THROW(model.TakeTable(""), std::invalid_argument);
  EXPECT_NO_THROW(model.TakeTable(bytes));
}

TEST(KeptTable, OfALawAloneThereIsNone) {
  v1alpha1::Model law = testing::SmallMessage();
  law.clear_residual();
  law.set_kind(v1alpha1::MODEL_KIND_BEKKER);
  EXPECT_EQ(MakeHybrid(law).TableSize(), 0u);
}

// Another digest means that tables kept by earlier programs are not what this one makes: raise
// HybridModel::kTableVersion, and put version and digests here. On a C library or processor that
// rounds otherwise they say nothing (where a sine differs in its last bit).
TEST(KeptTable, ChangesWithItsVersionAlone) {
#if !defined(__x86_64__) || !defined(__GLIBC__)
  GTEST_SKIP() << "digests of another platform";
#else
  if (!__builtin_cpu_supports("fma")) GTEST_SKIP() << "digests of processors with FMA";
  EXPECT_EQ(HybridModel::kTableVersion, 2);
  HybridModel model = MakeHybrid(WithSpeed());
  model.Tabulate();
  EXPECT_EQ(records::Sha256OfString(testing::Small().TableBytes()),
            "67b4f85ec8e1fc6bb823e5ee4c82f0d4b1e84fc6395eaa469c64b5ba35cec188");
  EXPECT_EQ(records::Sha256OfString(model.TableBytes()),
            "7dad28a791b005a8d81bfc4911ecdd16de96018299aaad57e0b484d05fe6692b");
#endif
}

}  // namespace
}  // namespace grouser::surrogate
