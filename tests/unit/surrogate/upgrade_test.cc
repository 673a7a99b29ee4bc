#include "surrogate/model_io/upgrade.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/write_model.h"
#include "tests/unit/records/throws.h"

#pragma GCC diagnostic ignored "-Wdeprecated-declarations"

namespace grouser::surrogate {
namespace {

using testing::HasSubstr;

/// Written by grouser-fit of model version 001, its provenance cut to one run.
const std::string kModel = GROUSER_EARLIER "/bekker.model";

TEST(ReadModel, GivesAModelOfVersion001InTodaysForm) {
  const records::LoadedModel raw = records::ReadModelFile(kModel), loaded = ReadModel(kModel);
  EXPECT_EQ(raw.version, 1);
  EXPECT_EQ(loaded.digest, raw.digest) << "that of the file, which aliases name";
  EXPECT_FALSE(loaded.model.has_bekker_values());
  EXPECT_FALSE(loaded.model.has_created_unix_s());
  const BekkerParameters parameters = ReadBekker(loaded.model.bekker());
  const auto& values = raw.model.bekker_values().values();
  ASSERT_EQ(values.size(), BekkerFields().size());
  for (const BekkerField& field : BekkerFields()) {
    EXPECT_EQ(parameters.*field.member, values.at(field.name)) << field.name;
  }
  const auto& created = loaded.model.create_time();
  EXPECT_NEAR(created.nanos(), 1e9 * std::fmod(raw.model.created_unix_s(), 1), 1);
  EXPECT_EQ(created.seconds(), std::floor(raw.model.created_unix_s()));
  EXPECT_NO_THROW(MakeTestedModel(loaded.model));
}

/// What UpgradeModel says about a model of version 001 with one change.
std::string ComplaintOfUpgrade(const std::function<void(v1alpha1::Model*)>& change) {
  v1alpha1::Model model = records::ReadModelFile(kModel).model;
  change(&model);
  return MessageOf([&] { UpgradeModel(&model); });
}

TEST(UpgradeModel, RefusesByName) {
  using M = v1alpha1::Model*;
  const auto values = [](M m) { return m->mutable_bekker_values()->mutable_values(); };
  EXPECT_THAT(ComplaintOfUpgrade([&](M m) { values(m)->erase("n"); }), HasSubstr("no entry \"n\""));
  EXPECT_THAT(ComplaintOfUpgrade([&](M m) { (*values(m))["nn"] = 1; }),
              HasSubstr("unknown entry \"nn\""));
  EXPECT_THAT(ComplaintOfUpgrade([](M m) { m->mutable_bekker()->set_n(1); }),
              HasSubstr("both bekker and bekker_values"));
  for (const double seconds : {-1.0, 1e12, std::nan("")}) {
    EXPECT_THAT(ComplaintOfUpgrade([&](M m) { m->set_created_unix_s(seconds); }),
                HasSubstr("created_unix_s: "));
  }
}

// Files of before the forms and grousers: what is absent is the default.
TEST(UpgradeModel, TakesTheDefaultsOfParametersThatCameLater) {
  v1alpha1::Model model = records::ReadModelFile(kModel).model;
  for (const BekkerField& field : BekkerFields()) {
    if (field.optional) model.mutable_bekker_values()->mutable_values()->erase(field.name);
  }
  EXPECT_EQ(model.bekker_values().values().size(), 18);
  EXPECT_TRUE(UpgradeModel(&model));
  EXPECT_EQ(ReadBekker(model.bekker()).grouser_share, 0.5);
  EXPECT_FALSE(UpgradeModel(&model)) << "there is nothing left to do";
}

// It would make two models of one soil different, and a job's run another than was asked.
TEST(UpgradeModel, DropsTheBekkerNumbersOfAScene) {
  v1alpha1::Model model = records::ReadModelFile(kModel).model;
  const std::string soil = model.soil().SerializeAsString();
  ASSERT_TRUE(model.mutable_soil()->MergeFromString(std::string("\x2a\x02\x08\x01", 4)));
  ASSERT_NE(model.soil().SerializeAsString(), soil);
  UpgradeModel(&model);
  EXPECT_EQ(model.soil().SerializeAsString(), soil);
}

// The table of parameters, the message and the accessors between them agree.
TEST(BekkerMessage, HoldsEveryParameterUnderItsName) {
  BekkerParameters parameters;
  double value = 0;
  for (const BekkerField& field : BekkerFields()) parameters.*field.member = value += 0.125;
  parameters.pressure_form = kReeceForm;
  v1alpha1::Model model;
  SetBekker(parameters, &model);
  const auto* message = v1alpha1::BekkerParameters::descriptor();
  const auto* reflection = model.bekker().GetReflection();
  ASSERT_EQ(static_cast<std::size_t>(message->field_count()), BekkerFields().size());
  const BekkerParameters back = ReadBekker(model.bekker());
  for (int i = 0; i < message->field_count(); ++i) {
    const auto* wire = message->field(i);
    const BekkerField& field = BekkerFields()[static_cast<std::size_t>(i)];
    EXPECT_TRUE(wire->name() == field.name ||
                wire->name().starts_with(field.name + std::string("_")))
        << wire->name() << " for " << field.name;
    EXPECT_EQ(back.*field.member, parameters.*field.member) << field.name;
    if (field.member == &BekkerParameters::pressure_form) continue;
    EXPECT_EQ(reflection->GetDouble(model.bekker(), wire), parameters.*field.member) << field.name;
  }
}

}  // namespace
}  // namespace grouser::surrogate
