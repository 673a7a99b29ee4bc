#include "dem_offline/engine/gpu/rig.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/gpu/ensemble.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/wheel_run.h"

namespace grouser::dem::gpu {
namespace {

constexpr std::int64_t kVisitSteps = 1000;  // between looks at worlds that call for nothing

/// Tests that run together.
class Batch {
 public:
  Batch(const std::vector<WheelJob>& jobs, const std::vector<std::size_t>& chosen, Device& device)
      : jobs_(jobs), numbers_(chosen) {
    std::vector<World*> worlds;
    for (const std::size_t n : chosen) {
      runs_.push_back(std::make_unique<WheelRun>(jobs[n].spec, *jobs[n].tile));
      worlds.push_back(&runs_.back()->world());
    }
    all_ = std::make_unique<Ensemble>(worlds, device);
    std::vector<Ensemble::WheelSetup> setups;
    for (const auto& run : runs_) {
      setups.push_back(
          {run->drive(), run->Limit(), run->state(), run->recorder().grid(), kStressStride});
    }
    all_->AddWheels(setups, kWheelBody);
    running_.assign(runs_.size(), true);
    results_.resize(runs_.size());
  }

  /// Until all have ended, or keep_on says no.
  template <class KeepOn, class Done>
  void Run(KeepOn&& keep_on, Done&& done) {
    const auto begin = std::chrono::steady_clock::now();
    while (std::find(running_.begin(), running_.end(), true) != running_.end()) {
      for (int w = 0; w < all_->size(); ++w) {
        if (running_[w] && runs_[w]->scene().LookDue(Step(w))) Look(w);
      }
      Advance();
      const std::vector<Ensemble::WheelNews> news = all_->Visit();
      for (int w = 0; w < all_->size(); ++w) {
        if (!running_[w] || Take(w, news[w])) continue;
        End(w, begin);
        done(numbers_[w], results_[w]);
      }
      if (keep_on(Share())) continue;
      for (int w = 0; w < all_->size(); ++w) {
        if (!running_[w]) continue;
        runs_[w]->Fail("stopped by caller", StopCause::kCaller);
        End(w, begin);
      }
    }
  }
  std::string Memory() const {
    return std::to_string(runs_.size()) + " worlds, " + ToText(all_->Plan());
  }
  const WheelTestResult& result(std::size_t w) const { return results_[w]; }

 private:
  std::uint64_t Step(int w) const { return static_cast<std::uint64_t>(all_->steps(w)); }

  /// Each to its next look, or a good way on; worlds that call wait by themselves.
  void Advance() {
    std::vector<std::int64_t> until;
    std::vector<std::int64_t> before;
    for (int w = 0; w < all_->size(); ++w) {
      const std::int64_t now = all_->steps(w);
      const std::int64_t look = jobs_[numbers_[w]].spec.rig.scene.look_steps;
      before.push_back(now);
      if (!running_[w]) {
        until.push_back(now);
      } else if (runs_[w]->scene().Looks()) {
        until.push_back((now / look + 1) * look);
      } else {
        until.push_back(now + kVisitSteps);
      }
    }
    all_->RunTo(until);
    for (int w = 0; w < all_->size(); ++w) {
      if (running_[w]) {
        runs_[w]->scene().CountSteps(static_cast<double>(all_->steps(w) - before[w]));
      }
    }
  }

  void Look(int w) {
    all_->Pull(w);
    if (runs_[w]->scene().Look(runs_[w]->wheel().position_m)) {
      all_->Push(w);
      all_->SetLimit(w, runs_[w]->Limit());
    }
  }

  /// False: the run has ended.
  bool Take(int w, const Ensemble::WheelNews& news) {
    WheelRun& run = *runs_[w];
    for (const WheelSample& sample : news.samples) run.Take(sample);
    run.state() = news.state;
    if (all_->fault(w) != StepFault::kNone) return run.Fail(Explain(all_->fault(w)));
    if (news.events & (kLedgerOpens | kDriveBegins)) all_->Pull(w);
    if (news.events & kChunkEnds) TakeStress(w);
    const bool on = run.Take(news.events);
    if (news.events & kDriveBegins) all_->SetEnergy(w, true);
    return on;
  }

  void TakeStress(int w) {
    const Ensemble::WheelStress stress = all_->TakeStress(w);
    runs_[w]->recorder().AddSums(stress.steps, stress.sums);
  }

