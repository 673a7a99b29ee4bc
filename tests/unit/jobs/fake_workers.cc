#include "tests/unit/jobs/fake_workers.h"

#include "proto/records/model_file.h"
#include "proto/records/run_file.h"
#include "server/jobs/refinement_spec.h"

namespace grouser::server::testing {
namespace {

constexpr char kFindOut[] =
    "#!/bin/sh\nbin=$(dirname \"$0\"); verb=$1; p=; out=\n"
    "for a in \"$@\"; do [ \"$p\" = --out ] && out=$a; p=$a; done\n";

constexpr char kDem[] = R"sh(
echo $$ >> "$bin/dem.started"
echo "progress 0.25 settling" >&2
while [ ! -e "$bin/dem.go" ] || [ -e "$bin/hold.run" ]; do sleep 0.02; done
cp "$bin/prepared.run.h5" "$out.part.$$" && mv "$out.part.$$" "$out"
echo '{}'
)sh";

constexpr char kFit[] = R"sh(
while [ -e "$bin/hold.$verb" ]; do sleep 0.02; done
case $verb in
  refit) cp "$bin/prepared.model" "$out.part" && mv "$out.part" "$out" ;;
  gate) cat "$bin/gate.json"; exit "$(cat "$bin/gate.exit")" ;;
  *) exit 2 ;;
esac
)sh";

constexpr char kBegin[] = R"sh(
job=${out%/*}; [ "$verb" = gate ] && job=$PWD; job=${job##*/}
for pid in $(cat "$bin/pids.$job" 2>/dev/null); do
  grep -qs "$job" "/proc/$pid/cmdline" && echo "$job: $verb beside $pid" >> "$bin/wrong"
done
echo $$ >> "$bin/pids.$job"
echo "$*" >> "$bin/args.$job"
own() { file="$bin/prepared.$job.$1"; [ -e "$file" ] || file="$bin/prepared.$1"; [ -e "$file" ]; }
leave() {
  cp "$file" "$out.part" && sync "$out.part" && mv "$out.part" "$out" && sync "${out%/*}" || exit 1
}
give() {
  until own "$1"; do sleep 0.02; done
  leave
}
)sh";

constexpr char kCarefulDem[] = R"sh(
[ -e "$bin/run.$job" ] && echo "$job: run again" >> "$bin/wrong"
echo $$ >> "$bin/dem.started"
echo "progress 0.25 settling" >&2
while [ ! -e "$bin/dem.go" ] || [ -e "$bin/hold.run" ]; do sleep 0.02; done
if [ -e "$bin/fail.run" ]; then echo 'spec.json: no such grain' >&2; exit 2; fi
give run.h5
echo > "$bin/run.$job"
while [ -e "$bin/hold.ran" ]; do sleep 0.02; done
echo '{}'
)sh";

constexpr char kCarefulFit[] = R"sh(
while [ -e "$bin/hold.$verb" ]; do sleep 0.02; done
case $verb in
  refit) give model ;;
  gate) cat "$bin/gate.json"; exit "$(cat "$bin/gate.exit")" ;;
  *) exit 2 ;;
esac
)sh";

constexpr char kCombiningDem[] = R"sh(
known=; q=
for a in "$@"; do [ "$q" = --known ] && known=$a; q=$a; done
until [ -e "$bin/id.$job" ]; do sleep 0.02; done
id=$(cat "$bin/id.$job")
if [ -e "$known/$id.run.h5" ]; then
  file="$known/$id.run.h5"; leave
else
  [ -e "$bin/run.$id" ] && echo "$job: $id run again" >> "$bin/wrong"
  echo $$ >> "$bin/dem.started"
  while [ ! -e "$bin/dem.go" ] || [ -e "$bin/hold.run" ]; do sleep 0.02; done
  give run.h5
  echo > "$bin/run.$id"
fi
echo '{}'
)sh";

constexpr char kCombiningFit[] = R"sh(
while [ -e "$bin/hold.$verb" ]; do sleep 0.02; done
[ "$verb" = gate ] && { cat "$bin/gate.json"; exit "$(cat "$bin/gate.exit")"; }
q=
for a in "$@"; do [ "$q" = --base ] && base=${a##*/}; q=$a; done
file="$bin/fit.$job.$base"
until [ -e "$file" ]; do sleep 0.02; done
leave
)sh";

}  // namespace

bool IsDead(pid_t pid) {
  const std::string text = ReadText("/proc/" + std::to_string(pid) + "/stat");
  const auto paren = text.rfind(')');
  return paren == std::string::npos || text.substr(paren + 2, 1) == "Z";
}

FakeWorkers::FakeWorkers() {
  for (const auto& folder : {state_, shipped_, bin_}) std::filesystem::create_directory(folder);
  base_digest_ = records::WriteModelFile(shipped_ + "/base.model", BaseModel());
  Fake("grouser-dem", kDem);
  Fake("grouser-fit", kFit);
  WriteText(bin_ + "/gate.json", R"([{"name":"held_out","passed":true,"detail":"fine"}])");
  WriteText(bin_ + "/gate.exit", "0");
}

void FakeWorkers::Fake(const std::string& program, const std::string& script) {
  WriteScript(bin_ + "/" + program, kFindOut + script);
}

void FakeWorkers::Prepare(const v1alpha1::SubmitRefinementRequest& request,
                          v1alpha1::RunStatus status, const std::string& run_id) {
  records::RunFile run;
  *run.record.mutable_spec() = BuildSpec(BaseModel(), request);
  run.record.set_run_id(run_id);
  run.record.set_status(status);
  if (status != v1alpha1::RUN_STATUS_STEADY) run.record.set_reason("it drifts");
  auto* mean = run.record.add_outputs();
  mean->set_name("f_x");
  mean->set_mean(1.5);
  records::WriteRunFile(bin_ + "/prepared.run.h5", run);
  v1alpha1::Model candidate = BaseModel();
  auto* provenance = candidate.mutable_provenance();
  provenance->set_base_digest(base_digest_);
  auto* trained = provenance->add_runs();
  trained->set_sha256(records::Sha256OfFile(bin_ + "/prepared.run.h5"));
  trained->set_run_id(run_id);
  records::WriteModelFile(bin_ + "/prepared.model", candidate);
}

void FakeWorkers::FakeCarefully() {
  Fake("grouser-dem", std::string(kBegin) + kCarefulDem);
  Fake("grouser-fit", std::string(kBegin) + kCarefulFit);
}

void FakeWorkers::FakeCombining() {
  Fake("grouser-dem", std::string(kBegin) + kCombiningDem);
  Fake("grouser-fit", std::string(kBegin) + kCombiningFit);
  std::filesystem::remove(bin_ + "/prepared.run.h5");
}

std::string FakeWorkers::Wrong() const { return ReadText(bin_ + "/wrong"); }

bool FakeWorkers::AwaitNoWorkers() const {
  for (const auto& entry : std::filesystem::directory_iterator(bin_)) {
    if (!entry.path().filename().string().starts_with("pids.")) continue;
    std::ifstream in(entry.path());
    for (pid_t pid; in >> pid;) {
      if (!Eventually([&] { return IsDead(pid); })) return false;
    }
  }
  return true;
}

void FakeWorkers::LetDemGo() { WriteText(bin_ + "/dem.go", ""); }

std::vector<pid_t> FakeWorkers::DemStarts() const {
  std::ifstream in(bin_ + "/dem.started");
  std::vector<pid_t> pids;
  for (pid_t pid; in >> pid;) pids.push_back(pid);
  return pids;
}

}  // namespace grouser::server::testing
