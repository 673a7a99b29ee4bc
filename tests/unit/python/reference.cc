// The in-process library's own answers, for the tests and the benchmark of the Python package.
//   python_reference model FILE IN OUT      IN: v_x, v_y, rim_speed, load, n float64 each
//   python_reference vehicle FILE IN OUT    IN: v_x, yaw_rate
//   python_reference time FILE IN           IN as of model; at each line on stdin evaluates 20
//                                           times and prints the processor time of one [s]
// OUT: float64, array by array, in the order that the code below writes them.
#include <array>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "grouser/model.h"
#include "grouser/vehicle.h"

namespace {

using Numbers = std::vector<double>;

std::vector<Numbers> ReadArrays(const char* file, std::size_t count) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(in), {});
  const std::size_t n = bytes.size() / sizeof(double) / count;
  std::vector<Numbers> arrays(count, Numbers(n));
  for (std::size_t k = 0; k < count; ++k) {
    bytes.copy(reinterpret_cast<char*>(arrays[k].data()), n * sizeof(double),
               k * n * sizeof(double));
  }
  return arrays;
}

void WriteArrays(const char* file, const std::vector<Numbers>& arrays) {
  std::ofstream out(file, std::ios::binary);
  for (const Numbers& a : arrays) {
    out.write(reinterpret_cast<const char*>(a.data()),
              static_cast<std::streamsize>(a.size() * sizeof(double)));
  }
  if (!out.flush()) throw std::runtime_error(std::string(file) + ": not written");
}

void AnswerModel(char** a) {
  using S = grouser::OutputSpans;
  constexpr std::span<double> S::*kParts[] = {
      &S::value,        &S::sd_fit,        &S::sd_patch,    &S::low,    &S::high,
      &S::d_v_x,        &S::d_v_y,         &S::d_rim_speed, &S::d_load, &S::sd_form,
      &S::measured_low, &S::measured_high, &S::sd_soil};
  const grouser::Model model = grouser::Model::Open(a[0]);
  const auto in = ReadArrays(a[1], 4);
  const std::size_t n = in[0].size();
  std::vector<Numbers> out(3 + grouser::kOutputs * std::size(kParts), Numbers(n));
  std::vector<std::uint32_t> flags(n);
  grouser::Answers answers;
  answers.flags = flags;
  answers.slip = out[1];
  answers.attack_angle = out[2];
  std::size_t at = 3;
  for (grouser::OutputSpans& o : answers.output) {
    for (const auto part : kParts) o.*part = out[at++];
  }
  if (!model.Evaluate({in[0], in[1], in[2], in[3]}, answers)) throw std::logic_error("model");
  out[0].assign(flags.begin(), flags.end());
  WriteArrays(a[2], out);
}

void AnswerVehicle(char** a) {
  const auto vehicle = grouser::Vehicle::Open(a[0]);
  const auto in = ReadArrays(a[1], 2);
  const std::size_t n = in[0].size();
  Numbers residual(n), power(n), low(n), high(n), load(n * vehicle.wheels()),
      rim(n * vehicle.drives());
  Numbers least(n), most(n), speed(n), safe(n), s(n);
  std::vector<std::uint32_t> reasons(n);
  grouser::VehicleSolver solver(vehicle);
  const grouser::Motions motions{.v_x = in[0], .yaw_rate = in[1]};
  grouser::Solutions solutions{.reasons = reasons, .residual = residual, .rim_speed = rim};
  solutions.wheel.load = load;
  bool good = solver.Solve(motions, solutions);
  const grouser::Powers powers{.reasons = reasons,
                               .electric = power,
                               .joules_per_metre_low = low,
                               .joules_per_metre_high = high};
  good &= solver.Energy(motions, powers) && solver.ProbabilityToGo(motions, {}, least, most);
  for (std::size_t i = 0; i < n; ++i) s[i] = 0.1 * static_cast<double>(i);
  grouser::SpeedPlanner planner(vehicle, n);
  good &= planner.Plan({.s = s, .curvature = in[1]}, {.speed_limit = 1},
                       {.speed = speed, .safe = safe});
  if (!good) throw std::logic_error("vehicle");
  WriteArrays(a[2], {residual, rim, load, power, low, high, least, most, speed, safe});
}

void Time(char** a) {
  const grouser::Model model = grouser::Model::Open(a[0]);
  const auto in = ReadArrays(a[1], 4);
  const std::size_t n = in[0].size();
  std::vector<std::uint32_t> flags(n);
  std::vector<Numbers> out(2 + 3 * grouser::kOutputs, Numbers(n));
  grouser::Answers answers;  // what Answers.empty of Python has by default
  answers.flags = flags;
  answers.slip = out[0];
  answers.attack_angle = out[1];
  for (std::size_t o = 0; o < grouser::kOutputs; ++o) {
    answers.output[o].value = out[2 + 3 * o];
    answers.output[o].low = out[3 + 3 * o];
    answers.output[o].high = out[4 + 3 * o];
  }
  for (std::string line; std::getline(std::cin, line);) {
    const std::clock_t start = std::clock();
    for (int k = 0; k < 20; ++k) {
      if (!model.Evaluate({in[0], in[1], in[2], in[3]}, answers)) throw std::logic_error("model");
    }
    std::printf("%.9f\n", static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / 20);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "model" && argc == 5) {
    AnswerModel(argv + 2);
  } else if (what == "vehicle" && argc == 5) {
    AnswerVehicle(argv + 2);
  } else if (what == "time" && argc == 4) {
    Time(argv + 2);
  } else {
    std::fputs("usage: python_reference model|vehicle FILE IN OUT | time FILE IN\n", stderr);
    return 2;
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "python_reference: %s\n", error.what());
  return 1;
}
