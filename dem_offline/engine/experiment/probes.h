#pragma once

#include <memory>
#include <vector>

#include "dem_offline/engine/experiment/ground.h"
#include "dem_offline/engine/experiment/joint_probes.h"
#include "dem_offline/engine/experiment/rings.h"
#include "dem_offline/engine/experiment/ruts.h"

namespace grouser::dem::experiment {

/// Mean over bins of a region; vectors and tensors in their axes (cylindrical: radial, turn, z).
struct Bin {
  double solid_fraction = 0;
  Vec3d velocity_m_per_s = {0, 0, 0};  ///< by mass
  double temperature_m2_per_s2 = 0;    ///< mean square of a component of velocity about the mean
  double grains = 0;
  /// Love-Weber stress of the contacts, compression positive: 11, 22, 33, 12, 13, 23.
  ContactMoment stress_pa = {};
  Vec3d displacement_m = {0, 0, 0};  ///< of the grains that are there, since the program began
};
/// What is known of the grains, by place; what is empty is not measured.
struct BinnedGrains {
  std::vector<GrainState> states;
  std::vector<double> solid_share = {};  ///< Ground::SolidShare; empty: 1
  std::vector<ContactMoment> moments = {};
  std::vector<Vec3d> displacement_m = {};  ///< NaN: came later
  bool planar = false;                     ///< discs in areas: solid fraction is the areal one
};
/// Row of bins, z fastest. A grain's volume and contacts are shared out by points spread evenly in
/// it; its velocity and displacement belong to the bin of its centre.
std::vector<Bin> MeasureBins(const BinnedGrains& grains, const Probe& probe);

/// Highest point of the grains over each of nx x ny fields of the region [m]; NaN: none.
std::vector<double> MeasureSurface(const std::vector<GrainState>& grains, const Probe& probe);

/// A heap about the upright axis through the middle of the region.
struct Heap {
  double angle_rad = 0;  ///< of the straight line through the flank, 20 to 80 % of its height
  double height_m = 0, foot_m = 0;
};
/// The surface ring by ring, each one the mean of the highest grains in up to 16 sectors; the foot
/// is where this mean falls under one diameter. All 0 for less than four rings.
Heap MeasureHeap(const std::vector<GrainState>& grains, const Probe& probe, double diameter_m);

/// Of the bonds of a world: columns of a series, and their values.
std::vector<const char*> BondColumns();
void AddBonds(const World& world, std::vector<double>* row);
std::vector<std::string> BondTableColumns(const Experiment& e, const Probe& p);

/// Tables of the probes of an experiment that is Resolved.
struct ProbeTables {
  void MakeColumns(const Experiment& e);

  Table series_;
  std::vector<Table> tables_;  ///< [probe]; without a name: none of its own
  std::vector<double> due_s_;  ///< [probe]
  bool energy_ = false;
};

/// Columns of the series that an experiment will have.
std::vector<std::string> SeriesColumns(const Experiment& experiment);

/// All probes of an experiment: collects every step, writes rows to the sink.
class Probes : ProbeTables {
 public:
  /// `e` is Resolved.
  /// mechanism: null where there are no joints.
  Probes(const Experiment& e, const Ground& ground, const Mechanism* mechanism, const SinkFn& sink);

  bool energy() const { return energy_; }
  /// The program begins: the stored energy is known from here on.
  void Begin();
  void AfterStep(std::int64_t steps);
  /// The last row, and the tables that are due at the end.
  void End();
  const EnergyBalance& first_balance() const { return balance_0_; }
  /// All that changes, for checkpoints, as Drive::Walk.
  template <class Archive>
  void Walk(Archive& a) {
    a(due_s_), a(sums_), a(turned_), a(summed_), a(next_s_), a(time_s_), a(balance_0_), a(start_m_);
    if (!trace_from_m_.empty()) a(trace_from_m_);
  }
  /// Energy that the world counts no longer (checkpoints: what left with grains).
  void Forget(double frozen_j) { balance_0_.frozen -= frozen_j; }

 private:
  void WriteSeries(double time_s);
  void AddRow(const Probe& p, std::vector<double>* row);
  void AddPose(std::size_t body, std::vector<double>* row) const;
  void AddWrench(std::size_t body, bool body_frame, std::vector<double>* row) const;
  void AddVelocity(std::size_t body, std::vector<double>* row) const;
  void AddEnergy(std::vector<double>* row) const;
  void AddTouching(std::size_t body, std::vector<double>* row) const;
  void WriteBondForces(const Table& table, double time_s) const;
  void WriteFragments(const Table& table, double time_s) const;
  Probe Shifted(const Probe& p) const;
  void WriteTable(const Probe& p, double time_s);
  void WriteBins(const Probe& p, const Probe& here, double time_s);
  BinnedGrains Binned() const;
  RingSums& RingsOf(const Probe& p);
  void AddToRings(double time_s);
  void WriteRings(const Probe& p, double time_s);
  void WriteGrains(const Probe& p, double time_s);
  void BeginTraces(double time_s);
  Trace TraceBehind(const Probe& p) const;
  Ruts RutsIn(const Probe& p, const Trace& trace) const;
  void WriteRuts(const Probe& p, double time_s) const;
  std::size_t IndexOf(const std::string& body) const;
  std::vector<GrainState> States() const;

  const Experiment& e_;
  const Ground& ground_;
  JointProbes joints_;
  const SinkFn& sink_;
  std::vector<RingSums> rings_;  ///< of probes of that kind, in their order
  std::vector<Wrench> sums_;     ///< [body]
  std::vector<Vec3d> turned_;    ///< [body] integral of the spin [rad]
  std::int64_t summed_ = 0;
  double next_s_ = 0, time_s_ = 0;
  EnergyBalance balance_0_;
  std::vector<Vec3d> start_m_;  ///< [id] where the program begins; empty: no bins
  /// [probe] x of the body where a trace begins (NaN: not yet); empty: no ruts
  std::vector<double> trace_from_m_;
};

}  // namespace grouser::dem::experiment
