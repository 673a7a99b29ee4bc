#include "grouser/mujoco.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace grouser::mujoco {
namespace {

[[noreturn]] void Refuse(const std::string& what, const std::string& got,
                         const std::string& expected) {
  throw std::invalid_argument("mujoco: " + what + ": got " + got + ", expected " + expected);
}

std::string Number(double x) {
  std::ostringstream text;
  text << x;
  return text.str();
}

std::string NameOf(const mjModel* m, int type, int id) {
  const char* name = mj_id2name(m, type, id);
  return name == nullptr ? "" : name;
}

// "one of 'a', 'b'" of all that have a name.
std::string NamesOf(const mjModel* m, int type, int count) {
  std::string all;
  for (int id = 0; id < count; ++id) {
    const std::string name = NameOf(m, type, id);
    if (!name.empty()) all += (all.empty() ? "one of '" : ", '") + name + "'";
  }
  return all.empty() ? "a name, and none has one" : all;
}

bool Within(double a, double b) { return std::fabs(a - b) <= 0.01 * std::fabs(b); }

// 'NAME', or the number of a geom without one.
std::string GeomOf(const mjModel* m, int id) {
  const std::string name = NameOf(m, mjOBJ_GEOM, id);
  return name.empty() ? "geom " + std::to_string(id) : "geom '" + name + "'";
}

// By their bits, or as a pair that is listed.
bool Collide(const mjModel* m, int a, int b) {
  for (int i = 0; i < m->npair; ++i) {
    const int one = m->pair_geom1[i], other = m->pair_geom2[i];
    if ((one == a && other == b) || (one == b && other == a)) return true;
  }
  return (m->geom_contype[a] & m->geom_conaffinity[b]) != 0 ||
         (m->geom_contype[b] & m->geom_conaffinity[a]) != 0;
}

// Stands in userdata beside what wheels remember at a time; 0: they never were asked.
double MarkOf(const mjData* d) { return d->time + 1; }

std::array<double, 3> Copy(const mjtNum* from) { return {from[0], from[1], from[2]}; }

// A height field, in its own frame.
class Heights {
 public:
  Heights(const mjModel* m, int geom) {
    const int field = m->geom_dataid[geom];
    rows_ = m->hfield_nrow[field];
    columns_ = m->hfield_ncol[field];
    size_ = m->hfield_size + 4 * field;
    data_ = m->hfield_data + m->hfield_adr[field];
  }
  bool Has(double x, double y) const {
    return std::fabs(x) <= size_[0] && std::fabs(y) <= size_[1];
  }
  // Beyond the edge: that of the edge.
  double At(double x, double y) const {
    int c, r;
    const double u = Place(x, size_[0], columns_, &c), v = Place(y, size_[1], rows_, &r);
    const float* d = data_ + r * columns_ + c;
    const double near = (1 - u) * d[0] + u * d[1];
    const double far = (1 - u) * d[columns_] + u * d[columns_ + 1];
    return size_[2] * ((1 - v) * near + v * far);
  }

 private:
  // Number of the datum before, and the share of the way to the next one.
  static double Place(double x, double half, int count, int* before) {
    const double at = std::clamp((x / half + 1) / 2, 0.0, 1.0) * (count - 1);
    *before = std::min(static_cast<int>(at), count - 2);
    return at - *before;
  }

