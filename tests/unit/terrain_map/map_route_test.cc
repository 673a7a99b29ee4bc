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

  // Five rows; cells of width_ x height_ m from (0, 5 height_) on.
  void Make(const std::string& name, int bands, int columns, const Cells& cells) const {
    Make(name, bands, columns, [&](int, int c, int r) { return cells(c, r); });
  }
  void Make(const std::string& name, int bands, int columns,
            const std::function<double(int band, int column, int row)>& cells) const {
    const std::string file = folder_ / "map" / (name + ".tif");
    GDALDataset* d = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        file.c_str(), columns, 5, bands, GDT_Float32, nullptr);
    double transform[6] = {0, width_, 0, 5 * height_, 0, -height_};
    d->SetGeoTransform(transform);
    for (int b = 1; b <= bands; ++b) {
      std::vector<float> values;
      for (int r = 0; r < 5; ++r) {
        for (int c = 0; c < columns; ++c) values.push_back(static_cast<float>(cells(b, c, r)));
      }
      EXPECT_EQ(d->GetRasterBand(b)->RasterIO(GF_Write, 0, 0, columns, 5, values.data(), columns, 5,
                                              GDT_Float32, 0, 0, nullptr),
                CE_None);
    }
    GDALClose(d);
  }
  // From the middle of the left edge to that of the right one.
  int Run(const std::string& from = "0.5 2.5", const std::string& to = "4.5 2.5") {
    const std::string call = std::string(GROUSER_MAP_ROUTE) + " " + (folder_ / "map").string() +
                             " " + from + " " + to + " " + (folder_ / "out").string() + " 2>" +
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
  double width_ = 1, height_ = 1;
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

// From corner to corner of cells of 2 m x 1 m (1 m x 2 m): four diagonals, each a leg on 135 and
// one on 090 (180), at the speeds of these.
TEST_F(MapRoute, DrivesTheDiagonalOfCellsThatAreNotSquareInTwoLegs) {
  for (const bool wide : {true, false}) {
    width_ = wide ? 2 : 1;
    height_ = wide ? 1 : 2;
    const int diagonal = 7, along = wide ? 6 : 8;  // bands
    Make("speed", 11, 5, [&](int band, int, int) {
      return band == diagonal ? 0.5 : band == along ? 4.0 : 1.0;
    });
    Make("energy", 11, 5, [](int, int) { return 3.0; });
    Make("slope", 2, 5, [](int, int) { return 0.0; });
    const std::string from = wide ? "1 4.5" : "0.5 9", to = wide ? "9 0.5" : "4.5 1";
    ASSERT_EQ(Run(from, to), 0) << error_;
    std::ifstream csv(folder_ / "out" / "routes.csv");
    std::string line, last;
    while (std::getline(csv, line)) last = line.find("least_energy") == 0 ? line : last;
    double x = 0, y = 0, seconds = 0, joules = 0;
    ASSERT_EQ(std::sscanf(last.c_str(), "least_energy,%lf,%lf,%lf,%lf", &x, &y, &seconds, &joules),
              4)
        << last;
    EXPECT_NEAR(joules, 4 * 3 * (std::sqrt(2) + 1), 1e-4);
    EXPECT_NEAR(seconds, 4 * (std::sqrt(2) / 0.5 + 1 / 4.0), 1e-4);
  }
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
