// grouser-map on small synthetic rasters: planes of known slope, a hill, holes, refusals, signals.
#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

namespace {

namespace fs = std::filesystem;
using Heights = std::function<double(double east, double north)>;

const std::string kHusky =
    std::string(GROUSER_SOURCE) + "/surrogate/vehicle/shipped/husky.vehicle.yaml";
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kHole = -9999;
constexpr long kMostKibibytes = 260 << 10;

struct Made {
  int columns = 20, rows = 20;
  double cell = 2, east = 500000, north = 5300000;
  int epsg = 32632;  // 0: none
  int bands = 1;
  bool nodata = true;
  const char* unit = "";
  double scale = 1;
  GDALDataType type = GDT_Float32;
};

class TerrainMap : public ::testing::Test {
 protected:
  void SetUp() override {
    GDALAllRegister();
    folder_ = fs::temp_directory_path() / ("terrain_map_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Make(const char* name, const Heights& heights, const Made& m = {}) const {
    const std::string file = folder_ / name;
    GDALDataset* d = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        file.c_str(), m.columns, m.rows, m.bands, m.type, nullptr);
    double transform[6] = {m.east, m.cell, 0, m.north, 0, -m.cell};
    d->SetGeoTransform(transform);
    if (m.epsg != 0) {
      OGRSpatialReference crs;
      if (m.epsg == 54008) {  // ESRI's; sheared, every cell's sides are as long as they say
        crs.SetSinusoidal(-60, 0, 0);
        crs.SetProjCS("Sinusoidal");
        crs.SetWellKnownGeogCS("WGS84");
      } else {
        crs.importFromEPSG(m.epsg);
      }
      d->SetSpatialRef(&crs);
    }
    std::vector<double> cells;
    for (int r = 0; r < m.rows; ++r) {
      for (int c = 0; c < m.columns; ++c) cells.push_back(heights(m.cell * c, -m.cell * r));
    }
    for (int b = 1; b <= m.bands; ++b) {
      d->GetRasterBand(b)->SetUnitType(m.unit);
      if (m.scale != 1) d->GetRasterBand(b)->SetScale(m.scale);
      if (m.nodata) d->GetRasterBand(b)->SetNoDataValue(kHole);
      EXPECT_EQ(d->GetRasterBand(b)->RasterIO(GF_Write, 0, 0, m.columns, m.rows, cells.data(),
                                              m.columns, m.rows, GDT_Float64, 0, 0, nullptr),
                CE_None);
    }
    GDALClose(d);
    return file;
  }
  std::string Out() const { return folder_ / "map"; }
  std::string Call(const std::string& arguments, const std::string& vehicle = kHusky) const {
    return std::string(GROUSER_MAP) + " " + vehicle +
           " --limit 0.5 --heading-nodes 24 --slope-nodes 9 " + arguments + " --out " + Out() +
           " >" + (folder_ / "out").string() + " 2>" + (folder_ / "error").string();
  }
  int Run(const std::string& arguments, const std::string& vehicle = kHusky,
          const std::string& before = "") {
    fs::remove_all(Out());
    const int status = std::system((before + Call(arguments, vehicle)).c_str());
    std::stringstream text;
    text << std::ifstream(folder_ / "error").rdbuf();
    error_ = text.str();
    return WEXITSTATUS(status);
  }
  /// Bad input: exit code 2, words in the message, nothing left.
  void Refused(const std::string& arguments, const std::vector<std::string>& words) {
    EXPECT_EQ(Run(arguments), 2) << error_;
    for (const std::string& w : words) EXPECT_NE(error_.find(w), std::string::npos) << error_;
    EXPECT_EQ(Maps(), 0) << arguments;
  }
  /// Folders whose name begins as that of the map.
  int Maps() const {
    int n = 0;
    for (const auto& e : fs::directory_iterator(folder_))
      n += e.path().filename().string().starts_with("map");
    return n;
  }
  /// One cell of every band.
  std::vector<double> Cell(const char* raster, int column, int row) const {
    const std::string file = Out() + "/" + raster + ".tif";
    GDALDataset* d = GDALDataset::Open(file.c_str(), GDAL_OF_RASTER);
    std::vector<double> out;
    if (d == nullptr) return out;
    for (int b = 1; b <= d->GetRasterCount(); ++b) {
      double value = 0;
      EXPECT_EQ(d->GetRasterBand(b)->RasterIO(GF_Read, column, row, 1, 1, &value, 1, 1, GDT_Float64,
                                              0, 0, nullptr),
                CE_None);
      out.push_back(value);
    }
    GDALClose(d);
    return out;
  }

