#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/sha256.h"
#include "proto/records/yaml/yaml_section.h"
#include "surrogate/calibrate/test_spec.h"
#include "surrogate/soils/csv_cells.h"

namespace grouser::surrogate {
namespace {

using enum Dimension;
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = std::numbers::pi;
constexpr QuantityField kPlate[] = {{"sinkage", kLength},    {"pressure", kPressure, true},
                                    {"force", kForce, true}, {"diameter", kLength},
                                    {"width", kLength},      {"length", kLength}};
constexpr QuantityField kPress[] = {
    {"sinkage", kLength}, {"force", kForce, true}, {"radius", kLength}, {"width", kLength}};
constexpr QuantityField kShear[] = {{"displacement", kLength},  {"rotation", kAngle},
                                    {"pressure", kPressure},    {"load", kForce},
                                    {"shear", kPressure, true}, {"force", kForce, true},
                                    {"torque", kMoment, true},  {"area", kArea},
                                    {"inner_radius", kLength},  {"outer_radius", kLength}};
constexpr QuantityField kWheel[] = {{"slip", kNone},        {"attack_angle", kAngle},
                                    {"rim_speed", kSpeed},  {"travel_speed", kSpeed},
                                    {"load", kForce},       {"f_x", kForce, true},
                                    {"f_y", kForce, true},  {"torque", kMoment, true},
                                    {"m_z", kMoment, true}, {"sinkage", kLength, true},
                                    {"radius", kLength},    {"width", kLength}};

// A CSV whose header has been read.
struct Table {
  std::string path;
  int header_line = 0;
  std::vector<std::string> header;
  std::vector<std::pair<int, std::vector<std::string>>> lines;

  [[noreturn]] void Fail(int line, const std::string& what) const {
    throw std::invalid_argument(fmt::format("{}:{}: {}", path, line, what));
  }
  int Column(const std::string& name, const std::string& place) const {
    const auto found = std::ranges::find(header, name);
    if (found == header.end()) {
      Fail(header_line,
           fmt::format("no column '{}' ({}), expected one of: {}; the nearest is '{}'", name, place,
                       fmt::join(header, ", "), records::NearestOf(name.substr(0, 100), header)));
    }
    return static_cast<int>(found - header.begin());
  }
};

Table ReadTable(const std::string& path, const std::string& text) {
  Table table{path, 0, {}, {}};
  std::istringstream stream(text);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    std::vector<std::string> cells;
    try {
      cells = CsvCells(line);
    } catch (const std::invalid_argument& error) {
      table.Fail(number, error.what());
    }
    if (cells[0].starts_with('#') || (cells.size() == 1 && cells[0].empty())) continue;
    if (table.header.empty()) {
      table.header = cells;
      table.header_line = number;
      for (auto c = cells.begin(); c != cells.end(); ++c) {
        if (std::find(cells.begin(), c, *c) != c) {
          table.Fail(number, "column '" + *c + "' stands here twice, expected each once");
        }
      }
      continue;
    }
    if (cells.size() != table.header.size()) {
      table.Fail(number, fmt::format("{} fields, expected {} as in line {}", cells.size(),
                                     table.header.size(), table.header_line));
    }
    table.lines.emplace_back(number, std::move(cells));
  }
  if (table.header.empty()) table.Fail(1, "empty, expected a header line and rows");
  return table;
}

// A test's columns in its table, ready to be read line by line.
class LineReader {
 public:
  LineReader(const TestSpec& spec, const Table& table) : spec_(spec), table_(table) {
    for (const auto& [quantity, column] : spec.columns) {
      const QuantityField& field = FindQuantity(spec.kind, quantity, spec.place);
      const int at = table.Column(column.column, "for " + quantity);
      columns_[quantity] = {at, column.sign * UnitFor(column, field, quantity).si};
      if (spec.constants.contains(quantity)) {
        throw std::invalid_argument(fmt::format(
            "{}: {} is a column and a constant, expected one of both", spec.place, quantity));
      }
    }
  }

  bool Has(const std::string& quantity) const {
    return columns_.contains(quantity) || spec_.constants.contains(quantity);
  }
  /// NaN: the cell is empty, or there is no such quantity.
  double Get(const std::string& quantity, int line, const std::vector<std::string>& cells) const {
    const auto constant = spec_.constants.find(quantity);
    if (constant != spec_.constants.end()) return constant->second;
    const auto column = columns_.find(quantity);
    if (column == columns_.end() || cells[column->second.at].empty()) return kMissing;
    const std::string& text = cells[column->second.at];
    const auto number = ParseNumber(text);
    if (!number) {
      table_.Fail(line, fmt::format("column '{}': got '{}', expected a finite number or an empty "
                                    "field",
                                    table_.header[column->second.at], text));
    }
    return *number * column->second.factor;
  }
  double SdOf(const std::string& quantity, double value, int line,
              const std::vector<std::string>& cells) const {
    const double own = std::abs(Get(quantity + "_sd", line, cells));
    if (own == 0) table_.Fail(line, quantity + "_sd: got 0, expected a positive number or nothing");
    if (!std::isnan(own)) return own;
    const auto stated = spec_.sd.find(quantity);
    if (stated == spec_.sd.end()) return kMissing;
    return stated->second.relative ? stated->second.value * std::abs(value) : stated->second.value;
  }
  const std::string& ColumnOf(const std::string& quantity) const {
    static const std::string kConstant = "constants";
    const auto column = columns_.find(quantity);
    return column == columns_.end() ? kConstant : table_.header[column->second.at];
  }

