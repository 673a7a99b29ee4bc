// Sweeps from the command line: the folder, its table, going on, failures, signals.
#include <signal.h>

#include <thread>

#include "proto/records/run_file.h"
#include "tests/unit/campaign/dem_cli.h"

namespace {

namespace fs = std::filesystem;

constexpr char kDrops[] = R"(name: drops
materials: {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.2, width_m: 0.2, height_m: 0.3, material: sand}
grains: {kind: lattice, material: sand, diameter_m: 0.01, count: 20}
duration_s: 0.02
probes: [{kind: rest}]
sweep:
  axes: {key: grains.count, values: [5, 6, 7]}
  results: {column: kinetic_over_weight, of: last}
)";

class SweepCli : public DemCli {
 protected:
  void SetUp() override {
    DemCli::SetUp();
    Write("drops.yaml", kDrops);
  }
  std::map<std::string, fs::file_time_type> Runs() const {
    std::map<std::string, fs::file_time_type> out;
    for (const auto& entry : fs::directory_iterator(folder_ / "out/runs")) {
      if (entry.path().string().ends_with(".run.h5")) {
        out[entry.path()] = fs::last_write_time(entry);
      }
    }
    return out;
  }
  std::string RunCommand(const std::string& more = "") const {
    return "run " + In("drops.yaml") + " --out " + In("out") + more;
  }
};

TEST_F(SweepCli, RunsAllMembersIntoAFolderWithATable) {
  ASSERT_EQ(Run(RunCommand()), 0) << said_;
  EXPECT_NE(said_.find("3/3 done, 0 failed"), std::string::npos) << said_;
  const auto runs = Runs();
  ASSERT_EQ(runs.size(), 3u);
  std::map<std::uint64_t, int> grains;
  for (const auto& [path, when] : runs) {
    const auto run = grouser::records::ReadAnyRunFile(path);
    ++grains[run.record.bed().grains()];
    EXPECT_TRUE(fs::exists(path.substr(0, path.size() - 7) + ".series.csv"));
    // The record alone is the same run.
    Write("member.yaml", run.record.experiment_spec().yaml());
    ASSERT_EQ(Run("run " + In("member.yaml") + " --out " + In("m.run.h5")), 0) << said_;
    const auto again = grouser::records::ReadAnyRunFile(In("m.run.h5"));
    EXPECT_EQ(again.record.run_id(), run.record.run_id());
    EXPECT_EQ(again.series, run.series);
  }
  EXPECT_EQ(grains, (std::map<std::uint64_t, int>{{5, 1}, {6, 1}, {7, 1}}));
  std::istringstream table(Read("out/members.csv"));
  std::string line;
  std::getline(table, line);
  EXPECT_EQ(line, "member,run_id,role,grains.count,seed,status,kinetic_over_weight.last,reason");
  std::getline(table, line);
  EXPECT_NE(line.find(",training,5,1,DONE,"), std::string::npos) << line;
}

TEST_F(SweepCli, OptionsOfASingleRunAreTakenOrRefused) {
  EXPECT_EQ(Run(RunCommand(" --resume")), 2);
  EXPECT_NE(said_.find("--resume: a file with a sweep goes on by itself"), std::string::npos);
  EXPECT_FALSE(fs::exists(In("out")));
  ASSERT_EQ(Run(RunCommand(" --progress-lines")), 0) << said_;
  EXPECT_NE(said_.find("progress 1.0000 eta=0 3 of 3 runs"), std::string::npos) << said_;
}

