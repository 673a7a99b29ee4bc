#include "dem_offline/engine/verify/suite.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

std::vector<Case> Chosen(const Suite& suite, const SuiteOptions& options) {
  std::vector<Case> out;
  std::string names;
  for (const Case& c : suite.cases) {
    names += std::string(names.empty() ? "" : ", ") + c.name;
    if (options.only.empty() ? c.level <= options.level : options.only == c.name) {
      out.push_back(c);
    }
  }
  if (!options.only.empty() && out.empty()) {
    throw std::invalid_argument("case: " + options.only + ", expected one of " + names);
  }
  return out;
}

/// A case that a device does not take.
Rows Refused(const char* name, const char* why) {
  Rows rows(name);
  rows.Note(std::string("not run here: ") + why);
  return rows;
}

Rows RunCase(const Case& c) {
  Rows rows(c.name);
  try {
    c.run(rows);
    if (rows.rows().empty()) throw std::logic_error("the case made no row");
  } catch (const NotElsewhere& refused) {
    return Refused(c.name, refused.what());
  } catch (const std::exception& error) {
    rows.Holds("runs to its end", false, std::string("threw: ") + error.what());
  } catch (...) {
    rows.Holds("runs to its end", false, "threw something that is no std::exception");
  }
  return rows;
}

double Since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

int SuiteResult::Failed() const {
  return static_cast<int>(
      std::count_if(rows.begin(), rows.end(), [](const Row& r) { return !r.pass; }));
}

SuiteResult RunSuite(const Suite& suite, const SuiteOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<Case> cases = Chosen(suite, options);
  std::shared_ptr<gpu::Device> device;
  if (options.device != "cpu") device = gpu::OpenDevice(options.device);
  std::vector<Rows> done(cases.size(), Rows(""));
  // Long ones first, so that the threads end together; tables end with theirs.
  std::vector<std::size_t> order(cases.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = order.size() - 1 - i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return cases[a].level > cases[b].level; });
  std::atomic<std::size_t> next{0};
  std::mutex speak;
  std::size_t finished = 0;
  const auto work = [&] {
    const Placement placement(device);
    for (std::size_t k = next++; k < order.size(); k = next++) {
      const auto start = std::chrono::steady_clock::now();
      Rows rows = RunCase(cases[order[k]]);
      const bool pass =
          std::all_of(rows.rows().begin(), rows.rows().end(), [](const Row& r) { return r.pass; });
      const std::lock_guard<std::mutex> lock(speak);
      ++finished;
      if (options.progress) {
        std::fprintf(stderr, "%s %zu/%zu %s: %s, %.1f s\n", suite.name.c_str(), finished,
                     cases.size(), cases[order[k]].name, pass ? "pass" : "FAIL", Since(start));
      }
      done[order[k]] = std::move(rows);
    }
  };
  std::vector<std::thread> threads;
  for (int t = 1; t < options.threads; ++t) threads.emplace_back(work);
  work();
  for (std::thread& t : threads) t.join();
  SuiteResult out;
  for (const Rows& r : done) {
    out.rows.insert(out.rows.end(), r.rows().begin(), r.rows().end());
    out.notes.insert(out.notes.end(), r.notes().begin(), r.notes().end());
  }
  out.seconds = Since(begin);
  return out;
}

int RunAndPrint(const Suite& suite, const SuiteCommand& c, const std::string& program) {
  SuiteOptions options;
  options.level = c.full ? Level::kFull : c.quick ? Level::kQuick : Level::kDefault;
  options.only = c.only;
  options.device = c.device;
  options.threads = c.device == "cpu" ? c.threads : 1;
  options.progress = !c.quiet;
  const SuiteResult result = RunSuite(suite, options);
  std::string line = program + " " + suite.name;
  if (c.full || c.quick) line += c.full ? " --full" : " --quick";
  if (!c.only.empty()) line += " --case " + c.only;
  if (c.device != "cpu") line += " --device " + c.device;
  if (c.threads != SuiteCommand().threads) line += " --threads " + std::to_string(c.threads);
  const std::string text = c.json       ? Json(suite, result)
                           : c.markdown ? Markdown(suite, result, line + " --markdown")
                                        : Table(suite, result);
  std::fwrite(text.data(), 1, text.size(), stdout);
  std::fflush(stdout);
  return result.Failed() == 0 ? 0 : 1;
}

}  // namespace grouser::dem::verify
