// A planner with Grouser in its own process: MPPI for a skid-steer rover on
// soft ground, over a stretch with a turn. About a million wheel states a
// cycle. See --help.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>

#include "grouser/model.h"
#include "path.h"
#include "planner.h"
#include "rover.h"

namespace {

constexpr char kHelp[] =
    "Usage: mppi_example [OPTIONS]\n"
    "Drives a rover along a path with a turn, from 0.15 m beside it. The rover\n"
    "that is driven obeys the same model as the plans (no noise, no wind).\n"
    "  --model FILE    model file (default: the installed one)\n"
    "  --wheels N      4 or 6 (default 4)\n"
    "  --rollouts K    noisy copies of the plan (default 5000)\n"
    "  --horizon H     steps of 0.2 s in a plan (default 50)\n"
    "  --cycles N      times the plan is improved (default 25)\n"
    "  --advance N     steps that are driven between two cycles (default 5)\n"
    "  --threads N     (default: one a core)\n"
    "  --seed N        (default 1)\n"
    "  --small         512 rollouts of 20 steps: a second or two\n"
    "Exit code: 0 ok, 1 failed, 2 bad usage.\n";

struct Options {
  std::filesystem::path model = DEFAULT_MODEL;
  int wheels = 4, cycles = 25, advance = 5;
  Settings planner;
};

[[noreturn]] void UsageError(const std::string& what) {
  std::fprintf(stderr, "mppi_example: %s; see --help\n", what.c_str());
  std::exit(2);
}

int Positive(const std::string& option, const std::string& text) {
  char* end = nullptr;
  const long value = std::strtol(text.c_str(), &end, 10);
  if (text.empty() || *end != '\0' || value < 1 || value > 10'000'000) {
    UsageError(option + ": '" + text + "', expected a positive number");
  }
  return static_cast<int>(value);
}

Options Parse(int argc, char** argv) {
  Options options;
  options.planner.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    if (option == "--help") {
      std::fputs(kHelp, stdout);
      std::exit(0);
    }
    if (option == "--small") {
      options.planner.rollouts = 512;
      options.planner.horizon = 20;
      continue;
    }
    if (i + 1 == argc) UsageError(option + ": unknown, or its value is missing");
    const std::string value = argv[++i];
    if (option == "--model") {
      options.model = value;
    } else if (option == "--wheels") {
      options.wheels = Positive(option, value);
      if (options.wheels != 4 && options.wheels != 6) UsageError("--wheels: expected 4 or 6");
    } else if (option == "--rollouts") {
      options.planner.rollouts = Positive(option, value);
    } else if (option == "--horizon") {
      options.planner.horizon = Positive(option, value);
    } else if (option == "--cycles") {
      options.cycles = Positive(option, value);
    } else if (option == "--advance") {
      options.advance = Positive(option, value);
    } else if (option == "--threads") {
      options.planner.threads = Positive(option, value);
    } else if (option == "--seed") {
      options.planner.seed = static_cast<std::uint64_t>(Positive(option, value));
    } else {
      UsageError("unknown option '" + option + "'");
    }
  }
  return options;
}

void Print(int cycle, const CycleReport& report, const Control& control, double off_path) {
  const double states = static_cast<double>(report.states);
  std::printf(
      "cycle %2d: %.0f states in %.1f ms (%.3g states/s, %.0f ns/state, %.0f %% in the model), "
      "plan cost %.4f, mean %.4f, best %.4f, samples %.1f, left %.4f right %.4f m/s, "
      "%.3f m off the path\n",
      cycle, states, 1e3 * report.seconds, states / report.seconds, 1e9 * report.seconds / states,
      100 * report.model_share, report.plan_cost, report.mean_cost, report.best_cost,
      report.samples, control.left, control.right, off_path);
  std::fflush(stdout);
}

int Drive(Options options) {
  const grouser::Model model = grouser::Model::Open(options.model);
  const Rover rover = Rover::For(model, options.wheels);
  const Path path;
  Settings& settings = options.planner;
  settings.cruise_rim = model.domain().speed_m_per_s;
  settings.goal_speed = 0.5 * settings.cruise_rim;
  std::printf("model %s (%s) of wheel %s on %s; rover of %d wheels, %.1f kg; %d thread(s)\n",
              model.name().c_str(), model.kind().c_str(), model.wheel().c_str(),
              model.soil().c_str(), rover.wheels, rover.mass, settings.threads);

  Planner planner(model, rover, path, settings);
  WheelBatch plant(rover, model, 1);
  Body body;
  body.y = -0.15;
  body.u = settings.goal_speed;
  double first = 0, last = 0;
  for (int cycle = 1; cycle <= options.cycles; ++cycle) {
    const CycleReport report = planner.Improve(body);
    Print(cycle, report, planner.now(), path.Off(path.Nearest(body.x, body.y), body.x, body.y));
    if (cycle == 1) first = report.plan_cost;
    last = report.plan_cost;
    for (int step = 0; step < options.advance; ++step) {
      StepReport driven;
      plant.Step(settings.step_s, {&planner.now(), 1}, {&body, 1}, {&driven, 1});
      if (driven.failed) throw std::runtime_error("the rover is stuck: the soil does not carry it");
      planner.Advance();
    }
  }
  std::printf("plan cost: first %.4f, last %.4f; rover at x %.3f y %.3f m, yaw %.3f rad\n", first,
              last, body.x, body.y, body.yaw);
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  return Drive(Parse(argc, argv));
} catch (const std::exception& error) {
  std::fprintf(stderr, "mppi_example: %s\n", error.what());
  return 1;
}