TEST_F(SweepCli, GoesOnWithoutRunningAgainWhatIsThere) {
  ASSERT_EQ(Run(RunCommand(" --jobs 1")), 0) << said_;
  const auto before = Runs();
  fs::remove(before.begin()->first);
  std::ofstream(std::next(before.begin())->first) << "damaged";
  ASSERT_EQ(Run(RunCommand(" --set 'sweep.axes.values=[5, 6, 7, 8]'")), 0) << said_;
  EXPECT_NE(said_.find("set aside as"), std::string::npos) << said_;
  const auto after = Runs();
  EXPECT_EQ(after.size(), 4u);
  const auto kept = std::prev(before.end());
  EXPECT_EQ(after.at(kept->first), kept->second);
  for (const auto& [path, when] : after) EXPECT_NO_THROW(grouser::records::ReadAnyRunFile(path));
}

TEST_F(SweepCli, AMemberThatFailsDoesNotStopTheOthers) {
  // A plate that does not reach the grains in its time.
  Write("drops.yaml", std::string(kDrops) +
                          R"(bodies:
  - {name: plate, material: sand, parts: {shape: disc, radius_m: 0.03},
     position_m: [0.1, 0.1, 0.2], motion: [{do: lower, speed_m_per_s: 0.1, touch: on, most_s: 1}]}
)");
  ASSERT_EQ(
      Run(RunCommand(" --set 'sweep.axes={key: \"bodies[0].motion[0].most_s\", values: [0.001, "
                     "9]}'")),
      0)
      << said_;
  EXPECT_NE(said_.find("2/2 done, 1 failed"), std::string::npos) << said_;
  const std::string table = Read("out/members.csv");
  EXPECT_NE(table.find("0.001,1,FAILED,"), std::string::npos) << table;
  EXPECT_NE(table.find("no end of it within"), std::string::npos) << table;
  EXPECT_NE(table.find("9,1,DONE,"), std::string::npos) << table;
}

TEST_F(SweepCli, AMemberWhosePreparationFailsIsARecordToo) {
  ASSERT_EQ(Run(RunCommand(" --set 'preparation={do: cut, height_m: 0.1}'"
                           " --set 'sweep.axes={key: preparation.height_m, values: [0.1, 0.02]}'"
                           " --set grains.count=1000")),
            0)
      << said_;
  const std::string table = Read("out/members.csv");
  EXPECT_NE(table.find("0.1,1,FAILED,"), std::string::npos) << table;
  EXPECT_NE(table.find("no grain reaches"), std::string::npos) << table;
  EXPECT_NE(table.find("0.02,1,DONE,"), std::string::npos) << table;
}

