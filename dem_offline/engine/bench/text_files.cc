// Beds on disk, and the forces on a wheel, from us or from a peer: text, so that any
// peer's converter reads them.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <utility>

#include "dem_offline/engine/bench/wheel.h"

namespace grouser::dem::bench {
namespace {

struct CloseFile {
  void operator()(std::FILE* f) const { std::fclose(f); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

/// Throws std::runtime_error with the file's name and the reason.
File OpenFile(const std::string& path, const char* mode) {
  File file(std::fopen(path.c_str(), mode));
  if (!file) throw std::runtime_error(path + ": " + std::strerror(errno));
  return file;
}

constexpr char kBedColumns[] = "x_m,y_m,z_m,radius_m,mass_kg,v_x,v_y,v_z,w_x,w_y,w_z,glued";

std::vector<std::pair<const char*, double*>> Numbers(Bed& bed) {
  BedSource& r = bed.source;
  return {{"length_m", &bed.length_m},
          {"width_m", &bed.width_m},
          {"height_m", &bed.height_m},
          {"dt_s", &bed.dt_s},
          {"shear_rate_per_s", &bed.shear_rate_per_s},
          {"mean_diameter_m", &r.mean_diameter_m},
          {"spread", &r.spread},
          {"density_kg_per_m3", &r.density_kg_per_m3},
          {"youngs_modulus_pa", &r.youngs_modulus_pa},
          {"poisson_ratio", &r.poisson_ratio},
          {"restitution", &r.restitution},
          {"friction", &r.friction},
          {"rolling_friction", &r.rolling_friction},
          {"rolling_damping", &r.rolling_damping},
          {"preparation_friction", &r.preparation_friction},
          {"gravity_m_per_s2", &r.gravity_m_per_s2},
          {"rayleigh_fraction", &r.rayleigh_fraction}};
}

void ReadSetting(const char* line, Bed& bed) {
  char name[64], value[64];
  if (std::sscanf(line, "# %63[^=]=%63s", name, value) != 2) return;
  const std::string key = name;
  if (key == "kind") bed.kind = value;
  if (key == "seed") bed.source.seed = std::stoull(value);
  for (const auto& [number, at] : Numbers(bed)) {
    if (key == number) *at = std::stod(value);
  }
}

constexpr char kSeriesColumns[] = "time_s,f_x_n,f_y_n,f_z_n,torque_n_m,sinkage_m,travel_m\n";

}  // namespace

void SaveBed(const Bed& bed, const std::string& path) {
  // Under another name until whole: a run that is cut short leaves no bad bed.
  const std::string part = path + ".part";
  File file = OpenFile(part, "w");
  Bed copy = bed;
  std::fprintf(file.get(), "# kind=%s\n# seed=%llu\n", bed.kind.c_str(),
               static_cast<unsigned long long>(bed.source.seed));
  for (const auto& [name, at] : Numbers(copy)) std::fprintf(file.get(), "# %s=%.17g\n", name, *at);
  std::fprintf(file.get(), "%s\n", kBedColumns);
  for (const GrainState& g : bed.grains) {
    for (const double v :
         {g.x_m, g.y_m, g.z_m, g.radius_m, g.mass_kg, g.v_x, g.v_y, g.v_z, g.w_x, g.w_y, g.w_z}) {
      std::fprintf(file.get(), "%.17g,", v);
    }
    std::fprintf(file.get(), "%d\n", g.glued ? 1 : 0);
  }
  const bool bad = std::ferror(file.get()) != 0;
  if (std::fclose(file.release()) != 0 || bad || std::rename(part.c_str(), path.c_str()) != 0) {
    throw std::runtime_error(path + ": " + std::strerror(errno));
  }
}

Bed LoadBed(const std::string& path) {
  const File file = OpenFile(path, "r");
  Bed bed;
  char line[512];
  bool columns = false;
  while (std::fgets(line, sizeof(line), file.get())) {
    if (line[0] == '#') {
      ReadSetting(line, bed);
    } else if (!columns) {
      columns = std::string(line) == std::string(kBedColumns) + "\n";
      if (!columns) throw std::runtime_error(path + ": expected the columns " + kBedColumns);
    } else {
      GrainState g = {};
      int glued = 0;
      const int got = std::sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%d", &g.x_m,
                                  &g.y_m, &g.z_m, &g.radius_m, &g.mass_kg, &g.v_x, &g.v_y, &g.v_z,
                                  &g.w_x, &g.w_y, &g.w_z, &glued);
      if (got != 12) throw std::runtime_error(path + ": bad line: " + line);
      g.glued = glued != 0;
      g.density_kg_per_m3 = bed.source.density_kg_per_m3;
      bed.grains.push_back(g);
    }
  }
  if (bed.grains.empty() || bed.kind.empty() || !(bed.dt_s > 0)) {
    throw std::runtime_error(path + ": not a bed of grouser-engine-bench");
  }
  bed.source.grains = static_cast<std::int64_t>(bed.grains.size());
  return bed;
}

void SaveSeries(const Series& s, const std::string& path) {
  File file = OpenFile(path, "w");
  std::fputs(kSeriesColumns, file.get());
  for (std::size_t k = 0; k < s.time_s.size(); ++k) {
    std::fprintf(file.get(), "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", s.time_s[k], s.f_x_n[k],
                 s.f_y_n[k], s.f_z_n[k], s.torque_n_m[k], s.sinkage_m[k], s.travel_m[k]);
  }
  if (std::fclose(file.release()) != 0) throw std::runtime_error(path + ": not written");
}

Series LoadSeries(const std::string& path) {
  const File file = OpenFile(path, "r");
  char line[256];
  if (!std::fgets(line, sizeof(line), file.get()) || std::strcmp(line, kSeriesColumns) != 0) {
    throw std::runtime_error(path + ": expected the columns " + kSeriesColumns);
  }
  Series s;
  double v[7];
  while (std::fgets(line, sizeof(line), file.get())) {
    if (std::sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%lf", v, v + 1, v + 2, v + 3, v + 4, v + 5,
                    v + 6) != 7) {
      throw std::runtime_error(path + ": bad line: " + line);
    }
    std::vector<double>* columns[] = {&s.time_s,     &s.f_x_n,     &s.f_y_n,   &s.f_z_n,
                                      &s.torque_n_m, &s.sinkage_m, &s.travel_m};
    for (int k = 0; k < 7; ++k) columns[k]->push_back(v[k]);
  }
  return s;
}

}  // namespace grouser::dem::bench
