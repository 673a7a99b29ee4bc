#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "tests/unit/jobs/jobs_fixtures.h"

namespace grouser::server::testing {

/// A state folder, a folder with a shipped model, and a folder of fake workers:
/// shell scripts that hand out prepared files when told to. They are steered by
/// files in bin_:
///   dem.go       grouser-dem run waits for it
///   dem.started  its process id, one line a start
///   hold.run, hold.refit, hold.gate   while there, that worker waits
///   gate.json, gate.exit    what grouser-fit gate prints and returns
class FakeWorkers {
 public:
  FakeWorkers();

  /// The run that the fake DEM hands out for a request, and the candidate of
  /// that run that the fake fitter hands out.
  void Prepare(const v1alpha1::SubmitRefinementRequest& request,
               v1alpha1::RunStatus status = v1alpha1::RUN_STATUS_STEADY,
               const std::string& run_id = "0123456789abcdef");
  /// Replaces a fake: a shell script, with $out set to the value of --out.
  void Fake(const std::string& program, const std::string& script);
  void LetDemGo();
  /// Replaces the fakes by ones that sync what they write, as the programs do, and that see what no
  /// kill may lead to. Files in bin_ as above, and of a job
  ///   prepared.JOB.run.h5, prepared.JOB.model   its own, if there are no prepared ones for all
  ///   pids.JOB      its workers' process ids, one line a start;  run.JOB  the run is on disk
  ///   args.JOB      their command lines
  ///   hold.ran      while there, a worker whose run is on disk waits;  fail.run: it refuses the
  ///   spec wrong         a run that is repeated, two workers at a job
  void FakeCarefully();
  /// As FakeCarefully, for several refinements of one model. Of a job
  ///   id.JOB   its run's id: one of that id in the folder of --known is taken, and not run again
  ///   fit.JOB.BASE.model   its candidate from the model file BASE.model
  /// and run.ID instead of run.JOB.
  void FakeCombining();
  std::string Wrong() const;
  /// Waits until no worker that these fakes know of lives.
  bool AwaitNoWorkers() const;
  /// Process ids of the DEM workers started so far.
  std::vector<pid_t> DemStarts() const;

  TempDir dir_;
  const std::string state_ = dir_ / "state", shipped_ = dir_ / "shipped", bin_ = dir_ / "bin";
  std::string base_digest_;
};

/// Gone or a zombie: runs no more.
bool IsDead(pid_t pid);

}  // namespace grouser::server::testing
