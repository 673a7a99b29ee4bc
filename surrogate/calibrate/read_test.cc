#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/sha256.h"
#include "surrogate/calibrate/measured_rows.h"
#include "surrogate/calibrate/test_spec.h"

namespace grouser::surrogate {
namespace {

constexpr double kPi = std::numbers::pi;

// Reads the lines of one test.
class TestReader {
 public:
  TestReader(const TestSpec& spec, const CsvTable& table, MeasuredSoil* soil)
      : spec_(spec), table_(table), reader_(spec, table), soil_(soil) {
    test_ = static_cast<int>(soil->tests.size());
  }

  void Read() {
    CheckColumns();
    MeasuredTest test{
        spec_.name, table_.path, "", spec_.kind, {}, spec_.counts_as, reader_.Has("diameter")};
    for (const auto& [line, cells] : table_.lines) {
      if (!Matches(cells)) continue;
      ++rows_;
      line_ = line;
      cells_ = &cells;
      ReadLine(&test);
    }
    if (rows_ == 0) {
      std::string wanted = spec_.where.empty() ? "rows below the header" : "rows with";
      for (const auto& [column, text] : spec_.where) wanted += " " + column + " = " + text;
      table_.Fail(table_.header_line, fmt::format("{}: no rows, expected {}", spec_.name, wanted));
    }
    if (told_ == 0) {
      table_.Fail(table_.header_line,
                  spec_.name +
                      ": no row tells anything, expected a positive "
                      "sinkage or displacement and a measured number in at least one");
    }
    if (skipped_ > 0) {
      soil_->notes.push_back(fmt::format(
          "{}: {} of {} rows have no {} or measure nothing: left out", spec_.name, skipped_, rows_,
          spec_.kind == TestKind::kShear ? "displacement > 0" : "sinkage > 0"));
    }
    soil_->tests.push_back(test);
  }

 private:
  void CheckColumns() const {
    const auto need = [&](std::initializer_list<const char*> any, const char* expected) {
      if (std::ranges::any_of(any, [&](const char* q) { return reader_.Has(q); })) return;
      throw std::invalid_argument(fmt::format("{}: {}: a {} test has no {}, expected {}",
                                              spec_.place, spec_.name, NameOf(spec_.kind),
                                              *any.begin(), expected));
    };
    switch (spec_.kind) {
      case TestKind::kPlate:
        need({"sinkage"}, "a column of it");
        need({"pressure", "force"}, "a column of pressure or of force");
        need({"diameter", "width"}, "the plate's diameter, or its width and length");
        if (!reader_.Has("pressure") && !reader_.Has("diameter"))
          need({"length"}, "the plate's length");
        return;
      case TestKind::kPress:
        for (const char* q : {"sinkage", "force", "radius", "width"}) need({q}, "it");
        return;
      case TestKind::kShear:
        need({"displacement", "rotation"}, "displacement, or rotation of a ring");
        need({"pressure", "load"}, "the normal pressure, or the load and the area");
        need({"shear", "force", "torque"}, "shear (stress), force with area, or torque of a ring");
        return;
      case TestKind::kWheel:
        for (const char* q : {"load", "radius", "width"}) need({q}, "it");
        need({"slip", "rim_speed"}, "slip, or rim_speed and travel_speed");
        if (!reader_.Has("slip")) need({"travel_speed"}, "it beside the rim speed");
        need({"f_x", "f_y", "torque", "m_z", "sinkage"}, "one measured output at least");
    }
  }

  static bool Holds(const CsvTable& table, const LineChoice& choice, int line,
                    const std::vector<std::string>& cells) {
    if (choice.all || choice.lines.contains(line)) return true;
    if (choice.texts.empty()) return false;
    return std::ranges::all_of(choice.texts, [&](const auto& entry) {
      const std::string& cell = cells[table.Column(entry.first, "to choose rows")];
      return std::ranges::any_of(entry.second, [&](const std::string& text) {
        const auto a = ParseNumber(cell), b = ParseNumber(text);
        return cell == text || (a && b && *a == *b);
      });
    });
  }

