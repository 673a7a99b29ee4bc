// Bodies out of parts: surfaces of revolution, mass and inertia, the body that a world takes.
#include "dem_offline/engine/experiment/shapes.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "dem_offline/engine/bodies/clump.h"
#include "dem_offline/engine/core/rotation.h"

namespace grouser::dem::experiment {
namespace {

constexpr int kSegments = 96;  // around an axis: an inscribed circle, 0.05 % of the radius inside

/// Axes of an engine's part whose own axis is y, so that it points along z.
constexpr float kAlongZ[9] = {1, 0, 0, 0, 0, 1, 0, -1, 0};

using Profile = std::vector<std::array<double, 2>>;

Profile ConeProfile(const PartSpec& p) {
  Profile out = {{0, 0}, {p.radius_m, p.height_m}};
  if (p.shaft_length_m > 0) {
    if (p.shaft_radius_m != p.radius_m) out.push_back({p.shaft_radius_m, p.height_m});
    out.push_back({p.shaft_radius_m, p.height_m + p.shaft_length_m});
  }
  out.push_back({0, out.back()[1]});
  return out;
}

void Append(const TriangleSoup& more, TriangleSoup* out) {
  const auto first = static_cast<std::int32_t>(out->vertices.size());
  out->vertices.insert(out->vertices.end(), more.vertices.begin(), more.vertices.end());
  for (const auto& t : more.triangles) {
    out->triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

void Place(const Vec3d& at, const Quatd& turn, TriangleSoup* soup) {
  const Mat3d r = MatrixOf(turn);
  for (auto& v : soup->vertices) v = Add(at, r * v);
}

/// Triangles of a part that is a mesh for the engine; none: another kind.
std::optional<TriangleSoup> SoupOf(const PartSpec& p) {
  switch (p.shape) {
    case PartShape::kCone:
      return Revolve(ConeProfile(p), kSegments);
    case PartShape::kRing:
      return Revolve({{p.inner_radius_m, 0},
                      {p.outer_radius_m, 0},
                      {p.outer_radius_m, p.height_m},
                      {p.inner_radius_m, p.height_m}},
                     kSegments);
    case PartShape::kMesh:
      return p.mesh;
    default:
      return std::nullopt;
  }
}

/// The same part in other coordinates: x_old = at + turn x_new, undone.
Part MovedPart(const Part& part, const Vec3d& at, const Quatd& turn) {
  const Mat3d r = MatrixOf(turn);
  Part out = part;
  const Vec3d c = Add(at, r * Vec3d{part.centre[0], part.centre[1], part.centre[2]});
  for (int row = 0; row < 3; ++row) {
    const float* a = &part.axes[3 * row];
    const Vec3d axis = r * Vec3d{a[0], a[1], a[2]};
    for (int k = 0; k < 3; ++k) out.axes[3 * row + k] = static_cast<float>(axis[k]);
    out.centre[row] = static_cast<float>(c[row]);
  }
  return out;
}

bool IsIdentity(const Vec3d& at, const Quatd& turn) {
  return at == Vec3d{0, 0, 0} && turn == Quatd{1, 0, 0, 0};
}

Shape BarsOf(const PartSpec& p) {
  Shape out;
  for (int k = 0; k < p.count; ++k) {
    const double angle = 2 * M_PI * k / p.count;
    Shape bar = Box(p.outer_radius_m - p.inner_radius_m, p.thickness_m, p.height_m);
    const double middle = 0.5 * (p.outer_radius_m + p.inner_radius_m);
    out.parts.push_back(MovedPart(
        bar.parts[0], {middle * std::cos(angle), middle * std::sin(angle), -0.5 * p.height_m},
        {std::cos(0.5 * angle), 0, 0, std::sin(0.5 * angle)}));
  }
  out.reach =
      static_cast<float>(std::sqrt(p.outer_radius_m * p.outer_radius_m +
                                   0.25 * p.thickness_m * p.thickness_m + p.height_m * p.height_m));
  out.round = false;
  return out;
}

/// A part that is no mesh, in its own coordinates: axis z (wheels: y).
Shape PrimitiveOf(const PartSpec& p) {
  Shape out;
  switch (p.shape) {
    case PartShape::kBox:
      return Box(p.size_m[0], p.size_m[1], p.size_m[2]);
    case PartShape::kCylinder:
      out = SmoothWheel(p.radius_m, p.length_m);
      break;
    case PartShape::kTube:
      out = HollowCylinder(p.radius_m, p.length_m, p.wall_m);
      break;
    case PartShape::kDisc:
      return Disc(p.radius_m);
    case PartShape::kAnnulus:
      return Annulus(p.inner_radius_m, p.outer_radius_m);
    case PartShape::kVanes:
      return BarsOf(p);
    case PartShape::kSphere:
      return Sphere(p.radius_m);
    case PartShape::kSpheres:
      return SphereRing(p.radius_m, p.ring_radius_m, p.count);
    case PartShape::kPlane:
      return HalfSpace(Vec3d{0, 0, 1}.data());
    default:
      return p.treads.empty() ? SmoothWheel(p.radius_m, p.width_m)
                              : TreadedWheel(p.radius_m, p.width_m, p.treads);
  }
  std::copy(std::begin(kAlongZ), std::end(kAlongZ), out.parts[0].axes);
  out.round = false;
  return out;
}

// Mass of single parts, in their own coordinates; tensors are diagonal there.

MassProperties Diagonal(double volume, double z, double xx, double yy, double zz) {
  return {volume, {0, 0, z}, {xx, yy, zz, 0, 0, 0}};
}
MassProperties CylinderMass(double radius, double length, double z) {
  const double v = M_PI * radius * radius * length, r2 = radius * radius;
  const double across = v * (3 * r2 + length * length) / 12;
  return Diagonal(v, z, across, across, 0.5 * v * r2);
}
MassProperties ConeMass(double radius, double height) {  // tip at z = 0
  const double v = M_PI * radius * radius * height / 3;
  const double across = v * (3.0 / 20 * radius * radius + 3.0 / 80 * height * height);
  return Diagonal(v, 0.75 * height, across, across, 0.3 * v * radius * radius);
}
MassProperties BoxMass(double x, double y, double z) {
  const double v = x * y * z;
  return Diagonal(v, 0, v * (y * y + z * z) / 12, v * (x * x + z * z) / 12,
                  v * (x * x + y * y) / 12);
}

struct Tensor {
  double m[3][3];
};
Tensor ToTensor(const double t[6]) {
  return {{{t[0], t[3], t[4]}, {t[3], t[1], t[5]}, {t[4], t[5], t[2]}}};
}

/// Adds `sign` times a part that is placed at, turned so; about the origin meanwhile.
class MassSum {
 public:
  void Add(const MassProperties& p, const Vec3d& at, const Quatd& turn, double sign = 1) {
    const Mat3d r = MatrixOf(turn);
    const Vec3d c = dem::Add(at, r * p.centre_m);
    const Tensor own = ToTensor(p.tensor_m5);
    const double c2 = DotD(c, c);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        double turned = 0;
        for (int k = 0; k < 3; ++k) {
          for (int l = 0; l < 3; ++l) turned += r.m[3 * i + k] * own.m[k][l] * r.m[3 * j + l];
        }
        about_origin_.m[i][j] += sign * (turned + p.volume_m3 * ((i == j ? c2 : 0) - c[i] * c[j]));
      }
      first_[i] += sign * p.volume_m3 * c[i];
    }
    volume_ += sign * p.volume_m3;
  }
  MassProperties Total() const {
    MassProperties out;
    out.volume_m3 = volume_;
    if (!(volume_ > 0)) return out;
    const Vec3d c = Scale(1 / volume_, first_);
    out.centre_m = c;
    const double c2 = DotD(c, c);
    const int at[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) {
        out.tensor_m5[at[i][j]] =
            about_origin_.m[i][j] - volume_ * ((i == j ? c2 : 0) - c[i] * c[j]);
      }
    }
    return out;
  }

