// grouser/map.h against the kernel and the planner behind it.
#include "clients/in_process/grouser/map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "surrogate/terrain_map/build_table.h"
#include "surrogate/terrain_map/cell.h"
#include "surrogate/vehicle/vehicle_file.h"
#include "tests/unit/count_allocations.h"

namespace grouser {
namespace {

const std::string kVehicle = std::string(GROUSER_VEHICLES) + "/cart.vehicle.yaml";
constexpr std::size_t kRows = 9, kColumns = 300, kCells = kRows * kColumns;
constexpr double kWidth = 1.5, kHeight = 2.5;

class InProcessMap : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    vehicle_ = new Vehicle(Vehicle::Open(kVehicle));
    map_ = new TerrainMap(*vehicle_, {.speed_limit = 3});
    const vehicle::VehicleFile file = vehicle::ReadVehicle(kVehicle);
    terrain_map::TableOptions options;
    options.limits.speed_limit_m_per_s = 3;
    tables_ = new std::vector<terrain_map::SlopeTable>;
    for (std::uint8_t s = 0; s < file.grounds.soils.size(); ++s) {
      tables_->push_back(
          terrain_map::BuildTable(file.vehicle, file.grounds, s, options, [](double) {}));
    }
  }
  static void TearDownTestSuite() {
    delete tables_;
    delete map_;
    delete vehicle_;
  }

  InProcessMap() : heights_((kRows + 2) * (kColumns + 2)), soil_(kCells) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> noise(-0.3F, 0.3F);
    for (std::size_t i = 0; i < heights_.size(); ++i) {
      heights_[i] = 0.2F * static_cast<float>(i % (kColumns + 2)) + noise(random);
    }
    for (std::size_t i = 0; i < kCells; ++i) soil_[i] = static_cast<std::uint8_t>(random() % 2);
  }
  MapCells Cells() const {
    return {.rows = kRows,
            .columns = kColumns,
            .width = kWidth,
            .height = kHeight,
            .elevation = heights_,
            .soil = soil_};
  }
  MapAnswers Answers() { return {speed_, energy_, least_, most_, binding_}; }
  terrain_map::Slope SlopeOf(std::size_t i) const {
    const auto row = [&](std::size_t r) {
      return std::span(heights_).subspan((i / kColumns + r) * (kColumns + 2), kColumns + 2);
    };
    return terrain_map::SlopeAt({row(0), row(1), row(2)}, i % kColumns + 1, kWidth, kHeight);
  }

  static Vehicle* vehicle_;
  static TerrainMap* map_;
  static std::vector<terrain_map::SlopeTable>* tables_;
  std::vector<float> heights_;
  std::vector<std::uint8_t> soil_;
  std::vector<float> speed_ = std::vector<float>(kCells), energy_ = speed_, least_ = speed_,
                     most_ = speed_;
  std::vector<Binding> binding_ = std::vector<Binding>(kCells);
};
Vehicle* InProcessMap::vehicle_ = nullptr;
TerrainMap* InProcessMap::map_ = nullptr;
std::vector<terrain_map::SlopeTable>* InProcessMap::tables_ = nullptr;

void ExpectSame(float a, float b, std::size_t i) {
  EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << i << ": " << a << " " << b;
}

// Every cell as by the kernel of one cell, on a heading of the grid and from the way up, by heights
// and by slopes, by classes and by probabilities; without an allocation.
TEST_F(InProcessMap, AnswersAsTheKernel) {
  heights_[5 * (kColumns + 2) + 40] = std::nanf("");
  soil_[17] = kNoSoil;
  std::vector<float> probability(2 * kCells);
  for (std::size_t i = 0; i < kCells; ++i) {
    probability[i] = soil_[i] == kNoSoil ? std::nanf("") : 0.25F + 0.5F * soil_[i];
    probability[kCells + i] = 1 - probability[i];
  }
  std::vector<double> slope(kCells), azimuth(kCells);
  for (std::size_t i = 0; i < kCells; ++i) {
    slope[i] = SlopeOf(i).angle_rad;
    azimuth[i] = SlopeOf(i).up_azimuth_rad;
  }
  int driven = 0, holes = 0;
  for (const MapWay way : {MapWay::Azimuth(2), MapWay::FromUp(0.4), MapWay::Across()}) {
    for (const bool by_slopes : {false, true}) {
      for (const bool by_class : {false, true}) {
        MapCells cells = Cells();
        if (by_slopes) {
          cells.elevation = {};
          cells.slope = slope;
          cells.up_azimuth = azimuth;
        }
        if (!by_class) {
          cells.soil = {};
          cells.probability = probability;
        }
        cells.way = way;
        const long before = g_allocations;
        ASSERT_TRUE(map_->Evaluate(cells, Answers())) << map_->Problem(cells, Answers());
        EXPECT_EQ(g_allocations, before);
        for (std::size_t i = 0; i < kCells; ++i) {
          if (std::isnan(slope[i]) || soil_[i] == kNoSoil) {
            EXPECT_TRUE(std::isnan(speed_[i]) && binding_[i] == kNoCell) << i;
            ++holes;
            continue;
          }
          const float shares[2] = {by_class ? soil_[i] == 0 : probability[i],
                                   by_class ? soil_[i] == 1 : probability[kCells + i]};
          const auto ask = [&](double heading) {
            return terrain_map::AnswerOf(*tables_, shares, 0.05, slope[i], heading);
          };
          terrain_map::CellAnswer expected = ask(way.of_grid ? azimuth[i] - way.angle : way.angle);
          if (way.both_ways) {
            const terrain_map::CellAnswer other = ask(-way.angle);
            if (other.speed_m_per_s < expected.speed_m_per_s ||
                (other.speed_m_per_s == expected.speed_m_per_s &&
                 other.go_least < expected.go_least)) {
              expected = other;
            }
          }
          ExpectSame(speed_[i], expected.speed_m_per_s, i);
          ExpectSame(energy_[i], expected.joules_per_metre, i);
          ExpectSame(least_[i], expected.go_least, i);
          ExpectSame(most_[i], expected.go_most, i);
          EXPECT_EQ(static_cast<int>(binding_[i]), static_cast<int>(expected.binding)) << i;
          driven += speed_[i] > 0;
        }
      }
    }
  }
  EXPECT_GT(driven, static_cast<int>(kCells));
  EXPECT_EQ(holes, 12 * 10);
}

