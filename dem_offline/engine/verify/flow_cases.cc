// Grains that flow and come to rest: heaps, hoppers, columns.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

// A heap of spheres: a cylinder of grains collapses and comes to rest, or not.

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

// Discharge: Anand et al. (2008) through a slot, Beverloo's law through holes.

/// Anand, Curtis, Wassgren, Hancock & Ketterhagen, Chem. Eng. Sci. 63 (2008)
/// 5821, base case, digitised: time [s], discharged [%].
constexpr double kAnand[][2] = {
    {0.078, 5.25}, {0.142, 10.5}, {0.206, 15.7}, {0.267, 21.1}, {0.333, 26.3}, {0.399, 31.4},
    {0.461, 36.7}, {0.524, 41.9}, {0.586, 47.2}, {0.652, 52.5}, {0.717, 57.8}, {0.783, 62.9},
    {0.850, 68.2}, {0.928, 73.5}, {1.014, 78.7}, {1.139, 84.1}, {1.466, 89.2}, {2.244, 90.7}};

/// Flat-bottomed bin 56 d wide with a slot of 11.2 d, 6790 grains for each 2.5
/// d of a depth that is periodic, here 3.75 d: wide enough for the lists.
class SlotHopper {
 public:
  static constexpr double kD = 0.00224, kHalf = 28 * kD, kSlot = 5.6 * kD, kDepth = 3.75 * kD;
  static constexpr int kCount = 10185;

  SlotHopper() : world_(Config(), Scene(Fill(), Walls())) {
    RunOrThrow(world_, std::llround(0.5 / world_.config().dt_s));
    world_.body(world_.bodies() - 1).position_m[2] = -0.6;  // the slot is open
    start_ = world_.time_s();
  }
  void RunTo(double t) {
    RunOrThrow(world_, std::llround((start_ + t - world_.time_s()) / world_.config().dt_s));
  }
  double DischargedPercent() const {
    int out = 0;
    for (std::int64_t i = 0; i < world_.count(); ++i) out += world_.State(i).z_m < 0;
    return 100.0 * out / kCount;
  }

 private:
  static WorldConfig Config() {
    WorldConfig c;
    c.frame = {0.2, kDepth, 2.0};
    c.dt_s = 1.5e-5;
    const Laws laws = {.rolling = "constant_torque"};
    const Elastic glass = {1e7, 0.3};
    c.contacts =
        ContactModel(LawsByName(laws.normal, laws.tangential, laws.rolling, laws.cohesion));
    c.contacts.AddMaterial(glass);
    c.contacts.AddMaterial(glass);
    const ContactProperties grains = {
        .restitution = 0.94, .friction = 0.2, .rolling_friction = 0.09};
    ContactProperties wall = grains;
    wall.restitution = 0.90;
    c.contacts.SetContactProperties(0, 0, grains);
    c.contacts.SetContactProperties(0, 1, wall);
    c.contacts.SetContactProperties(1, 1, wall);
    return c;
  }
  static std::vector<GrainState> Fill() {
    BedSpec spec;
    spec.smallest_d_m = spec.largest_d_m = kD;
    spec.density = 2500;
    auto grains = Grid(spec, 0.1 - kHalf + 0.5 * kD, 0.1 + kHalf - 0.5 * kD, 0, kDepth, 0, kCount);
    return grains;
  }
  static std::vector<Body> Walls() {
    const double thick = 0.02, y = kDepth / 2, deep = 4 * kDepth;
    std::vector<Body> out;
    for (const int side : {-1, 1}) {
      out.push_back(Block({0.1 + side * (kHalf + thick / 2), y, 0.25}, {thick, deep, 0.6}));
      out.push_back(Block({0.1 + side * 0.5 * (kSlot + kHalf + thick), y, -thick / 2},
                          {kHalf + thick - kSlot, deep, thick}));
    }
    out.push_back(Floor(-0.4));  // what has left is caught
    out.push_back(Block({0.1, y, -thick / 2}, {2 * kSlot, deep, thick}));
    return out;
  }
  World world_;
  double start_ = 0;
};

void AnandHopper(Rows& rows) {
  SlotHopper hopper;
  double worst = 0, at = 0;
  for (const auto& p : kAnand) {
    hopper.RunTo(p[0]);
    const double got = hopper.DischargedPercent();
    if (std::abs(got / p[1] - 1) > std::abs(worst)) worst = got / p[1] - 1, at = p[0];
  }
  rows.AtMost(Format("discharge curve, worst relative distance (at %.3f s) [-]", at), 0.10,
              std::abs(worst), "Anand et al. 2008");
  rows.Absolute("discharged at the end [%]", 90.7, hopper.DischargedPercent(), 9.07,
                "Anand et al. 2008");
}

