// sd_form from measured rows: by hand, its intervals' coverage, and as a model file has it.
#include "surrogate/fit/form_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>

#include "proto/records/model_file.h"
#include "surrogate/fit/binomial_band.h"
#include "surrogate/fit/compare.h"
#include "surrogate/fit/pair_folder.h"
#include "surrogate/fit/print.h"
#include "surrogate/model_io/form_message.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/model_parts.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::surrogate {
namespace {

using ::testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLevel = 0.9;

/// Rows whose model answers are chosen; f_x alone is measured.
struct Table {
  void Add(double slip, double degrees, double load, double measured, double model,
           double half_width) {
    v1alpha1::MeasuredPoint& p = points.emplace_back();
    p.set_slip(slip);
    p.set_attack_angle_rad(degrees * kDegree);
    p.set_load_n(load);
    for (int o = 0; o < kOutputs; ++o) p.add_value(o == kFx ? measured : kNaN);
    WheelAnswer& a = answers.emplace_back();
    a.value.fill(model);
    a.half_width.fill(half_width);
  }
  std::vector<MeasuredRow> Rows() const {
    std::vector<MeasuredRow> rows;
    for (std::size_t i = 0; i < points.size(); ++i) {
      rows.push_back({&points[i], answers[i], nullptr});
    }
    return rows;
  }
  std::vector<v1alpha1::MeasuredPoint> points;
  std::vector<WheelAnswer> answers;
};

TEST(BinomialBand, IsExact) {
  // Of 10 at 0.5: P(count <= 1) = 11/1024 < 0.025 < P(count <= 2) = 56/1024.
  const Band ten = BinomialBand(10, 0.5), hundred = BinomialBand(100, 0.9);
  EXPECT_EQ(std::pair(ten.low, ten.high), std::pair(2, 8));
  EXPECT_EQ(std::pair(hundred.low, hundred.high), std::pair(84, 95));
}

TEST(FormFit, ByRegionAtTheMiddleLoadLessTheIntervalsOwnPart) {
  Table table;
  table.Add(0.2, 0, 20, 1, 4, 1.645);       // misses 3; the interval's own sd is 1
  table.Add(0.5, 0, 40, 1, -5, 1.645 * 2);  // misses 6 at twice the load: 3, and 1
  table.Add(-1, 0, 20, -30, -10, 0);
  table.Add(0.2, 30, 20, 1, 4, 0);
  table.Add(0.4, 30, 20, 1, -2, 0);
  const FormEstimate got = EstimateForm(table.Rows(), 20, kLevel);
  const auto& straight = got.form.region[static_cast<std::size_t>(MeasuredRegion::kStraight)];
  const auto& locked = got.form.region[static_cast<std::size_t>(MeasuredRegion::kLocked)];
  EXPECT_EQ(got.rows[0][kFx], 2);
  EXPECT_NEAR(straight.sd[kFx], 3, 1e-9);           // sqrt(2/n) = 1: two rows tell it no better
  EXPECT_NEAR(straight.factor[kFx], 2.9200, 1e-4);  // Student's t, 2 degrees of freedom
  EXPECT_NEAR(locked.sd[kFx], 20, 1e-9);
  EXPECT_NEAR(locked.factor[kFx], 6.3138, 1e-4);
  EXPECT_TRUE(std::isnan(straight.sd[kTorque]));
  const auto& angled = got.form.region[static_cast<std::size_t>(MeasuredRegion::kAngled)];
  EXPECT_EQ(got.rows[1][kFx], 2);
  EXPECT_NEAR(angled.sd[kFx], 3, 1e-9);
  EXPECT_NEAR(angled.factor[kFx], 6.3138, 1e-4);  // two rows of one angle
  const auto& braking = got.form.region[static_cast<std::size_t>(MeasuredRegion::kBraking)];
  EXPECT_TRUE(std::isnan(braking.sd[kFx]) && std::isnan(braking.factor[kFx]));
  for (int k = 0; k < 6; ++k) table.Add(0.2, 0, 20, 1, 4, 1.645);
  EXPECT_NEAR(EstimateForm(table.Rows(), 20, kLevel).form.region[0].sd[kFx], std::sqrt(8), 1e-3);
}

// A rig does not hold an angle to the last digit.
TEST(FormFit, JitteredAnglesAreOne) {
  constexpr auto kAngled = static_cast<std::size_t>(MeasuredRegion::kAngled);
  Table table;
  for (const double degrees : {29.9, 30.0, 30.1, 29.2, 31.3}) {
    table.Add(0.2, degrees, 20, 1, 4, 0);
  }
  EXPECT_EQ(EstimateForm(table.Rows(), 20, kLevel).rows[kAngled][kFx], 5);
  EXPECT_NEAR(EstimateForm(table.Rows(), 20, kLevel).form.region[kAngled].factor[kFx], 6.3138,
              1e-4);  // one degree of freedom
  EXPECT_EQ(LeaveAnglesOut(table.Rows(), 20, kLevel).size(), 1u);
  table.Add(0.2, 45.2, 20, 1, 4, 0);
  table.Add(0.2, -44.8, 20, 1, 4, 0);
  EXPECT_NEAR(EstimateForm(table.Rows(), 20, kLevel).form.region[kAngled].factor[kFx], 2.9200,
              1e-4);
  EXPECT_EQ(LeaveAnglesOut(table.Rows(), 20, kLevel).size(), 2u);
}

// Share of rows inside the intervals that the other angles give, the model itself exact. Misses:
// one normal draw an angle, alike at all its rows, and one a row. Sum of their variances: 1.
double ShareInside(double of_the_angle) {
  std::mt19937_64 random(20);
  std::normal_distribution<double> normal;
  int inside = 0, rows = 0;
  for (int trial = 0; trial < 400; ++trial) {
    Table table;
    for (const double degrees : {20.0, 40.0, 60.0}) {
      const double common = std::sqrt(of_the_angle) * normal(random);
      for (const double slip : {0.6, 0.75, 0.9}) {
        table.Add(slip, degrees, 20, 0, common + std::sqrt(1 - of_the_angle) * normal(random), 0);
      }
    }
    for (const AngleLeftOut& one : LeaveAnglesOut(table.Rows(), 20, kLevel)) {
      EXPECT_EQ(one.unknown, 0);
      inside += one.inside;
      rows += one.rows;
    }
  }
  EXPECT_EQ(rows, 400 * 9);
  return static_cast<double>(inside) / rows;
}

// Nine of ten rows that were left out lie inside, however few the other angles are, where all rows
// of an angle miss alike; more of them where each row misses for itself.
TEST(FormFit, IntervalsOfAnglesLeftOutHoldAtTheirLevel) {
  EXPECT_NEAR(ShareInside(1), kLevel, 0.02);
  EXPECT_GT(ShareInside(0.5), kLevel);
  EXPECT_GT(ShareInside(0), kLevel);
}

TEST(FormFit, RowsWhoseRegionTheOthersLackAreUnknown) {
  Table table;
  table.Add(0.2, 0, 20, 1, 2, 0);
  table.Add(0.3, 0, 20, 1, 2, 0);
  table.Add(0.5, 30, 20, 1, 3, 0);
  const auto each = LeaveAnglesOut(table.Rows(), 20, kLevel);
  ASSERT_EQ(each.size(), 2u);
  EXPECT_EQ(each[0].unknown, 2);
  EXPECT_EQ(each[0].rows, 0);
  EXPECT_THAT(LeftOutText(each, kLevel), HasSubstr("unknown"));
  EXPECT_EQ(OverAngles(each)[0].unknown, 3);
}

class PairModel : public ::testing::Test {
 protected:
  v1alpha1::Model model_ = ReadModel(GROUSER_DENSE_PAIR "/hybrid.model").model;
  std::string Complaint() {
    try {
      FormErrorsOf(model_);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "accepted";
  }
};

// The measured wheel with one angle left out at a time: what is counted is inside the band.
TEST_F(PairModel, MeasuredIntervalsHoldAnglesThatWereLeftOut) {
  const auto scalar = MakeScalar(model_);
  const auto rows = MeasuredInDomain(*scalar, model_);
  ASSERT_EQ(rows.size(), 27u);
  const double middle = std::sqrt(model_.domain().load_min_n() * model_.domain().load_max_n());
  const auto all = OverAngles(LeaveAnglesOut(rows, middle, kLevel));
  ASSERT_EQ(all.size(), 3u);  // no torque
  for (const AngleLeftOut& one : all) {
    EXPECT_EQ(one.rows, 21)
        << kOutputFields[one.output].name;  // straight ahead: at 0 degrees alone
    EXPECT_EQ(one.unknown, 6);
    EXPECT_TRUE(BinomialBand(one.rows, kLevel).Has(one.inside)) << one.inside;
  }
}

// The shipped wheel in the calibrated sand: the rows that its training domain holds.
TEST(ShippedPair, MeasuredIntervalsHoldAnglesThatWereLeftOut) {
  const auto message = ReadModel(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/hybrid.model").model;
  const double middle = std::sqrt(message.domain().load_min_n() * message.domain().load_max_n());
  const auto all =
      OverAngles(LeaveAnglesOut(MeasuredInDomain(*MakeScalar(message), message), middle, kLevel));
  ASSERT_EQ(all.size(), 3u);
  for (const AngleLeftOut& one : all) {
    EXPECT_GE(one.rows, 19) << kOutputFields[one.output].name;
    EXPECT_TRUE(BinomialBand(one.rows, kLevel).Has(one.inside)) << one.inside;
  }
}

// About a pair's runs the table is the answer; at motions that no run has physics are: a rim that
// turns against the travel. The smooth CMU pair has runs of such.
TEST(ShippedPair, RunsAnswerWhereTheyAreAndPhysicsElsewhere) {
  for (const auto& [path, name, soils, unusual] : FindPairs(GROUSER_PAIRS)) {
    SCOPED_TRACE(name);
    const auto message = ReadModel(path + "/hybrid.model").model;
    const double middle = std::sqrt(message.domain().load_min_n() * message.domain().load_max_n());
    const auto share = [&](const VelocityState& v, double load) {
      return TrainedShare(message, ToCanonical(v.v_x, v.v_y, v.rim_speed), load);
    };
    for (const v1alpha1::RunSummary& run : message.provenance().runs()) {
      if (run.role() != v1alpha1::RUN_ROLE_TRAIN) continue;
      if (run.status() != v1alpha1::RUN_STATUS_STEADY) continue;
      const VelocityState v = FromSlip(run.slip(), run.attack_angle_rad(), 1);
      EXPECT_NEAR(share(v, run.load_n()), 1, 0.05) << run.run_id();
    }
    EXPECT_LT(share({0, 0, 1}, message.domain().load_min_n()), 0.6);  // slip 1
    if (name == "cmu-smooth-62.5-8mm") continue;
    for (const VelocityState& v : {VelocityState{0.5, 0, -1}, VelocityState{0.5, 0.3, -1}}) {
      EXPECT_NEAR(share(v, middle), 0, 0.02);
    }
  }
}

TEST_F(PairModel, KeepsItInTheFileByRegion) {
  SetFormError(*MakeScalar(model_), &model_);
  ASSERT_EQ(model_.form_by_region_size(), 4);
  EXPECT_EQ(model_.form_by_region(3).rows(kFx), 3u);  // a locked wheel an angle
  EXPECT_EQ(model_.form_by_region(3).rows(kTorque), 0u);
  const FormErrors form = FormErrorsOf(model_);
  EXPECT_TRUE(form.KnowsInterval(kFx) && form.KnowsInterval(kSinkage));
  EXPECT_FALSE(form.KnowsInterval(kTorque) || form.ClearsFlags());
  EXPECT_GT(form.Sd(MeasuredRegion::kLocked, kFx, 20), form.Sd(MeasuredRegion::kStraight, kFx, 20));
  EXPECT_THAT(ModelText(model_, "d"), HasSubstr("locked"));
  model_.mutable_form_by_region(1)->set_region(v1alpha1::MEASURED_REGION_LOCKED);
  EXPECT_THAT(Complaint(), HasSubstr("form_by_region[3].region"));
  model_.mutable_form_by_region(1)->set_region(v1alpha1::MEASURED_REGION_ANGLED);
  model_.mutable_form_by_region(2)->set_sd(0, -1);
  EXPECT_THAT(Complaint(), HasSubstr("form_by_region[2].sd[0]: expected"));
  model_.mutable_form_by_region(2)->mutable_sd()->RemoveLast();
  EXPECT_THAT(Complaint(), HasSubstr("5 numbers, expected 6"));
  model_.mutable_form_by_region(0)->mutable_rows()->RemoveLast();
  EXPECT_THAT(Complaint(), HasSubstr("form_by_region[0].rows: 5 numbers, expected 6"));
}

TEST_F(PairModel, FilesOfBeforeHaveOneNumberAndNoInterval) {
  model_.clear_form_by_region();
  model_.clear_sd_form();
  EXPECT_FALSE(FormErrorsOf(model_).KnowsInterval(kFx));
  for (int o = 0; o < kOutputs; ++o) model_.add_sd_form(o == kFx ? 2 : kNaN);
  const FormErrors form = FormErrorsOf(model_);
  EXPECT_EQ(form.Sd(MeasuredRegion::kBraking, kFx, 7), 2);
  EXPECT_TRUE(std::isnan(form.Sd(MeasuredRegion::kBraking, kFy, 7)));
  EXPECT_FALSE(form.KnowsInterval(kFx));
  for (int o = 0; o < kOutputs; ++o) model_.set_sd_form(o, 2);
  EXPECT_FALSE(FormErrorsOf(model_).ClearsFlags());  // no factor
  model_.set_sd_form(kMz, -1);
  EXPECT_THAT(Complaint(), HasSubstr(": sd_form[4]: expected a finite number"));
  model_.set_sd_form(kMz, INFINITY);
  EXPECT_THAT(Complaint(), HasSubstr("sd_form[4]: expected"));
  model_.mutable_sd_form()->RemoveLast();
  EXPECT_THAT(Complaint(), HasSubstr("sd_form: 5 numbers, expected 6"));
}

TEST_F(PairModel, ComparedAnewItSaysWhenAndByWhat) {
  const std::string base = ::testing::TempDir() + "/base.model";
  model_.mutable_provenance()->set_grouser_version("0.0.1");
  model_.mutable_create_time()->set_seconds(1);
  records::WriteModelFile(base, model_);
  const std::string table = ::testing::TempDir() + "/compared.json";
  std::ofstream(table) << R"({"table": "t.csv", "rows": [{"slip": 0.2, "attack_angle_deg": 0.0,)"
                       << R"( "load_n": 20.5, "measured": {"f_x": {"value": 1.0,)"
                       << R"( "standard_error": 0.3}}}]})";
  CompareRequest asked;
  asked.model = base;
  asked.measured = table;
  asked.with_form = true;
  const v1alpha1::Model made = CompareMeasured(asked).with_form;
  EXPECT_EQ(made.provenance().grouser_version(), GROUSER_VERSION);
  EXPECT_GT(made.create_time().seconds(), 1'700'000'000);
}

TEST(MeasuredRows, AreReadFromWhatValidateWrote) {
  const std::string path = ::testing::TempDir() + "/rows.json";
  const auto write = [&](const std::string& rows) {
    std::ofstream(path) << "{\"table\": \"t.csv\", \"rows\": [" << rows << "]}";
  };
  const std::string good =
      R"({"slip": -0.2, "attack_angle_deg": 60.0, "load_n": 20.55, "measured": {"f_x": {"value": -20.81,)"
      R"( "standard_error": 0.3}, "sinkage": {"value": 0.0418, "standard_error": null}}})";
  write(good);
  const auto points = ReadMeasured(path, {0.0625});
  ASSERT_EQ(points.size(), 1u);
  EXPECT_DOUBLE_EQ(points[0].value(kFx), -20.81);
  EXPECT_DOUBLE_EQ(points[0].sd(kFx), 0.3);
  EXPECT_TRUE(std::isnan(points[0].value(kFy)) && std::isnan(points[0].sd(kSinkage)));
  EXPECT_NEAR(points[0].attack_angle_rad(), std::numbers::pi / 3, 1e-12);
  const auto complaint = [&](const std::string& rows) {
    write(rows);
    try {
      ReadMeasured(path, {0.0625});
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(
      complaint(good + R"(, {"slip": 0.1, "attack_angle_deg": 0, "load_n": -1, "measured": {}})"),
      HasSubstr("rows.json: row 2: load_n"));
  EXPECT_THAT(complaint("{}"), HasSubstr("expected rows.json of grouser validate"));
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace grouser::surrogate
