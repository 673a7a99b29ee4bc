#include "dem_offline/engine/verify/rows.h"

#include <cstdarg>
#include <cstdio>
#include <utility>

namespace grouser::dem::verify {

std::string Format(const char* format, ...) {
  char buffer[1024];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof(buffer), format, arguments);
  va_end(arguments);
  return buffer;
}

Mean MeanOf(const std::vector<double>& runs) {
  const auto n = static_cast<double>(runs.size());
  Mean m;
  for (const double v : runs) m.value += v / n;
  for (const double v : runs) m.error += (v - m.value) * (v - m.value);
  m.error = std::sqrt(m.error / (n * (n - 1)));
  return m;
}

std::string Value::Words() const {
  if (!text.empty()) return text;
  return std::isnan(number) ? "" : Format("%.6g", number);
}

Rows::Rows(std::string name) : name_(std::move(name)), last_(std::chrono::steady_clock::now()) {}

void Rows::Add(Row row) {
  const auto now = std::chrono::steady_clock::now();
  row.name = name_;
  row.seconds = std::chrono::duration<double>(now - last_).count();
  last_ = now;
  // A number that is not one never passes, and says so.
  if (row.got.text.empty() && !std::isfinite(row.got.number)) {
    row.got.text = "not finite";
    row.pass = false;
  }
  rows_.push_back(std::move(row));
}

void Rows::Relative(const std::string& quantity, double expected, double got, double share,
                    const std::string& source) {
  const bool pass = std::abs(got - expected) <= share * std::abs(expected);
  Add({"", quantity, expected, source, got, Format("%g %%", 100 * share), pass, 0});
}

void Rows::Absolute(const std::string& quantity, double expected, double got, double tolerance,
                    const std::string& source) {
  const bool pass = std::abs(got - expected) <= tolerance;
  Add({"", quantity, expected, source, got, Format("+- %g", tolerance), pass, 0});
}

void Rows::AtMost(const std::string& quantity, double limit, double got,
                  const std::string& source) {
  Add({"", quantity, limit, source, got, "at most", got <= limit, 0});
}

void Rows::AtLeast(const std::string& quantity, double limit, double got,
                   const std::string& source) {
  Add({"", quantity, limit, source, got, "at least", got >= limit, 0});
}

void Rows::Holds(const std::string& criterion, bool pass, Value got) {
  Add({"", criterion, {}, "", std::move(got), "", pass, 0});
}

}  // namespace grouser::dem::verify