 private:
  double volume_ = 0;
  Vec3d first_ = {0, 0, 0};
  Tensor about_origin_ = {};
};

constexpr Quatd kAsIs = {1, 0, 0, 0};
constexpr Vec3d kHere = {0, 0, 0};
const Quatd kYToZ = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};

/// An open mesh has none, nor has a vessel, which is filled outside.
MassProperties SolidMeshMass(const TriangleSoup& soup) {
  const MassProperties out = Mesh(soup).closed() ? MassOfMesh(soup) : MassProperties{};
  return out.volume_m3 > 0 ? out : MassProperties{};
}

MassProperties MassOfPart(const PartSpec& p) {
  MassSum sum;
  switch (p.shape) {
    case PartShape::kBox:
      return BoxMass(p.size_m[0], p.size_m[1], p.size_m[2]);
    case PartShape::kCylinder:
      return CylinderMass(p.radius_m, p.length_m, 0);
    case PartShape::kTube:
      if (!(p.wall_m > 0)) return {};
      sum.Add(CylinderMass(p.radius_m + p.wall_m, p.length_m, 0), kHere, kAsIs);
      sum.Add(CylinderMass(p.radius_m, p.length_m, 0), kHere, kAsIs, -1);
      return sum.Total();
    case PartShape::kRing:
      sum.Add(CylinderMass(p.outer_radius_m, p.height_m, 0.5 * p.height_m), kHere, kAsIs);
      sum.Add(CylinderMass(p.inner_radius_m, p.height_m, 0.5 * p.height_m), kHere, kAsIs, -1);
      return sum.Total();
    case PartShape::kVanes: {
      const MassProperties bar =
          BoxMass(p.outer_radius_m - p.inner_radius_m, p.thickness_m, p.height_m);
      const double middle = 0.5 * (p.outer_radius_m + p.inner_radius_m);
      for (int k = 0; k < p.count; ++k) {
        const double a = 2 * M_PI * k / p.count;
        sum.Add(bar, {middle * std::cos(a), middle * std::sin(a), -0.5 * p.height_m},
                {std::cos(0.5 * a), 0, 0, std::sin(0.5 * a)});
      }
      return sum.Total();
    }
    case PartShape::kCone:
      sum.Add(ConeMass(p.radius_m, p.height_m), kHere, kAsIs);
      if (p.shaft_length_m > 0) {
        sum.Add(
            CylinderMass(p.shaft_radius_m, p.shaft_length_m, p.height_m + 0.5 * p.shaft_length_m),
            kHere, kAsIs);
      }
      return sum.Total();
    case PartShape::kSphere: {
      const double v = 4.0 / 3 * M_PI * p.radius_m * p.radius_m * p.radius_m,
                   i = 0.4 * v * p.radius_m * p.radius_m;
      return Diagonal(v, 0, i, i, i);
    }
    case PartShape::kSpheres:
      for (int k = 0; k < p.count; ++k) {
        const double a = 2 * M_PI * k / p.count;
        PartSpec one = p;
        one.shape = PartShape::kSphere;
        sum.Add(MassOfPart(one), {p.ring_radius_m * std::sin(a), 0, p.ring_radius_m * std::cos(a)},
                kAsIs);
      }
      return sum.Total();
    case PartShape::kWheel:
      sum.Add(CylinderMass(p.radius_m, p.width_m, 0), kHere, kYToZ);
      return sum.Total();
    case PartShape::kMesh:
      return SolidMeshMass(p.mesh);
    default:
      return {};
  }
}

