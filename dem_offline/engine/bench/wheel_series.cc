// The forces on a wheel as text, from us or from a peer.
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "dem_offline/engine/bench/text_file.h"
#include "dem_offline/engine/bench/wheel.h"

namespace grouser::dem::bench {
namespace {

constexpr char kColumns[] = "time_s,f_x_n,f_y_n,f_z_n,torque_n_m,sinkage_m,travel_m\n";

}  // namespace

void SaveSeries(const Series& s, const std::string& path) {
  File file = OpenFile(path, "w");
  std::fputs(kColumns, file.get());
  for (std::size_t k = 0; k < s.time_s.size(); ++k) {
    std::fprintf(file.get(), "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", s.time_s[k], s.f_x_n[k],
                 s.f_y_n[k], s.f_z_n[k], s.torque_n_m[k], s.sinkage_m[k], s.travel_m[k]);
  }
  if (std::fclose(file.release()) != 0) throw std::runtime_error(path + ": not written");
}

Series LoadSeries(const std::string& path) {
  const File file = OpenFile(path, "r");
  char line[256];
  if (!std::fgets(line, sizeof(line), file.get()) || std::strcmp(line, kColumns) != 0) {
    throw std::runtime_error(path + ": expected the columns " + kColumns);
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