  int rows_, columns_;
  const mjtNum* size_;
  const float* data_;
};

void CheckGround(const mjModel* m, int ground) {
  const std::string what = "ground '" + NameOf(m, mjOBJ_GEOM, ground) + "'";
  const int type = m->geom_type[ground];
  if (type != mjGEOM_PLANE && type != mjGEOM_HFIELD) {
    Refuse(what, "geom type " + std::to_string(type), "a plane or an hfield");
  }
  for (int body = m->geom_bodyid[ground]; body != 0; body = m->body_parentid[body]) {
    if (m->body_mocapid[body] >= 0 || m->body_jntnum[body] > 0) {
      Refuse(what, "body '" + NameOf(m, mjOBJ_BODY, body) + "', which can move",
             "the world, or bodies without joints that are no mocap bodies");
    }
  }
  if (type != mjGEOM_HFIELD) return;
  const int rows = m->hfield_nrow[m->geom_dataid[ground]],
            columns = m->hfield_ncol[m->geom_dataid[ground]];
  if (rows < 2 || columns < 2) {
    Refuse(what, std::to_string(rows) + " rows and " + std::to_string(columns) + " columns",
           "2 or more of both");
  }
}

SoilContact* passive_contact = nullptr;  // MuJoCo's callbacks are global and carry nothing
mjfGeneric passive_before = nullptr;

void CallPassive(const mjModel* m, mjData* d) {
  if (passive_before != nullptr) passive_before(m, d);
  if (m != passive_contact->model()) return;
  static thread_local std::string message;  // mju_error may not come back
  try {
    passive_contact->Apply(m, d);
    return;
  } catch (const std::exception& error) {
    message = error.what();
  }
  mju_error(message.c_str());
}

}  // namespace

SoilContact::SoilContact(const mjModel* m, std::vector<Wheels> wheels,
                         const std::string& ground_geom, int userdata_offset)
    : model_(m), ground_(mj_name2id(m, mjOBJ_GEOM, ground_geom.c_str())), offset_(userdata_offset) {
  if (ground_ < 0) {
    Refuse("ground", "geom '" + ground_geom + "'", NamesOf(m, mjOBJ_GEOM, m->ngeom));
  }
  CheckGround(m, ground_);
  const double gravity = mju_norm3(m->opt.gravity);
  for (const Wheels& some : wheels) {
    if (some.model == nullptr) Refuse("wheels '" + some.bodies + "'", "no model", "one");
    if (!Within(some.model->gravity_m_per_s2(), gravity)) {
      Refuse("option gravity", Number(gravity) + " m/s^2",
             Number(some.model->gravity_m_per_s2()) + ", that of the model '" + some.model->name() +
                 "' (or another by Model::Scaled)");
    }
    kinds_.push_back({WheelContact(*some.model, some.options),
                      some.model->radius_m(),
                      some.model->width_m(),
                      some.model->kind() == "hard",
                      {},
                      {},
                      {},
                      {}});
    bool any = false;
    for (int body = 1; body < m->nbody; ++body) {
      const std::string name = NameOf(m, mjOBJ_BODY, body);
      if (name.empty() || fnmatch(some.bodies.c_str(), name.c_str(), 0) != 0) continue;
      AddWheel(m, body, kinds_.size() - 1);
      any = true;
    }
    if (!any) {
      Refuse("wheels", "no body '" + some.bodies + "'", NamesOf(m, mjOBJ_BODY, m->nbody));
    }
  }
  if (wheels_.empty()) Refuse("wheels", "none", "one or more");
  const int least = offset_ + UserData(wheels_.size());
  if (offset_ < 0 || m->nuserdata < least) {
    Refuse("nuserdata", std::to_string(m->nuserdata) + " (from " + std::to_string(offset_) + " on)",
           "<size nuserdata=\"" + std::to_string(least) + "\"/> or more for " +
               std::to_string(wheels_.size()) + " wheels");
  }
}