float Support(const Part& part, const Vec3d& up_in_body) {  // lowest along -up, of its own centre
  const float* m = part.axes;
  const auto along = [&](int row) {
    return m[3 * row] * up_in_body[0] + m[3 * row + 1] * up_in_body[1] +
           m[3 * row + 2] * up_in_body[2];
  };
  const double x = along(0), y = along(1), z = along(2);
  const double c = part.centre[0] * up_in_body[0] + part.centre[1] * up_in_body[1] +
                   part.centre[2] * up_in_body[2];
  double down = 0;
  switch (part.kind) {
    case PartKind::kHalfSpace:
      break;
    case PartKind::kCylinder:
      down = part.a * std::hypot(x, z) + part.b * std::abs(y);
      break;
    case PartKind::kHollowCylinder:
      down = (part.a + part.c) * std::hypot(x, z) + part.b * std::abs(y);
      break;
    case PartKind::kDisc:
      down = part.a * std::hypot(x, y);
      break;
    case PartKind::kAnnulus:
      down = part.b * std::hypot(x, y);
      break;
    case PartKind::kBox:
      down = part.a * std::abs(x) + part.b * std::abs(y) + part.c * std::abs(z);
      break;
    case PartKind::kSphere:
      down = part.a;
      break;
    case PartKind::kPrism:
      down =
          std::max(part.a * std::abs(x), part.d * std::abs(x) - part.c * z) + part.b * std::abs(y);
      break;
  }
  return static_cast<float>(c - down);
}

}  // namespace