 private:
  struct Column {
    int at;
    double factor;
  };

  Unit UnitFor(const ColumnSpec& column, const QuantityField& field, const std::string& quantity) {
    const auto named = UnitOfColumn(column.column);
    const std::string expected = "expected one of the units " + UnitsOf(field.dimension);
    if (column.unit.empty()) {
      // A standard deviation stands in the unit of what it belongs to.
      const auto own = spec_.columns.find(quantity.substr(0, quantity.rfind("_sd")));
      if (!named && quantity.ends_with("_sd") && own != spec_.columns.end()) {
        return UnitFor(own->second, field, own->first);
      }
      if (named && named->dimension == field.dimension) return *named;
      if (field.dimension == kNone && !named) return {"1", kNone, 1};
      throw std::invalid_argument(
          named ? fmt::format("{}: column '{}' is in {} by its name and {} is not, {}", spec_.place,
                              column.column, named->name, quantity, expected)
                : fmt::format("{}: column '{}' for {} has no unit in its name, {}", spec_.place,
                              column.column, quantity, expected));
    }
    const auto stated = FindUnit(column.unit);
    if (!stated || stated->dimension != field.dimension) {
      throw std::invalid_argument(fmt::format("{}: unit '{}' of column '{}' for {}, {}",
                                              spec_.place, column.unit, column.column, quantity,
                                              expected));
    }
    if (named && named->dimension == stated->dimension && named->si != stated->si) {
      throw std::invalid_argument(
          fmt::format("{}: column '{}' is stated to be in {}, its name says {}: mixed units?",
                      spec_.place, column.column, stated->name, named->name));
    }
    return *stated;
  }

  const TestSpec& spec_;
  const Table& table_;
  std::map<std::string, Column> columns_;
};

// Reads the lines of one test.
class TestReader {
 public:
  TestReader(const TestSpec& spec, const Table& table, MeasuredSoil* soil)
      : spec_(spec), table_(table), reader_(spec, table), soil_(soil) {
    test_ = static_cast<int>(soil->tests.size());
  }

  void Read() {
    CheckColumns();
    MeasuredTest test{spec_.name, table_.path, "", spec_.kind, {}, spec_.counts_as};
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

  static bool Holds(const Table& table, const LineChoice& choice, int line,
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
  const Table& table_;
  LineReader reader_;
  MeasuredSoil* soil_;
  int test_ = 0, line_ = 0;
  const std::vector<std::string>* cells_ = nullptr;
  std::size_t rows_ = 0, told_ = 0, skipped_ = 0;
};

}  // namespace

const char* NameOf(TestKind kind) {
  switch (kind) {
    case TestKind::kPlate:
      return "plate";
    case TestKind::kShear:
      return "shear";
    case TestKind::kPress:
      return "press";
    case TestKind::kWheel:
      break;
  }
  return "wheel";
}

TestKind ParseKind(const std::string& word, const std::string& place) {
  for (const TestKind kind :
       {TestKind::kPlate, TestKind::kShear, TestKind::kPress, TestKind::kWheel}) {
    if (word == NameOf(kind)) return kind;
  }
  throw std::invalid_argument(
      fmt::format("{}: kind '{}', expected plate, shear, press or wheel", place, word));
}

std::span<const QuantityField> QuantitiesOf(TestKind kind) {
  switch (kind) {
    case TestKind::kPlate:
      return kPlate;
    case TestKind::kShear:
      return kShear;
    case TestKind::kPress:
      return kPress;
    case TestKind::kWheel:
      break;
  }
  return kWheel;
}

const QuantityField& FindQuantity(TestKind kind, const std::string& name,
                                  const std::string& place) {
  std::vector<std::string> names;
  for (const QuantityField& field : QuantitiesOf(kind)) {
    if (name == field.name || (field.measured && name == std::string(field.name) + "_sd")) {
      return field;
    }
    names.push_back(field.name);
  }
  throw std::invalid_argument(
      fmt::format("{}: '{}' is nothing that a {} test has, expected one of: {} (and NAME_sd); the "
                  "nearest is '{}'",
                  place, name, NameOf(kind), fmt::join(names, ", "),
                  records::NearestOf(name.substr(0, 100), names)));
}

void ReadTest(const TestSpec& spec, MeasuredSoil* soil) {
  const std::string text = records::ReadInputFile(spec.file, "a CSV of measured rows");
  const Table table = ReadTable(spec.file, text);
  TestReader(spec, table, soil).Read();
  MeasuredTest& test = soil->tests.back();
  test.file = std::filesystem::path(spec.file).filename().string();
  test.sha256 = records::Sha256OfString(text);
  const std::array<std::string, 2> file = {test.file, test.sha256};
  if (std::ranges::find(soil->files, file) == soil->files.end()) soil->files.push_back(file);
}

}  // namespace grouser::surrogate