void SoilContact::AddWheel(const mjModel* m, int body, std::size_t kind) {
  const std::string name = NameOf(m, mjOBJ_BODY, body), what = "body '" + name + "'";
  const int joint = m->body_jntadr[body];
  if (m->body_jntnum[body] != 1 || m->jnt_type[joint] != mjJNT_HINGE) {
    Refuse(what, std::to_string(m->body_jntnum[body]) + " joints", "one, a hinge about its axle");
  }
  if (std::find(names_.begin(), names_.end(), name) != names_.end()) {
    Refuse(what, "a second kind of wheel", "one");
  }
  int largest = -1;  // cylinder or sphere; a hub may be one too
  for (int geom = 0; geom < m->ngeom; ++geom) {
    // Of the body, and of those fixed to it.
    if (m->body_weldid[m->geom_bodyid[geom]] != body) continue;
    const int type = m->geom_type[geom];
    if ((type == mjGEOM_CYLINDER || type == mjGEOM_SPHERE) &&
        (largest < 0 || m->geom_size[3 * geom] > m->geom_size[3 * largest])) {
      largest = geom;
    }
    if (Collide(m, geom, ground_)) {
      Refuse(
          what, GeomOf(m, geom) + " that collides with the ground, so that it is carried twice",
          "contype=\"0\" conaffinity=\"0\" or bits that the ground has not, and no <pair> of both");
    }
  }
  if (largest >= 0 && !Within(m->geom_size[3 * largest], kinds_[kind].radius)) {
    Refuse(what, GeomOf(m, largest) + " of radius " + Number(m->geom_size[3 * largest]) + " m",
           Number(kinds_[kind].radius) + ", that of the model '" +
               kinds_[kind].contact.model().name() + "' (or another by Model::Scaled)");
  }
  wheels_.push_back({body, joint, kind});
  names_.push_back(name);
}

void SoilContact::PutGround(const mjModel* m, const mjData* d, const Kind& kind,
                            WheelMotion* motion) const {
  const mjtNum* frame = d->geom_xmat + 9 * ground_;
  const mjtNum* origin = d->geom_xpos + 3 * ground_;
  motion->ground_normal = {frame[2], frame[5], frame[8]};
  motion->ground_point = Copy(origin);
  if (m->geom_type[ground_] == mjGEOM_PLANE) return;
  const Heights heights(m, ground_);
  mjtNum from[3], at[3], axle[3];
  mju_sub3(from, motion->centre.data(), origin);
  mju_rotVecMatT(at, from, frame);
  mju_rotVecMatT(axle, motion->axle.data(), frame);
  const double across = std::hypot(axle[0], axle[1]);
  mjtNum point[3] = {at[0], at[1], 0}, normal[3] = {0, 0, 1};
  if (!heights.Has(at[0], at[1])) {
    point[2] = at[2] - 10 * kind.radius;  // in the air
  } else if (across > 0) {
    const double left[2] = {axle[0] / across, axle[1] / across};
    const double r = 0.5 * kind.radius, w = 0.5 * kind.width;
    const double ahead = heights.At(at[0] + r * left[1], at[1] - r * left[0]);
    const double behind = heights.At(at[0] - r * left[1], at[1] + r * left[0]);
    const double on_left = heights.At(at[0] + w * left[0], at[1] + w * left[1]);
    const double on_right = heights.At(at[0] - w * left[0], at[1] - w * left[1]);
    point[2] = 0.25 * (ahead + behind + on_left + on_right);
    const double along = (ahead - behind) / (2 * r), over = (on_left - on_right) / (2 * w);
    normal[0] = -along * left[1] - over * left[0];
    normal[1] = along * left[0] - over * left[1];
  } else {  // lies flat
    point[2] = heights.At(at[0], at[1]);
  }
  mju_rotVecMat(motion->ground_normal.data(), normal, frame);
  mju_rotVecMat(motion->ground_point.data(), point, frame);
  mju_addTo3(motion->ground_point.data(), origin);
}

WheelMotion SoilContact::MotionOf(const mjModel* m, const mjData* d, const Wheel& wheel) const {
  WheelMotion motion;
  mjtNum velocity[6], arm[3], turning[3];  // rotation first
  mj_objectVelocity(m, d, mjOBJ_XBODY, wheel.body, velocity, 0);
  motion.centre = Copy(d->xanchor + 3 * wheel.joint);
  motion.axle = Copy(d->xaxis + 3 * wheel.joint);
  mju_sub3(arm, motion.centre.data(), d->xpos + 3 * wheel.body);
  mju_cross(turning, velocity, arm);
  motion.angular_velocity = Copy(velocity);
  mju_add3(motion.velocity.data(), velocity + 3, turning);
  PutGround(m, d, kinds_[wheel.kind], &motion);
  return motion;
}