TriangleSoup Revolve(const std::vector<std::array<double, 2>>& profile, int segments) {
  TriangleSoup out;
  const auto n = static_cast<std::int32_t>(profile.size());
  std::vector<std::int32_t> first(profile.size());
  for (std::size_t i = 0; i < profile.size(); ++i) {
    first[i] = static_cast<std::int32_t>(out.vertices.size());
    const auto [r, z] = profile[i];
    for (int k = 0; k < (r > 0 ? segments : 1); ++k) {
      const double a = 2 * M_PI * k / segments;
      out.vertices.push_back({r * std::cos(a), r * std::sin(a), z});
    }
  }
  const auto vertex = [&](std::int32_t i, int k) {
    return profile[i][0] > 0 ? first[i] + k % segments : first[i];
  };
  for (std::int32_t i = 0; i < n; ++i) {
    const std::int32_t j = (i + 1) % n;
    if (!(profile[i][0] > 0) && !(profile[j][0] > 0)) continue;  // along the axis
    for (int k = 0; k < segments; ++k) {
      if (profile[i][0] > 0) {
        out.triangles.push_back({vertex(i, k), vertex(i, k + 1), vertex(j, k + 1)});
      }
      if (profile[j][0] > 0) {
        out.triangles.push_back({vertex(i, k), vertex(j, k + 1), vertex(j, k)});
      }
    }
  }
  return out;
}

MassProperties MassOfMesh(const TriangleSoup& soup) {
  // Moments of the tetrahedra that the triangles make with the origin (Tonon, J. Math. Stat. 1
  // (2004) 8): int x_i x_j = V/20 (sum_k v_i v_j + S_i S_j), S the sum of the corners.
  double volume = 0, second[3][3] = {};
  Vec3d first = {0, 0, 0};
  for (const auto& t : soup.triangles) {
    const Vec3d &a = soup.vertices[t[0]], &b = soup.vertices[t[1]], &c = soup.vertices[t[2]];
    const double v = DotD(a, CrossD(b, c)) / 6;
    const Vec3d s = Add(a, Add(b, c));
    volume += v;
    first = Add(first, Scale(v / 4, s));
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        second[i][j] += v / 20 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
      }
    }
  }
  MassProperties out;
  out.volume_m3 = volume;
  if (!(volume > 0)) return out;
  const Vec3d c = Scale(1 / volume, first);
  out.centre_m = c;
  double spread[3][3], trace = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) spread[i][j] = second[i][j] - volume * c[i] * c[j];
    trace += spread[i][i];
  }
  const double tensor[6] = {trace - spread[0][0], trace - spread[1][1], trace - spread[2][2],
                            -spread[0][1],        -spread[0][2],        -spread[1][2]};
  std::copy(std::begin(tensor), std::end(tensor), out.tensor_m5);
  return out;
}

MassProperties MassOf(const std::vector<PartSpec>& parts, const std::string& field) {
  MassSum sum;
  for (const PartSpec& p : parts) sum.Add(MassOfPart(p), p.at_m, p.turn);
  const MassProperties out = sum.Total();
  if (!(out.volume_m3 > 0)) {
    throw SpecError(field + ".mass_kg", "none",
                    "a mass: its parts enclose no volume (open meshes and vessels have none)");
  }
  return out;
}