TEST_F(SweepCli, ASignalEndsTheRunsInProgressAndKeepsTheOthers) {
  const pid_t child = fork();
  if (child == 0) {
    const std::string file = In("drops.yaml"), out = In("out"), log = In("child");
    if (!std::freopen(log.c_str(), "w", stderr)) _exit(1);
    execl(GROUSER_DEM, GROUSER_DEM, "run", file.c_str(), "--out", out.c_str(), "--set",
          "sweep.axes={key: duration_s, values: [0.01, 50000]}", "--jobs", "2", nullptr);
    _exit(1);
  }
  // The short one is done; the long one would go on for hours.
  for (int k = 0; k < 6000 && (!fs::exists(In("out/runs")) || Runs().empty()); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ASSERT_EQ(Runs().size(), 1u);
  kill(child, SIGTERM);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(WEXITSTATUS(status), 143) << Read("child");
  EXPECT_EQ(Runs().size(), 1u);
  const std::string table = Read("out/members.csv");
  EXPECT_NE(table.find(",DONE,"), std::string::npos) << table;
  EXPECT_NE(table.find(",PLANNED,"), std::string::npos) << table;
}

/// Killed after a checkpoint: the files are those of a run that was not.
TEST_F(SweepCli, AKilledRunGoesOnFromItsCheckpointToTheBit) {
  std::string one = std::string(kDrops).substr(0, std::string(kDrops).find("sweep:"));
  one.replace(one.find("duration_s: 0.02"), 16, "duration_s: 2.5");
  Write("one.yaml", one +
                        "output: {checkpoint_every_s: 0.02, sample_s: 0.0005, "
                        "frames: {every_s: 0.5}}\n");
  ASSERT_EQ(Run("run " + In("one.yaml") + " --out " + In("whole.run.h5")), 0) << said_;
  EXPECT_FALSE(fs::exists(In("whole.checkpoint")));
  const pid_t child = fork();
  if (child == 0) {
    const std::string file = In("one.yaml"), out = In("part.run.h5");
    execl(GROUSER_DEM, GROUSER_DEM, "run", file.c_str(), "--out", out.c_str(), nullptr);
    _exit(1);
  }
  for (int k = 0; k < 60000 && !fs::exists(In("part.checkpoint")); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  kill(child, SIGKILL);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status)) << "it was done before";
  EXPECT_FALSE(fs::exists(In("part.run.h5")));
  // Of another experiment: refused, and nothing is lost.
  EXPECT_EQ(Run("run " + In("one.yaml") + " --set seed=9 --resume --out " + In("part.run.h5")), 2);
  EXPECT_NE(said_.find("the experiment or the engine has changed"), std::string::npos) << said_;
  const std::string kept = Read("part.checkpoint");
  Write("part.checkpoint", kept.substr(0, kept.size() / 2));
  EXPECT_EQ(Run("run " + In("one.yaml") + " --resume --out " + In("part.run.h5")), 2);
  EXPECT_NE(said_.find("damaged"), std::string::npos) << said_;
  Write("part.checkpoint", kept);
  ASSERT_EQ(Run("run " + In("one.yaml") + " --resume --out " + In("part.run.h5")), 0) << said_;
  EXPECT_EQ(said_.find("no checkpoint"), std::string::npos) << said_;
  EXPECT_EQ(Read("part.series.csv"), Read("whole.series.csv"));
  const auto whole = grouser::records::ReadAnyRunFile(In("whole.run.h5")),
             part = grouser::records::ReadAnyRunFile(In("part.run.h5"));
  EXPECT_EQ(part.series, whole.series);
  EXPECT_EQ(part.record.numerics().steps(), whole.record.numerics().steps());
  EXPECT_EQ(Read("part.frames/frames.pvd"), Read("whole.frames/frames.pvd"));
  EXPECT_EQ(Read("part.frames/grains_000005.vtp"), Read("whole.frames/grains_000005.vtp"));
}

TEST_F(SweepCli, CheckCountsMembersAndAddsUpTheirTime) {
  ASSERT_EQ(Run("check " + In("drops.yaml")), 0) << said_;
  EXPECT_NE(said_.find("members      3, 0 of them held out"), std::string::npos) << said_;
  EXPECT_NE(said_.find("together on one core"), std::string::npos) << said_;
}

TEST_F(SweepCli, RefusesBeforeAnyWork) {
  EXPECT_EQ(Run(RunCommand(" --set 'sweep.results.column=kinetic_over_weigth'")), 2);
  EXPECT_NE(said_.find("the nearest is 'kinetic_over_weight'"), std::string::npos) << said_;
  EXPECT_EQ(Run(RunCommand(" --set 'sweep.axes.values=[5, 5]'")), 2);
  EXPECT_NE(said_.find("members 0 and 1 are the same"), std::string::npos) << said_;
  EXPECT_EQ(Run(RunCommand(" --set 'sweep.axes.values=[5, -1]'")), 2);
  EXPECT_FALSE(fs::exists(In("out")));
  ASSERT_EQ(Run(RunCommand(" --set 'sweep.axes.values=[5]'")), 0) << said_;
  EXPECT_EQ(Run(RunCommand(" --set name=others")), 2);
  EXPECT_NE(said_.find("choose another --out"), std::string::npos) << said_;
  Write("one.yaml", std::string(kDrops).substr(0, std::string(kDrops).find("sweep:")));
  EXPECT_EQ(Run("run " + In("one.yaml") + " --jobs 2 --out " + In("a.run.h5")), 2);
}

}  // namespace
