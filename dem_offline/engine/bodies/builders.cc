// Shapes from lengths. Angles by our own series: the same bits everywhere.
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/bodies/shape.h"

namespace grouser::dem {
namespace {

constexpr double kPi = std::numbers::pi;

[[noreturn]] void Refuse(const std::string& field, double got, const std::string& expected) {
  std::ostringstream out;
  out << field << ": got " << got << ", expected " << expected;
  throw std::invalid_argument(out.str());
}

void CheckLength(const char* field, double value) {
  if (!(value > 0 && value < 1e6)) Refuse(field, value, "a length > 0 m and < 1e6 m");
}

/// Taylor to 1e-17 after reduction to a quarter turn; + - x / only.
void SinCos(double angle, double* sine, double* cosine) {
  const double turns = angle / (0.5 * kPi);
  const double whole = std::floor(turns + 0.5);
  const double x = angle - whole * (0.5 * kPi), x2 = x * x;
  double s = 1, c = 1;
  for (int k = 19; k > 1; k -= 2) s = 1 - s * x2 / (k * (k - 1));
  for (int k = 18; k > 1; k -= 2) c = 1 - c * x2 / (k * (k - 1));
  s *= x;
  const int quarter = static_cast<int>(whole - 4 * std::floor(whole / 4));
  const double sines[4] = {s, c, -s, -c};
  *sine = sines[quarter];
  *cosine = sines[(quarter + 1) % 4];
}

Shape OfOne(const Part& part, double reach, bool round) {
  Shape shape;
  shape.parts.push_back(part);
  shape.reach = static_cast<float>(reach);
  shape.round = round;
  return shape;
}

Part PartOf(PartKind kind, double a, double b, double c, double d = 0) {
  Part part;
  part.kind = kind;
  part.a = static_cast<float>(a);
  part.b = static_cast<float>(b);
  part.c = static_cast<float>(c);
  part.d = static_cast<float>(d);
  return part;
}

void Check(const Tread& t, double radius_m, double width_m) {
  if (t.count < 1 || t.count > 1000) Refuse("tread.count", t.count, "1 to 1000 bars");
  if (!(t.height_m >= 1e-4 * radius_m && t.height_m < 1e6)) {
    Refuse("tread.height_m", t.height_m, "at least 1e-4 of the radius");
  }
  CheckLength("tread.root_thickness_m", t.root_thickness_m);
  if (!(t.tip_thickness_m >= 0 && t.tip_thickness_m < 1e6)) {
    Refuse("tread.tip_thickness_m", t.tip_thickness_m, "a length >= 0 m (0: as the root)");
  }
  if (t.count * t.root_thickness_m > 2 * kPi * radius_m) {
    Refuse("tread.root_thickness_m", t.root_thickness_m, "bars that fit around the rim");
  }
  const double width = t.width_m == 0 ? width_m : t.width_m;
  const double offset = t.offset_m < 0 ? -t.offset_m : t.offset_m;
  if (!(width > 0 && offset + 0.5 * width <= 0.5 * width_m * (1 + 1e-9))) {
    Refuse("tread.width_m", t.width_m, "bars no wider than the wheel, offset included");
  }
  if (!(t.lean_rad > -1.3 && t.lean_rad < 1.3)) Refuse("tread.lean_rad", t.lean_rad, "-1.3 to 1.3");
  if (!(t.phase_rad > -10 && t.phase_rad < 10)) Refuse("tread.phase_rad", t.phase_rad, "-10 to 10");
}

/// Sizes of one bar, its flanks drawn on to a foot within the rim.
struct Bar {
  double foot = 0;  ///< distance of the foot from the axle
  double root_half = 0, tip_half = 0, length_half = 0;
};

/// The least deep foot whose corners lie within the rim by a twentieth of the
/// bar's height.
Bar FitBar(const Tread& t, double radius_m, double width_m, double sine, double cosine) {
  const double step = 0.05 * t.height_m, width = t.width_m == 0 ? width_m : t.width_m;
  const double tip = t.tip_thickness_m == 0 ? t.root_thickness_m : t.tip_thickness_m;
  const double slope = 0.5 * (t.root_thickness_m - tip) / t.height_m;  // half sizes per depth
  const double lean_sine = sine < 0 ? -sine : sine;
  const auto rounds = static_cast<int>(radius_m / step);
  for (int round = 1; round <= rounds; ++round) {
    const double depth = round * step;
    Bar bar;
    bar.foot = radius_m - depth;
    bar.root_half = 0.5 * t.root_thickness_m + slope * depth;
    bar.tip_half = 0.5 * tip;
    if (!(bar.root_half > 0)) break;
    const double thick = bar.root_half > bar.tip_half ? bar.root_half : bar.tip_half;
    bar.length_half = (0.5 * width - thick * lean_sine) / cosine;
    if (!(bar.length_half > 0)) break;
    const double side = bar.length_half * lean_sine + bar.root_half * cosine;  // along the rim
    const double inner = radius_m - step;
    if (inner > 0 && side * side + bar.foot * bar.foot <= inner * inner) return bar;
  }
  Refuse("tread.root_thickness_m", t.root_thickness_m,
         "a bar whose foot fits within the rim and whose flanks do not cross (see width_m, "
         "lean_rad, tip_thickness_m)");
}

void AddBars(const Tread& t, double radius_m, double width_m, Shape* shape) {
  double lean_sine, lean_cosine;
  SinCos(t.lean_rad, &lean_sine, &lean_cosine);
  const Bar bar = FitBar(t, radius_m, width_m, lean_sine, lean_cosine);
  Shape::Ring ring;
  ring.first = static_cast<int>(shape->parts.size());
  ring.count = t.count;
  for (int k = 0; k < t.count; ++k) {
    double s, c;
    SinCos(t.phase_rad + 2 * kPi * k / t.count, &s, &c);
    // Tangent (c, 0, -s) and axle (0, 1, 0), turned by the lean about (s, 0, c).
    const double axes[9] = {lean_cosine * c,
                            lean_sine,
                            -lean_cosine * s,
                            -lean_sine * c,
                            lean_cosine,
                            lean_sine * s,
                            s,
                            0,
                            c};
    Part part = PartOf(PartKind::kPrism, bar.root_half, bar.length_half,
                       radius_m + t.height_m - bar.foot, bar.tip_half);
    for (int i = 0; i < 9; ++i) part.axes[i] = static_cast<float>(axes[i]);
    part.centre[0] = static_cast<float>(bar.foot * s);
    part.centre[1] = static_cast<float>(t.offset_m);
    part.centre[2] = static_cast<float>(bar.foot * c);
    shape->parts.push_back(part);
  }
  const double lean = lean_sine < 0 ? -lean_sine : lean_sine;
  const double side = bar.length_half * lean + bar.tip_half * lean_cosine;
  const double top = radius_m + t.height_m;
  ring.outer_radius = static_cast<float>(std::sqrt(top * top + side * side) * (1 + 1e-6));
  ring.half_width = static_cast<float>(
      ((t.offset_m < 0 ? -t.offset_m : t.offset_m) + 0.5 * (t.width_m == 0 ? width_m : t.width_m)) *
      (1 + 1e-6));
  shape->rings.push_back(ring);
}

}  // namespace

Shape HalfSpace(const double normal[3]) {
  const double n2 = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
  if (!(n2 > 1e-200 && n2 < 1e200)) Refuse("normal", n2, "a finite vector, not zero (squared)");
  const double scale = 1 / std::sqrt(n2);
  const double z[3] = {normal[0] * scale, normal[1] * scale, normal[2] * scale};
  // x: the coordinate axis that stands best against z, made normal to it.
  int k = 0;
  for (int i = 1; i < 3; ++i) {
    if (z[i] * z[i] < z[k] * z[k]) k = i;
  }
  double x[3];
  for (int i = 0; i < 3; ++i) x[i] = (i == k ? 1.0 : 0.0) - z[k] * z[i];
  const double length = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  for (double& v : x) v /= length;
  Part part;
  part.kind = PartKind::kHalfSpace;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, l = (i + 2) % 3;
    part.axes[i] = static_cast<float>(x[i]);
    part.axes[3 + i] = static_cast<float>(z[j] * x[l] - z[l] * x[j]);
    part.axes[6 + i] = static_cast<float>(z[i]);
  }
  return OfOne(part, std::numeric_limits<double>::infinity(), z[0] == 0 && z[2] == 0);
}

