// A stand-in for the parts of Chrono::Vehicle 9.0 that grouser/chrono.h names, after its documented
// interface (api.projectchrono.org/9.0.0). It is no part of Chrono, and what compiles against it
// need not compile against Chrono: docs/hosts.md.
#pragma once

#include <cmath>
#include <memory>
#include <string>

namespace chrono {

class ChVector3d {
 public:
  ChVector3d() = default;
  ChVector3d(double x, double y, double z) : x_(x), y_(y), z_(z) {}
  double x() const { return x_; }
  double y() const { return y_; }
  double z() const { return z_; }

 private:
  double x_ = 0, y_ = 0, z_ = 0;
};

template <class Real = double>
class ChQuaternion {
 public:
  ChQuaternion() = default;
  ChQuaternion(Real e0, Real e1, Real e2, Real e3) : e_{e0, e1, e2, e3} {}
  ChVector3d Rotate(const ChVector3d& v) const {
    const Real w = e_[0], x = e_[1], y = e_[2], z = e_[3];
    return {(1 - 2 * (y * y + z * z)) * v.x() + 2 * (x * y - w * z) * v.y() +
                2 * (x * z + w * y) * v.z(),
            2 * (x * y + w * z) * v.x() + (1 - 2 * (x * x + z * z)) * v.y() +
                2 * (y * z - w * x) * v.z(),
            2 * (x * z - w * y) * v.x() + 2 * (y * z + w * x) * v.y() +
                (1 - 2 * (x * x + y * y)) * v.z()};
  }

  ChVector3d RotateBack(const ChVector3d& v) const {
    return ChQuaternion(e_[0], -e_[1], -e_[2], -e_[3]).Rotate(v);
  }

 private:
  Real e_[4] = {1, 0, 0, 0};
};

template <class Real = double>
struct ChCoordsys {
  ChCoordsys() = default;
  ChCoordsys(const ChVector3d& p, const ChQuaternion<Real>& q) : pos(p), rot(q) {}
  ChVector3d pos;
  ChQuaternion<Real> rot;
};

namespace vehicle {

struct WheelState {
  ChVector3d pos;
  ChQuaternion<> rot;
  ChVector3d lin_vel, ang_vel;
  double omega = 0;
};
struct TerrainForce {
  ChVector3d force, point, moment;
};

class ChTerrain {
 public:
  virtual ~ChTerrain() = default;
  virtual double GetHeight(const ChVector3d& loc) const = 0;
  virtual ChVector3d GetNormal(const ChVector3d& loc) const = 0;
};

class ChWorldFrame {
 public:
  static const ChVector3d& Vertical() { return vertical; }
  static double Height(const ChVector3d& v) {
    return v.x() * vertical.x() + v.y() * vertical.y() + v.z() * vertical.z();
  }
  static inline ChVector3d vertical{0, 0, 1};
};

class ChWheel {
 public:
  WheelState GetState() const { return state; }
  ChVector3d GetPos() const { return state.pos; }
  WheelState state;
};

class ChPart {
 public:
  explicit ChPart(const std::string& name) : m_name(name) {}
  virtual ~ChPart() = default;
  const std::string& GetName() const { return m_name; }
  virtual std::string GetTemplateName() const = 0;

 protected:
  std::string m_name;
};

class ChTire : public ChPart {
 public:
  virtual double GetRadius() const = 0;
  virtual double GetWidth() const = 0;
  virtual double GetTireMass() const = 0;
  virtual ChVector3d GetTireInertia() const = 0;
  virtual TerrainForce ReportTireForce(ChTerrain* terrain) const = 0;
  virtual TerrainForce ReportTireForceLocal(ChTerrain* terrain, ChCoordsys<>& tire_frame) const = 0;
  virtual double GetDeflection() const { return 0; }
  virtual void Initialize(std::shared_ptr<ChWheel> wheel) { m_wheel = wheel; }
  virtual void Synchronize(double, const ChTerrain&) {}
  virtual void Advance(double) {}
  double GetSlipAngle() const { return slip_angle_; }
  double GetLongitudinalSlip() const { return longitudinal_slip_; }
  double GetCamberAngle() const { return camber_angle_; }

 protected:
  explicit ChTire(const std::string& name) : ChPart(name) {}
  void CalculateKinematics(const WheelState& state, const ChCoordsys<>& frame) {
    const ChVector3d v = frame.rot.RotateBack(state.lin_vel);
    const ChVector3d axle = frame.rot.RotateBack(state.rot.Rotate(ChVector3d(0, 1, 0)));
    const double along = std::abs(v.x());
    const bool moves = along > 1e-4;
    slip_angle_ = moves ? std::atan(v.y() / along) : 0;
    longitudinal_slip_ = moves ? (state.omega * GetRadius() - v.x()) / along : 0;
    camber_angle_ = std::atan2(axle.z(), axle.y());
  }
  virtual TerrainForce GetTireForce() const = 0;
  std::shared_ptr<ChWheel> m_wheel;

 private:
  double slip_angle_ = 0, longitudinal_slip_ = 0, camber_angle_ = 0;
};

class ChForceElementTire : public ChTire {
 public:
  struct ContactData {
    bool in_contact = false;
    ChCoordsys<> frame;
    ChVector3d vel;
    double normal_force = 0, depth = 0;
  };
  TerrainForce ReportTireForce(ChTerrain*) const override { return GetTireForce(); }
  TerrainForce ReportTireForceLocal(ChTerrain*, ChCoordsys<>& tire_frame) const override {
    if (!m_data.in_contact) return {};
    tire_frame = m_data.frame;
    return m_tireforce;
  }
  const ContactData& ReportTireContactData() const { return m_data; }

 protected:
  explicit ChForceElementTire(const std::string& name) : ChTire(name) {}
  virtual double GetNormalStiffnessForce(double depth) const = 0;
  virtual double GetNormalDampingForce(double depth, double velocity) const = 0;
  TerrainForce GetTireForce() const override { return m_tireforce; }
  virtual double GetVisualizationWidth() const = 0;
  ContactData m_data;
  TerrainForce m_tireforce;
};

}  // namespace vehicle
}  // namespace chrono