  bool Matches(const std::vector<std::string>& cells) const {
    LineChoice choice;
    for (const auto& [column, text] : spec_.where) choice.texts[column] = {text};
    return spec_.where.empty() || Holds(table_, choice, 0, cells);
  }

  double Get(const char* quantity) const { return reader_.Get(quantity, line_, *cells_); }
  [[noreturn]] void FailAt(const char* quantity, const char* expected) const {
    const double value = Get(quantity);
    const std::string unit = SiUnit(FindQuantity(spec_.kind, quantity, "").dimension);
    table_.Fail(line_,
                fmt::format("{}: got {} (column '{}'), expected {}", quantity,
                            std::isnan(value) ? "nothing" : fmt::format("{:g} {}", value, unit),
                            reader_.ColumnOf(quantity), expected));
  }
  double Positive(const char* quantity) const {
    if (!(Get(quantity) > 0)) FailAt(quantity, "a positive number");
    return Get(quantity);
  }
  double NotNegative(const char* quantity) const {
    if (!(Get(quantity) >= 0)) FailAt(quantity, "a number not below 0");
    return Get(quantity);
  }
  /// A measured number may be missing.
  double Measured(const char* quantity) const {
    return std::isnan(Get(quantity)) ? Get(quantity) : NotNegative(quantity);
  }

  // `scale` turns the measured number into the observation's.
  void Add(Observation at, const char* quantity, double scale) {
    const double value = Get(quantity);
    if (std::isnan(value)) return;
    at.test = test_;
    at.line = line_;
    at.held_out = spec_.fitted ? !Holds(table_, *spec_.fitted, line_, *cells_)
                               : Holds(table_, spec_.held_out, line_, *cells_);
    at.value = scale * value;
    at.sd = std::abs(scale) * reader_.SdOf(quantity, value, line_, *cells_);
    soil_->observations.push_back(at);
    ++told_;
  }

  void ReadLine(MeasuredTest* test) {
    const std::size_t before = told_;
    switch (spec_.kind) {
      case TestKind::kPlate:
        ReadPlate();
        break;
      case TestKind::kPress:
        ReadPress(test);
        break;
      case TestKind::kShear:
        ReadShear();
        break;
      case TestKind::kWheel:
        ReadWheel(test);
        break;
    }
    if (told_ == before) ++skipped_;
  }

  void CheckSinkage(double sinkage, double size, const char* of) const {
    constexpr double kMost = 10;
    if (!(sinkage > kMost * size)) return;  // a missing one is neither
    table_.Fail(line_, fmt::format("sinkage {:g} m is more than {:g} times the {} ({:g} m): column "
                                   "'{}' in another unit?",
                                   sinkage, kMost, of, size, reader_.ColumnOf("sinkage")));
  }

  void ReadPlate() {
    Observation at;
    at.sinkage = Get("sinkage");
    const bool disc = reader_.Has("diameter");
    const double first = Positive(disc ? "diameter" : "width");
    const double second = !disc && reader_.Has("length") ? Positive("length") : first;
    at.width = disc ? first / 2 : std::min(first, second);
    if (!(at.sinkage > 0)) return;
    CheckSinkage(at.sinkage, 2 * at.width, "plate");
    if (reader_.Has("pressure")) {
      if (Measured("pressure") > 0) Add(at, "pressure", 1);
    } else {
      if (Measured("force") > 0)
        Add(at, "force", 1 / (disc ? kPi / 4 * first * first : first * second));
    }
  }

  void ReadPress(MeasuredTest* test) {
    TakeWheel(test);
    Observation at;
    at.sinkage = Get("sinkage");
    if (!(at.sinkage > 0)) return;
    if (at.sinkage > kMostSinkage * test->wheel.radius_m) {
      table_.Fail(line_, fmt::format("sinkage {:g} m, expected at most {:g} radii of the wheel",
                                     at.sinkage, kMostSinkage));
    }
    if (Measured("force") > 0) Add(at, "force", 1);
  }

