// grouser/chrono.h against Chrono's own headers: a tyre on a wheel has the force of WheelContact.
#include <chrono/physics/ChSystemSMC.h>
#include <chrono_vehicle/terrain/FlatTerrain.h>
#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "grouser/chrono.h"

namespace ch = chrono::vehicle;

/// What carries a tyre, and weighs nothing.
class BareWheel : public ch::ChWheel {
 public:
  BareWheel() : ChWheel("wheel") {}
  double GetWheelMass() const override { return 0; }
  const chrono::ChVector3d& GetWheelInertia() const override { return inertia_; }

 private:
  chrono::ChVector3d inertia_{0, 0, 0};
};

TEST(ChronoHeaders, ATyreCanBeMade) {
  const auto model = grouser::Model::Open(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/hybrid.model");
  const grouser::ChronoSoilTire tire("tyre", model, 1, chrono::ChVector3d(0.1, 0.2, 0.1));
  EXPECT_EQ(tire.GetRadius(), model.radius_m());
  EXPECT_FALSE(tire.ReportTireContactData().in_contact);
}

TEST(ChronoHeaders, HasTheForceOfWheelContact) {
  const auto model = grouser::Model::Open(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/hybrid.model");
  const double v = model.domain().speed_m_per_s, height = model.radius_m() - 0.005;
  chrono::ChSystemSMC system;
  // ChBody, of later versions ChSpindle.
  using Spindle = decltype(std::declval<const ch::ChWheel&>().GetSpindle())::element_type;
  auto spindle = std::make_shared<Spindle>();
  system.AddBody(spindle);
  spindle->SetPos(chrono::ChVector3d(0, 0, height));
  spindle->SetPosDt(chrono::ChVector3d(v, 0.2 * v, 0));
  spindle->SetAngVelParent(chrono::ChVector3d(0, 1.2 * v / model.radius_m(), 0));
  auto wheel = std::make_shared<BareWheel>();
  wheel->Initialize(nullptr, spindle, ch::LEFT);
  const grouser::ContactOptions options{.relaxation_over_radius = 0};
  auto tire = std::make_shared<grouser::ChronoSoilTire>("tyre", model, 1,
                                                        chrono::ChVector3d(0.1, 0.2, 0.1), options);
  wheel->SetTire(tire);
  std::static_pointer_cast<ch::ChTire>(tire)->Initialize(wheel);
  ch::FlatTerrain ground(0);
  tire->Synchronize(0, ground);

  grouser::WheelMotion motion;
  motion.centre = {0, 0, height};
  motion.axle = {0, 1, 0};
  motion.velocity = {v, 0.2 * v, 0};
  motion.angular_velocity = {0, 1.2 * v / model.radius_m(), 0};
  motion.ground_normal = {0, 0, 1};
  grouser::WheelContact contact(model, options);
  grouser::ContactState state;
  const grouser::WheelForce expected = contact.Evaluate(motion, &state);
  ASSERT_GT(expected.load, 0);
  const ch::TerrainForce got = tire->ReportTireForce(&ground);
  const double tolerance = 1e-9 * expected.load;
  EXPECT_NEAR(got.force.x(), expected.force[0], tolerance);
  EXPECT_NEAR(got.force.y(), expected.force[1], tolerance);
  EXPECT_NEAR(got.force.z(), expected.force[2], tolerance);
  EXPECT_NEAR(got.moment.x(), expected.moment[0], tolerance);
  EXPECT_NEAR(got.moment.y(), expected.moment[1], tolerance);
  EXPECT_NEAR(tire->GetLongitudinalSlip(), 0.2, 1e-9);
}
