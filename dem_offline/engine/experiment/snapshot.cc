// What is drawn of an experiment.
#include "dem_offline/engine/experiment/snapshot.h"

#include <cmath>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/validate.h"

namespace grouser::dem::experiment {
namespace {

/// Triangles of one part, in its own frame, put into the body's.
class PartSurface {
 public:
  PartSurface(const Part& part, int segments, TriangleSoup* out)
      : p_(part), n_(segments), out_(*out) {}

  void Draw() {
    switch (p_.kind) {
      case PartKind::kHalfSpace:
        return;
      case PartKind::kCylinder:
        return Revolve({{0, -p_.b}, {p_.a, -p_.b}, {p_.a, p_.b}, {0, p_.b}});
      case PartKind::kHollowCylinder: {
        const double outer = p_.a + p_.c;
        if (!(p_.c > 0)) return Revolve({{p_.a, p_.b}, {p_.a, -p_.b}});
        return Revolve({{p_.a, p_.b}, {p_.a, -p_.b}, {outer, -p_.b}, {outer, p_.b}, {p_.a, p_.b}});
      }
      case PartKind::kSphere: {
        std::vector<std::array<double, 2>> line;  // from pole to pole
        for (int k = 0, half = n_ / 2; k <= half; ++k) {
          const double angle = M_PI * k / half, radius = p_.a * std::sin(angle);
          line.push_back({k == 0 || k == half ? 0 : radius, -p_.a * std::cos(angle)});
        }
        return Revolve(line);
      }
      case PartKind::kDisc:
        return Flat(0, p_.a);
      case PartKind::kAnnulus:
        return Flat(p_.a, p_.b);
      case PartKind::kBox:
        return Hexahedron(-p_.c, p_.c, p_.a, p_.a);
      case PartKind::kPrism:
        return Hexahedron(0, p_.c, p_.a, p_.d);
    }
  }

 private:
  std::int32_t Put(double x, double y, double z) {
    const float* m = p_.axes;
    Vec3d at;
    for (int k = 0; k < 3; ++k) at[k] = p_.centre[k] + x * m[k] + y * m[3 + k] + z * m[6 + k];
    out_.vertices.push_back(at);
    return static_cast<std::int32_t>(out_.vertices.size()) - 1;
  }
  void Quad(std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) {
    out_.triangles.push_back({a, b, c});
    out_.triangles.push_back({a, c, d});
  }
  /// A line of (radius, y) about y; each piece has corners of its own, so that edges stay sharp.
  void Revolve(const std::vector<std::array<double, 2>>& line) {
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
      Ring(line[k][0], line[k + 1][0], [&](double radius, double s, double c, bool first) {
        return Put(radius * s, first ? line[k][1] : line[k + 1][1], radius * c);
      });
    }
  }
  void Flat(double inner, double outer) {
    Ring(inner, outer,
         [&](double radius, double s, double c, bool) { return Put(radius * c, radius * s, 0); });
  }
  template <class Corner>
  void Ring(double first, double second, Corner&& corner) {
    std::vector<std::int32_t> a, b;
    for (int k = 0; k < n_; ++k) {
      const double angle = 2 * M_PI * k / n_;
      a.push_back(corner(first, std::sin(angle), std::cos(angle), true));
      b.push_back(corner(second, std::sin(angle), std::cos(angle), false));
    }
    for (int k = 0; k < n_; ++k) {
      const int l = (k + 1) % n_;
      if (first > 0) out_.triangles.push_back({a[k], a[l], b[k]});
      if (second > 0) out_.triangles.push_back({a[l], b[l], b[k]});
    }
  }
  /// Half sizes along x at either end of z; along y: b.
  void Hexahedron(double z0, double z1, double x0, double x1) {
    std::int32_t v[8];
    for (int k = 0; k < 8; ++k) {
      const double x = (k & 4 ? x1 : x0) * (k & 1 ? 1 : -1);
      v[k] = Put(x, k & 2 ? p_.b : -p_.b, k & 4 ? z1 : z0);
    }
    Quad(v[0], v[2], v[3], v[1]);
    Quad(v[4], v[5], v[7], v[6]);
    Quad(v[0], v[1], v[5], v[4]);
    Quad(v[2], v[6], v[7], v[3]);
    Quad(v[0], v[4], v[6], v[2]);
    Quad(v[1], v[3], v[7], v[5]);
  }

