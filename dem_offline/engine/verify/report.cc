// The table of a suite, for people, programs and docs/.
#include <algorithm>
#include <array>

#include "dem_offline/engine/core/json.h"
#include "dem_offline/engine/verify/suite.h"

namespace grouser::dem::verify {
namespace {

using Cells = std::vector<std::string>;

bool IsTorture(const Suite& suite) { return suite.name == "torture"; }

Cells Head(const Suite& suite) {
  if (IsTorture(suite)) return {"case", "criterion", "got", "pass", "seconds"};
  return {"case", "quantity", "expected", "source", "got", "tolerance", "pass", "seconds"};
}

Cells Line(const Suite& suite, const Row& r) {
  const std::string pass = r.pass ? "yes" : "NO", seconds = Format("%.2f", r.seconds);
  if (IsTorture(suite)) return {r.name, r.quantity, r.got.Words(), pass, seconds};
  return {r.name, r.quantity, r.expected.Words(), r.source, r.got.Words(), r.tolerance,
          pass,   seconds};
}

void Put(const char* key, const Value& v, JsonObject* out) {
  v.text.empty() ? out->Number(key, v.number) : out->Text(key, v.text);
}

std::string Verdict(const SuiteResult& result) {
  return Format("%zu rows, %d failed, %.0f s", result.rows.size(), result.Failed(), result.seconds);
}

}  // namespace

std::string Table(const Suite& suite, const SuiteResult& result) {
  std::vector<Cells> lines = {Head(suite)};
  for (const Row& r : result.rows) lines.push_back(Line(suite, r));
  std::vector<std::size_t> width(lines[0].size(), 0);
  for (const Cells& line : lines) {
    for (std::size_t k = 0; k < line.size(); ++k) width[k] = std::max(width[k], line[k].size());
  }
  std::string out;
  for (const Cells& line : lines) {
    std::string text;
    for (std::size_t k = 0; k < line.size(); ++k) {
      text += line[k] + std::string(width[k] - line[k].size() + 2, ' ');
    }
    out += text.substr(0, text.find_last_not_of(' ') + 1) + "\n";
  }
  for (const std::string& note : result.notes) out += "note: " + note + "\n";
  return out + Verdict(result) + "\n";
}

std::string Json(const Suite& suite, const SuiteResult& result) {
  const bool torture = IsTorture(suite);
  std::string out;
  for (const Row& r : result.rows) {
    JsonObject row;
    row.Text("case", r.name).Text(torture ? "criterion" : "quantity", r.quantity);
    if (!torture) Put("expected", r.expected, &row);
    if (!torture) row.Text("source", r.source);
    Put("got", r.got, &row);
    if (!torture) row.Text("tolerance", r.tolerance);
    row.Flag("pass", r.pass).Number("seconds", r.seconds);
    out += (out.empty() ? "\n " : ",\n ") + row.Done();
  }
  return "[" + out + "\n]\n";
}

std::string Markdown(const Suite& suite, const SuiteResult& result, const std::string& command) {
  std::string out = suite.about + "\n\nMade by `" + command + "`: " + Verdict(result) + ".\n\n";
  const auto add = [&](const Cells& cells) {
    out += "|";
    for (std::string text : cells) {
      for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) {
        text.insert(at, "\\");
      }
      out += " " + text + " |";
    }
    out += "\n";
  };
  add(Head(suite));
  add(Cells(Head(suite).size(), "---"));
  for (const Row& r : result.rows) add(Line(suite, r));
  if (!result.notes.empty()) out += "\n";
  for (const std::string& note : result.notes) out += "- " + note + "\n";
  return out;
}

}  // namespace grouser::dem::verify