Shape SmoothWheel(double radius_m, double width_m) {
  CheckLength("radius_m", radius_m);
  CheckLength("width_m", width_m);
  return OfOne(PartOf(PartKind::kCylinder, radius_m, 0.5 * width_m, 0),
               std::sqrt(radius_m * radius_m + 0.25 * width_m * width_m), true);
}

Shape HollowCylinder(double radius_m, double length_m, double wall_m) {
  CheckLength("radius_m", radius_m);
  CheckLength("length_m", length_m);
  if (!(wall_m >= 0 && wall_m < 1e6)) Refuse("wall_m", wall_m, "a length >= 0 m (0: a bore)");
  const double outer = radius_m + wall_m;
  return OfOne(PartOf(PartKind::kHollowCylinder, radius_m, 0.5 * length_m, wall_m),
               std::sqrt(outer * outer + 0.25 * length_m * length_m), true);
}

Shape Disc(double radius_m) {
  CheckLength("radius_m", radius_m);
  return OfOne(PartOf(PartKind::kDisc, radius_m, 0, 0), radius_m, false);
}

Shape Annulus(double inner_radius_m, double outer_radius_m) {
  CheckLength("inner_radius_m", inner_radius_m);
  CheckLength("outer_radius_m", outer_radius_m);
  if (!(outer_radius_m > inner_radius_m)) {
    Refuse("outer_radius_m", outer_radius_m, "more than inner_radius_m");
  }
  return OfOne(PartOf(PartKind::kAnnulus, inner_radius_m, outer_radius_m, 0), outer_radius_m,
               false);
}