  fs::path folder_;
  std::string error_;
};

Heights Plane(double degrees, double up_azimuth) {
  const double rise = std::tan(degrees * kDegree);
  return [=](double east, double north) {
    return 100 +
           rise * (east * std::sin(up_azimuth * kDegree) + north * std::cos(up_azimuth * kDegree));
  };
}

enum Band { kUp, kDown, kAcross, kNorth, kEast = 5 };

// The plane's own headings: what is up the slope is so on the compass, whichever way the plane
// faces.
TEST_F(TerrainMap, OfAPlane) {
  double energy_up = 0;
  for (const auto& [azimuth, up] :
       std::vector<std::pair<double, int>>{{0, kNorth}, {90, kEast}, {225, kNorth + 5}}) {
    ASSERT_EQ(Run("--elevation " + Make("plane.tif", Plane(12, azimuth))), 0) << error_;
    const auto slope = Cell("slope", 9, 9);
    EXPECT_NEAR(slope[0], 12, 1e-3);
    EXPECT_NEAR(std::remainder(slope[1] - azimuth, 360), 0, 1e-2);
    const auto energy = Cell("energy", 9, 9), speed = Cell("speed", 9, 9),
               go = Cell("go_least", 9, 9);
    const int down = kNorth + (up - kNorth + 4) % 8, right = kNorth + (up - kNorth + 2) % 8;
    for (const auto& cells : {energy, speed, go}) {
      EXPECT_NEAR(cells[up], cells[kUp], 1e-4 * std::fabs(cells[kUp])) << azimuth;
      EXPECT_NEAR(cells[down], cells[kDown], 1e-4 * std::fabs(cells[kDown])) << azimuth;
      EXPECT_NEAR(cells[right], cells[kAcross], 0.01 * std::fabs(cells[kAcross])) << azimuth;
    }
    EXPECT_GT(energy[kUp], energy[kAcross]);
    EXPECT_GT(energy[kAcross], energy[kDown]);
    // Weight along the way: a metre up less a metre down costs at least twice the height gained.
    EXPECT_GT(energy[kUp] - energy[kDown], 2 * 70 * 9.81 * std::tan(12 * kDegree) * 0.5);
    EXPECT_NEAR(speed[kAcross], 0.5, 1e-3);
    if (energy_up == 0) energy_up = energy[kUp];
    EXPECT_NEAR(energy[kUp], energy_up, 1e-3 * energy_up);
  }
}

TEST_F(TerrainMap, BeyondTheGripNothingIsDriven) {
  ASSERT_EQ(Run("--soil ice --elevation " + Make("steep.tif", Plane(15, 0))), 0) << error_;
  for (int b = 0; b < 11; ++b) {
    EXPECT_EQ(Cell("speed", 5, 5)[b], 0);
    EXPECT_TRUE(std::isnan(Cell("energy", 5, 5)[b]));
    EXPECT_LT(Cell("go_least", 5, 5)[b], 0.05);
  }
  std::ifstream file(Out() + "/map.json");
  const auto info = nlohmann::json::parse(file);
  const auto binds = [&](int band) {
    return info["binding"][std::to_string(int(Cell("binding", 5, 5)[band]))].get<std::string>();
  };
  EXPECT_EQ(binds(kUp), "TRACTION");
  EXPECT_EQ(binds(kAcross), "LATERAL_GRIP");
  EXPECT_EQ(info["cells"]["driven_on_none"], 18 * 18);
  EXPECT_EQ(info["cells"]["holes"], 400 - 18 * 18);
  EXPECT_EQ(info["vehicle"]["name"], "husky");
}

// A cone's sides look outward: the way up at a cell points to its top.
TEST_F(TerrainMap, OfAHillWithAHole) {
  Made m;
  m.columns = m.rows = 61;
  const auto hill = [](double east, double north) {
    if (std::fabs(east - 20) < 3 && std::fabs(north + 20) < 3) return kHole;
    return 50 - 0.1 * std::hypot(east - 60, north + 60);
  };
  ASSERT_EQ(Run("--elevation " + Make("hill.tif", hill, m)), 0) << error_;
  EXPECT_NEAR(Cell("slope", 30, 5)[1], 180, 0.5);
  EXPECT_NEAR(Cell("slope", 55, 30)[1], 270, 0.5);
  EXPECT_NEAR(Cell("slope", 15, 45)[1], 45, 0.5);
  EXPECT_NEAR(Cell("slope", 15, 45)[0], std::atan(0.1) / kDegree, 0.02);
  for (const auto& [column, row] :
       std::vector<std::pair<int, int>>{{10, 10}, {12, 12}, {0, 30}, {60, 60}}) {
    EXPECT_TRUE(std::isnan(Cell("speed", column, row)[0])) << column;  // hole, beside it, the edge
    EXPECT_EQ(Cell("binding", column, row)[0], 255) << column;
  }
  EXPECT_FALSE(std::isnan(Cell("speed", 13, 13)[0]));
}

// GDAL's blocks of eleven bands of 512 x 512 cells are 11.5 MiB each. (Holes but for strips: those
// cost no time.)
TEST_F(TerrainMap, HoldsABoundedNumberOfBlocks) {
  Made m;
  m.columns = m.rows = 1024;
  const Heights plane = Plane(5, 30);
  const Heights strips = [&](double east, double north) {
    return std::fmod(east, 1024) < 40 ? plane(east, north) : kHole;
  };
  ASSERT_EQ(Run("--elevation " + Make("large.tif", strips, m)), 0) << error_;
  rusage children;
  ASSERT_EQ(getrusage(RUSAGE_CHILDREN, &children), 0);
  EXPECT_LT(children.ru_maxrss, kMostKibibytes);
  EXPECT_GT(children.ru_maxrss, 64 << 10);
}

TEST_F(TerrainMap, IsACloudOptimisedGeoTiff) {
  Made m;
  m.columns = 700;
  m.rows = 600;
  ASSERT_EQ(Run("--elevation " + Make("wide.tif", Plane(5, 30), m)), 0) << error_;
  for (const char* name : {"speed", "energy", "go_least", "binding", "slope"}) {
    const std::string file = Out() + "/" + name + ".tif";
    GDALDataset* d = GDALDataset::Open(file.c_str(), GDAL_OF_RASTER);
    ASSERT_NE(d, nullptr) << name;
    const char* layout = d->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE");
    EXPECT_STREQ(layout == nullptr ? "" : layout, "COG") << name;
    EXPECT_EQ(d->GetRasterXSize(), 700);
    GDALRasterBand* band = d->GetRasterBand(1);
    EXPECT_GE(band->GetOverviewCount(), 1) << name;
    int has = 0;
    const double nodata = band->GetNoDataValue(&has);
    EXPECT_EQ(has, 1);
    const bool bytes = std::string(name) == "binding";
    EXPECT_EQ(band->GetRasterDataType(), bytes ? GDT_Byte : GDT_Float32);
    EXPECT_TRUE(bytes ? nodata == 255 : std::isnan(nodata));
    if (std::string(name) != "slope") {
      EXPECT_STREQ(d->GetRasterBand(4)->GetDescription(), "000");
    }
    EXPECT_NE(d->GetSpatialRef(), nullptr);
    GDALClose(d);
  }
  // Tiles meet without a seam.
  EXPECT_EQ(Cell("speed", 511, 300), Cell("speed", 512, 300));
}

TEST_F(TerrainMap, SoilsByClassAndProbability) {
  const std::string dem = Make("dem.tif", Plane(8, 0));
  const std::string classes =
      Make("soil.tif", [](double east, double) { return east < 20 ? 1.0 : 2.0; });
  ASSERT_EQ(Run("--elevation " + dem + " --soil-class " + classes + " --soils 1=asphalt,2=ice"), 0)
      << error_;
  EXPECT_GT(Cell("speed", 4, 9)[kUp], 0.4);
  EXPECT_EQ(Cell("speed", 15, 9)[kUp], 0);
  const double firm = Cell("go_least", 4, 9)[kUp], ice = Cell("go_least", 15, 9)[kUp];
  const auto share = [](double p) { return [p](double, double) { return p; }; };
  const std::string sources = " --soil-probability asphalt=" + Make("a.tif", share(0.7)) +
                              " --soil-probability ice=" + Make("i.tif", share(0.3));
  ASSERT_EQ(Run("--elevation " + dem + sources), 0) << error_;
  EXPECT_NEAR(Cell("go_least", 4, 9)[kUp], 0.7 * firm + 0.3 * ice, 1e-5);
  EXPECT_EQ(Cell("speed", 4, 9)[kUp], 0);

  Refused("--elevation " + dem + " --soil-class " + classes + " --soils 1=asphalt",
          {"soil class: got 2 at"});
  Refused("--elevation " + dem + " --soil-class " + classes + " --soils 1=asphalt,2=icy",
          {"such as ice"});
  Refused("--elevation " + dem + " --soil-class " + classes, {"--soils"});
  Refused("--elevation " + dem + " --soil-probability ice=" + Make("i.tif", share(0.3)),
          {"sum 0.3"});
  Refused("--elevation " + dem + " --soil-probability ice=" + Make("i.tif", share(-0.3)),
          {"got -0.3"});
}

TEST_F(TerrainMap, RefusesBadRasters) {
  const Heights plane = Plane(5, 0);
  const auto with = [&](auto change) {
    Made m;
    change(&m);
    return "--elevation " + Make("bad.tif", plane, m);
  };
  Refused(with([](Made* m) { m->epsg = 4326; }), {"in degrees", "WGS 84", "gdalwarp"});
  Refused(with([](Made* m) { m->epsg = 0; }), {"no coordinate reference system"});
  Refused(with([](Made* m) { m->epsg = 2263; }), {"foot"});
  Refused(with([](Made* m) { m->epsg = 3857; }), {"Mercator", "whose metre is 0.7"});
  Refused(with([](Made* m) { m->epsg = 32662; }), {"Plate Carree", "on the ground"});
  Refused(with([](Made* m) { m->epsg = 4087; }), {"Equidistant Cylindrical", "on the ground"});
  Refused(with([](Made* m) { m->epsg = 54008; }), {"Sinusoidal", "on the ground"});
  Refused(with([](Made* m) { m->bands = 2; }), {"2 bands"});
  Refused(with([](Made* m) { m->columns = 2; }), {"2 x 20 cells"});
  Refused("--elevation " + (folder_ / "none.tif").string(), {"none.tif", "expected a GeoTIFF"});
  Refused(
      "--elevation " + Make("nan.tif", [](double e, double) { return e == 8 ? std::nan("") : 3; }),
      {"nan at column 4, row 0"});
  Refused("--elevation " + Make("inf.tif", [](double e, double) { return e == 8 ? INFINITY : 3; }),
          {"inf at"});
  for (const double wall : {-32768.0, 1e300, -3.4028235e38, 20001.0}) {  // nodata, not declared
    Made m;
    m.type = GDT_Float64;
    Refused(
        "--elevation " + Make(
                             "wall.tif", [=](double e, double) { return e == 8 ? wall : 3; }, m),
        {"at column 4, row 0", "a height within 20 km", "or a nodata value"});
  }
  Refused(with([](Made* m) { m->scale = 1e3; }), {"a height within 20 km"});
  Refused(with([](Made* m) { m->unit = "ft"; }), {"heights in ft"});
  Refused("--elevation " + Make("empty.tif", [](double, double) { return kHole; }), {"hole"});
  const std::string dem = "--elevation " + Make("dem.tif", plane) + " --soils 1=ice --soil-class ";
  const auto ones = [](double, double) { return 1.0; };
  const auto soil = [&](auto change) {
    Made m;
    change(&m);
    return Make("soil.tif", ones, m);
  };
  Refused(dem + soil([](Made* m) { m->columns = 21; }), {"21 x 20 cells", "20 x 20"});
  Refused(dem + soil([](Made* m) { m->east += 1; }), {"origin"});
  Refused(dem + soil([](Made* m) { m->cell = 2.1; }), {"cells of 2.1"});
  Refused(dem + soil([](Made* m) { m->epsg = 32633; }), {"zone 33N"});
  Refused("", {"--elevation"});
  const std::string class_1 = dem + soil([](Made*) {});
  Refused(class_1 + " --soils 1=asphalt", {"got class 1 twice"});
  Refused(dem.substr(0, dem.find(" --soils")) + " --negligible nan", {"--negligible: got nan"});
  fs::create_directories(Out());
  EXPECT_EQ(WEXITSTATUS(std::system(Call("--elevation " + Make("dem.tif", plane)).c_str())), 2)
      << "is there";
}

TEST_F(TerrainMap, TakesMetresByAnyName) {
  for (const char* unit : {"Metre", "meters"}) {
    Made m;
    m.unit = unit;
    EXPECT_EQ(Run("--elevation " + Make("unit.tif", Plane(5, 0), m)), 0) << error_;
  }
  Made m;  // a projection near its line of true length
  m.epsg = 32662;
  m.north = 10;
  EXPECT_EQ(Run("--elevation " + Make("equator.tif", Plane(5, 0), m)), 0) << error_;
}

// A folder that a killed process left is not taken over.
TEST_F(TerrainMap, LeavesOtherPartialFoldersAlone) {
  const std::string stale = Out() + ".partial-$$";
  ASSERT_EQ(Run("--elevation " + Make("plane.tif", Plane(5, 0)), kHusky,
                "mkdir " + stale + " " + stale + "-1; touch " + stale + "/stale.tif; exec "),
            0)
      << error_;
  EXPECT_TRUE(fs::exists(Out() + "/speed.tif"));
  EXPECT_FALSE(fs::exists(Out() + "/stale.tif"));
  EXPECT_EQ(Maps(), 3);
}

TEST_F(TerrainMap, NamesThatAreNoUtf8) {
  const std::string file = Make("h\xf6he n.tif", Plane(5, 0));
  ASSERT_EQ(Run("--elevation '" + file + "'"), 0) << error_;
  std::ifstream stream(Out() + "/map.json");
  const auto info = nlohmann::json::parse(stream);
  const std::string expected = (folder_ / "h\xef\xbf\xbdhe n.tif").string();
  EXPECT_EQ(info["inputs"][0]["file"], expected);
  EXPECT_NE(info["command"].get<std::string>().find("--elevation '" + expected + "'"),
            std::string::npos)
      << info["command"];
}

class TerrainPictures : public TerrainMap {
 protected:
  void SetUp() override {
    TerrainMap::SetUp();
    if (std::system("/usr/bin/python3 -c 'import matplotlib, PIL' 2>/dev/null") != 0) {
      GTEST_SKIP() << "no python3-matplotlib, python3-pil";
    }
  }
  const std::string by_ =
      " --pictures-by " GROUSER_SOURCE "/surrogate/terrain_map/map_pictures.py ";
  void ExpectPictures() const {
    for (const char* name : {"speed", "energy", "go_least", "binding"}) {
      const fs::path picture = Out() + "/" + name + ".png";
      ASSERT_TRUE(fs::exists(picture)) << name;
      GDALDataset* d = GDALDataset::Open(picture.c_str(), GDAL_OF_RASTER);
      ASSERT_NE(d, nullptr) << name;
      EXPECT_GT(d->GetRasterXSize(), 1000) << name;
      GDALClose(d);
    }
    EXPECT_FALSE(fs::exists(Out() + "/thinned"));
  }
};

TEST_F(TerrainPictures, OfTheExampleTerrain) {
  const std::string terrain = (folder_ / "terrain").string();
  ASSERT_EQ(std::system(("/usr/bin/python3 " GROUSER_SOURCE
                         "/surrogate/terrain_map/example/make_terrain.py --cells 60 " +
                         terrain)
                            .c_str()),
            0);
  ASSERT_EQ(Run("--elevation " + terrain + "/elevation.tif --soil-class " + terrain +
                "/soil.tif --soils 1=asphalt,2=ice" + by_),
            0)
      << error_;
  ExpectPictures();
}

TEST_F(TerrainPictures, OfAStripAndANameWithADollar) {
  std::stringstream text;
  text << std::ifstream(kHusky).rdbuf();
  std::string yaml = text.str();
  const std::size_t at = yaml.find("name: ");
  ASSERT_NE(at, std::string::npos);
  yaml.replace(at, yaml.find('\n', at) - at, "name: 'h$u_{s'");
  const std::string copy = (folder_ / "dollar.vehicle.yaml").string();
  std::ofstream(copy) << yaml;
  Made m;
  m.columns = 4;
  m.rows = 2000;
  ASSERT_EQ(Run("--elevation " + Make("strip.tif", Plane(5, 30), m) + by_, copy), 0) << error_;
  ExpectPictures();
}

// The map is there, its pictures are not, and the exit code says so.
TEST_F(TerrainPictures, ThatFailDoNotTakeTheMapAway) {
  const std::string script = (folder_ / "fails.py").string();
  std::ofstream(script) << "import pathlib, sys\n"
                           "(pathlib.Path(sys.argv[1]) / 'speed.png').write_text('torn')\n"
                           "sys.exit(1)\n";
  EXPECT_EQ(Run("--elevation " + Make("plane.tif", Plane(5, 0)) + " --pictures-by " + script), 3)
      << error_;
  EXPECT_NE(error_.find("fails.py: failed"), std::string::npos) << error_;
  for (const char* there : {"speed.tif", "map.json"}) {
    EXPECT_TRUE(fs::exists(Out() + "/" + there)) << there;
  }
  for (const char* gone : {"speed.png", "thinned"}) {
    EXPECT_FALSE(fs::exists(Out() + "/" + gone)) << gone;
  }
}

class TerrainSignals : public TerrainMap {
 protected:
  pid_t Start(const std::string& command) const {
    const pid_t child = fork();
    if (child == 0) {
      execl("/bin/sh", "sh", "-c", ("exec " + command).c_str(), nullptr);
      _exit(127);
    }
    return child;
  }
  /// Waits for a file of the partial folder ("": the folder). False: the process ended before.
  bool Appears(pid_t child, const std::string& name) const {
    for (int i = 0; i < 60000; ++i) {
      for (const auto& e : fs::directory_iterator(folder_)) {
        if (e.path().filename().string().starts_with("map.partial-") &&
            fs::exists(name.empty() ? e.path() : e.path() / name)) {
          return true;
        }
      }
      siginfo_t info = {};
      if (waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
          info.si_pid == child) {
        return false;
      }
      usleep(1000);
    }
    return false;
  }
};

// SIGTERM, SIGINT and SIGHUP leave nothing, SIGKILL nothing of the map's name.
TEST_F(TerrainSignals, EndCleanly) {
  Made m;
  m.columns = m.rows = 1500;
  const std::string dem = Make("large.tif", Plane(5, 30), m);
  for (const auto& [signal, when] :
       std::vector<std::pair<int, std::string>>{{SIGTERM, ""},
                                                {SIGHUP, ""},
                                                {SIGTERM, "speed.part"},
                                                {SIGINT, "speed.tif"},
                                                {SIGKILL, "speed.part"}}) {
    const pid_t child = Start(Call("--elevation " + dem));
    EXPECT_TRUE(Appears(child, when)) << when;
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_FALSE(fs::exists(Out())) << signal;
    if (signal != SIGKILL) {
      EXPECT_TRUE(WIFEXITED(status)) << signal;
      EXPECT_EQ(WEXITSTATUS(status), 1) << when;
      EXPECT_EQ(Maps(), 0) << when;
    }
  }
}

// Nothing is to be cleaned up: the signal ends it where it is.
TEST_F(TerrainSignals, EndACheckAtOnce) {
  const pid_t child = Start(std::string(GROUSER_MAP) + " " + kHusky + " --check 100000000 2>" +
                            (folder_ / "error").string());
  for (int i = 0; i < 60000; ++i) {  // its table is made
    std::stringstream text;
    text << std::ifstream(folder_ / "error").rdbuf();
    if (text.str().find(" s\n") != std::string::npos) break;
    usleep(1000);
  }
  kill(child, SIGTERM);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
}

}  // namespace
