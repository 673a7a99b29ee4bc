// What grouser::Model refuses: spans of the wrong size, bad files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "grouser/model.h"
#include "proto/records/model_file.h"
#include "tests/unit/in_process/batch.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/records/throws.h"

namespace grouser {
namespace {

using testing::AllOf;
using testing::Each;
using testing::HasSubstr;
using testing::StartsWith;

// Every span in turn, too long and too short: refused, and nothing written.
TEST(Model, RefusesSpansOfAnotherSizeAndTouchesNothing) {
  const Model model = Model::Open(kSmall);
  constexpr std::size_t n = 8;
  Batch batch = MakeBatch(n);
  std::vector<double> wrong(n + 1, kUntouched);
  std::vector<std::uint32_t> wrong_flags(n + 1, 77u);
  const auto expect_refused = [&](const States& in, const Answers& out, const std::string& name) {
    EXPECT_FALSE(model.Evaluate(in, out)) << name;
    EXPECT_THAT(Model::SizeProblem(in, out), StartsWith(name + ": "));
    EXPECT_TRUE(batch.Untouched()) << name;
    EXPECT_THAT(wrong, Each(kUntouched)) << name;
  };
  const auto change = [&](auto make, const std::string& name) {
    for (const std::size_t size : {n - 1, n + 1}) {
      States in = batch.states();
      Answers out = batch.answers();
      make(in, out, size);
      expect_refused(in, out, name);
    }
  };
  change([&](States& in, Answers&, std::size_t s) { in.v_x = {wrong.data(), s}; }, "v_x");
  change([&](States& in, Answers&, std::size_t s) { in.v_y = {wrong.data(), s}; }, "v_y");
  change(
      [&](States& in, Answers&, std::size_t s) {
        in.rim_speed = {wrong.data(), s};
      },
      "rim_speed");
  change(
      [&](States&, Answers& out, std::size_t s) {
        out.flags = {wrong_flags.data(), s};
      },
      "flags");
  change([&](States&, Answers& out, std::size_t s) { out.slip = {wrong.data(), s}; }, "slip");
  change(
      [&](States&, Answers& out, std::size_t s) {
        out.attack_angle = {wrong.data(), s};
      },
      "attack_angle");
  const std::pair<const char*, std::span<double> OutputSpans::*> fields[] = {
      {"value", &OutputSpans::value},       {"sd_fit", &OutputSpans::sd_fit},
      {"sd_patch", &OutputSpans::sd_patch}, {"low", &OutputSpans::low},
      {"high", &OutputSpans::high},         {"d_v_x", &OutputSpans::d_v_x},
      {"d_v_y", &OutputSpans::d_v_y},       {"d_rim_speed", &OutputSpans::d_rim_speed},
      {"d_load", &OutputSpans::d_load}};
  for (std::size_t o = 0; o < kOutputs; ++o) {
    for (const auto& [name, field] : fields) {
      const auto member = field;
      change(
          [&](States&, Answers& out, std::size_t s) {
            out.output[o].*member = {wrong.data(), s};
          },
          "output[" + std::to_string(o) + "]." + name);
    }
  }
  Answers no_flags = batch.answers();
  no_flags.flags = {};
  expect_refused(batch.states(), no_flags, "flags");
  EXPECT_EQ(Model::SizeProblem(batch.states(), batch.answers()), "");
}

TEST(Model, RefusesAfterItWasMovedFrom) {
  Model model = Model::Open(kSmall);
  Model other = std::move(model);
  Batch batch = MakeBatch(5);
  // NOLINTBEGIN(bugprone-use-after-move,clang-analyzer-cplusplus.Move): that is what is tested
  EXPECT_FALSE(model.Evaluate(batch.states(), batch.answers()));
  EXPECT_TRUE(batch.Untouched());
  const Answer none = model.Evaluate(State{0.1, 0, 0.1, 20});
  // NOLINTEND(bugprone-use-after-move,clang-analyzer-cplusplus.Move)
  EXPECT_EQ(none.flags, kInvalid);
  EXPECT_TRUE(std::isnan(none.output[kFx].value) && std::isnan(none.output[kFx].d_load));
  EXPECT_TRUE(other.Evaluate(batch.states(), batch.answers()));
  model = std::move(other);
  EXPECT_EQ(model.name(), "cmu-smooth-62.5");
}

std::string OpenComplaint(const std::string& file) {
  return MessageOf([&] { Model::Open(file); });
}

TEST(Model, SaysWhichFileIsBadAndWhy) {
  const records::TempFolder folder;
  EXPECT_THROW(Model::Open(folder / "none.model"), std::runtime_error);
  EXPECT_THAT(OpenComplaint(folder / "none.model"),
              AllOf(StartsWith(folder / "none.model"), HasSubstr("No such file")));
  ASSERT_EQ(mkfifo((folder / "fifo.model").c_str(), 0600), 0);
  EXPECT_THAT(OpenComplaint(folder / "fifo.model"), HasSubstr("a FIFO"));
  std::ofstream(folder / "text.model") << "hello";
  EXPECT_THAT(OpenComplaint(folder / "text.model"),
              AllOf(StartsWith(folder / "text.model"), HasSubstr("not a Grouser model file")));
  std::ifstream shipped(kSmall, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(shipped), {});
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  std::ofstream(folder / "bit.model", std::ios::binary) << bytes;
  EXPECT_THAT(OpenComplaint(folder / "bit.model"),
              AllOf(StartsWith(folder / "bit.model"), HasSubstr("SHA-256")));
  // Well-formed, but its content is not: the loader names the field, Open the file.
  v1alpha1::Model message = records::ReadModelFile(kSmall).model;
  message.mutable_golden(0)->set_value(0, 1e6);
  records::WriteModelFile(folder / "golden.model", message);
  EXPECT_THROW(Model::Open(folder / "golden.model"), std::runtime_error);
  EXPECT_THAT(OpenComplaint(folder / "golden.model"),
              AllOf(StartsWith(folder / "golden.model"), HasSubstr("golden[0]")));
}

// sd_form by region, as the file says it, and its interval; room for one end is enough.
TEST(Model, TellsWhatIsKnownOfMeasurements) {
  const records::TempFolder folder;
  v1alpha1::Model message = records::ReadModelFile(kSmall).model;
  const double middle = std::sqrt(message.domain().load_min_n() * message.domain().load_max_n());
  message.clear_form_by_region();
  v1alpha1::FormError* form = message.add_form_by_region();
  form->set_region(v1alpha1::MEASURED_REGION_STRAIGHT);
  for (std::size_t o = 0; o < kOutputs; ++o) {
    form->add_rows(o == kFx ? 5 : 0);
    form->add_sd(o == kFx ? 2 : kNaN);
    form->add_factor(o == kFx ? 3 : kNaN);
  }
  records::WriteModelFile(folder / "form.model", message);
  const Model model = Model::Open(folder / "form.model");
  const Answer straight = model.Evaluate(State{0.08, 0, 0.1, middle});
  const OutputAnswer& f_x = straight.output[kFx];
  EXPECT_NEAR(f_x.sd_form, 2, 1e-9);
  EXPECT_NEAR(f_x.measured_high - f_x.value, std::hypot(f_x.high - f_x.value, 6), 1e-6);
  EXPECT_NEAR(f_x.measured_low + f_x.measured_high, f_x.low + f_x.high, 1e-6);
  EXPECT_TRUE(std::isnan(straight.output[kTorque].sd_form));
  EXPECT_TRUE(straight.flags & kFormUnknown);
  EXPECT_TRUE(std::isnan(model.Evaluate(State{0.05, 0.05, 0.1, middle}).output[kFx].measured_low));
  Batch batch = MakeBatch(200);
  Answers low;
  low.flags = batch.flags;
  low.output[kFx].measured_low = batch.out[kFx][0];
  ASSERT_TRUE(model.Evaluate(batch.states(), low));
  for (std::size_t i = 0; i < 200; ++i) {
    const State one{batch.in[0][i], batch.in[1][i], batch.in[2][i], batch.in[3][i]};
    const double expected = model.Evaluate(one).output[kFx].measured_low,
                 got = batch.out[kFx][0][i];
    EXPECT_TRUE(std::isnan(expected) ? std::isnan(got) : std::fabs(got - expected) < 1e-9) << i;
  }
  low.output[kFx].measured_low = low.output[kFx].measured_low.first(3);
  EXPECT_FALSE(model.Evaluate(batch.states(), low));
  EXPECT_THAT(Model::SizeProblem(batch.states(), low), HasSubstr("output[0].measured_low: 3"));
}

}  // namespace
}  // namespace grouser
