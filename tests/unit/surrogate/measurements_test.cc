#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "surrogate/calibrate/measurement_file.h"
#include "tests/unit/records/temp_folder.h"

namespace grouser::surrogate {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class MeasurementFile : public ::testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& text) {
    const std::string path = folder_ / name;
    std::ofstream(path) << text;
    return path;
  }
  MeasuredSoil Read(const std::string& yaml) {
    return ReadMeasuredSoil({Write("m.yaml", yaml)}, {});
  }
  // What the reader says of one test of this kind, or "accepted".
  std::string Said(const std::string& csv, const std::string& test) {
    Write("d.csv", csv);
    try {
      Read("tests:\n  - " + test + "\n");
    } catch (const std::exception& error) {
      return error.what();
    }
    return "accepted";
  }
  std::string SaidOfPlate(const std::string& csv, const std::string& more = "") {
    return Said(csv,
                "{kind: plate, file: d.csv, columns: {sinkage: z_mm, force: F_N}, constants: "
                "{diameter: 60 mm}" +
                    more + "}");
  }

  const records::TempFolder folder_;
};

TEST_F(MeasurementFile, WhatItNamesMayNotLeaveAFolder) {
  std::filesystem::create_directory(folder_ / "in");
  Write("out.csv", "z_mm,F_N\n1,2\n2,5\n");
  Write("in/in.csv", "z_mm,F_N\n1,2\n2,5\n");
  std::filesystem::create_symlink(folder_ / "out.csv", folder_ / "in/link.csv");
  const auto said = [&](const std::string& name) -> std::string {
    const std::string file = Write(
        "in/m.yaml", "tests:\n  - {kind: plate, file: " + name +
                         ", columns: {sinkage: z_mm, force: F_N}, constants: {diameter: 60 mm}}\n");
    try {
      ReadMeasuredSoil({file}, {}, folder_ / "in");
    } catch (const std::exception& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(said("in.csv"), "accepted");
  EXPECT_EQ(said("../in/in.csv"), "accepted");
  for (const std::string& bad : {std::string("../out.csv"), folder_ / "out.csv",
                                 std::string("link.csv"), std::string("/dev/zero")}) {
    EXPECT_THAT(said(bad), AllOf(HasSubstr("m.yaml:2: key 'tests[0].file'"),
                                 HasSubstr("does not leave the folder")))
        << bad;
  }
}

TEST_F(MeasurementFile, UnitsConstantsSdsAndHeldOutRowsAreTaken) {
  Write("p.csv",
        "# a comment\nz_mm,F_N,s,plate\n1,2.5,0.1,a\n0,0,0.1,a\n3,,0.1,a\n2,5,0.2,a\n5,9,1,b\n");
  const MeasuredSoil soil = Read(
      "soil: mine\nkind: clay\ndensity_kg_per_m3: 1500\ntests:\n"
      "  - kind: plate\n    name: disc\n    file: p.csv\n    where: {plate: a}\n"
      "    columns: {sinkage: z_mm, force: F_N, force_sd: s}\n    constants: {diameter: 6 cm}\n"
      "    held_out: {lines: [6]}\n");
  EXPECT_EQ(soil.name, "mine");
  EXPECT_EQ(soil.kind, SoilKind::kClay);
  ASSERT_EQ(soil.observations.size(), 2u);
  const double area = M_PI * 0.03 * 0.03;
  EXPECT_NEAR(soil.observations[0].value, 2.5 / area, 1e-9);
  EXPECT_NEAR(soil.observations[0].sd, 0.1 / area, 1e-9);
  EXPECT_DOUBLE_EQ(soil.observations[0].width, 0.03);
  EXPECT_DOUBLE_EQ(soil.observations[0].sinkage, 0.001);
  EXPECT_EQ(soil.observations[1].line, 6);
  EXPECT_FALSE(soil.observations[0].held_out);
  EXPECT_TRUE(soil.observations[1].held_out);
  EXPECT_THAT(soil.notes.at(0), HasSubstr("disc: 2 of 4 rows have no sinkage > 0"));
  EXPECT_EQ(soil.files.size(), 2u);
  EXPECT_EQ(soil.files[1][1].size(), 64u);
}

TEST_F(MeasurementFile, WheelsTakeSlipOrSpeedsAndMissOutputs) {
  Write("w.csv", "beta_deg,rim_mm_per_s,load_N,DP_N,side_N\n60,13,20.9,-2.9,14.1\n0,0,20,,\n");
  const MeasuredSoil soil = Read(
      "tests:\n  - kind: wheel\n    file: w.csv\n    columns:\n      attack_angle: beta_deg\n"
      "      rim_speed: rim_mm_per_s\n      load: load_N\n      f_x: DP_N\n"
      "      f_y: {column: side_N, unit: N, sign: -1}\n"
      "    constants: {travel_speed: 10 mm/s, radius: 62.5 mm, width: 50 mm}\n    sd: {f_x: 0.3 N, "
      "f_y: 5 %}\n");
  ASSERT_EQ(soil.observations.size(), 2u);
  EXPECT_NEAR(soil.observations[0].slip, (13 - 5.0) / 13, 1e-12);
  EXPECT_EQ(soil.observations[0].output, kFx);
  EXPECT_DOUBLE_EQ(soil.observations[0].sd, 0.3);
  EXPECT_DOUBLE_EQ(soil.observations[1].value, -14.1);
  EXPECT_NEAR(soil.observations[1].sd, 0.05 * 14.1, 1e-12);
}

TEST_F(MeasurementFile, RingsGiveStressAndTravel) {
  Write("r.csv", "rotation_deg,T_n_m,load_N\n10,1,100\n");
  const MeasuredSoil soil = Read(
      "tests:\n  - {kind: shear, file: r.csv, columns: {rotation: rotation_deg, torque: T_n_m, "
      "load: "
      "load_N}, constants: {inner_radius: 40 mm, outer_radius: 60 mm}}\n");
  ASSERT_EQ(soil.observations.size(), 1u);
  const double cubes = 0.06 * 0.06 * 0.06 - 0.04 * 0.04 * 0.04, squares = 0.0036 - 0.0016;
  EXPECT_NEAR(soil.observations[0].value, 3 / (2 * M_PI * cubes), 1e-6);
  EXPECT_NEAR(soil.observations[0].pressure, 100 / (M_PI * squares), 1e-6);
  EXPECT_NEAR(soil.observations[0].displacement, M_PI / 18 * 2 / 3 * cubes / squares, 1e-12);
}

TEST_F(MeasurementFile, TheCommandLineMapsColumns) {
  const std::string file = Write("p.csv", "depth,F\n2,5\n4,10\n");
  const MeasuredSoil soil =
      ReadMeasuredSoil({file}, {"plate", {"depth=sinkage:mm", "F=force:N"}, {"diameter=60 mm"}});
  EXPECT_EQ(soil.observations.size(), 2u);
  EXPECT_DOUBLE_EQ(soil.observations[0].sinkage, 0.002);
  const auto said = [&](const CommandLineTest& how) -> std::string {
    try {
      ReadMeasuredSoil({file}, how);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(said({}), HasSubstr("a CSV needs --kind"));
  EXPECT_THAT(
      said({"plate", {"depth=sinkage:mm", "F=forse:N"}, {}}),
      HasSubstr("'forse' is nothing that a plate test has, expected one of: sinkage, pressure, "
                "force, diameter, width, length (and NAME_sd); the nearest is 'force'"));
  EXPECT_THAT(said({"plate", {"depth=sinkage", "F=force:N"}, {"diameter=60 mm"}}),
              HasSubstr("column 'depth' for sinkage has no unit in its name, expected one of the "
                        "units m, mm, cm, in"));
  EXPECT_THAT(said({"plate", {"depth=sinkage:mm", "F=force:N"}, {"diameter=60 N"}}),
              HasSubstr("got '60 N', expected a number and one of the units m, mm, cm, in"));
}

TEST_F(MeasurementFile, ColumnsThatSayWhatTheyAreNeedNoWord) {
  const std::string file = Write(
      "w.csv",
      "slip,attack_angle_deg,load_n,load_sd,f_x_n,f_x_sd,sinkage [mm],torque_n_m,n,z_sinkage_mm\n"
      "0.2,30,20,1,-4,0.6,12,,4,99\n");
  const MeasuredSoil soil =
      ReadMeasuredSoil({file}, {"wheel", {"n=repeats"}, {"radius=50 mm", "width=50 mm"}});
  ASSERT_EQ(soil.observations.size(), 2u);
  const Observation &pull = soil.observations[0], &sinkage = soil.observations[1];
  EXPECT_EQ(pull.output, kFx);
  EXPECT_NEAR(pull.slip, 0.2, 1e-12);
  EXPECT_NEAR(pull.attack_angle, M_PI / 6, 1e-12);
  EXPECT_DOUBLE_EQ(pull.load, 20);
  EXPECT_DOUBLE_EQ(pull.value, -4);
  EXPECT_DOUBLE_EQ(pull.sd, 0.3);  // of a mean of four
  EXPECT_EQ(sinkage.output, kSinkage);
  EXPECT_DOUBLE_EQ(sinkage.value, 0.012);
  EXPECT_TRUE(std::isnan(sinkage.sd));
  EXPECT_EQ(QuantityOfColumn(TestKind::kWheel, "load_kpa"), "");
  EXPECT_EQ(QuantityOfColumn(TestKind::kWheel, "load"), "");
  EXPECT_EQ(QuantityOfColumn(TestKind::kPlate, "force_of_n"), "");
}

TEST_F(MeasurementFile, BadInputIsRefusedByPlace) {
  EXPECT_EQ(SaidOfPlate("z_mm,F_N\n1,2\n"), "accepted");
  EXPECT_EQ(SaidOfPlate("z_mm,F_N\n2,4\n1,2\n3,7\n2,3\n"), "accepted");  // unloading is no error
  EXPECT_THAT(SaidOfPlate("z_mm,Fz_N\n1,2\n"),
              HasSubstr("d.csv:1: no column 'F_N' (for force), expected one of: z_mm, Fz_N; the "
                        "nearest is 'Fz_N'"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N\n1,2\n2,nan\n"),
              HasSubstr("d.csv:3: column 'F_N': got 'nan', expected a finite number"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N\n1,-2\n"),
              HasSubstr("d.csv:2: force: got -2 N (column 'F_N'), expected a number not below 0"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N\n"),
              HasSubstr("d.csv:1: plate 1: no rows, expected rows below"));
  EXPECT_THAT(SaidOfPlate(""), HasSubstr("d.csv:1: empty, expected a header line"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N\n0,0\n"), HasSubstr("no row tells anything"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N\n1,2,3\n"), HasSubstr("d.csv:2: 3 fields, expected 2"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N,F_N\n1,2,3\n"), HasSubstr("'F_N' stands here twice"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N\n1,2\n", ", where: {z_mm: 7}"),
              HasSubstr("no rows, expected rows with z_mm = 7"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N\n1,2\n", ", held_out: true"),
              HasSubstr("every row is held out"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N\n1,2\n", ", sd: {force: -3 %}"),
              HasSubstr("expected a positive standard deviation"));
  EXPECT_THAT(SaidOfPlate("z_mm,F_N\n1,2\n", ", heldout: true"),
              HasSubstr("an unknown key, expected one of:"));
  EXPECT_THAT(Said("z_mm,p_kPa\n1,2\n",
                   "{kind: plate, file: d.csv, columns: {sinkage: z_mm, pressure: "
                   "{column: p_kPa, unit: Pa}}, constants: {width: 5 cm}}"),
              HasSubstr("column 'p_kPa' is stated to be in Pa, its name says kPa: mixed units?"));
  EXPECT_THAT(
      Said("z,F_N\n30,2\n",
           "{kind: plate, file: d.csv, columns: {sinkage: {column: z, unit: m}, "
           "force: F_N}, constants: {diameter: 60 mm}}"),
      HasSubstr("d.csv:2: sinkage 30 m is more than 10 times the plate (0.06 m): column 'z' in "
                "another unit?"));
  EXPECT_THAT(
      Said("z_mm,F_N\n1,2\n", "{kind: plate, file: d.csv, columns: {sinkage: z_mm, force: F_N}}"),
      HasSubstr("a plate test has no diameter, expected the plate's diameter, or its width and"));
  EXPECT_THAT(Said("z_mm,F_N\n1,2\n", "{kind: plait, file: d.csv, columns: {}}"),
              HasSubstr("kind 'plait', expected plate, shear, press or wheel"));
  EXPECT_THAT(Said("slip,load_N,f_x_N\n3,2,1\n",
                   "{kind: wheel, file: d.csv, columns: {slip: slip, load: load_N, f_x: f_x_N}, "
                   "constants: {radius: 0.1 m, width: 0.1 m}}"),
              HasSubstr("d.csv:2: no motion"));
  EXPECT_THAT(Said("z_mm,F_N\n1,2\n",
                   "{kind: plate, file: no.csv, columns: {sinkage: z_mm, force: F_N}, "
                   "constants: {diameter: 60 mm}}"),
              HasSubstr("no.csv"));
}

TEST_F(MeasurementFile, TwoPlatesOfOneWidthAreNoted) {
  Write("p.csv", "z_mm,F_N\n1,2\n2,4\n");
  const std::string test = "  - {kind: plate, file: p.csv, columns: {sinkage: z_mm, force: F_N}, ";
  const MeasuredSoil soil = Read("tests:\n" + test + "name: disc, constants: {diameter: 60 mm}}\n" +
                                 test + "name: bar, constants: {width: 30 mm, length: 90 mm}}\n");
  ASSERT_EQ(soil.notes.size(), 1u);
  EXPECT_THAT(soil.notes[0], HasSubstr("disc and bar have the same width b = 30 mm"));
}

}  // namespace
}  // namespace grouser::surrogate
