#include "dem_offline/engine/experiment/freedoms.h"

#include <cmath>

#include "dem_offline/engine/core/rotation.h"
#include "dem_offline/engine/experiment/plan.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kOnAxle = 1e-3;  // of a body's reach: the centre of mass is on the axle
constexpr const char* kAxes[] = {"x", "y", "z"};

bool AnyAxis(const MotionStep& s) { return s.free_axes[0] || s.free_axes[1] || s.free_axes[2]; }

/// Along an axis of the world, or the axle as the body stands at first.
double Along(const Vec3d& v, const Vec3d& axis) { return std::abs(DotD(v, axis)); }

void CheckAxis(const Experiment& e, const std::string& at, const MotionStep& s, int k) {
  const auto refuse = [&](const char* key, const std::string& expected) {
    throw SpecError(at + ".free", std::string(kAxes[k]) + " beside " + key + " along it", expected);
  };
  const std::string either = std::string("either ") + kAxes[k] + " free, or that";
  if (s.velocity_m_per_s[k] != 0) refuse("a velocity", either);
  if (s.amplitude_m[k] != 0) refuse("an amplitude", either);
  if (s.hold && s.direction[k] != 0) refuse("a held force", either);
  if (k == 1 && e.box.planar) refuse("a planar box", "x, z or spin");
}

/// A rig takes up the moment of a centre of mass that is not on the axle, but its forces along
/// free axes would be those of another motion.
void CheckCentre(const std::string& at, const BodySpec& body, const MotionStep& s,
                 const FreeMass& mass) {
  const bool turns = DotD(s.spin_rad_per_s, s.spin_rad_per_s) > 0, about_axle = s.about_axle;
  if (!s.free_spin && !turns) return;
  const double near = kOnAxle * ShapeOf(body.parts, at).reach;
  const Vec3d& c = mass.centre_m;
  const bool off_axle = std::hypot(c[0], c[2]) > near;
  if (off_axle || (turns && !about_axle && std::abs(c[1]) > near)) {
    throw SpecError(at + ".free",
                    "it for a body that turns, with its centre of mass at [" + Short(c[0]) + ", " +
                        Short(c[1]) + ", " + Short(c[2]) + "] m",
                    "a centre of mass on the axle (the body's own y axis); at the origin where it "
                    "turns about another axis");
  }
}

}  // namespace

bool HasFreedom(const MotionStep& s) { return AnyAxis(s) || s.free_spin; }

FreeMass FreeMassOf(const BodySpec& body, const Material& material, const std::string& field) {
  FreeMass out;
  const bool given = body.inertia_kg_m2 != Vec3d{0, 0, 0};
  double of_unit_density[2] = {0, 0};  // volume, moment about the centre along y
  out.mass_kg = body.mass_kg;
  out.centre_m = body.centre_m;
  if (!given) {
    const MassProperties m = MassOf(body.parts, field);
    of_unit_density[0] = m.volume_m3;
    of_unit_density[1] = m.tensor_m5[1];
    out.centre_m = m.centre_m;
    if (!(out.mass_kg > 0)) out.mass_kg = material.density_kg_per_m3 * m.volume_m3;
  }
  if (!(out.mass_kg > 0)) {
    throw SpecError(field + ".mass_kg", "none",
                    "a mass, or a density of material '" + material.name + "'");
  }
  const double about_centre =
      given ? body.inertia_kg_m2[1] : of_unit_density[1] * out.mass_kg / of_unit_density[0];
  const Vec3d& c = out.centre_m;
  out.axle_inertia_kg_m2 = about_centre + out.mass_kg * (c[0] * c[0] + c[2] * c[2]);
  return out;
}

void CheckFreedoms(const Experiment& e, const std::string& at, const BodySpec& body,
                   const MotionStep& s) {
  for (int k = 0; k < 3; ++k) {
    if (!std::isfinite(s.applied_force_n[k])) {
      throw SpecError(at + ".applied_force_n", Short(s.applied_force_n[k]), "finite numbers");
    }
    if (s.free_axes[k]) CheckAxis(e, at, s, k);
    if (!s.free_axes[k] && s.applied_force_n[k] != 0) {
      throw SpecError(at + ".applied_force_n",
                      Short(s.applied_force_n[k]) + " N along " + kAxes[k] + ", which is not free",
                      std::string(kAxes[k]) + " in `free`, or 0");
    }
  }
  if (!s.free_spin && s.applied_torque_n_m != 0) {
    throw SpecError(at + ".applied_torque_n_m", "it while the spin is not free", "spin in `free`");
  }
  if (!HasFreedom(s)) return;
  const std::string field = at.substr(0, at.find(".motion["));
  const FreeMass mass = FreeMassOf(body, MaterialOf(e, body.material), field);
  CheckCentre(at, body, s, mass);
  if (!s.free_spin) return;
  if (!(mass.axle_inertia_kg_m2 > 0)) {
    throw SpecError(field + ".inertia_kg_m2", Short(mass.axle_inertia_kg_m2),
                    "an inertia about the axle > 0, where the spin is free");
  }
  const Vec3d axle = MatrixOf(Unit(body.turn)) * Vec3d{0, 1, 0};
  const Vec3d& spin = s.spin_rad_per_s;
  const double about = s.about_axle ? Norm(spin) : Along(spin, axle);
  if (about > 1e-9 * Norm(spin)) {
    throw SpecError(at + ".free", "spin beside a rate about the axle",
                    "either spin free, or that rate");
  }
}

void Freedoms::Enter(const MotionStep* before, const MotionStep& s, const Vec3d& velocity,
                     double axle_rad_per_s) {
  shift_ = {0, 0, 0};
  turn_ = 0;
  for (int k = 0; k < 3; ++k) {
    if (before && before->free_axes[k] && s.free_axes[k]) continue;
    velocity_[k] = velocity[k];
    first_[k] = true;
  }
  if (before && before->free_spin && s.free_spin) return;
  spin_ = axle_rad_per_s;
  first_spin_ = true;
}

void Freedoms::Advance(const MotionStep& s, const FreeMass& mass, const Vec3d& force,
                       const Vec3d& torque, const Vec3d& axle, double gravity, double dt,
                       Vec3d* velocity, Vec3d* spin) {
  for (int k = 0; k < 3; ++k) {
    if (!s.free_axes[k]) continue;
    const double push = force[k] + s.applied_force_n[k] - (k == 2 ? mass.mass_kg * gravity : 0.0);
    velocity_[k] += (first_[k] ? 0.5 : 1.0) * dt * push / mass.mass_kg;
    first_[k] = false;
    (*velocity)[k] = velocity_[k];
    shift_[k] += dt * velocity_[k];
  }
  if (!s.free_spin) return;
  const double moment = DotD(torque, axle) + s.applied_torque_n_m;
  spin_ += (first_spin_ ? 0.5 : 1.0) * dt * moment / mass.axle_inertia_kg_m2;
  first_spin_ = false;
  turn_ += dt * spin_;
  *spin = Add(*spin, Scale(spin_ - DotD(*spin, axle), axle));
}

double Freedoms::Way(const MotionStep& s) const {
  const double level = std::hypot(s.free_axes[0] ? shift_[0] : 0, s.free_axes[1] ? shift_[1] : 0);
  return s.free_axes[0] || s.free_axes[1] ? level : std::abs(shift_[2]);
}

double Freedoms::Speed2(const MotionStep& s) const {
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += s.free_axes[k] ? velocity_[k] * velocity_[k] : 0.0;
  return sum;
}

}  // namespace grouser::dem::experiment
