// The fastest route and that of least energy over a map of `./grouser map`, by Boost Graph's
// Dijkstra.
//
//   map_route MAP FROM_X FROM_Y TO_X TO_Y OUT
//
// A step goes from a cell to one of its eight neighbours, d metres away on heading h, half of it in
// each: d/2 (1/v_h(a) + 1/v_h(b)) seconds, d/2 (e_h(a) + e_h(b)) joules, where a step that would
// give energy back counts as none (Dijkstra's costs are not negative). The diagonal of a cell that
// is not square lies on no heading of the map: it is driven in two legs, one on the diagonal
// heading and one along the longer side. Cells that are not driven on such a heading, or whose
// energy there is not known, are not entered or left by it. OUT: routes.csv, and backdrop.png for
// map_route.py.
#include <gdal_priv.h>

#include <algorithm>
#include <array>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <boost/graph/dijkstra_shortest_paths.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

namespace {

struct Step {
  int east, south;
};
// In the order of the map's bands: clockwise from north.
constexpr std::array<Step, 8> kSteps = {
    {{0, -1}, {1, -1}, {1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}}};
constexpr int kFirstBand = 4;  // before it: up, down, across

/// `bands` bands from `first` on of a raster of the map, cell by cell.
class Raster {
 public:
  Raster(const std::string& file, int first, int bands) {
    GDALDataset* data = GDALDataset::Open(file.c_str(), GDAL_OF_RASTER);
    if (data == nullptr) throw std::runtime_error(file + ": no raster of a map");
    if (data->GetRasterCount() < first + bands - 1) {
      throw std::runtime_error(file + ": " + std::to_string(data->GetRasterCount()) +
                               " bands, expected " + std::to_string(first + bands - 1));
    }
    columns = data->GetRasterXSize();
    rows = data->GetRasterYSize();
    data->GetGeoTransform(transform.data());
    values_.resize(static_cast<std::size_t>(bands));
    for (int b = 0; b < bands; ++b) {
      std::vector<float>& band = values_[static_cast<std::size_t>(b)];
      band.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
      if (data->GetRasterBand(first + b)->RasterIO(GF_Read, 0, 0, columns, rows, band.data(),
                                                   columns, rows, GDT_Float32, 0, 0,
                                                   nullptr) != CE_None) {
        throw std::runtime_error(file + ": cannot be read");
      }
    }
    GDALClose(data);
  }
  float At(std::size_t band, std::size_t cell) const { return values_[band][cell]; }
  /// Throws where the other one has not as many cells each way.
  void CheckSize(const std::string& file, const Raster& other) const {
    if (columns == other.columns && rows == other.rows) return;
    throw std::runtime_error(file + ": " + std::to_string(columns) + " x " + std::to_string(rows) +
                             " cells, expected " + std::to_string(other.columns) + " x " +
                             std::to_string(other.rows) + " as in speed.tif");
  }

  int columns = 0, rows = 0;
  std::array<double, 6> transform{};

 private:
  std::vector<std::vector<float>> values_;
};

struct Cost {
  float seconds = 0, joules = 0, metres = 0;
};
using Graph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, Cost>;

class Terrain {
 public:
  explicit Terrain(const std::string& map)
      : speed_(map + "/speed.tif", kFirstBand, 8), energy_(map + "/energy.tif", kFirstBand, 8) {
    energy_.CheckSize(map + "/energy.tif", speed_);
    std::vector<std::pair<std::size_t, std::size_t>> edges;
    std::vector<Cost> costs;
    for (int r = 0; r < speed_.rows; ++r) {
      for (int c = 0; c < speed_.columns; ++c) {
        for (std::size_t h = 0; h < kSteps.size(); ++h) {
          const int column = c + kSteps[h].east, row = r + kSteps[h].south;
          if (column < 0 || row < 0 || column >= speed_.columns || row >= speed_.rows) continue;
          const std::size_t a = CellAt(c, r), b = CellAt(column, row);
          Cost cost;
          if (!Drives(h, a, b, &cost)) continue;
          edges.emplace_back(a, b);
          costs.push_back(cost);
        }
      }
    }
    graph_ =
        Graph(boost::edges_are_sorted, edges.begin(), edges.end(), costs.begin(),
              static_cast<std::size_t>(speed_.columns) * static_cast<std::size_t>(speed_.rows));
  }

