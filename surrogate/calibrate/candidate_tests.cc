#include "surrogate/calibrate/candidate_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace grouser::surrogate {
namespace {

std::string Listed(const std::set<double>& values, double unit) {
  std::vector<std::string> texts;
  for (const double v : values) texts.push_back(fmt::format("{:.3g}", v / unit));
  if (texts.size() > 4) return fmt::format("{} to {}", texts.front(), texts.back());
  std::string text = texts.front();
  for (std::size_t i = 1; i < texts.size(); ++i) {
    text += (i + 1 == texts.size() ? " and " : ", ") + texts[i];
  }
  return text;
}

Candidate Plate(const std::string& text, double width, double depth) {
  Candidate c{text, {}, {}};
  c.test.kind = TestKind::kPlate;
  for (int i = 1; i <= 10; ++i) {
    Observation at;
    at.width = width;
    at.sinkage = depth * i / 10;
    c.rows.push_back(at);
  }
  return c;
}

Candidate Shear(const std::string& text, const std::vector<double>& pressures, double travel) {
  Candidate c{text, {}, {}};
  c.test.kind = TestKind::kShear;
  for (const double pressure : pressures) {
    for (int i = 1; i <= 10; ++i) {
      Observation at;
      at.pressure = pressure;
      at.displacement = travel * i / 10;
      c.rows.push_back(at);
    }
  }
  return c;
}

Candidate Wheel(const std::string& text, const Made& made, const std::vector<double>& slips,
                double angle) {
  Candidate c{text, *made.wheel, {}};
  c.test.kind = TestKind::kWheel;
  for (const double slip : slips) {
    for (const Output o : kMeasurable) {
      Observation at;
      at.output = o;
      at.motion = FromSlip(slip, angle, 1);
      at.load = made.load;
      c.rows.push_back(at);
    }
  }
  return c;
}

}  // namespace

Made MadeOf(const MeasuredSoil& soil) {
  Made made;
  std::set<std::pair<int, int>> states;
  for (const Observation& at : soil.observations) {
    if (at.held_out) continue;
    const MeasuredTest& test = soil.tests[at.test];
    switch (test.kind) {
      case TestKind::kPlate:
        made.widths.insert(at.width);
        made.depth = std::max(made.depth, at.sinkage);
        break;
      case TestKind::kShear:
        made.pressures.insert(at.pressure);
        made.displacement = std::max(made.displacement, at.displacement);
        ++made.shears;
        break;
      case TestKind::kPress:
        made.wheel = &test;
        made.load = std::max(made.load, at.value);
        ++made.presses;
        break;
      case TestKind::kWheel:
        made.wheel = &test;
        made.load = at.load;
        states.insert({at.test, at.line});
    }
  }
  made.wheels = static_cast<int>(states.size());
  return made;
}

std::string TestsMade(const Made& made) {
  std::vector<std::string> parts;
  if (!made.widths.empty()) {
    parts.push_back(made.widths.size() == 1
                        ? fmt::format("plates of one width (b = {} mm)", Listed(made.widths, 1e-3))
                        : fmt::format("plates of b = {} mm", Listed(made.widths, 1e-3)));
  }
  if (made.shears > 0) {
    parts.push_back(
        made.pressures.size() == 1
            ? fmt::format("shear tests at one pressure ({} kPa)", Listed(made.pressures, 1e3))
            : fmt::format("shear tests at {} kPa", Listed(made.pressures, 1e3)));
  }
  if (made.presses > 0) parts.push_back("a wheel pressed down");
  if (made.wheels > 0) {
    parts.push_back(fmt::format("{} wheel state{}", made.wheels, made.wheels == 1 ? "" : "s"));
  }
  std::string text = parts.empty() ? "the tests" : parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) {
    text += (i + 1 == parts.size() ? " and " : ", ") + parts[i];
  }
  return text;
}

std::vector<Candidate> CandidatesFor(const SoilFit& fit, const Made& made) {
  const BekkerParameters p = fit.Parameters();
  const double width = fit.law->reference_width();
  const double depth = made.depth > 0 ? made.depth : 2 * fit.law->reference_sinkage();
  const double pressure = std::exp(fit.x[kLogPressure]);
  const double narrow = made.widths.empty() ? width : *made.widths.begin();
  const double wide = made.widths.empty() ? width : *made.widths.rbegin();
  const double travel = 5 * p.shear_modulus;
  const auto kpa = [](double value) { return fmt::format("{:.2g} kPa", 1e-3 * value); };
  const auto mm = [](double value) { return fmt::format("{:.2g} mm", 1e3 * value); };
  std::vector<Candidate> all;
  all.push_back(Plate("a plate of width b = " + mm(2 * wide), 2 * wide, depth));
  all.push_back(Plate("a plate of width b = " + mm(narrow / 2), narrow / 2, depth));
  if (!made.widths.empty()) {
    all.push_back(Plate("the same plate to a sinkage of " + mm(2 * depth), wide, 2 * depth));
  }
  if (made.pressures.size() == 1) {
    const double own = std::max(*made.pressures.begin(), 500.0);
    all.push_back(Shear("a shear ring at " + kpa(own / 4) + " besides", {own / 4}, travel));
    all.push_back(Shear("a shear ring at " + kpa(4 * own) + " besides", {4 * own}, travel));
  } else {
    all.push_back(Shear(
        "a shear ring at " + kpa(pressure / 4) + ", " + kpa(pressure) + " and " + kpa(4 * pressure),
        {pressure / 4, pressure, 4 * pressure}, travel));
  }
  if (made.wheel != nullptr && made.load > 0) {
    constexpr double kSkew = std::numbers::pi / 6;
    all.push_back(
        Wheel("the wheel driven at slips 0.1, 0.3 and 0.6, with torque", made, {0.1, 0.3, 0.6}, 0));
    all.push_back(
        Wheel("the wheel braked at slips -0.2 and -0.5, with torque", made, {-0.2, -0.5}, 0));
    all.push_back(
        Wheel("the wheel at 30 deg of attack angle and slips -0.2, 0 and 0.3, with torque", made,
              {-0.2, 0, 0.3}, kSkew));
  }
  return all;
}

}  // namespace grouser::surrogate