// A whole map needs no ring: its inner cells are those of a block whose ring is the outermost
// cells.
TEST_F(InProcessMap, TakesAMapWithoutRing) {
  MapCells whole = Cells();
  whole.rows += 2;
  whole.columns += 2;
  whole.soil = {};
  whole.height = 0;  // square cells
  std::vector<float> speed(heights_.size()), energy = speed;
  ASSERT_TRUE(map_->Evaluate(whole, {.speed = speed, .energy = energy}))
      << map_->Problem(whole, {.speed = speed, .energy = energy});
  MapCells inner = Cells();
  inner.soil = {};
  inner.height = kWidth;
  ASSERT_TRUE(map_->Evaluate(inner, Answers()));
  for (std::size_t i = 0; i < speed.size(); ++i) {
    const std::size_t r = i / whole.columns, c = i % whole.columns;
    if (r == 0 || r > kRows || c == 0 || c > kColumns) {
      EXPECT_TRUE(std::isnan(speed[i]) && std::isnan(energy[i])) << i;
      continue;
    }
    ExpectSame(speed[i], speed_[(r - 1) * kColumns + c - 1], i);
    ExpectSame(energy[i], energy_[(r - 1) * kColumns + c - 1], i);
  }
  for (const std::size_t rows : {1, 2}) {  // edges alone
    whole.rows = rows;
    whole.elevation = std::span(heights_).first(rows * whole.columns);
    std::fill(speed.begin(), speed.end(), 7);
    ASSERT_TRUE(map_->Evaluate(whole, {.speed = std::span(speed).first(rows * whole.columns)}));
    EXPECT_EQ(std::count_if(speed.begin(), speed.end(), [](float v) { return std::isnan(v); }),
              rows * whole.columns);
  }
}

// Level ground is driven as the planner drives a level straight; a wall is not.
TEST_F(InProcessMap, DrivesTheLevelAsThePlannerAndNoWall) {
  const std::vector<double> slope = {0, 1.2}, azimuth = {0, 0}, s = {0, 1e4};
  const MapCells cells{.rows = 1, .columns = 2, .slope = slope, .up_azimuth = azimuth};
  std::vector<float> speed(2);
  ASSERT_TRUE(map_->Evaluate(cells, {.speed = speed}));
  std::vector<double> plan(2), safe(2);
  SpeedPlanner planner(*vehicle_, 2);
  ASSERT_TRUE(planner.Plan({.s = s}, {.speed_limit = 3}, {.speed = plan, .safe = safe}));
  EXPECT_NEAR(speed[0], safe[0], 1e-6);
  EXPECT_EQ(speed[1], 0);
}

TEST_F(InProcessMap, RefusesByName) {
  const auto says = [&](const MapCells& cells, const MapAnswers& out, const std::string& text) {
    EXPECT_FALSE(map_->Evaluate(cells, out));
    EXPECT_NE(map_->Problem(cells, out).find(text), std::string::npos) << map_->Problem(cells, out);
  };
  MapCells cells = Cells();
  cells.elevation = cells.elevation.first(7);
  says(cells, Answers(), "elevation: 7 entries, expected 3322");
  // Products that wrap to what the spans have.
  constexpr std::size_t kQuarter = std::size_t{1} << 62;
  const MapCells wrapped[] = {{.rows = kQuarter - 2, .columns = 2, .width = 1, .height = 1},
                              {.rows = 2 * kQuarter - 2, .columns = 0, .width = 1, .height = 1},
                              {.rows = 2, .columns = kQuarter - 2, .width = 1, .height = 1},
                              {.rows = SIZE_MAX - 1, .columns = 1, .width = 1, .height = 1}};
  for (const MapCells& w : wrapped) says(w, {}, "rows: ");
  cells = Cells();
  cells.width = NAN;
  says(cells, Answers(), "width: nan, expected a finite number above 0");
  soil_[3] = 2;
  says(Cells(), Answers(), "soil[3]: 2.000000, expected an index into soils()");
  soil_[3] = 0;
  MapAnswers out = Answers();
  out.energy = out.energy.first(2);
  says(Cells(), out, "energy: 2 entries, expected 2700 or none");
  cells = Cells();
  cells.height = -1;
  says(cells, Answers(), "height: -1");
  cells = Cells();
  cells.way = MapWay::FromUp(INFINITY);
  says(cells, Answers(), "way: inf");
  EXPECT_THROW(TerrainMap(*vehicle_, {.speed_limit = -1}), std::invalid_argument);
  EXPECT_THROW(TerrainMap(*vehicle_, {.worse_by_sd = 5}), std::invalid_argument);
}

}  // namespace
}  // namespace grouser
