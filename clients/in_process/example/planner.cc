#include "planner.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <numeric>
#include <random>
#include <thread>

namespace {

constexpr std::size_t kMostBlock = 256;  // rollouts a batch: 1024 states stay in cache

double Seconds(std::chrono::steady_clock::time_point since) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

}  // namespace

double StepCost(const Rover& rover, const Settings& settings, const Path::Pose& goal,
                const Body& body, const StepReport& report) {
  if (report.failed) return 1000;
  const double off = std::hypot(body.x - goal.x, body.y - goal.y) / 0.1;
  const double tracking = off * off + 4 * (1 - std::cos(body.yaw - goal.yaw));
  const double transport = report.power_w / (rover.mass * kGravity * settings.goal_speed);
  const double risk = 10 * std::max(0.0, report.sinkage_high - 0.4) + report.pull_doubt;
  return tracking + 0.5 * transport + risk;
}

Planner::Planner(const grouser::Model& model, const Rover& rover, const Path& path,
                 const Settings& settings)
    : rover_(rover), path_(path), settings_(settings) {
  const auto rollouts = static_cast<std::size_t>(settings.rollouts);
  plan_.assign(static_cast<std::size_t>(settings.horizon),
               {settings.cruise_rim, settings.cruise_rim});
  noise_.resize(rollouts * plan_.size());
  cost_.resize(rollouts);
  const auto threads = static_cast<std::size_t>(settings.threads);
  block_ = std::min(kMostBlock, (rollouts + threads - 1) / threads);  // all have work
  for (int t = 0; t < settings.threads; ++t) batches_.emplace_back(rover, model, block_);
}

Control Planner::Clamped(const Control& control) const {
  const double least = 0.1 * settings_.cruise_rim, most = 2 * settings_.cruise_rim;
  return {std::clamp(control.left, least, most), std::clamp(control.right, least, most)};
}

// Seeded by cycle and rollout: the same for any number of threads.
void Planner::DrawNoise(int cycle, std::size_t rollout) {
  Control* noise = &noise_[rollout * plan_.size()];
  std::seed_seq seed{static_cast<std::uint32_t>(settings_.seed),
                     static_cast<std::uint32_t>(settings_.seed >> 32),
                     static_cast<std::uint32_t>(cycle), static_cast<std::uint32_t>(rollout)};
  std::minstd_rand random(seed);
  std::normal_distribution<double> normal(0, 1);
  const double keep = settings_.noise_memory, fresh = std::sqrt(1 - keep * keep);
  double common = normal(random), opposed = normal(random);
  for (std::size_t t = 0; t < plan_.size(); ++t) {
    const double scale = rollout == 0 ? 0 : settings_.noise * settings_.cruise_rim;
    const Control wanted = Clamped(
        {plan_[t].left + scale * (common - opposed), plan_[t].right + scale * (common + opposed)});
    noise[t] = {wanted.left - plan_[t].left, wanted.right - plan_[t].right};
    common = keep * common + fresh * normal(random);
    opposed = keep * opposed + fresh * normal(random);
  }
}

void Planner::Roll(const Body& start, std::size_t first, std::size_t last, WheelBatch* batch) {
  const std::size_t n = last - first;
  std::vector<Body> bodies(n, start);
  std::vector<Control> controls(n);
  std::vector<StepReport> reports(n);
  const double here = path_.Nearest(start.x, start.y), dt = settings_.step_s;
  for (std::size_t k = first; k < last; ++k) {
    DrawNoise(cycle_, k);
    cost_[k] = 0;
  }
  for (std::size_t t = 0; t < plan_.size(); ++t) {
    for (std::size_t k = 0; k < n; ++k) {
      const Control& e = noise_[(first + k) * plan_.size() + t];
      controls[k] = {plan_[t].left + e.left, plan_[t].right + e.right};
    }
    batch->Step(dt, controls, bodies, reports);
    const double ahead = settings_.goal_speed * dt * static_cast<double>(t + 1);
    const Path::Pose goal = path_.At(here + ahead);
    for (std::size_t k = 0; k < n; ++k) {
      cost_[first + k] += StepCost(rover_, settings_, goal, bodies[k], reports[k]) /
                          static_cast<double>(plan_.size());
    }
  }
}

CycleReport Planner::Improve(const Body& start) {
  const auto began = std::chrono::steady_clock::now();
  const auto sum = [this](auto of) {
    return std::accumulate(batches_.begin(), batches_.end(), decltype(of(batches_[0])){},
                           [&](auto total, const WheelBatch& b) { return total + of(b); });
  };
  const auto asked = [](const WheelBatch& b) { return b.states(); };
  const auto spent = [](const WheelBatch& b) { return b.model_seconds(); };
  const std::int64_t states_before = sum(asked);
  const double model_before = sum(spent);

  // Threads take blocks as they come; the model is shared and needs no lock.
  std::atomic<std::size_t> next{0};
  std::vector<std::exception_ptr> failures(batches_.size());
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < batches_.size(); ++i) {
    threads.emplace_back([&, i] {
      try {
        for (std::size_t first; (first = next.fetch_add(block_)) < cost_.size();) {
          Roll(start, first, std::min(first + block_, cost_.size()), &batches_[i]);
        }
      } catch (...) {
        failures[i] = std::current_exception();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
  CycleReport report;
  report.model_share =
      (sum(spent) - model_before) / (Seconds(began) * static_cast<double>(batches_.size()));
  report.states = sum(asked) - states_before;
  Update(&report);
  report.seconds = Seconds(began);
  ++cycle_;
  return report;
}

void Planner::Update(CycleReport* report) {
  const double count = static_cast<double>(cost_.size());
  const double mean = std::accumulate(cost_.begin(), cost_.end(), 0.0) / count;
  const double least = *std::min_element(cost_.begin(), cost_.end());
  double square = 0;
  for (const double s : cost_) square += (s - mean) * (s - mean) / count;
  const double lambda = std::max(settings_.temperature * std::sqrt(square), 1e-12);
  double total = 0, total_square = 0;
  std::vector<Control> change(plan_.size());
  for (std::size_t k = 0; k < cost_.size(); ++k) {
    const double weight = std::exp(-(cost_[k] - least) / lambda);
    total += weight;
    total_square += weight * weight;
    for (std::size_t t = 0; t < plan_.size(); ++t) {
      change[t].left += weight * noise_[k * plan_.size() + t].left;
      change[t].right += weight * noise_[k * plan_.size() + t].right;
    }
  }
  for (std::size_t t = 0; t < plan_.size(); ++t) {
    plan_[t] =
        Clamped({plan_[t].left + change[t].left / total, plan_[t].right + change[t].right / total});
  }
  report->plan_cost = cost_.front();
  report->mean_cost = mean;
  report->best_cost = least;
  report->samples = total * total / total_square;
}

void Planner::Advance() {
  std::rotate(plan_.begin(), plan_.begin() + 1, plan_.end());
  plan_.back() = plan_[plan_.size() >= 2 ? plan_.size() - 2 : 0];  // the end goes on
}
