#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "dem_offline/engine/experiment/experiment.h"

namespace grouser::dem::experiment {

/// One grain far from everything, a floor and nothing else: for motions.
inline Experiment Empty() {
  Experiment e;
  e.name = "test";
  e.materials = {{"sand", 2500, 5e6, 0.3}, {"steel", 7800, 0, 0}};
  e.interfaces = {{"sand", "any", 0.5, 0.5, 0.1, {}}};
  e.box = {1, 1, 1, Side::kPeriodic, Side::kPeriodic, "steel"};
  Grains g;
  g.filling = Filling::kListed;
  g.material = "sand";
  GrainState s = {};
  s.x_m = s.y_m = 0.9;
  s.z_m = s.radius_m = 0.01;
  g.listed = {s};
  e.grains = {g};
  e.sample_s = 0.01;
  return e;
}

inline BodySpec Ball(std::vector<MotionStep> motion) {
  BodySpec b;
  b.name = "ball";
  b.material = "steel";
  PartSpec p;
  p.shape = PartShape::kSphere;
  p.radius_m = 0.05;
  b.parts = {p};
  b.position_m = {0.5, 0.5, 0.5};
  b.motion = std::move(motion);
  return b;
}

/// All rows of all tables of a run, by column.
struct Recorded {
  std::vector<Table> tables;
  std::vector<std::vector<std::vector<double>>> rows;
  SinkFn Sink() {
    return [this](const Table& table, const std::vector<double>& row) {
      std::size_t k = 0;
      while (k < tables.size() && tables[k].name != table.name) ++k;
      if (k == tables.size()) {
        tables.push_back(table);
        rows.emplace_back();
      }
      rows[k].push_back(row);
    };
  }
  std::vector<double> Column(const std::string& column, const std::string& table = "series") const {
    for (std::size_t k = 0; k < tables.size(); ++k) {
      const auto& names = tables[k].columns;
      const auto at = std::find(names.begin(), names.end(), column);
      if (tables[k].name != table || at == names.end()) continue;
      std::vector<double> out;
      for (const auto& row : rows[k]) out.push_back(row[at - names.begin()]);
      return out;
    }
    throw std::runtime_error("no column " + column + " in " + table);
  }
};

}  // namespace grouser::dem::experiment
