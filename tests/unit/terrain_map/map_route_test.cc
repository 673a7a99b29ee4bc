// map_route on maps of a few cells: round what has no energy, and what it refuses.
#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <vector>

namespace {

namespace fs = std::filesystem;
using Cells = std::function<double(int column, int row)>;

class MapRoute : public ::testing::Test {
 protected:
  void SetUp() override {
    GDALAllRegister();
    folder_ = fs::temp_directory_path() / ("map_route_" + std::to_string(getpid()));
    fs::create_directories(folder_ / "map");
    Make("speed", 11, 5, [](int, int) { return 1.0; });
    Make("energy", 11, 5, [](int, int) { return 1.0; });
    Make("slope", 2, 5, [](int, int) { return 0.0; });
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Five rows; cells of 1 m from (0, 5) on.
  void Make(const std::string& name, int bands, int columns, const Cells& cells) const {
    const std::string file = folder_ / "map" / (name + ".tif");
    GDALDataset* d = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        file.c_str(), columns, 5, bands, GDT_Float32, nullptr);
    double transform[6] = {0, 1, 0, 5, 0, -1};
    d->SetGeoTransform(transform);
    std::vector<float> values;
    for (int r = 0; r < 5; ++r) {
      for (int c = 0; c < columns; ++c) values.push_back(static_cast<float>(cells(c, r)));
    }
    for (int b = 1; b <= bands; ++b) {
      EXPECT_EQ(d->GetRasterBand(b)->RasterIO(GF_Write, 0, 0, columns, 5, values.data(), columns, 5,
                                              GDT_Float32, 0, 0, nullptr),
                CE_None);
    }
    GDALClose(d);
  }
  // From the middle of the left edge to that of the right one.
  int Run(const std::string& from = "0.5 2.5") {
    const std::string call = std::string(GROUSER_MAP_ROUTE) + " " + (folder_ / "map").string() +
                             " " + from + " 4.5 2.5 " + (folder_ / "out").string() + " 2>" +
                             (folder_ / "error").string();
    const int status = std::system(call.c_str());
    std::stringstream text;
    text << std::ifstream(folder_ / "error").rdbuf();
    error_ = text.str();
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  bool Said(const std::string& text) const { return error_.find(text) != std::string::npos; }

  fs::path folder_;
  std::string error_;
};

// A wall of cells without energy that is open in the last row.
TEST_F(MapRoute, GoesRoundWhatHasNoEnergy) {
  ASSERT_EQ(Run(), 0) << error_;
  Make("energy", 11, 5, [](int c, int r) { return c == 2 && r < 4 ? NAN : 1.0; });
  ASSERT_EQ(Run(), 0) << error_;
  std::ifstream csv(folder_ / "out" / "routes.csv");
  std::string line;
  int in_column = 0;
  while (std::getline(csv, line)) {
    if (line.find("least_energy,2.5,") == std::string::npos) continue;
    ++in_column;
    EXPECT_EQ(line.find("least_energy,2.5,0.5,"), 0u) << line;
  }
  EXPECT_EQ(in_column, 1);
  Make("energy", 11, 5, [](int c, int) { return c == 2 ? NAN : 1.0; });
  EXPECT_EQ(Run(), 1);
  EXPECT_TRUE(Said("there is no route")) << error_;
}

TEST_F(MapRoute, RefusesWhatIsNoNumberAndNoMap) {
  EXPECT_EQ(Run("abc 2.5"), 2);
  EXPECT_TRUE(Said("'abc', expected a number")) << error_;
  EXPECT_EQ(Run("0.5 2.5x"), 2);
  EXPECT_EQ(Run("nan 2.5"), 2);
  EXPECT_EQ(Run("9 2.5"), 1);
  EXPECT_TRUE(Said("not on the map")) << error_;
  Make("slope", 2, 4, [](int, int) { return 0.0; });
  EXPECT_EQ(Run(), 1);
  EXPECT_TRUE(Said("slope.tif: 4 x 5 cells, expected 5 x 5")) << error_;
  Make("energy", 11, 4, [](int, int) { return 1.0; });
  EXPECT_EQ(Run(), 1);
  EXPECT_TRUE(Said("energy.tif: 4 x 5 cells, expected 5 x 5")) << error_;
  Make("energy", 3, 5, [](int, int) { return 1.0; });
  EXPECT_EQ(Run(), 1);
  EXPECT_TRUE(Said("energy.tif: 3 bands, expected 11")) << error_;
}

}  // namespace
