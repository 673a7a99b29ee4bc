// What a spec that no mechanism has is told: what, where, expected.
#include <gtest/gtest.h>

#include <functional>

#include "tests/unit/multibody/multibody_testing.h"

namespace grouser::dem {
namespace {

MultibodySpec Good() {
  MultibodySpec spec;
  spec.bodies = {Solid("a", 1, {1, 1, 1}, {0, 0, 0}), Solid("b", 1, {1, 1, 1}, {0, 0, 1})};
  spec.joints = {JointAt(spec, "j", JointType::kRevolute, "a", "b", {0, 0, 0.5}, {0, 1, 0})};
  LinearSpringSpec l;
  l.name = "l";
  l.body_b = "a";
  l.point_a_m = {0, 0, -1};
  spec.linear_springs = {l};
  RotationalSpringSpec r;
  r.name = "r";
  r.joint = "j";
  spec.rotational_springs = {r};
  return spec;
}

struct Fault {
  const char* said;
  std::function<void(MultibodySpec&)> plant;
};

TEST(Specs, FaultsAreNamedWithTheirPlace) {
  EXPECT_EQ(Message([] { MultibodySystem m(Good()); }), "");
  const double nan = std::nan("");
  const std::vector<Fault> faults = {
      {"body 'a': mass_kg: 0, expected > 0", [](auto& s) { s.bodies[0].mass_kg = 0; }},
      {"body 'b': mass_kg: nan", [&](auto& s) { s.bodies[1].mass_kg = nan; }},
      {"body 'a': inertia_kg_m2: principal moments -1, 1, 1 kg m^2, expected all > 0",
       [](auto& s) { s.bodies[0].inertia_kg_m2[1] = -1; }},
      {"body 'a': inertia_kg_m2: principal moments -1, 1, 3",
       [](auto& s) { s.bodies[0].inertia_off_kg_m2[0] = 2; }},
      {"principal moments 1, 1, 2.1 kg m^2, expected none above the sum",
       [](auto& s) { s.bodies[0].inertia_kg_m2[2] = 2.1; }},
      {"body 'a': inertia_off_kg_m2: nan",
       [&](auto& s) { s.bodies[0].inertia_off_kg_m2[2] = nan; }},
      {"body 'a': name: taken", [](auto& s) { s.bodies[1].name = "a"; }},
      {"body '': name: empty", [](auto& s) { s.bodies[1].name = ""; }},
      {"body 'ground': name", [](auto& s) { s.bodies[1].name = "ground"; }},
      {"body 'a': orientation: a quaternion of length 2",
       [](auto& s) {
         s.bodies[0].orientation = {2, 0, 0, 0};
       }},
      {"body 'b': position_m: nan", [&](auto& s) { s.bodies[1].position_m[1] = nan; }},
      {"body 'b': spin_rad_per_s: inf", [](auto& s) { s.bodies[1].spin_rad_per_s[0] = INFINITY; }},
      {"joint 'j': child: 'c', expected one of 'a', 'b', 'ground'",
       [](auto& s) { s.joints[0].child = "c"; }},
      {"joint 'j': child: 'a', which is the parent", [](auto& s) { s.joints[0].child = "a"; }},
      {"joint 'j': name: taken", [](auto& s) { s.joints.push_back(s.joints[0]); }},
      {"joint 'j': in_child.orientation: a quaternion of length 0",
       [](auto& s) {
         s.joints[0].in_child.orientation = {0, 0, 0, 0};
       }},
      {"joint 'j': its frames are 0.1 m and 0 rad apart",
       [](auto& s) { s.joints[0].in_child.position_m[1] += 0.1; }},
      {"joint 'j': its frames are",
       [](auto& s) { s.joints[0].in_child.orientation = TurnAbout(0, 0.3); }},
      {"joint 'j': the velocities of its frames are 1 m/s",
       [](auto& s) {
         s.bodies[1].velocity_m_per_s = {0, 1, 0};
       }},
      {"joint 'j': rate: 2 functions, expected 1",
       [](auto& s) {
         s.joints[0].rate = {[](double) { return 0.0; }, [](double) { return 0.0; }};
       }},
      {"joint 'j': coordinate: an empty function", [](auto& s) { s.joints[0].coordinate = {{}}; }},
      {"joint 'j': coordinate: 1.000000 at time zero, expected",
       [](auto& s) { s.joints[0].coordinate = {[](double) { return 1.0; }}; }},
      {"joint 'j': locked: true, expected false for a driven joint",
       [](auto& s) {
         s.joints[0].locked = true;
         s.joints[0].rate = {[](double) { return 0.0; }};
       }},
      {"joint 'j': locked: true, expected false for a spherical",
       [](auto& s) {
         s.rotational_springs.clear();
         s.joints[0].type = JointType::kSpherical;
         s.joints[0].locked = true;
       }},
      {"spring 'l': body_b: 'x', expected one of",
       [](auto& s) { s.linear_springs[0].body_b = "x"; }},
      {"spring 'l': stiffness_n_per_m: -1",
       [](auto& s) { s.linear_springs[0].stiffness_n_per_m = -1; }},
      {"spring 'l': its ends meet",
       [](auto& s) {
         s.linear_springs[0].point_a_m = {0, 0, 0};
       }},
      {"spring 'r': name: taken", [](auto& s) { s.linear_springs[0].name = "r"; }},
      {"spring 'r': joint: 'x', expected one of 'j'",
       [](auto& s) { s.rotational_springs[0].joint = "x"; }},
      {"spring 'r': joint: 'j', expected a revolute",
       [](auto& s) { s.joints[0].type = JointType::kTranslational; }},
      {"spring 'r': coordinate: 1, expected 0",
       [](auto& s) { s.rotational_springs[0].coordinate = 1; }},
  };
  for (const Fault& f : faults) {
    MultibodySpec spec = Good();
    f.plant(spec);
    const std::string said = Message([&] { MultibodySystem m(spec); });
    EXPECT_NE(said.find(f.said), std::string::npos) << "said: " << said << "\nexpected: " << f.said;
  }
}

TEST(Specs, CallsAreChecked) {
  MultibodySystem m(Good());
  EXPECT_NE(Message([&] { m.Advance(0); }).find("dt_s"), std::string::npos);
  EXPECT_NE(Message([&] { m.Advance(1e-3, std::vector<Wrench>(3)); }).find("one a body: 2"),
            std::string::npos);
  EXPECT_NE(Message([&] { m.Coordinates("k"); }).find("joint 'k', expected one of 'j'"),
            std::string::npos);
  EXPECT_NE(Message([&] { m.SpringForce("k"); }).find("one of 'l', 'r'"), std::string::npos);
  EXPECT_NE(Message([&] { m.BodyNumber("k"); }).find("one of 'a', 'b'"), std::string::npos);
  EXPECT_NE(Message([] {
              JointAt(Good(), "j", JointType::kRevolute, "a", "b", {}, {0, 0, 0});
            }).find("joint 'j': axis: null"),
            std::string::npos);
}

}  // namespace
}  // namespace grouser::dem
