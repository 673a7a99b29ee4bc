// What is written of bonds, of fragments, and of the grains that touch a body.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "dem_offline/engine/experiment/bonded_grain.h"
#include "dem_offline/engine/experiment/probes.h"

namespace grouser::dem::experiment {
namespace {

/// What intact bonds hold together, by id: the number of a piece is the least id in it.
std::vector<std::int32_t> PiecesOf(const World& world, const std::vector<BondLoad>& bonds) {
  std::vector<std::int32_t> piece(world.state().index_of.size());
  std::iota(piece.begin(), piece.end(), 0);
  const auto root = [&](std::int32_t k) {
    while (piece[k] != k) k = piece[k] = piece[piece[k]];
    return k;
  };
  for (const BondLoad& b : bonds) {
    if (!b.intact) continue;
    const std::int32_t p = root(b.grain_a), q = root(b.grain_b);
    piece[std::max(p, q)] = std::min(p, q);
  }
  for (std::size_t k = 0; k < piece.size(); ++k) piece[k] = root(static_cast<std::int32_t>(k));
  return piece;
}

/// [place in memory] whether the grain touches the body.
std::vector<std::uint8_t> TouchesOf(const World& world, int body) {
  const BodySlots& slots = world.state().bodies[static_cast<std::size_t>(body)].slots;
  std::vector<std::uint8_t> out(world.grains().size(), 0);
  for (std::size_t k = 0; k < slots.near.size(); ++k) {
    const std::int32_t* keys = &slots.key[k * slots.per_grain];
    out[slots.near[k]] =
        std::any_of(keys, keys + slots.per_grain, [](int key) { return key >= 0; });
  }
  return out;
}

}  // namespace

std::vector<const char*> BondColumns() {
  return {"intact",          "share_broken",      "broken_in_tension",
          "broken_in_shear", "broken_by_stretch", "force_mean_n",
          "force_max_n",     "stored_j",          "freed_j",
          "pieces",          "largest_piece",     "singles"};
}

/// Pieces, among them single spheres, of those spheres that were bonded.
void AddBonds(const World& world, std::vector<double>* row) {
  const std::vector<BondLoad> bonds = world.BondLoads();
  const BondStatistics& s = world.bond_statistics();
  double sum = 0, most = 0;
  for (const BondLoad& b : bonds) {
    const double force = std::hypot(b.tension_n, b.shear_n);
    sum += force;
    most = std::max(most, force);
  }
  std::map<std::int32_t, double> sizes;
  const std::vector<std::int32_t> piece = PiecesOf(world, bonds);
  std::vector<std::uint8_t> bonded(piece.size(), 0);
  for (const BondLoad& b : bonds) bonded[b.grain_a] = bonded[b.grain_b] = 1;
  for (std::size_t k = 0; k < piece.size(); ++k) {
    if (bonded[k]) sizes[piece[k]] += 1;
  }
  double largest = 0, singles = 0;
  for (const auto& [id, size] : sizes) {
    largest = std::max(largest, size);
    singles += size == 1;
  }
  const auto all = static_cast<double>(bonds.size()), intact = static_cast<double>(s.intact);
  row->insert(row->end(),
              {intact, all > 0 ? 1 - intact / all : 0, static_cast<double>(s.broken_in_tension),
               static_cast<double>(s.broken_in_shear), static_cast<double>(s.broken_by_stretch),
               sum / std::max(1.0, intact), most, s.stored_j, s.broken_j,
               static_cast<double>(sizes.size()), largest, singles});
}

std::vector<std::string> BondTableColumns(const Experiment& e, const Probe& p) {
  if (p.kind == Probe::Kind::kBondForces) {
    return {"time_s", "id_a", "id_b", "intact", "tension_n", "shear_n"};
  }
  std::vector<std::string> out = {"time_s",        "id",           "grain",       "piece",
                                  "bonds",         "x_m",          "y_m",         "z_m",
                                  "v_x_m_per_s",   "v_y_m_per_s",  "v_z_m_per_s", "w_x_rad_per_s",
                                  "w_y_rad_per_s", "w_z_rad_per_s"};
  for (const BodySpec& b : e.bodies) out.push_back("touches_" + b.name);
  return out;
}

/// The radius is that about the z axis of the file's body coordinates; NaN where none touches.
void Probes::AddTouching(std::size_t b, std::vector<double>* row) const {
  const World& world = ground_.world();
  const Body& body = world.body(ground_.BodyOf(b));
  const BuiltBody& built = ground_.Built(b);
  const Quatd turn = Unit(Mul(body.orientation, Conj(built.turn)));
  const Mat3d axes = MatrixOf(turn);
  const Vec3d origin = Sub(body.position_m, axes * built.centre_m);
  const std::vector<std::uint8_t> touches = TouchesOf(world, ground_.BodyOf(b));
  double n = 0, radius = 0;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    if (!touches[i]) continue;
    const GrainState s = ground_.At(i);
    const Vec3d at = axes.Back(Sub({s.x_m, s.y_m, s.z_m}, origin));
    radius += std::hypot(at[0], at[1]);
    n += 1;
  }
  row->push_back(n);
  row->push_back(n > 0 ? radius / n : std::numeric_limits<double>::quiet_NaN());
}

void Probes::WriteBondForces(const Table& table, double time_s) const {
  for (const BondLoad& b : ground_.world().BondLoads()) {
    sink_(table,
          {time_s, 1.0 * b.grain_a, 1.0 * b.grain_b, b.intact ? 1.0 : 0.0, b.tension_n, b.shear_n});
  }
}

void Probes::WriteFragments(const Table& table, double time_s) const {
  const World& world = ground_.world();
  const std::vector<BondLoad> bonds = world.BondLoads();
  const std::vector<std::int32_t> piece = PiecesOf(world, bonds);
  std::vector<double> held(piece.size(), 0);
  for (const BondLoad& b : bonds) {
    held[b.grain_a] += b.intact;
    held[b.grain_b] += b.intact;
  }
  std::vector<std::vector<std::uint8_t>> touches;
  for (std::size_t b = 0; b < e_.bodies.size(); ++b) {
    touches.push_back(TouchesOf(world, ground_.BodyOf(b)));
  }
  for (const std::int32_t place : world.state().index_of) {
    if (place < 0) continue;
    const std::int32_t id = world.grains()[place].id;
    const GrainState s = ground_.At(place);
    std::vector<double> row = {time_s,          1.0 * id, 1.0 * ground_.BondedGrainOf(id),
                               1.0 * piece[id], held[id], s.x_m,
                               s.y_m,           s.z_m,    s.v_x,
                               s.v_y,           s.v_z,    s.w_x,
                               s.w_y,           s.w_z};
    for (const auto& t : touches) row.push_back(t[place]);
    sink_(table, row);
  }
}

}  // namespace grouser::dem::experiment
