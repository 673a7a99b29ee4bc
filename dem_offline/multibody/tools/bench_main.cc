// What a step of jointed bodies costs and how exact it is: the tables of docs/multibody.md.
#include <cmath>
#include <cstdio>
#include <ctime>

#include "dem_offline/multibody/multibody.h"

namespace {

using namespace grouser::dem;

MultibodyBody Bar(const std::string& name, Vec3d from, Vec3d to) {
  MultibodyBody b;
  const Vec3d d = Sub(to, from);
  b.name = name;
  b.mass_kg = 1;
  const double i = DotD(d, d) / 12;
  b.inertia_kg_m2 = {0.01 * i, i, i};
  b.position_m = Scale(0.5, Add(from, to));
  const double half = std::atan2(-d[2], d[0]) / 2;
  b.orientation = {std::cos(half), 0, std::sin(half), 0};
  return b;
}

/// A chain of n bars with hinges along y, from the origin along x; looped: the last bar's end is
/// hinged to the ground as well (three bars: a four-bar linkage).
MultibodySpec Chain(int n, bool looped) {
  MultibodySpec spec;
  const auto node = [&](int k) -> Vec3d {
    if (!looped) return {0.2 * k, 0, 0};
    const Vec3d nodes[] = {{0, 0, 0}, {0, 0, 0.1}, {0.3, 0, 0.28}, {0.4, 0, 0}};
    return nodes[k];
  };
  std::string parent = kGround;
  for (int k = 0; k < n; ++k) {
    const std::string name = "bar " + std::to_string(k);
    spec.bodies.push_back(Bar(name, node(k), node(k + 1)));
    spec.joints.push_back(JointAt(spec, "hinge " + std::to_string(k), JointType::kRevolute, parent,
                                  name, node(k), {0, 1, 0}));
    parent = name;
  }
  if (looped) {
    spec.joints.push_back(
        JointAt(spec, "last", JointType::kRevolute, kGround, parent, node(n), {0, 1, 0}));
  }
  return spec;
}

MultibodySpec Tumbling() {
  MultibodySpec spec;
  MultibodyBody b = Bar("book", {0, 0, 0}, {1, 0, 0});
  b.inertia_kg_m2 = {1e-3, 2e-3, 2.5e-3};
  b.spin_rad_per_s = {0.01, 10, 0.01};
  spec.bodies = {b};
  return spec;
}

void Print(const char* name, const MultibodySpec& spec) {
  for (const double dt : {1e-3, 1e-4}) {
    MultibodySystem m(spec);
    const auto steps = std::lround(2 / dt);
    m.Advance(dt);
    const double start = m.Energy().Balance();
    double kinetic = 0, error = 0, gap = 0;
    const std::clock_t begin = std::clock();
    for (long s = 1; s < steps; ++s) {
      m.Advance(dt);
      const MultibodyEnergy e = m.Energy();
      kinetic = std::max(kinetic, e.kinetic);
      error = std::max(error, std::abs(e.Balance() - start));
      gap = std::max(gap, m.Gap());
    }
    const double cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    std::printf("| %s | %g | %.1f | %.1e | %.1e |\n", name, dt, 1e6 * cpu_s / steps,
                error / kinetic, gap);
  }
}

}  // namespace

int main() {
  std::printf(
      "| mechanism | dt [s] | CPU us a step | energy error over largest kinetic | gap [m] |\n");
  std::printf("| --- | --- | --- | --- | --- |\n");
  Print("free body, tumbling", Tumbling());
  Print("pendulum", Chain(1, false));
  Print("chain of 4", Chain(4, false));
  Print("four-bar linkage", Chain(3, true));
}
