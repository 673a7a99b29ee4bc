#include "dem_offline/engine/experiment/joint_probes.h"

#include <algorithm>

#include "dem_offline/engine/core/rotation.h"
#include "dem_offline/engine/rig/work.h"

namespace grouser::dem::experiment {
namespace {

template <class T>
std::size_t IndexOf(const std::vector<T>& list, const std::string& name) {
  std::size_t k = 0;
  while (k < list.size() && list[k].name != name) ++k;
  return k;
}

}  // namespace

JointProbes::JointProbes(const Experiment& e, const Mechanism* mechanism)
    : e_(e),
      mechanism_(mechanism),
      joint_wanted_(e.joints.size()),
      spring_wanted_(e.springs.size()),
      reactions_(e.joints.size()),
      forces_(e.springs.size()) {
  for (const Probe& p : e.probes) {
    if (p.kind == Probe::Kind::kJoint) joint_wanted_[IndexOf(e.joints, p.of)] = 1;
    if (p.kind == Probe::Kind::kSpring) spring_wanted_[IndexOf(e.springs, p.of)] = 1;
  }
}

const Joint& JointProbes::JointOf(const Probe& probe) const {
  return e_.joints[IndexOf(e_.joints, probe.of)];
}

std::vector<std::string> JointProbes::ColumnsOf(const Experiment& e, const Probe& p) {
  std::vector<std::string> out;
  if (p.kind == Probe::Kind::kSpring) {
    const bool turns = e.springs[IndexOf(e.springs, p.of)].rotational;
    out = turns ? std::vector<std::string>{"torque_n_m", "angle_rad"}
                : std::vector<std::string>{"force_n", "length_m"};
  } else {
    const Joint::Kind kind = e.joints[IndexOf(e.joints, p.of)].kind;
    out = CoordinateNames(kind);
    const auto rates = kind == Joint::Kind::kSpherical
                           ? std::vector<std::string>{"w_x_rad", "w_y_rad", "w_z_rad"}
                           : out;
    for (const std::string& r : rates) out.push_back(r + "_per_s");
    const std::string axes = p.body_frame ? "body_" : "";
    for (const char* f : {"f_x_n", "f_y_n", "f_z_n", "t_x_n_m", "t_y_n_m", "t_z_n_m"}) {
      out.push_back(axes + f);
    }
    out.push_back("gap_m");
  }
  for (std::string& name : out) name = p.of + "." + name;
  return out;
}

void JointProbes::AfterStep() {
  ++steps_;
  for (std::size_t k = 0; k < joint_wanted_.size(); ++k) {
    if (joint_wanted_[k]) reactions_[k].Add(mechanism_->Reaction(k));
  }
  for (std::size_t k = 0; k < spring_wanted_.size(); ++k) {
    if (spring_wanted_[k]) forces_[k] += mechanism_->ReadSpring(k).force;
  }
}

void JointProbes::Forget() {
  steps_ = 0;
  std::fill(reactions_.begin(), reactions_.end(), Wrench{});
  std::fill(forces_.begin(), forces_.end(), 0.0);
}

void JointProbes::AddRow(const Probe& p, const Quatd& turn, std::vector<double>* row) const {
  const double share = 1 / std::max(1.0, steps_);
  if (p.kind == Probe::Kind::kSpring) {
    const std::size_t k = IndexOf(e_.springs, p.of);
    row->insert(row->end(), {share * forces_[k], mechanism_->ReadSpring(k).extent});
    return;
  }
  const std::size_t k = IndexOf(e_.joints, p.of);
  const JointReading r = mechanism_->ReadJoint(k);
  row->insert(row->end(), r.coordinates.begin(), r.coordinates.end());
  row->insert(row->end(), r.rates.begin(), r.rates.end());
  const Wrench& w = reactions_[k];
  Vec3d force = Scale(share, {w.fx, w.fy, w.fz}), moment = Scale(share, {w.tx, w.ty, w.tz});
  if (p.body_frame) {
    const Mat3d m = MatrixOf(turn);
    force = m.Back(force);
    moment = m.Back(moment);
  }
  row->insert(row->end(), force.begin(), force.end());
  row->insert(row->end(), moment.begin(), moment.end());
  row->push_back(r.gap_m);
}

void CheckJointProbe(const Experiment& e, const std::string& at, const Probe& p) {
  const bool joint = p.kind == Probe::Kind::kJoint;
  if (joint ? IndexOf(e.joints, p.of) < e.joints.size()
            : IndexOf(e.springs, p.of) < e.springs.size()) {
    return;
  }
  throw SpecError(at + (joint ? ".joint" : ".spring"), "'" + p.of + "'",
                  joint ? "the name of a joint" : "the name of a spring");
}

}  // namespace grouser::dem::experiment