  const Part& p_;
  int n_;
  TriangleSoup& out_;
};

void AddBody(const Body& body, TriangleSoup* out) {
  const TriangleSoup own = TrianglesOf(body.shape);
  const auto first = static_cast<std::int32_t>(out->vertices.size());
  const Mat3d turn = MatrixOf(body.orientation);
  for (const Vec3d& v : own.vertices) out->vertices.push_back(Add(body.position_m, turn * v));
  for (const auto& t : own.triangles) {
    out->triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

}  // namespace

TriangleSoup TrianglesOf(const Shape& shape, int segments) {
  TriangleSoup out;
  for (const Part& part : shape.parts) PartSurface(part, segments, &out).Draw();
  if (!shape.mesh) return out;
  const auto first = static_cast<std::int32_t>(out.vertices.size());
  const TriangleSoup& soup = shape.mesh->soup();
  out.vertices.insert(out.vertices.end(), soup.vertices.begin(), soup.vertices.end());
  for (const auto& t : soup.triangles) {
    out.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  return out;
}

Snapshot SnapshotOf(const Experiment& e, const Ground& ground, double time_s) {
  const World& world = ground.world();
  Snapshot out;
  out.time_s = time_s;
  out.box_m = {e.box.length_m, e.box.width_m, e.box.height_m};
  out.planar = e.box.planar;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainLoad& load = world.loads()[i];
    out.grains.push_back(ground.At(i));
    out.ids.push_back(world.grains()[i].id);
    out.force_n.push_back({load.fx, load.fy, load.fz});
    out.overlap.push_back(load.deepest / world.grains()[i].radius);
    out.contacts.push_back(load.touching);
  }
  for (const BondEntry& b : world.state().bonds) {
    if (b.intact) out.bonds.push_back({b.a, b.b});
  }
  for (std::size_t b = 0; b < e.bodies.size(); ++b) {
    out.bodies.push_back(e.bodies[b].name);
    AddBody(world.body(ground.BodyOf(b)), &out.triangles);
    out.body_of.resize(out.triangles.triangles.size(), static_cast<std::int32_t>(b));
    for (BodyContact c : world.ContactsOf(ground.BodyOf(b))) {
      c.body = static_cast<int>(b);
      c.point = c.point + ToFloat(world.body(ground.BodyOf(b)).position_m);
      out.touches.push_back(c);
    }
  }
  return out;
}

void CheckFrames(const Experiment& e) {
  const FrameSpec& f = e.frames;
  CheckWithin("output.frames.every_s", f.every_s, 0, 1e300);
  for (std::size_t k = 0; k < f.times_s.size(); ++k) {
    if (f.times_s[k] >= 0 && (k == 0 || f.times_s[k] > f.times_s[k - 1])) continue;
    throw SpecError("output.frames.times_s", Short(f.times_s[k]), "times >= 0 that rise");
  }
  if (f.every_s > 0) {
    CheckWithin("output.frames.every_s", f.every_s, ProgramTime(e) / kMostFrames, 1e300);
  } else if (static_cast<double>(f.times_s.size()) > kMostFrames) {
    throw SpecError("output.frames.times_s", std::to_string(f.times_s.size()),
                    "at most " + Short(kMostFrames) + " times");
  }
}

bool SnapshotTimes::Due(double time_s) {
  const auto n = static_cast<std::size_t>(taken_);
  const double rounding = 1 + 1e-9;
  if (spec_.every_s > 0) {
    if (time_s * rounding < static_cast<double>(taken_) * spec_.every_s) return false;
  } else if (n >= spec_.times_s.size() || time_s * rounding < spec_.times_s[n]) {
    return false;
  }
  ++taken_;
  return true;
}

}  // namespace grouser::dem::experiment