  std::size_t CellOf(double x, double y) const {
    const auto& t = speed_.transform;
    const double column = std::floor((x - t[0]) / t[1]), row = std::floor((y - t[3]) / t[5]);
    if (!(column >= 0 && row >= 0 && column < speed_.columns && row < speed_.rows)) {
      throw std::runtime_error(std::to_string(x) + ", " + std::to_string(y) + ": not on the map");
    }
    return CellAt(static_cast<int>(column), static_cast<int>(row));
  }
  double X(std::size_t cell) const {
    return speed_.transform[0] +
           speed_.transform[1] * (0.5 + static_cast<double>(cell % Columns()));
  }
  double Y(std::size_t cell) const {
    return speed_.transform[3] +
           speed_.transform[5] * (0.5 + static_cast<double>(cell / Columns()));
  }
  /// Cells from start to end; empty: there is no route.
  std::vector<std::size_t> Route(std::size_t from, std::size_t to, float Cost::*cost) const {
    std::vector<std::size_t> before(boost::num_vertices(graph_));
    for (std::size_t i = 0; i < before.size(); ++i) before[i] = i;
    boost::dijkstra_shortest_paths(
        graph_, from,
        boost::weight_map(boost::get(cost, graph_))
            .predecessor_map(boost::make_iterator_property_map(
                before.begin(), boost::get(boost::vertex_index, graph_))));
    std::vector<std::size_t> route = {to};
    while (route.back() != from && before[route.back()] != route.back()) {
      route.push_back(before[route.back()]);
    }
    if (route.back() != from) return {};
    std::reverse(route.begin(), route.end());
    return route;
  }
  Cost Between(std::size_t a, std::size_t b) const {
    return graph_[boost::edge(a, b, graph_).first];
  }
  const Raster& speed() const { return speed_; }

 private:
  std::size_t Columns() const { return static_cast<std::size_t>(speed_.columns); }
  std::size_t CellAt(int column, int row) const {
    return static_cast<std::size_t>(row) * Columns() + static_cast<std::size_t>(column);
  }
  // Adds what `metres` on heading h cost, half of them in each cell; false: not driven, or unknown.
  bool AddLeg(std::size_t h, double metres, std::size_t a, std::size_t b, Cost* cost) const {
    if (!(speed_.At(h, a) > 0 && speed_.At(h, b) > 0)) return false;  // NaN: a hole
    const float energy = energy_.At(h, a) + energy_.At(h, b);
    if (!std::isfinite(energy)) return false;
    cost->seconds += static_cast<float>(0.5 * metres * (1 / speed_.At(h, a) + 1 / speed_.At(h, b)));
    cost->joules += static_cast<float>(std::max(0.0, 0.5 * metres * energy));
    cost->metres += static_cast<float>(metres);
    return true;
  }
  // A step from a to b, its neighbour on heading h.
  bool Drives(std::size_t h, std::size_t a, std::size_t b, Cost* cost) const {
    const double east = std::fabs(kSteps[h].east * speed_.transform[1]);
    const double south = std::fabs(kSteps[h].south * speed_.transform[5]);
    if (east == 0 || south == 0) return AddLeg(h, east + south, a, b, cost);
    const double across = std::min(east, south), rest = std::fabs(east - south);
    if (!AddLeg(h, std::sqrt(2.0) * across, a, b, cost)) return false;
    if (rest < 1e-9 * across) return true;
    // The heading beside h that goes along the longer side: 090 or 270, else 000 or 180.
    const std::size_t along =
        east > south ? (kSteps[h].east > 0 ? 2 : 6) : (kSteps[h].south < 0 ? 0 : 4);
    return AddLeg(along, rest, a, b, cost);
  }