Shape ShapeOf(const std::vector<PartSpec>& parts, const std::string& field) {
  Shape out;
  TriangleSoup soup;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const PartSpec& p = parts[i];
    const std::string at = field + ".parts[" + std::to_string(i) + "]";
    try {
      if (std::optional<TriangleSoup> mesh = SoupOf(p)) {
        (void)Mesh(*mesh);  // alone, so that a complaint counts its own faces
        Place(p.at_m, p.turn, &*mesh);
        Append(*mesh, &soup);
        continue;
      }
      Shape one = PrimitiveOf(p);
      if (!IsIdentity(p.at_m, p.turn)) {
        one.rings.clear();  // evenly spaced about the body's y no more
        one.round = false;
      }
      for (Shape::Ring& ring : one.rings) ring.first += static_cast<int>(out.parts.size());
      out.rings.insert(out.rings.end(), one.rings.begin(), one.rings.end());
      for (Part& part : one.parts) out.parts.push_back(MovedPart(part, p.at_m, p.turn));
      out.reach = std::max(out.reach, one.reach + static_cast<float>(Norm(p.at_m)));
      out.round = one.round && parts.size() == 1;
    } catch (const SpecError&) {
      throw;
    } catch (const std::invalid_argument& error) {
      throw SpecError(at, error.what(), "a part that can be built");
    }
  }
  if (!soup.triangles.empty()) {
    const Shape mesh = FromMesh(std::make_shared<Mesh>(std::move(soup)));
    out.mesh = mesh.mesh;
    out.reach = std::max(out.reach, mesh.reach);
    out.round = false;
  }
  return out;
}

Shape Moved(const Shape& shape, const Vec3d& origin_m, const Quatd& turn) {
  const Quatd back = Conj(turn);
  const Vec3d at = Scale(-1, MatrixOf(back) * origin_m);
  Shape out = shape;
  for (Part& part : out.parts) part = MovedPart(part, at, back);
  if (shape.mesh) {
    TriangleSoup soup = shape.mesh->soup();
    Place(at, back, &soup);
    out.mesh = std::make_shared<Mesh>(std::move(soup));
  }
  out.reach = shape.reach + static_cast<float>(Norm(origin_m));
  if (!IsIdentity(origin_m, turn)) {
    out.rings.clear();
    out.round = false;
  }
  return out;
}

BuiltBody BuildBody(const BodySpec& spec, const Material& material, int number, bool moves_freely,
                    const std::string& field) {
  BuiltBody out;
  Body& body = out.body;
  body.shape = ShapeOf(spec.parts, field);
  body.material = number;
  body.position_m = spec.position_m;
  body.orientation = Unit(spec.turn);
  body.motion = spec.motion.empty() ? BodyMotion::kFixed : BodyMotion::kPrescribed;
  if (!moves_freely) return out;
  Vec3d centre = spec.centre_m;
  Quatd turn = {1, 0, 0, 0};
  body.mass_kg = spec.mass_kg;
  body.inertia_kg_m2 = spec.inertia_kg_m2;
  if (spec.inertia_kg_m2 == Vec3d{0, 0, 0}) {
    const MassProperties m = MassOf(spec.parts, field);
    if (!(spec.mass_kg > 0)) body.mass_kg = material.density_kg_per_m3 * m.volume_m3;
    if (!(body.mass_kg > 0)) {
      throw SpecError(field + ".mass_kg", "none",
                      "a mass, or a density of material '" + material.name + "'");
    }
    centre = m.centre_m;
    Tensor tensor = ToTensor(m.tensor_m5);
    turn = ToPrincipalAxes(tensor.m);
    for (int k = 0; k < 3; ++k) {
      body.inertia_kg_m2[k] = tensor.m[k][k] * body.mass_kg / m.volume_m3;
    }
  }
  body.shape = Moved(body.shape, centre, turn);
  body.position_m = Add(body.position_m, MatrixOf(body.orientation) * centre);
  body.orientation = Unit(Mul(body.orientation, turn));
  out.turn = turn;
  out.centre_m = centre;
  return out;
}

double LowestPoint(const Body& body) {
  const Mat3d r = MatrixOf(body.orientation);
  const Vec3d up = r.Back({0, 0, 1});  // in body coordinates
  double low = kNever;
  for (const Part& part : body.shape.parts) low = std::min<double>(low, Support(part, up));
  if (body.shape.mesh) {
    for (const auto& v : body.shape.mesh->soup().vertices) low = std::min(low, DotD(up, v));
  }
  return body.position_m[2] + (std::isfinite(low) ? low : 0.0);
}

}  // namespace grouser::dem::experiment
