// A bed on disk: text, so that any peer's converter reads it.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "dem_offline/engine/bench/bed.h"
#include "dem_offline/engine/bench/text_file.h"

namespace grouser::dem::bench {
namespace {

constexpr char kColumns[] = "x_m,y_m,z_m,radius_m,mass_kg,v_x,v_y,v_z,w_x,w_y,w_z,glued";

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

}  // namespace

void SaveBed(const Bed& bed, const std::string& path) {
  // Under another name until whole: a run that is cut short leaves no bad bed.
  const std::string part = path + ".part";
  File file = OpenFile(part, "w");
  Bed copy = bed;
  std::fprintf(file.get(), "# kind=%s\n# seed=%llu\n", bed.kind.c_str(),
               static_cast<unsigned long long>(bed.source.seed));
  for (const auto& [name, at] : Numbers(copy)) std::fprintf(file.get(), "# %s=%.17g\n", name, *at);
  std::fprintf(file.get(), "%s\n", kColumns);
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
      columns = std::string(line) == std::string(kColumns) + "\n";
      if (!columns) throw std::runtime_error(path + ": expected the columns " + kColumns);
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

}  // namespace grouser::dem::bench