  Raster speed_, energy_;
  Graph graph_;
};

// Hillshade with the light from the north-west; red: driven on none of the eight headings.
void DrawBackdrop(const std::string& map, const Raster& speed, const std::string& file) {
  const Raster slope(map + "/slope.tif", 1, 2);
  slope.CheckSize(map + "/slope.tif", speed);
  GDALDataset* image = GetGDALDriverManager()->GetDriverByName("MEM")->Create(
      "", speed.columns, speed.rows, 3, GDT_Byte, nullptr);
  const auto n = static_cast<std::size_t>(speed.columns) * static_cast<std::size_t>(speed.rows);
  constexpr double kDegree = std::numbers::pi / 180;
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<unsigned char> cells(n, 255);
    for (std::size_t i = 0; i < n; ++i) {
      if (std::isnan(speed.At(0, i))) continue;
      const double angle = slope.At(0, i) * kDegree, up = slope.At(1, i) * kDegree;
      const double light =
          std::sqrt(0.5) * (std::cos(angle) + std::sin(angle) * std::cos(up - 135 * kDegree));
      bool driven = false;
      for (std::size_t h = 0; h < kSteps.size(); ++h) driven |= speed.At(h, i) > 0;
      const double tint = driven || channel == 0 ? 1 : 0.6;
      cells[i] = static_cast<unsigned char>(255 * std::clamp(tint * light, 0.0, 1.0));
    }
    if (image->GetRasterBand(channel + 1)
            ->RasterIO(GF_Write, 0, 0, speed.columns, speed.rows, cells.data(), speed.columns,
                       speed.rows, GDT_Byte, 0, 0, nullptr) != CE_None) {
      throw std::runtime_error(file + ": cannot be drawn");
    }
  }
  GDALDataset* png = GetGDALDriverManager()->GetDriverByName("PNG")->CreateCopy(
      file.c_str(), image, FALSE, nullptr, nullptr, nullptr);
  GDALClose(image);
  if (png == nullptr) throw std::runtime_error(file + ": cannot be written");
  GDALClose(png);
}

// The whole text as a number; throws std::invalid_argument.
double Number(const char* text) {
  double value = 0;
  const char* end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value)) {
    throw std::invalid_argument("'" + std::string(text) + "', expected a number");
  }
  return value;
}

int Run(char** argv) {
  GDALAllRegister();
  const std::string map = argv[1], out = argv[6];
  const std::array<double, 4> at = {Number(argv[2]), Number(argv[3]), Number(argv[4]),
                                    Number(argv[5])};
  const Terrain terrain(map);
  const auto cell = [&](std::size_t first) { return terrain.CellOf(at[first], at[first + 1]); };
  const std::size_t from = cell(0), to = cell(2);
  std::filesystem::create_directories(out);
  std::ofstream csv(out + "/routes.csv");
  csv.precision(10);
  csv << "route,x_m,y_m,time_s,energy_j\n";
  int missing = 0;
  for (const auto& [name, cost] : {std::pair<const char*, float Cost::*>{"fastest", &Cost::seconds},
                                   {"least_energy", &Cost::joules}}) {
    const std::vector<std::size_t> route = terrain.Route(from, to, cost);
    if (route.empty()) {
      std::fprintf(stderr, "map_route: %s: there is no route\n", name);
      ++missing;
      continue;
    }
    double length = 0, seconds = 0, joules = 0;
    for (std::size_t i = 0; i < route.size(); ++i) {
      if (i > 0) {
        const Cost step = terrain.Between(route[i - 1], route[i]);
        seconds += step.seconds;
        joules += step.joules;
        length += step.metres;
      }
      csv << name << "," << terrain.X(route[i]) << "," << terrain.Y(route[i]) << "," << seconds
          << "," << joules << "\n";
    }
    std::printf("%-12s %8.1f m  %8.1f s  %8.2f kJ\n", name, length, seconds, joules / 1000);
  }
  csv.close();
  if (!csv) throw std::runtime_error(out + "/routes.csv: cannot be written");
  DrawBackdrop(map, terrain.speed(), out + "/backdrop.png");
  return missing > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7) {
    std::fprintf(stderr, "usage: map_route MAP FROM_X FROM_Y TO_X TO_Y OUT\n");
    return 2;
  }
  try {
    return Run(argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "map_route: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "map_route: %s\n", error.what());
    return 1;
  }
}