  void End(int w, std::chrono::steady_clock::time_point begin) {
    running_[w] = false;
    TakeStress(w);
    all_->Pull(w);
    results_[w] = runs_[w]->Finish(Step(w));
    // Of the whole batch so far: worlds of a batch share the device.
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    results_[w].wall_s = took.count();
  }

  double Share() const {
    double sum = 0;
    for (std::size_t w = 0; w < runs_.size(); ++w) sum += running_[w] ? runs_[w]->Fraction() : 1;
    return sum / static_cast<double>(runs_.size());
  }

  const std::vector<WheelJob>& jobs_;
  std::vector<std::size_t> numbers_;
  std::vector<std::unique_ptr<WheelRun>> runs_;
  std::unique_ptr<Ensemble> all_;
  std::vector<bool> running_;
  std::vector<WheelTestResult> results_;
};

bool SameLaws(const WheelTestSpec& a, const WheelTestSpec& b) {
  return LawsOf(a.soil.contact) == LawsOf(b.soil.contact);
}

/// Grains that fit: a quarter of the device's memory stays for lists that grow. A
/// grain takes about as much there, with its checkpoint (PlanOf), as on the host.
double GrainsThatFit(const Device& device, const WorkLimits& limits) {
  return std::min(0.75 * static_cast<double>(device.FreeBytes()), MostBytes(limits)) /
         kBytesPerGrain;
}

/// Of a scene, which may be many tiles long.
double GrainsOf(const WheelJob& job) {
  return static_cast<double>(job.tile->radius_m.size()) * SceneLength(job.spec) /
         job.spec.rig.bed_length_m;
}

/// Throws std::invalid_argument with the test's number.
void Validate(const WheelJob& job, std::size_t number, const Device& device,
              const WorkLimits& limits) {
  const std::string which = "wheel test " + std::to_string(number) + ": ";
  try {
    ValidateSpec(job.spec, limits);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(which + error.what());
  }
  const double needed = kBytesPerGrain * GrainsOf(job);
  const auto free = static_cast<double>(device.FreeBytes());
  if (needed <= free) return;
  throw std::invalid_argument(which + Short(GrainsOf(job)) + " grains need about " +
                              Short(needed / 1e9) + " GB, expected at most the " +
                              Short(free / 1e9) + " GB that are free on " + device.name());
}

std::vector<std::size_t> NextBatch(const std::vector<WheelJob>& jobs,
                                   std::vector<std::size_t>* left, double most_grains) {
  std::vector<std::size_t> chosen, rest;
  double grains = 0;
  for (const std::size_t n : *left) {
    const double own = GrainsOf(jobs[n]);
    const bool fits = chosen.empty() ||
                      (grains + own <= most_grains && SameLaws(jobs[chosen[0]].spec, jobs[n].spec));
    (fits ? chosen : rest).push_back(n);
    if (fits) grains += own;
  }
  *left = rest;
  return chosen;
}

}  // namespace

std::vector<WheelTestResult> RunWheelTests(
    const std::vector<WheelJob>& jobs, Device& device, const ProgressFn& progress,
    const std::function<void(std::size_t, const WheelTestResult&)>& done,
    const WorkLimits& limits) {
  std::vector<std::size_t> left;
  for (std::size_t n = 0; n < jobs.size(); ++n) {
    Validate(jobs[n], n, device, limits);
    left.push_back(n);
  }
  std::vector<WheelTestResult> out(jobs.size());
  std::size_t finished = 0;
  while (!left.empty()) {
    const std::vector<std::size_t> chosen = NextBatch(jobs, &left, GrainsThatFit(device, limits));
    Batch batch(jobs, chosen, device);
    const std::size_t before = finished;
    if (progress) {
      progress(static_cast<double>(before) / jobs.size(),
               std::string(kMemoryStage) + batch.Memory() + " on " + device.name());
    }
    batch.Run(
        [&](double share) {
          if (!progress) return true;
          const double all = (static_cast<double>(before) + share * chosen.size()) / jobs.size();
          return progress(all, std::to_string(finished) + " of " + std::to_string(jobs.size()) +
                                   " done on " + device.name());
        },
        [&](std::size_t n, const WheelTestResult& result) {
          ++finished;
          if (done) done(n, result);
        });
    for (std::size_t w = 0; w < chosen.size(); ++w) out[chosen[w]] = batch.result(w);
  }
  return out;
}

}  // namespace grouser::dem::gpu
