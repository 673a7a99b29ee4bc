// Experiment files from the command line: exit codes, CSVs, run file.
#include "proto/records/run_file.h"
#include "tests/unit/campaign/dem_cli.h"

namespace {

namespace fs = std::filesystem;

constexpr char kDrop[] = R"(name: drop
materials: {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.2, width_m: 0.2, height_m: 0.3, material: sand}
grains: {kind: lattice, material: sand, diameter_m: 0.01, count: 20}
duration_s: 0.05
probes: [{kind: rest}, {kind: bins, name: layers, n: [1, 1, 2]}]
)";

class ExperimentCli : public DemCli {
 protected:
  void SetUp() override {
    DemCli::SetUp();
    Write("drop.yaml", kDrop);
  }
};

TEST_F(ExperimentCli, RunWritesRunFileSeriesAndTables) {
  ASSERT_EQ(Run("run " + In("drop.yaml") + " --out " + In("a.run.h5")), 0) << said_;
  const auto run = grouser::records::ReadAnyRunFile(In("a.run.h5"));
  EXPECT_EQ(run.record.status(), grouser::v1alpha1::RUN_STATUS_DONE);
  EXPECT_EQ(run.record.experiment_spec().yaml(), kDrop);
  EXPECT_EQ(run.record.bed().grains(), 20u);
  std::ifstream series(In("a.series.csv")), layers(In("a.layers.csv"));
  std::string line;
  ASSERT_TRUE(std::getline(series, line));
  EXPECT_EQ(line, "time_s,kinetic_over_weight");
  std::size_t rows = 0;
  while (std::getline(series, line)) ++rows;
  EXPECT_EQ(rows, run.series.at("time_s").size());
  rows = 0;
  while (std::getline(layers, line)) ++rows;
  EXPECT_EQ(rows, 3u);
  ASSERT_EQ(Run("show " + In("a.run.h5")), 0) << said_;
  EXPECT_NE(said_.find("experiment drop: 20 grains"), std::string::npos) << said_;
  // A reader of wheel tests refuses it by name.
  EXPECT_THROW(grouser::records::ReadRunFile(In("a.run.h5")), std::runtime_error);
}

TEST_F(ExperimentCli, RunMakesTheFolderAboveItsFiles) {
  const std::string run = "run " + In("drop.yaml") + " --out ";
  EXPECT_EQ(Run(run + In("new/in/a.run.h5") + " --set grains.cuont=7"), 2);
  EXPECT_FALSE(fs::exists(In("new"))) << "for a file that cannot be run";
  ASSERT_EQ(Run(run + In("new/in/a.run.h5")), 0) << said_;
  EXPECT_TRUE(fs::exists(In("new/in/a.run.h5")) && fs::exists(In("new/in/a.series.csv")));
  EXPECT_EQ(Run(run + In("drop.yaml/a.run.h5")), 2);
  EXPECT_NE(said_.find("drop.yaml: cannot be made: File exists"), std::string::npos) << said_;
}

TEST_F(ExperimentCli, SetChangesTheRunAndStandsInTheRecord) {
  ASSERT_EQ(Run("run " + In("drop.yaml") + " --set grains.count=7 --out " + In("b.run.h5")), 0)
      << said_;
  const auto run = grouser::records::ReadAnyRunFile(In("b.run.h5"));
  EXPECT_EQ(run.record.bed().grains(), 7u);
  ASSERT_EQ(run.record.experiment_spec().sets_size(), 1);
  EXPECT_EQ(run.record.experiment_spec().sets(0), "grains.count=7");
}

TEST_F(ExperimentCli, CheckPrintsWhatItTakes) {
  ASSERT_EQ(Run("check " + In("drop.yaml")), 0) << said_;
  for (const char* word : {"grains       20", "steps", "memory", "grain-steps/s", "time"}) {
    EXPECT_NE(said_.find(word), std::string::npos) << word << "\n" << said_;
  }
}

TEST_F(ExperimentCli, SaysWhatWasChangedInAMesh) {
  Write("foot.obj",  // inside-out, one face twice
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
        "f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\nf 3 4 1\n");
  Write("foot.yaml", std::string(kDrop) +
                         "bodies: {name: foot, material: sand, position_m: [0.1, 0.1, 0.2],\n"
                         "  parts: {shape: mesh, file: foot.obj, scale: 0.02}}\n");
  const std::string line =
      "foot.obj: 4 triangles, 1 closed shell; 1 copy dropped; 1 shell inside-out turned";
  ASSERT_EQ(Run("check " + In("foot.yaml")), 0) << said_;
  EXPECT_NE(said_.find("mesh         " + line + "\n"), std::string::npos) << said_;
  ASSERT_EQ(Run("run " + In("foot.yaml") + " --out " + In("d.run.h5")), 0) << said_;
  EXPECT_NE(said_.find(line), std::string::npos) << said_;
  const auto run = grouser::records::ReadAnyRunFile(In("d.run.h5"));
  ASSERT_EQ(run.record.experiment_spec().others_size(), 1);
  EXPECT_EQ(run.record.experiment_spec().others(0).substr(64), " " + line);
  EXPECT_EQ(Run("check " + In("foot.yaml") + " --set bodies.parts.repair=off"), 2);
  EXPECT_NE(said_.find("off, but foot.obj needs it: 4 triangles"), std::string::npos) << said_;
}

TEST_F(ExperimentCli, BadFilesAreRefusedBeforeAnyWork) {
  EXPECT_EQ(Run("check " + In("drop.yaml") + " --set grains.cuont=7"), 2);
  EXPECT_NE(said_.find("the nearest is 'count'"), std::string::npos) << said_;
  EXPECT_EQ(Run("check " + In("ghost.yaml")), 2);
  EXPECT_EQ(Run("run " + In("drop.yaml") + " --set duration_s=1e9 --out " + In("c.run.h5")), 2);
  EXPECT_FALSE(fs::exists(In("c.series.csv")));
  EXPECT_EQ(Run("run " + In("drop.yaml") + " --slip 0.2 --out " + In("c.run.h5")), 2);
  EXPECT_EQ(Run("run " + In("drop.yaml")), 2);
  EXPECT_EQ(Run("run " + In("drop.yaml") + " --memory-gib 1e-6 --out " + In("c.run.h5")), 2);
}

}  // namespace
