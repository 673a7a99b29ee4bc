// Discharge: Anand et al. (2008) through a slot, Beverloo's law through holes.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

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

}  // namespace

Cases HopperCases() {
  return {{"hopper_anand", Level::kFull, AnandHopper}, {"beverloo", Level::kFull, Beverloo}};
}

}  // namespace grouser::dem::verify