  void ReadShear() {
    Observation at;
    const bool ring = reader_.Has("outer_radius");
    const double inner = ring && reader_.Has("inner_radius") ? Get("inner_radius") : 0;
    const double outer = ring ? Positive("outer_radius") : 0;
    if (ring && !(inner >= 0 && inner < outer)) {
      table_.Fail(line_, fmt::format("inner_radius {:g} m, expected 0 to outer_radius {:g} m",
                                     inner, outer));
    }
    const double cubes = std::pow(outer, 3) - std::pow(inner, 3);
    const double squares = outer * outer - inner * inner;
    const auto area = [&] { return ring ? kPi * squares : Positive("area"); };
    at.displacement = reader_.Has("displacement")
                          ? Get("displacement")
                          : Get("rotation") * (ring ? 2.0 / 3 * cubes / squares : kMissing);
    at.pressure = reader_.Has("pressure") ? NotNegative("pressure") : NotNegative("load") / area();
    if (!(at.displacement > 0)) return;
    if (reader_.Has("shear")) {
      Measured("shear");
      Add(at, "shear", 1);
    } else if (reader_.Has("force")) {
      Measured("force");
      Add(at, "force", 1 / area());
    } else {
      if (!ring) Positive("outer_radius");
      Measured("torque");
      Add(at, "torque", 3 / (2 * kPi * cubes));
    }
  }

  void TakeWheel(MeasuredTest* test) {
    const WheelGeometry wheel{Positive("radius"), Positive("width")};
    if (test->wheel.radius_m == 0) test->wheel = wheel;
    if (wheel.radius_m != test->wheel.radius_m || wheel.width_m != test->wheel.width_m) {
      table_.Fail(line_, spec_.name +
                             ": another wheel than in the rows before, expected one wheel "
                             "a test");
    }
  }

  void ReadWheel(MeasuredTest* test) {
    TakeWheel(test);
    Observation at;
    at.load = Positive("load");
    at.attack_angle = reader_.Has("attack_angle") ? Get("attack_angle") : 0;
    if (reader_.Has("slip")) {
      at.motion = FromSlip(Get("slip"), at.attack_angle, 1);
    } else {
      const double travel = Get("travel_speed");
      at.motion = {travel * std::cos(at.attack_angle), travel * std::sin(at.attack_angle),
                   Get("rim_speed")};
    }
    const auto& v = at.motion;
    if (!std::isfinite(v.v_x + v.v_y + v.rim_speed)) {
      table_.Fail(line_,
                  "no motion: slip or speeds, expected a slip that this attack angle allows, "
                  "or both speeds");
    }
    at.slip = ToSlip(v.v_x, v.v_y, v.rim_speed).slip;
    for (const Output o : kPredicted) {
      at.output = o;
      if (o == kSinkage) CheckSinkage(Get("sinkage"), test->wheel.radius_m, "wheel's radius");
      Add(at, kOutputFields[o].name, 1);
    }
  }

  const TestSpec& spec_;
  const CsvTable& table_;
  MeasuredRows reader_;
  MeasuredSoil* soil_;
  int test_ = 0, line_ = 0;
  const std::vector<std::string>* cells_ = nullptr;
  std::size_t rows_ = 0, told_ = 0, skipped_ = 0;
};

}  // namespace

void ReadTest(const TestSpec& spec, MeasuredSoil* soil) {
  const std::string text = records::ReadInputFile(spec.file, "a CSV of measured rows");
  const CsvTable table = ReadCsvTable(spec.file, text);
  const TestSpec whole = spec.by_name ? WithNamedColumns(spec, table) : spec;
  TestReader(whole, table, soil).Read();
  MeasuredTest& test = soil->tests.back();
  test.file = std::filesystem::path(spec.file).filename().string();
  test.sha256 = records::Sha256OfString(text);
  const std::array<std::string, 2> file = {test.file, test.sha256};
  if (std::ranges::find(soil->files, file) == soil->files.end()) soil->files.push_back(file);
}

}  // namespace grouser::surrogate
