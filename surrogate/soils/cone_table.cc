#include "surrogate/soils/cone_table.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <numbers>

#include "surrogate/soils/grain_table.h"

namespace grouser::surrogate {
namespace {

constexpr char kConeWhat[] = "cone indices";
constexpr double kConeDegree = std::numbers::pi / 180;
constexpr std::array kConeColumns = {"soil",
                                     "soil_sha256",
                                     "cone_index_kPa",
                                     "cone_index_se_kPa",
                                     "gradient_kPa_per_m",
                                     "gradient_se_kPa_per_m",
                                     "beds",
                                     "to_depth_mm",
                                     "cone_diameter_mm",
                                     "cone_angle_deg",
                                     "speed_mm_per_s",
                                     "grain_mm",
                                     "bevameter_sha256",
                                     "source"};

ConeIndex ReadCone(const GrainLine& row) {
  ConeIndex cone;
  cone.soil = row.cells[0];
  cone.soil_sha256 = row.Hash(1);
  cone.index_pa = 1e3 * row.Number(2, 1e-3, 1e5);
  if (const auto se = row.Maybe(3, 0, 1e5)) cone.index_se_pa = 1e3 * *se;
  cone.gradient_pa_per_m = 1e3 * row.Number(4, -1e6, 1e6);
  if (const auto se = row.Maybe(5, 0, 1e6)) cone.gradient_se_pa_per_m = 1e3 * *se;
  cone.beds = row.Whole(6, 1, 1000);
  for (const std::size_t column : {3, 5}) {
    if (row.cells[column].empty() == (cone.beds == 1)) continue;
    row.Fail(column, cone.beds == 1 ? "none of one bed" : "a standard error over the beds");
  }
  cone.to_depth_m = 1e-3 * row.Number(7, 1, 1000);
  cone.diameter_m = 1e-3 * row.Number(8, 1, 1000);
  cone.angle_rad = kConeDegree * row.Number(9, 5, 180);
  cone.speed_m_per_s = 1e-3 * row.Number(10, 0.01, 1e4);
  cone.grain_m = 1e-3 * row.Number(11, 0.01, 1000);
  cone.bevameter_sha256 = row.Hash(12);
  cone.source = row.cells[13];
  return cone;
}

/// "18.0 kPa (0.4)", "18.0 kPa".
std::string WithError(double value, std::optional<double> error, double unit, const char* name) {
  const std::string text = fmt::format("{:.3g} {}", value / unit, name);
  return error ? text + fmt::format(" ({:.2g})", *error / unit) : text;
}

}  // namespace

std::vector<ConeIndex> ReadConeIndices(std::istream& table, const std::string& name) {
  std::vector<ConeIndex> cones;
  for (const GrainLine& line : ReadGrainLines(table, name, kConeColumns, kConeWhat)) {
    cones.push_back(ReadCone(line));
  }
  return cones;
}

std::vector<ConeIndex> ConeIndices(const std::vector<std::string>& more_files) {
  return LinesOf(GrainTables("cone_indices.csv", more_files, kConeWhat), ReadConeIndices);
}

std::string ConeText(const ConeIndex& c) {
  if (c.beds == 0) {
    return fmt::format("cone index {:.3g} kPa, gradient {:.3g} kPa/m, as given\n", c.index_pa / 1e3,
                       c.gradient_pa_per_m / 1e3);
  }
  return fmt::format(
      "cone index {}, mean over 0 to {:.0f} mm; gradient {}{}\n"
      "  cone of {:.3g} mm and {:.0f} degrees at {:.3g} mm/s, grains of {:.3g} mm; {}; "
      "bevameter.json {}\n",
      WithError(c.index_pa, c.index_se_pa, 1e3, "kPa"), 1e3 * c.to_depth_m,
      WithError(c.gradient_pa_per_m, c.gradient_se_pa_per_m, 1e3, "kPa/m"),
      c.index_se_pa ? fmt::format("; standard errors of {} beds in brackets", c.beds) : ", one bed",
      1e3 * c.diameter_m, c.angle_rad / kConeDegree, 1e3 * c.speed_m_per_s, 1e3 * c.grain_m,
      c.source, c.bevameter_sha256.substr(0, 12));
}

std::string ConeListText(const std::vector<ConeIndex>& cones) {
  std::string text =
      fmt::format("{:<40} {:>16} {:>16} {:>6} {:>6} {:>8} {:>6}\n", "soil", "cone index kPa",
                  "gradient kPa/m", "beds", "to mm", "cone mm", "grains");
  const auto cell = [](double value, std::optional<double> error) {
    return error ? fmt::format("{:.3g} ({:.2g})", value / 1e3, *error / 1e3)
                 : fmt::format("{:.3g}", value / 1e3);
  };
  for (const ConeIndex& c : cones) {
    text += fmt::format("{:<40} {:>16} {:>16} {:>6} {:>6.0f} {:>8.3g} {:>6.3g}\n", c.soil,
                        cell(c.index_pa, c.index_se_pa),
                        cell(c.gradient_pa_per_m, c.gradient_se_pa_per_m), c.beds,
                        1e3 * c.to_depth_m, 1e3 * c.diameter_m, 1e3 * c.grain_m);
  }
  return text + "(standard errors over beds in brackets; grains in mm)\n";
}

std::string ConeListJson(const std::vector<ConeIndex>& cones) {
  const auto maybe = [](const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
  };
  nlohmann::json list = nlohmann::json::array();
  for (const ConeIndex& c : cones) {
    list.push_back({{"soil", c.soil},
                    {"soil_sha256", c.soil_sha256},
                    {"index_pa", c.index_pa},
                    {"index_se_pa", maybe(c.index_se_pa)},
                    {"gradient_pa_per_m", c.gradient_pa_per_m},
                    {"gradient_se_pa_per_m", maybe(c.gradient_se_pa_per_m)},
                    {"beds", c.beds},
                    {"to_depth_m", c.to_depth_m},
                    {"diameter_m", c.diameter_m},
                    {"angle_rad", c.angle_rad},
                    {"speed_m_per_s", c.speed_m_per_s},
                    {"grain_m", c.grain_m},
                    {"bevameter_sha256", c.bevameter_sha256},
                    {"source", c.source}});
  }
  return list.dump(1) + "\n";
}

}  // namespace grouser::surrogate