/// Grains per second through a hole of `opening` diameters in the floor of a
/// cylinder 28 d wide.
double HoleRate(double opening) {
  BedSpec spec;
  spec.smallest_d_m = 0.0045, spec.largest_d_m = 0.0055;
  const double d = 0.005, radius = 14 * d, side = 0.2, middle = side / 2;
  spec.length_m = spec.width_m = side;
  spec.grains = {5e6, 0.3};
  spec.surfaces = {.restitution = 0.6, .friction = 0.5, .rolling_friction = 0};
  spec.laws.rolling = "none";
  spec.density = 2500;
  std::vector<GrainState> grains;
  for (const GrainState& g : Grid(spec, 0, side, 0, side, 0, 45000)) {
    if (std::hypot(g.x_m - middle, g.y_m - middle) < radius - 0.6 * d) grains.push_back(g);
  }
  WorldConfig c = spec.Config();
  const auto body = [&](Shape shape) {
    Body b;
    b.shape = std::move(shape);
    b.position_m = {middle, middle, 0};
    return b;
  };
  // The cylinder's axis is y of its own: turned to stand upright.
  Body wall = body(HollowCylinder(radius, 3.0));
  wall.orientation = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};
  World world(c, Scene(grains, {wall, body(Annulus(0.5 * opening * d, radius + d)),
                                body(Disc(0.5 * opening * d)), Floor(-0.4)}));
  RunOrThrow(world, std::llround(0.4 / c.dt_s));
  world.body(2).position_m[2] = -0.6;  // open
  const auto gone = [&] {
    int n = 0;
    for (std::int64_t i = 0; i < world.count(); ++i) n += world.State(i).z_m < 0;
    return n;
  };
  const int first = static_cast<int>(0.08 * world.count()), last = 4 * first;
  double t0 = 0, t1 = 0;
  int n0 = 0, n1 = 0;
  while (n1 == 0) {
    RunOrThrow(world, 50);
    const int n = gone();
    if (n >= first && n0 == 0) n0 = n, t0 = world.time_s();
    if (n >= last) n1 = n, t1 = world.time_s();
    if (world.time_s() > 12) throw std::runtime_error("the hole is clogged");
  }
  return (n1 - n0) / (t1 - t0);
}

/// W ~ (D - k d)^5/2 with k = 1.4: Beverloo, Leniger & van de Velde, Chem.
/// Eng. Sci. 15 (1961) 260.
void Beverloo(Rows& rows) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  std::string rates;
  const double openings[] = {7, 8.5, 10.5, 13};
  for (const double opening : openings) {
    const double rate = HoleRate(opening), x = std::log(opening - 1.4), y = std::log(rate);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
    rates += Format("%s%.0f at %g d", rates.empty() ? "" : ", ", rate, opening);
  }
  rows.Absolute("exponent of the flow in D - 1.4 d, four openings [-]", 2.5,
                (4 * sxy - sx * sy) / (4 * sxx - sx * sx), 0.1, "Beverloo et al. 1961");
  rows.Note("grains per second: " + rates);
}

// Collapse of granular columns: Lube, Huppert, Sparks & Hallworth, J. Fluid
// Mech. 508 (2004) 175: (r_end - r_0)/r_0 = 1.24 a for a < 1.7, 1.6 sqrt(a)
// beyond; Lajeunesse, Mangeney-Castelnau & Vilotte, Phys. Fluids 16 (2004)
// 2371: the same powers.

/// Runout over the first radius of a column of this aspect ratio.
double Runout(double aspect) {
  BedSpec spec;
  spec.smallest_d_m = 0.0036, spec.largest_d_m = 0.0044;
  const double r0 = 0.04, side = 0.5 + 0.05 * aspect, middle = side / 2;
  spec.length_m = spec.width_m = side;
  spec.grains = {5e6, 0.3};
  spec.surfaces = {.restitution = 0.5, .friction = 0.5, .rolling_friction = 0.1};
  spec.density = 2500;
  std::vector<GrainState> grains;
  for (const GrainState& g : Grid(spec, middle - r0, middle + r0, middle - r0, middle + r0, 0,
                                  static_cast<int>(18 * 18 * 26 * std::max(aspect, 0.5)))) {
    if (std::hypot(g.x_m - middle, g.y_m - middle) < r0 - 0.003) grains.push_back(g);
  }
  WorldConfig c = spec.Config();
  c.frame.z_span_m = 4;
  Body wall;
  wall.shape = HollowCylinder(r0, 1.6);
  wall.orientation = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};
  wall.position_m = {middle, middle, 0.75};
  World world(c, Scene(grains, {Floor(), wall}));
  RunOrThrow(world, std::llround(0.4 / c.dt_s));
  const double height = Top(world);
  world.body(1).position_m[2] = 1.9;  // lifted off at once, high above
  RunOrThrow(world, std::llround((0.6 + 4 * std::sqrt(2 * height / 9.81)) / c.dt_s));
  std::vector<double> far;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainState g = world.State(i);
    far.push_back(std::hypot(g.x_m - middle, g.y_m - middle) + g.radius_m);
  }
  std::sort(far.begin(), far.end());
  // Single grains roll on alone: the edge is where 98 % have stopped.
  return far[static_cast<std::size_t>(0.98 * far.size())] / r0 - 1;
}

void Collapse(Rows& rows) {
  const double aspects[] = {0.6, 1.2, 3, 6, 12};
  std::vector<double> out;
  std::string all;
  for (const double a : aspects) {
    out.push_back(Runout(a));
    all += Format("%s%.2f at %g", all.empty() ? "" : ", ", out.back(), a);
  }
  rows.Absolute("power of the runout in the aspect ratio, 0.6 to 1.2 [-]", 1,
                std::log(out[1] / out[0]) / std::log(2.0), 0.2, "Lube et al. 2004");
  rows.Absolute("power of the runout in the aspect ratio, 3 to 12 [-]", 0.5,
                std::log(out[4] / out[2]) / std::log(4.0), 0.1, "Lube et al. 2004");
  rows.Note("runout over the first radius: " + all);
}

}  // namespace

Cases FlowCases() {
  return {{"heap_5_s", Level::kDefault, StandingHeap},
          {"hopper_anand", Level::kFull, AnandHopper},
          {"beverloo", Level::kFull, Beverloo},
          {"column_collapse", Level::kFull, Collapse}};
}

}  // namespace grouser::dem::verify
