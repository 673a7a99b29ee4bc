// What is written while an experiment runs.
#include "dem_offline/engine/experiment/probes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dem_offline/engine/experiment/mixing.h"
#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/treads.h"

namespace grouser::dem::experiment {
namespace {

/// Origin of the file's body coordinates, and their axes.
struct Pose {
  Vec3d at;
  Quatd turn;
};
Pose PoseOf(const Body& b, const BuiltBody& built) {
  const Quatd turn = Unit(Mul(b.orientation, Conj(built.turn)));
  return {Sub(b.position_m, MatrixOf(turn) * built.centre_m), turn};
}

}  // namespace

Probes::Probes(const Experiment& e, const Ground& ground, const Mechanism* mechanism,
               const SinkFn& sink)
    : e_(e),
      ground_(ground),
      joints_(e, mechanism),
      sink_(sink),
      sums_(e.bodies.size()),
      turned_(e.bodies.size()) {
  MakeColumns(e);
  for (const Probe& p : e.probes) {
    if (p.kind == Probe::Kind::kRings) rings_.emplace_back(p, e.box);
    if (p.kind == Probe::Kind::kRuts) {
      trace_from_m_.assign(e.probes.size(), std::numeric_limits<double>::quiet_NaN());
    }
  }
}

std::vector<std::string> SeriesColumns(const Experiment& experiment) {
  ProbeTables tables;
  tables.MakeColumns(Resolved(experiment));
  return tables.series_.columns;
}

void ProbeTables::MakeColumns(const Experiment& e_) {
  series_.name = "series";
  series_.columns = {"time_s"};
  const auto add = [&](const std::string& prefix, const std::vector<const char*>& names) {
    for (const char* n : names) series_.columns.push_back(prefix + n);
  };
  for (const Probe& p : e_.probes) {
    const std::string body = p.body + "." + (p.body_frame ? "body_" : "");
    Table table;
    switch (p.kind) {
      case Probe::Kind::kWrench:
        add(body, {"f_x_n", "f_y_n", "f_z_n", "t_x_n_m", "t_y_n_m", "t_z_n_m"});
        break;
      case Probe::Kind::kPose:
        add(body,
            {"x_m", "y_m", "z_m", "turned_x_rad", "turned_y_rad", "turned_z_rad", "sinkage_m"});
        break;
      case Probe::Kind::kVelocity:
        add(body, {"v_x_m_per_s", "v_y_m_per_s", "v_z_m_per_s", "w_x_rad_per_s", "w_y_rad_per_s",
                   "w_z_rad_per_s"});
        break;
      case Probe::Kind::kCoordination:
        add("", {"coordination"});
        break;
      case Probe::Kind::kEnergy:
        energy_ = true;
        add("energy.",
            {"kinetic_j", "potential_j", "stored_j", "normal_damping_j", "tangential_damping_j",
             "slip_j", "rolling_j", "plastic_j", "cohesion_j", "body_work_j", "residual_j"});
        break;
      case Probe::Kind::kJoint:
      case Probe::Kind::kSpring: {
        const auto names = JointProbes::ColumnsOf(e_, p);
        series_.columns.insert(series_.columns.end(), names.begin(), names.end());
        break;
      }
      case Probe::Kind::kTreads:
        add(body,
            {"tread_rad", "entry_rad", "exit_rad", "flow_grains", "flow_area_m2", "flow_m_per_s"});
        break;
      case Probe::Kind::kMixing:
        add("", {"mixing"});
        break;
      case Probe::Kind::kRest:
        add("", {"kinetic_over_weight"});
        break;
      case Probe::Kind::kRepose:
        add("repose.", {"angle_rad", "height_m", "foot_m"});
        break;
      case Probe::Kind::kBins:
        table = {p.name, {"time_s",       "low_1_m",      "high_1_m",     "low_2_m",
                          "high_2_m",     "low_z_m",      "high_z_m",     "solid_fraction",
                          "v_1_m_per_s",  "v_2_m_per_s",  "v_z_m_per_s",  "temperature_m2_per_s2",
                          "grains",       "stress_11_pa", "stress_22_pa", "stress_zz_pa",
                          "stress_12_pa", "stress_1z_pa", "stress_2z_pa", "d_1_m",
                          "d_2_m",        "d_z_m"}};
        break;
      case Probe::Kind::kSurface:
        table = {p.name, {"time_s", "x_m", "y_m", "height_m"}};
        break;
      case Probe::Kind::kRuts:
        add(p.name + ".", {"count", "depth_m", "spacing_m", "spacing_error_m"});
        table = {p.name, {"time_s", "x_m", "height_m", "depth_m"}};
        break;
      case Probe::Kind::kRings:
        table = {p.name,
                 {"time_s", "low_m", "high_m", "grains", "areal_fraction", "v_t_m_per_s",
                  "v_r_m_per_s", "temperature_m2_per_s2"}};
        break;
      case Probe::Kind::kGrains:
        table = {p.name,
                 {"time_s", "id", "x_m", "y_m", "z_m", "r_m", "v_x_m_per_s", "v_y_m_per_s",
                  "v_z_m_per_s", "w_x_rad_per_s", "w_y_rad_per_s", "w_z_rad_per_s"}};
        break;
      case Probe::Kind::kBonds:
        add("bonds.", BondColumns());
        break;
      case Probe::Kind::kTouching:
        add(body, {"touching", "touching_radius_m"});
        break;
      case Probe::Kind::kBondForces:
      case Probe::Kind::kFragments:
        table = {p.name, BondTableColumns(e_, p)};
        break;
    }
    tables_.push_back(table);
    due_s_.push_back(p.every_s + (p.kind == Probe::Kind::kRings ? p.from_s : 0));
  }
}

std::size_t Probes::IndexOf(const std::string& body) const {
  std::size_t k = 0;
  while (e_.bodies[k].name != body) ++k;
  return k;
}

std::vector<GrainState> Probes::States() const {
  std::vector<GrainState> out;
  out.reserve(ground_.world().count());
  for (std::int64_t i = 0; i < ground_.world().count(); ++i) out.push_back(ground_.At(i));
  return out;
}

void Probes::Begin() {
  balance_0_ = ground_.world().Balance();
  const bool bins = std::any_of(e_.probes.begin(), e_.probes.end(),
                                [](const Probe& p) { return p.kind == Probe::Kind::kBins; });
  const World& world = ground_.world();
  for (std::int64_t i = 0; bins && i < world.count(); ++i) {
    const auto id = static_cast<std::size_t>(world.grains()[i].id);
    const GrainState s = ground_.At(i);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    if (id >= start_m_.size()) start_m_.resize(id + 1, Vec3d{nan, nan, nan});
    start_m_[id] = {s.x_m, s.y_m, s.z_m};
  }
  BeginTraces(0);
  WriteSeries(0);
}

void Probes::AfterStep(std::int64_t steps) {
  const double time = time_s_ = static_cast<double>(steps) * ground_.world().config().dt_s;
  for (std::size_t b = 0; b < sums_.size(); ++b) {
    sums_[b].Add(ground_.world().wrench(ground_.BodyOf(b)));
    const Body& body = ground_.world().body(ground_.BodyOf(b));
    turned_[b] = Add(turned_[b], Scale(ground_.world().config().dt_s, body.spin_rad_per_s));
  }
  joints_.AfterStep();
  ++summed_;
  if (steps == 1 && energy_) balance_0_ = ground_.world().Balance();
  if (time * (1 + 1e-9) < next_s_) return;
  BeginTraces(time);
  WriteSeries(time);
  AddToRings(time);
  for (std::size_t k = 0; k < e_.probes.size(); ++k) {
    if (!HasTable(e_.probes[k]) || !(e_.probes[k].every_s > 0)) continue;
    if (time * (1 + 1e-9) < due_s_[k]) continue;
    due_s_[k] += e_.probes[k].every_s;
    WriteTable(e_.probes[k], time);
  }
}

void Probes::End() {
  if (summed_ > 0) {
    WriteSeries(time_s_);
    AddToRings(time_s_);
  }
  for (const Probe& p : e_.probes) {
    if (HasTable(p) && !(p.every_s > 0)) WriteTable(p, time_s_);
  }
}

void Probes::WriteSeries(double time_s) {
  std::vector<double> row = {time_s};
  for (const Probe& p : e_.probes) AddRow(p, &row);
  if (sink_) sink_(series_, row);
  next_s_ += e_.sample_s;
  summed_ = 0;
  joints_.Forget();
  std::fill(sums_.begin(), sums_.end(), Wrench{});
}

void Probes::AddRow(const Probe& p, std::vector<double>* row) {
  const World& world = ground_.world();
  switch (p.kind) {
    case Probe::Kind::kWrench:
      return AddWrench(IndexOf(p.body), p.body_frame, row);
    case Probe::Kind::kPose:
      return AddPose(IndexOf(p.body), row);
    case Probe::Kind::kVelocity:
      return AddVelocity(IndexOf(p.body), row);
    case Probe::Kind::kCoordination:
      return row->push_back(world.MeanContacts());
    case Probe::Kind::kEnergy:
      return AddEnergy(row);
    case Probe::Kind::kSpring:
      return joints_.AddRow(p, {1, 0, 0, 0}, row);
    case Probe::Kind::kJoint: {
      const std::size_t child = IndexOf(joints_.JointOf(p).child);
      const Body& body = world.body(ground_.BodyOf(child));
      return joints_.AddRow(p, PoseOf(body, ground_.Built(child)).turn, row);
    }
    case Probe::Kind::kTreads: {
      const int b = ground_.BodyOf(IndexOf(p.body));
      const TreadState t = MeasureTreads(States(), world.body(b), world.config().frame.length_m);
      row->insert(row->end(), {t.tread_rad, t.entry_rad, t.exit_rad, t.flow_grains, t.flow_area_m2,
                               t.flow_m_per_s});
      return;
    }
    case Probe::Kind::kMixing:
      return row->push_back(MeasureMixing(States(), Shifted(p)));
    case Probe::Kind::kRest:
      return row->push_back(Restlessness(world));
    case Probe::Kind::kRepose: {
      const Heap heap = MeasureHeap(States(), p, LargestDiameter(e_));
      row->insert(row->end(), {heap.angle_rad, heap.height_m, heap.foot_m});
      return;
    }
    case Probe::Kind::kRuts: {
      const Ruts ruts = RutsIn(p, TraceBehind(p));
      row->insert(row->end(), {static_cast<double>(ruts.bottoms.size()), ruts.mean_depth_m,
                               ruts.spacing_m, ruts.spacing_error_m});
      return;
    }
    case Probe::Kind::kBonds:
      return AddBonds(world, row);
    case Probe::Kind::kTouching:
      return AddTouching(IndexOf(p.body), row);
    default:
      return;
  }
}

/// Mean over the sample, about the origin of the file's body coordinates.
void Probes::AddWrench(std::size_t b, bool body_frame, std::vector<double>* row) const {
  const Wrench& w = sums_[b];
  const double n = std::max<double>(1, static_cast<double>(summed_));
  Vec3d force = Scale(1 / n, {w.fx, w.fy, w.fz}), moment = Scale(1 / n, {w.tx, w.ty, w.tz});
  const Body& body = ground_.world().body(ground_.BodyOf(b));
  const Pose pose = PoseOf(body, ground_.Built(b));
  moment = Add(moment, CrossD(Sub(body.position_m, pose.at), force));
  if (body_frame) {
    const Mat3d r = MatrixOf(pose.turn);
    force = r.Back(force);
    moment = r.Back(moment);
  }
  row->insert(row->end(), {force[0], force[1], force[2], moment[0], moment[1], moment[2]});
}

void Probes::AddPose(std::size_t b, std::vector<double>* row) const {
  const Body& body = ground_.world().body(ground_.BodyOf(b));
  const Pose pose = PoseOf(body, ground_.Built(b));
  const Vec3d& turned = turned_[b];
  row->insert(row->end(), {pose.at[0], pose.at[1], pose.at[2], turned[0], turned[1], turned[2],
                           ground_.level_m() - LowestPoint(body)});
}

void Probes::AddVelocity(std::size_t b, std::vector<double>* row) const {
  const Body& body = ground_.world().body(ground_.BodyOf(b));
  const Pose pose = PoseOf(body, ground_.Built(b));
  const Vec3d& w = body.spin_rad_per_s;
  const Vec3d v = Add(body.velocity_m_per_s, CrossD(w, Sub(pose.at, body.position_m)));
  row->insert(row->end(), {v[0], v[1], v[2], w[0], w[1], w[2]});
}

void Probes::AddEnergy(std::vector<double>* row) const {
  const EnergyBalance e = ground_.world().Balance();
  row->insert(row->end(), {e.kinetic, e.potential - balance_0_.potential, e.stored,
                           e.normal_damping, e.tangent_damping, e.slip, e.rolling, e.plastic,
                           e.cohesion, e.body_work, e.Total() - balance_0_.Total()});
}

RingSums& Probes::RingsOf(const Probe& p) {
  std::size_t k = 0;
  for (const Probe* o = e_.probes.data(); o != &p; ++o) k += o->kind == Probe::Kind::kRings;
  return rings_[k];
}

void Probes::AddToRings(double time_s) {
  for (const Probe& p : e_.probes) {
    if (p.kind == Probe::Kind::kRings && time_s > p.from_s) RingsOf(p).Add(ground_);
  }
}

void Probes::WriteRings(const Probe& p, double time_s) {
  RingSums& sums = RingsOf(p);
  if (sums.samples() == 0) return;
  const std::vector<RingMean> rings = sums.Take();
  for (std::size_t k = 0; k < rings.size(); ++k) {
    const RingMean& m = rings[k];
    sink_(tables_[&p - e_.probes.data()],
          {time_s, sums.Low(k), sums.Low(k + 1), m.grains, m.areal_fraction, m.tangential_m_per_s,
           m.radial_m_per_s, m.temperature_m2_per_s2});
  }
}

void Probes::WriteGrains(const Probe& p, double time_s) {
  for (std::int64_t i = 0; i < ground_.world().count(); ++i) {
    const GrainState s = ground_.At(i);
    sink_(tables_[&p - e_.probes.data()],
          {time_s, static_cast<double>(ground_.world().grains()[i].id), s.x_m, s.y_m, s.z_m,
           s.radius_m, s.v_x, s.v_y, s.v_z, s.w_x, s.w_y, s.w_z});
  }
}

/// Regions are counted from the back of a window that follows a body.
Probe Probes::Shifted(const Probe& p) const {
  Probe here = p;
  for (Vec3d* end : {&here.region.low_m, &here.region.high_m}) (*end)[0] += ground_.from_m();
  return here;
}

void Probes::WriteTable(const Probe& p, double time_s) {
  if (!sink_) return;
  if (p.kind == Probe::Kind::kRings) return WriteRings(p, time_s);
  if (p.kind == Probe::Kind::kGrains) return WriteGrains(p, time_s);
  if (p.kind == Probe::Kind::kRuts) return WriteRuts(p, time_s);
  const Table& table = tables_[&p - e_.probes.data()];
  if (p.kind == Probe::Kind::kBondForces) return WriteBondForces(table, time_s);
  if (p.kind == Probe::Kind::kFragments) return WriteFragments(table, time_s);
  const Probe here = Shifted(p);
  const Region& r = here.region;
  if (p.kind == Probe::Kind::kSurface) {
    const std::vector<double> height = MeasureSurface(States(), here);
    for (int ix = 0; ix < p.n[0]; ++ix) {
      for (int iy = 0; iy < p.n[1]; ++iy) {
        sink_(table, {time_s, r.low_m[0] + (ix + 0.5) * (r.high_m[0] - r.low_m[0]) / p.n[0],
                      r.low_m[1] + (iy + 0.5) * (r.high_m[1] - r.low_m[1]) / p.n[1],
                      height[static_cast<std::size_t>(ix) * p.n[1] + iy]});
      }
    }
    return;
  }
  WriteBins(p, here, time_s);
}

}  // namespace grouser::dem::experiment