void SoilContact::Check(std::span<mjData* const> worlds) const {
  for (std::size_t i = 0; i < forces_.size(); ++i) {
    if ((forces_[i].flags & kInvalid) == 0) continue;
    const std::size_t world = i / wheels_.size(), w = i % wheels_.size();
    const mjData* d = worlds[world];
    const mjtNum* p = d->xanchor + 3 * wheels_[w].joint;
    std::ostringstream text;
    text << "mujoco: body '" << names_[w] << "', world " << world << ", time " << d->time
         << " s: position (" << p[0] << ", " << p[1] << ", " << p[2] << ") m, spin "
         << d->qvel[model_->jnt_dofadr[wheels_[w].joint]]
         << " rad/s, expected finite numbers (also of all other velocities and of userdata)";
    throw std::runtime_error(text.str());
  }
}

void SoilContact::Apply(const mjModel* m, mjData* d) { Apply(m, {&d, 1}); }

void SoilContact::Apply(const mjModel* m, std::span<mjData* const> worlds) {
  if (m != model_) Refuse("mjModel", "another one", "that of the constructor");
  for (Kind& kind : kinds_) {
    kind.motions.clear();
    kind.states.clear();
    kind.at.clear();
  }
  const std::size_t n = wheels_.size();
  for (std::size_t world = 0; world < worlds.size(); ++world) {
    const mjData* d = worlds[world];
    const mjtNum* memory = d->userdata + offset_;
    const double now = MarkOf(d);
    const bool known = memory[0] > 0 && now >= memory[0];
    for (std::size_t w = 0; w < n; ++w) {
      Kind& kind = kinds_[wheels_[w].kind];
      const mjtNum* u = memory + 1 + 3 * w;
      kind.motions.push_back(MotionOf(m, d, wheels_[w]));
      kind.motions.back().time_step = known ? now - memory[0] : 0;
      kind.states.push_back(known ? ContactState{u[0], u[1], u[2]} : ContactState{});
      kind.at.push_back(world * n + w);
    }
  }
  forces_.resize(worlds.size() * n);
  mjtNum up[3];
  mju_scl3(up, m->opt.gravity, -1 / mju_norm3(m->opt.gravity));
  for (Kind& kind : kinds_) {
    kind.out.resize(kind.motions.size());
    (void)kind.contact.Evaluate(kind.motions, kind.states, kind.out);  // sizes are right
    for (std::size_t i = 0; i < kind.out.size(); ++i) {
      WheelForce& force = forces_[kind.at[i]] = kind.out[i];
      mjtNum normal[3];
      mju_copy3(normal, kind.motions[i].ground_normal.data());
      mju_normalize3(normal);
      const bool level = mju_dot3(normal, up) > 1 - 1e-12;
      if (!level && !kind.hard && (force.flags & kAirborne) == 0) force.flags |= kSlope;
    }
  }
  Check(worlds);
  for (const Kind& kind : kinds_) {
    for (std::size_t i = 0; i < kind.out.size(); ++i) {
      mjData* d = worlds[kind.at[i] / n];
      const std::size_t w = kind.at[i] % n;
      mjtNum* memory = d->userdata + offset_;
      const ContactState& u = kind.states[i];
      memory[0] = MarkOf(d);
      memory[1 + 3 * w] = u.v_x;
      memory[2 + 3 * w] = u.v_y;
      memory[3 + 3 * w] = u.rim;
      if (kind.out[i].load == 0) continue;
      mj_applyFT(m, d, kind.out[i].force.data(), kind.out[i].moment.data(),
                 kind.motions[i].centre.data(), wheels_[w].body, d->qfrc_passive);
    }
  }
}

PassiveForces::PassiveForces(SoilContact* contact) {
  if (passive_contact != nullptr) {
    throw std::logic_error("mujoco: passive forces: a second SoilContact, expected one at a time");
  }
  passive_contact = contact;
  passive_before = mjcb_passive;
  mjcb_passive = CallPassive;
}

PassiveForces::~PassiveForces() {
  mjcb_passive = passive_before;
  passive_contact = nullptr;
}

}  // namespace grouser::mujoco
