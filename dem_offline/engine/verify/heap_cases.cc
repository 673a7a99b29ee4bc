// A heap of spheres: a cylinder of grains collapses and comes to rest, or not.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

struct Heap {
  double height_m = 0, restless = 0, angle_deg = 0;
};

/// Slope between a quarter and three quarters of the radius, of the highest
/// grains ring by ring, by least squares.
double SlopeDegrees(const World& world, double centre, double radius) {
  const int rings = 6;
  std::vector<double> top(rings, 0);
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainState g = world.State(i);
    const double share = std::hypot(g.x_m - centre, g.y_m - centre) / radius;
    const int k = static_cast<int>((share - 0.2) / 0.6 * rings);
    if (share >= 0.2 && k < rings) top[k] = std::max(top[k], g.z_m + g.radius_m);
  }
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (int k = 0; k < rings; ++k) {
    const double x = (0.2 + 0.6 * (k + 0.5) / rings) * radius;
    sx += x, sy += top[k], sxx += x * x, sxy += x * top[k];
  }
  return std::atan(-(rings * sxy - sx * sy) / (rings * sxx - sx * sx)) * 180 / M_PI;
}

class HeapRun {
 public:
  explicit HeapRun(const char* rolling) : world_(Build(rolling)) {}
  void RunTo(double t) {
    RunOrThrow(world_, std::llround((t - world_.time_s()) / world_.config().dt_s));
  }
  Heap Look() const {
    return {Top(world_), Restlessness(world_), SlopeDegrees(world_, kSide / 2, 0.1)};
  }

 private:
  static constexpr double kSide = 0.6;
  static World Build(const char* rolling) {
    BedSpec spec;
    spec.length_m = spec.width_m = kSide;
    spec.grains = {4e6, 0.3};
    spec.surfaces = {.restitution = 0.5, .friction = 0.6, .rolling_friction = 0.2};
    spec.laws.rolling = rolling;
    std::vector<GrainState> grains;
    for (const GrainState& g : Grid(spec, 0.21, 0.39, 0.21, 0.39, 0, 3000)) {
      if (std::hypot(g.x_m - kSide / 2, g.y_m - kSide / 2) < 0.08 && g.z_m < 0.16) {
        grains.push_back(g);
      }
    }
    return World(spec.Config(), Scene(grains, {Floor()}));
  }
  World world_;
};

/// Five seconds in all. EPSD stands; the constant torque, which has no static
/// part, keeps moving (Ai et al., Powder Technol. 206 (2011) 269).
void StandingHeap(Rows& rows) {
  HeapRun run("epsd");
  run.RunTo(4);
  const Heap before = run.Look();
  run.RunTo(5);
  const Heap heap = run.Look();
  const char* source = "Ai et al. 2011: EPSD is static";
  rows.AtMost("EPSD heap of spheres: kinetic energy over sum m g d at 5 s [-]", 1e-8, heap.restless,
              source);
  rows.AtMost("EPSD heap: change of height in the last second, of the height [-]", 1e-4,
              std::abs(heap.height_m - before.height_m) / heap.height_m, source);
  HeapRun creeping("constant_torque");
  creeping.RunTo(5);
  rows.AtLeast("constant torque: kinetic energy over that of EPSD [-]", 100,
               creeping.Look().restless / heap.restless, "Ai et al. 2011: it creeps");
  HeapRun smooth("none");
  smooth.RunTo(3);
  rows.AtLeast("slope with rolling resistance less that without [deg]", 3,
               heap.angle_deg - smooth.Look().angle_deg, "Zhou et al. 1999: it steepens heaps");
  rows.Note(Format("slopes: EPSD %.1f deg, constant torque %.1f deg, none %.1f deg", heap.angle_deg,
                   creeping.Look().angle_deg, smooth.Look().angle_deg));
}

}  // namespace

Cases HeapCases() { return {{"heap_5_s", Level::kDefault, StandingHeap}}; }

}  // namespace grouser::dem::verify
