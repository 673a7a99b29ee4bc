#include "proto/records/run_file.h"

#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/resource.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <thread>

#include "proto/records/durable_file.h"
#include "proto/records/hdf5_file.h"
#include "proto/records/message_json.h"
#include "proto/records/model_file.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/records/throws.h"

namespace grouser::records {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

RunFile SomeRun() {
  RunFile run;
  auto& record = run.record;
  record.set_run_id("0123456789abcdef");
  record.mutable_spec()->set_scene("smoke");
  record.mutable_spec()->mutable_state()->set_load_n(24);
  record.set_status(v1alpha1::RUN_STATUS_STEADY);
  auto* mean = record.add_outputs();
  mean->set_name("f_x");
  mean->set_mean(1.0 / 3.0);
  mean->set_standard_error(0.01);
  auto* stress = record.mutable_stress();
  stress->set_first_angle_rad(-1.5);
  stress->set_width_bins(5);
  for (int i = 0; i < 360; ++i) {
    stress->add_normal_pa(i * 1.1);
    stress->add_shear_tangential_pa(-i * 0.1);
    stress->add_shear_axial_pa(1e-300 * i);
  }
  auto* surface = record.mutable_surface();
  surface->set_nx(100);
  surface->set_ny(100);
  for (int i = 0; i < 10000; ++i) surface->add_height_m(i % 7 ? 0.001 * i : NAN);
  run.series["time_s"] = {0.0, 0.1, 0.2};
  run.series["f_x_n"] = {1.0, NAN, -3.0};
  return run;
}

TEST(RunFile, ARecordSaysWhichExperimentItIs) {
  const TempFolder folder;
  RunFile run = SomeRun();
  EXPECT_EQ(run.record.experiment_case(), v1alpha1::RunRecord::kSpec);
  run.record.clear_experiment();
  WriteRunFile(folder / "a.run.h5", run);
  EXPECT_THAT(MessageOf([&] { ReadRunFile(folder / "a.run.h5"); }),
              HasSubstr("a.run.h5: holds no experiment that this version knows"));
}

// What has gone since is passed over in a file of schema 1 alone.
TEST(RunFile, KeysAreUnknownByTheFilesSchema) {
  const TempFolder folder;
  const auto complaint = [&](int schema) {
    auto file = internal::H5Image::Create(folder / "a.run.h5");
    file.WriteFormat("grouser-run", schema);
    file.WriteText("record_json", R"({"gone": 1, "created_unix_s": 1e9})");
    file.Save();
    return MessageOf([&] { ReadRunFile(folder / "a.run.h5"); });
  };
  EXPECT_THAT(complaint(1), HasSubstr("holds no experiment"));
  EXPECT_THAT(complaint(2), HasSubstr("gone"));
  for (const int schema : {0, 3}) {
    EXPECT_THAT(complaint(schema), HasSubstr("expected 1 to 2")) << schema;
  }
}

TEST(RunFile, ARecordOfSchema1IsGivenInTodaysForm) {
  const TempFolder folder;
  const auto read = [&](const std::string& created) {
    auto file = internal::H5Image::Create(folder / "a.run.h5");
    file.WriteFormat("grouser-run", 1);
    file.WriteText("record_json", R"({"spec": {"scene": "a"}, "created_unix_s": )" + created + "}");
    file.CreateGroup("/series");
    file.Save();
    return ReadRunFile(folder / "a.run.h5");
  };
  const RunFile run = read("1795417257.5");
  EXPECT_EQ(run.schema, 1);
  EXPECT_EQ(run.record.create_time().seconds(), 1795417257);
  EXPECT_EQ(run.record.create_time().nanos(), 500000000);
  EXPECT_THAT(ToJson(run.record), testing::Not(HasSubstr("created_unix_s")));
  EXPECT_THAT(MessageOf([&] { read("-1"); }), HasSubstr("a.run.h5: record_json: created_unix_s"));
}

// hertz_oden_martins was another law up to engine version 4: hertz_dashpot.
TEST(RunFile, TheFormerLawOfARenamedNameIsReadUnderItsNewName) {
  const TempFolder folder;
  const auto read = [&](const std::string& version, const std::string& normal) {
    RunFile run = SomeRun();
    run.record.mutable_numerics()->set_engine_version(version);
    auto* laws = run.record.mutable_spec()->mutable_soil()->mutable_grains()->mutable_contact();
    laws->set_normal(normal);
    auto* setting = laws->add_settings();
    setting->set_law(normal);
    setting->set_name("damping_n_s_per_m");
    setting->set_value(2);
    WriteRunFile(folder / "a.run.h5", run);
    return ReadRunFile(folder / "a.run.h5");
  };
  const RunFile old = read("4", "hertz_oden_martins");
  const auto& laws = old.record.spec().soil().grains().contact();
  EXPECT_EQ(laws.normal(), "hertz_dashpot");
  EXPECT_EQ(laws.settings(0).law(), "hertz_dashpot");
  EXPECT_EQ(laws.settings(0).value(), 2);
  EXPECT_EQ(old.note,
            "run 0123456789abcdef of engine version 4 names the law hertz_oden_martins, which is "
            "hertz_dashpot since version 5, and is read so");
  for (const RunFile& kept : {read("5", "hertz_oden_martins"), read("4", "linear_spring")}) {
    EXPECT_THAT(kept.note, IsEmpty());
    EXPECT_NE(kept.record.spec().soil().grains().contact().normal(), "hertz_dashpot");
  }
}

TEST(RunFile, RoundTripIsExact) {
  const TempFolder folder;
  const RunFile run = SomeRun();
  WriteRunFile(folder / "a.run.h5", run);
  const RunFile back = ReadRunFile(folder / "a.run.h5");
  google::protobuf::util::MessageDifferencer differencer;
  google::protobuf::util::DefaultFieldComparator comparator;
  comparator.set_treat_nan_as_equal(true);
  differencer.set_field_comparator(&comparator);
  EXPECT_TRUE(differencer.Compare(run.record, back.record));
  EXPECT_EQ(back.series.at("time_s"), run.series.at("time_s"));
  EXPECT_TRUE(std::isnan(back.series.at("f_x_n")[1]));
}

TEST(RunFile, EqualRunsGiveEqualBytes) {
  const TempFolder folder;
  WriteRunFile(folder / "a.run.h5", SomeRun());
  WriteRunFile(folder / "b.run.h5", SomeRun());
  EXPECT_EQ(Sha256OfFile(folder / "a.run.h5"), Sha256OfFile(folder / "b.run.h5"));
}

TEST(RunFile, MeansAndUnitsAreReadableAttributes) {
  const TempFolder folder;
  WriteRunFile(folder / "a.run.h5", SomeRun());
  const auto file = internal::H5Image::Open(folder / "a.run.h5");
  EXPECT_EQ(file.ReadText("format"), "grouser-run");
  EXPECT_EQ(file.ReadText("status"), "RUN_STATUS_STEADY");
  EXPECT_EQ(file.ReadNumber("/", "f_x_mean"), 1.0 / 3.0);
  EXPECT_EQ(file.ReadNumber("/", "load_n"), 24.0);
  // A plain HDF5 reader sees the unit beside the data.
  const hid_t plain = H5Fopen((folder / "a.run.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(plain, 0);
  EXPECT_GT(H5Aexists_by_name(plain, "/series/f_x_n", "unit", H5P_DEFAULT), 0);
  H5Fclose(plain);
}

TEST(RunFile, TruncatedFilesAreRefusedWithThePath) {
  const TempFolder folder;
  WriteRunFile(folder / "a.run.h5", SomeRun());
  const std::string bytes = ReadFileBytes(folder / "a.run.h5");
  testing::internal::CaptureStderr();
  for (std::size_t size = 0; size < bytes.size(); size += bytes.size() / 97) {
    WriteFileDurably(folder / "cut.run.h5", bytes.substr(0, size));
    ASSERT_THAT(MessageOf([&] { ReadRunFile(folder / "cut.run.h5"); }),
                HasSubstr(folder / "cut.run.h5"))
        << size;
  }
  EXPECT_THAT(testing::internal::GetCapturedStderr(), IsEmpty());
}

// A flipped byte must never crash the reader; in the data it must be noticed.
TEST(RunFile, DamagedFilesNeverCrash) {
  const TempFolder folder;
  WriteRunFile(folder / "a.run.h5", SomeRun());
  const std::string bytes = ReadFileBytes(folder / "a.run.h5");
  for (std::size_t at = 0; at < bytes.size(); at += 1 + bytes.size() / 397) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x40);
    WriteFileDurably(folder / "bad.run.h5", damaged);
    MessageOf([&] { ReadRunFile(folder / "bad.run.h5"); });
  }
  std::string damaged = bytes;
  const double needle = 100 * 1.1;  // one entry of /stress/normal_pa
  const std::size_t at = damaged.find(std::string(reinterpret_cast<const char*>(&needle), 8));
  ASSERT_NE(at, std::string::npos);
  damaged[at + 2] = static_cast<char>(damaged[at + 2] ^ 1);
  WriteFileDurably(folder / "bad.run.h5", damaged);
  EXPECT_THAT(MessageOf([&] { ReadRunFile(folder / "bad.run.h5"); }),
              HasSubstr("/stress/normal_pa"));
}

TEST(RunFile, ForeignFilesAreNamedForWhatTheyAre) {
  const TempFolder folder;
  WriteFileDurably(folder / "text", "hello, this is no HDF5 file");
  EXPECT_THAT(MessageOf([&] { ReadRunFile(folder / "text"); }), HasSubstr("not an HDF5 file"));
  TileFile tile;
  tile.meta_json = "{}";
  WriteTileFile(folder / "tile", tile);
  EXPECT_THAT(MessageOf([&] { ReadRunFile(folder / "tile"); }),
              HasSubstr("holds 'grouser-tile', expected 'grouser-run'"));
  internal::H5Image foreign = internal::H5Image::Create(folder / "foreign");
  foreign.WriteArray("/x", std::vector<double>{1.0});
  foreign.Save();
  EXPECT_THAT(MessageOf([&] { ReadRunFile(folder / "foreign"); }), HasSubstr("foreign HDF5 file"));
  EXPECT_THAT(MessageOf([&] { ReadRunFile(folder / "gone"); }), HasSubstr("gone: cannot open"));
}

TEST(RunFile, FullDiskLeavesNothing) {
  const TempFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit tight = before;
  tight.rlim_cur = 8192;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tight), 0);
  const std::string message = MessageOf([&] { WriteRunFile(folder / "a.run.h5", SomeRun()); });
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_THAT(message, HasSubstr("a.run.h5: cannot write"));
  EXPECT_THAT(folder.List(), IsEmpty());
}