Shape Box(double x_m, double y_m, double z_m) {
  CheckLength("x_m", x_m);
  CheckLength("y_m", y_m);
  CheckLength("z_m", z_m);
  return OfOne(PartOf(PartKind::kBox, 0.5 * x_m, 0.5 * y_m, 0.5 * z_m),
               0.5 * std::sqrt(x_m * x_m + y_m * y_m + z_m * z_m), false);
}

Shape Sphere(double radius_m) {
  CheckLength("radius_m", radius_m);
  return OfOne(PartOf(PartKind::kSphere, radius_m, radius_m, radius_m), radius_m, false);
}

Shape SphereRing(double sphere_radius_m, double ring_radius_m, int count) {
  CheckLength("radius_m", sphere_radius_m);
  CheckLength("ring_radius_m", ring_radius_m);
  if (count < 1 || count > 10000) Refuse("count", count, "1 to 10000 spheres");
  Shape shape;
  Part part = PartOf(PartKind::kSphere, sphere_radius_m, sphere_radius_m, sphere_radius_m);
  for (int k = 0; k < count; ++k) {
    double s, c;
    SinCos(2 * kPi * k / count, &s, &c);
    part.centre[0] = static_cast<float>(ring_radius_m * s);
    part.centre[2] = static_cast<float>(ring_radius_m * c);
    shape.parts.push_back(part);
  }
  const auto outer = static_cast<float>((ring_radius_m + sphere_radius_m) * (1 + 1e-6));
  shape.rings.push_back({0, count, outer, static_cast<float>(sphere_radius_m * (1 + 1e-6))});
  shape.reach = outer;
  shape.round = false;
  return shape;
}

Shape TreadedWheel(double radius_m, double width_m, const std::vector<Tread>& treads) {
  Shape shape = SmoothWheel(radius_m, width_m);
  for (const Tread& tread : treads) {
    Check(tread, radius_m, width_m);
    AddBars(tread, radius_m, width_m, &shape);
    const Shape::Ring& ring = shape.rings.back();
    const float reach =
        Sqrt(ring.outer_radius * ring.outer_radius + ring.half_width * ring.half_width);
    shape.reach = Max(shape.reach, reach);
    shape.round = false;
  }
  return shape;
}

Shape FromMesh(std::shared_ptr<const Mesh> mesh) {
  if (!mesh) throw std::invalid_argument("mesh: got none, expected a mesh");
  Shape shape;
  shape.round = false;
  shape.reach = static_cast<float>(mesh->reach() * (1 + 1e-6));
  shape.mesh = std::move(mesh);
  return shape;
}

}  // namespace grouser::dem