TEST(RunFile, UnequalSeriesAreRefused) {
  const TempFolder folder;
  RunFile run = SomeRun();
  run.series["f_y_n"] = {1.0};
  EXPECT_THAT(MessageOf([&] { WriteRunFile(folder / "a.run.h5", run); }),
              HasSubstr("has 1 entries, expected 3 as"));
}

TEST(RunFile, ManyThreadsWriteAndReadAtOnce) {
  const TempFolder folder;
  std::vector<std::jthread> threads;
  std::atomic<int> good{0};
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 10; ++i) {
        const std::string path = folder / (t % 2 ? "shared" : "own" + std::to_string(t));
        WriteRunFile(path, SomeRun());
        good += ReadRunFile(path).record.run_id() == "0123456789abcdef";
      }
    });
  }
  threads.clear();
  EXPECT_EQ(good, 40);
}

TEST(TileFile, RoundTrip) {
  const TempFolder folder;
  TileFile tile;
  tile.meta_json = R"({"what":"a tile"})";
  tile.doubles["length_m"] = {0.28};
  tile.floats["radius_m"] = {0.004f, 0.0045f};
  tile.floats["empty"] = {};
  tile.ints["position"] = {1, -2, 2147483647};
  WriteTileFile(folder / "t", tile);
  const TileFile back = ReadTileFile(folder / "t");
  EXPECT_EQ(back.meta_json, tile.meta_json);
  EXPECT_EQ(back.doubles, tile.doubles);
  EXPECT_EQ(back.floats, tile.floats);
  EXPECT_EQ(back.ints, tile.ints);
}

}  // namespace
}  // namespace grouser::records
