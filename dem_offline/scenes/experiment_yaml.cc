#include "dem_offline/scenes/experiment_yaml.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "dem_offline/engine/bodies/mesh_repair.h"
#include "dem_offline/engine/core/rotation.h"
#include "dem_offline/engine/experiment/mesh_axle.h"
#include "dem_offline/scenes/experiment_joints_yaml.h"
#include "dem_offline/scenes/experiment_keys.h"
#include "dem_offline/scenes/experiment_motion_yaml.h"
#include "proto/records/durable_file.h"

namespace grouser::campaign {
namespace {

namespace dx = dem::experiment;
using dem::Quatd;
using dem::Vec3d;

constexpr std::uint64_t kMostCount = 1000000000;
constexpr int kFindAxle = 3;  // of the choices of `axle`

/// Turned about the fixed x, then y, then z.
Quatd TurnOf(const std::vector<double>& angles) {
  const auto about = [&](std::size_t axis) {
    Quatd q = {std::cos(0.5 * angles[axis]), 0, 0, 0};
    q[axis + 1] = std::sin(0.5 * angles[axis]);
    return q;
  };
  return dem::Mul(about(2), dem::Mul(about(1), about(0)));
}

class Reader {
 public:
  Reader(ExperimentFile* out, std::string folder) : out_(*out), folder_(std::move(folder)) {}

  void Read(KeyedSection root) {
    dx::Experiment& e = out_.experiment;
    if (root.Has("sweep")) root.yaml().Fail("sweep", "many runs", "one run: a file without");
    e.name = root.Text("name");
    e.seed = root.CountOr("seed", 1, std::numeric_limits<std::uint64_t>::max());
    e.gravity_m_per_s2 = root.NumberOr("gravity_m_per_s2", e.gravity_m_per_s2);
    e.duration_s = root.NumberOr("duration_s", 0);
    if (root.Has("laws")) ReadLaws(root.Section("laws"));
    for (KeyedSection& s : root.Sections("materials")) e.materials.push_back(ReadMaterial(s));
    for (KeyedSection& s : root.Sections("interfaces")) e.interfaces.push_back(ReadPair(s));
    ReadBox(root.Section("box"));
    for (KeyedSection& s : root.Sections("grains")) e.grains.push_back(ReadGrains(s));
    if (root.Has("preparation")) {
      for (KeyedSection& s : root.Sections("preparation")) {
        e.preparation.push_back(ReadPreparation(s));
      }
    }
    if (root.Has("bodies")) {
      for (KeyedSection& s : root.Sections("bodies")) e.bodies.push_back(ReadBody(s));
    }
    if (root.Has("joints")) {
      for (KeyedSection& s : root.Sections("joints")) e.joints.push_back(ReadJoint(s));
    }
    if (root.Has("springs")) {
      for (KeyedSection& s : root.Sections("springs")) e.springs.push_back(ReadSpring(s));
    }
    e.mechanism = JointMechanism();
    if (root.Has("probes")) {
      for (KeyedSection& s : root.Sections("probes")) e.probes.push_back(ReadProbe(s));
    }
    if (root.Has("output")) {
      KeyedSection s = root.Section("output");
      e.sample_s = s.NumberOr("sample_s", e.sample_s);
      if (s.Has("checkpoint_every_s")) {
        e.checkpoint_every_s = s.yaml().Number("checkpoint_every_s", kPositive);
      }
      if (s.Has("frames")) e.frames = ReadFrames(s.Section("frames"));
      s.Finish();
    }
    if (root.Has("numerics")) {
      KeyedSection s = root.Section("numerics");
      e.rayleigh_fraction = s.NumberOr("rayleigh_fraction", e.rayleigh_fraction);
      e.program_step = s.NumberOr("program_step", e.program_step);
      e.overlap = s.NumberOr("overlap", e.overlap);
      s.Finish();
    }
    root.Finish();
  }

 private:
  static std::vector<dem::NamedSetting> ReadSettings(KeyedSection& at) {
    std::vector<dem::NamedSetting> out;
    for (const dem::LawEntry& law : dem::LawRegistry()) {
      if (law.settings.empty() || !at.yaml().Has(law.name)) continue;
      YamlSection section = at.yaml().Section(law.name);
      for (const dem::NamedSetting& known : law.settings) {
        if (section.Has(known.name)) {
          out.push_back({law.name, known.name, section.Number(known.name)});
        }
      }
      section.Finish();
    }
    return out;
  }

  static dx::FrameSpec ReadFrames(KeyedSection s) {
    dx::FrameSpec f;
    if (s.Has("every_s") == s.Has("times_s")) {
      s.yaml().Fail("every_s", s.Has("every_s") ? "it beside times_s" : "neither it nor times_s",
                    "one of them");
    }
    if (s.Has("every_s")) f.every_s = s.yaml().Number("every_s", kPositive);
    if (s.Has("times_s")) f.times_s = s.Numbers("times_s");
    s.Finish();
    return f;
  }

  void ReadLaws(KeyedSection s) {
    dem::ContactChoice& c = out_.experiment.laws;
    c.normal = s.TextOr("normal", c.normal);
    c.tangential = s.TextOr("tangential", c.tangential);
    c.rolling = s.TextOr("rolling", c.rolling);
    c.cohesion = s.TextOr("cohesion", c.cohesion);
    c.rolling_damping = s.NumberOr("rolling_damping", c.rolling_damping);
    c.surface_energy_j_per_m2 = s.NumberOr("surface_energy_j_per_m2", 0);
    c.settings = ReadSettings(s);
    s.Finish();
  }

  static dx::Material ReadMaterial(KeyedSection& s) {
    dx::Material m;
    m.name = s.Text("name");
    m.density_kg_per_m3 = s.NumberOr("density_kg_per_m3", 0);
    m.youngs_modulus_pa = s.NumberOr("youngs_modulus_pa", 0);
    m.poisson_ratio = s.NumberOr("poisson_ratio", 0);
    s.Finish();
    return m;
  }

  static dx::PairProperties ReadPair(KeyedSection& s) {
    dx::PairProperties f;
    const auto between = s.Texts("between");
    f.a = between[0];
    f.b = between[1];
    f.restitution = s.Number("restitution");
    f.friction = s.Number("friction");
    f.rolling_friction = s.NumberOr("rolling_friction", 0);
    if (s.Has("rolling_damping")) f.numbers.rolling_damping = s.Number("rolling_damping");
    if (s.Has("surface_energy_j_per_m2")) {
      f.numbers.surface_energy_j_per_m2 = s.Number("surface_energy_j_per_m2");
    }
    if (s.Has("normal")) f.normal = s.Text("normal");
    if (s.Has("tangential")) f.tangential = s.Text("tangential");
    if (s.Has("rolling")) f.rolling = s.Text("rolling");
    if (s.Has("cohesion")) f.cohesion = s.Text("cohesion");
    f.numbers.settings = ReadSettings(s);
    s.Finish();
    return f;
  }

  void ReadBox(KeyedSection s) {
    dx::BoxSpec& b = out_.experiment.box;
    b.length_m = s.Number("length_m");
    b.width_m = s.Number("width_m");
    b.height_m = s.Number("height_m");
    b.x = static_cast<dx::Side>(s.ChoiceOr("x", 0));
    b.y = static_cast<dx::Side>(s.ChoiceOr("y", 0));
    b.material = s.Text("material");
    b.planar = s.Switch("planar", false);
    b.disc_thickness_m = s.NumberOr("disc_thickness_m", 0);
    if (s.Has("follow")) {
      KeyedSection f = s.Section("follow");
      b.follow.body = f.Text("body");
      b.follow.length_m = f.Number("length_m");
      b.follow.ahead = f.NumberOr("ahead", b.follow.ahead);
      f.Finish();
    }
    s.Finish();
  }

  static dx::Region ReadRegion(KeyedSection s) {
    dx::Region r;
    r.low_m = ToVec3(s.Vector("low_m"));
    r.high_m = ToVec3(s.Vector("high_m"));
    r.radius_m = s.NumberOr("radius_m", 0);
    r.inner_radius_m = s.NumberOr("inner_radius_m", 0);
    s.Finish();
    if (r.low_m == r.high_m) s.yaml().Fail("high_m", "the same as low_m", "the opposite corner");
    return r;
  }

  static dx::Bonding ReadBonds(KeyedSection s) {
    dx::Bonding b;
    b.fragment_m = s.Number("fragment_m");
    b.fragments = static_cast<int>(s.Count("fragments", 1000000));
    if (b.fragments < 2) s.yaml().Fail("fragments", fmt::format("{}", b.fragments), "2 or more");
    b.count = static_cast<std::int64_t>(s.Count("count", kMostCount));
    b.disk_scale = s.NumberOr("disk_scale", 1);
    b.law.normal_stiffness_n_per_m3 = s.Number("normal_stiffness_n_per_m3");
    b.law.shear_stiffness_n_per_m3 =
        s.NumberOr("shear_stiffness_n_per_m3", b.law.normal_stiffness_n_per_m3);
    const double ratio = s.NumberOr("strength_ratio", 1);
    if (s.Has("strength_pa")) {
      b.law.tensile_strength_pa = s.Number("strength_pa");
      b.law.shear_strength_pa = ratio * b.law.tensile_strength_pa;
    }
    b.law.largest_stretch = s.NumberOr("largest_stretch", b.law.largest_stretch);
    b.largest_distance = s.NumberOr("largest_distance", b.largest_distance);
    b.law.damping_ratio = s.NumberOr("damping_ratio", 0);
    b.law.beside_contact = s.Switch("beside_contact", true);
    s.Finish();
    return b;
  }

  static std::vector<Vec3d> ReadPlaces(KeyedSection& s) {
    std::vector<Vec3d> out;
    if (s.Has("places") == s.Has("circle")) {
      s.yaml().Fail("places", s.Has("places") ? "it beside circle" : "neither it nor circle",
                    "one of them");
    }
    if (s.Has("places")) {
      for (KeyedSection& p : s.Sections("places")) {
        out.push_back(ToVec3(p.Vector("at_m")));
        p.Finish();
      }
      return out;
    }
    KeyedSection circle = s.Section("circle");
    const std::uint64_t n = circle.Count("count", 100000);
    const double radius = circle.Number("radius_m");
    const Vec3d at = ToVec3(circle.Vector("at_m"));
    for (std::uint64_t k = 0; k < n; ++k) {
      const double turn = 2 * M_PI * static_cast<double>(k) / static_cast<double>(n);
      out.push_back({at[0] + radius * std::cos(turn), at[1] + radius * std::sin(turn), at[2]});
    }
    circle.Finish();
    return out;
  }

  static dem::BedPreparation ReadPacking(KeyedSection& s) {
    dem::BedPreparation out;
    if (!s.Has("preparation")) return out;
    KeyedSection p = s.Section("preparation");
    if (p.Has("friction")) out.friction = p.Number("friction");
    if (p.Has("rolling_friction")) out.rolling_friction = p.Number("rolling_friction");
    p.Finish();
    return out;
  }

  dx::Grains ReadGrains(KeyedSection& s) {
    dx::Grains g;
    g.filling = static_cast<dx::Filling>(s.Choice("kind"));
    g.material = s.Text("material");
    if (g.filling == dx::Filling::kListed) {
      g.listed = ReadList(s);
      s.Finish();
      return g;
    }
    if (s.Has("diameter_m") == s.Has("sizes")) {
      s.yaml().Fail("sizes", s.Has("sizes") ? "it beside diameter_m" : "neither it nor diameter_m",
                    "one of them");
    }
    if (s.Has("diameter_m")) g.sizes = {{s.Number("diameter_m"), 1.0}};
    if (s.Has("sizes")) {
      for (KeyedSection& bin : s.Sections("sizes")) {
        g.sizes.push_back({bin.Number("diameter_m"), bin.Number("mass_fraction")});
        bin.Finish();
      }
    }
    if (g.filling == dx::Filling::kBed) {
      g.depth_m = s.Number("depth_m");
      g.solid_fraction = s.Number("solid_fraction");
      g.preparation = ReadPacking(s);
      if (s.Has("top_layer")) {
        KeyedSection top = s.Section("top_layer");
        g.top = {top.Number("thickness_m"), top.Number("solid_fraction"), ReadPacking(top)};
        top.Finish();
      }
      s.Finish();
      return g;
    }
    const bool placed = g.filling == dx::Filling::kPlaced;
    if (g.filling != dx::Filling::kRained && s.Has("bonds"))
      g.bonds = ReadBonds(s.Section("bonds"));
    if (placed) g.places_m = ReadPlaces(s);
    if (!placed && s.Has("region")) g.region = ReadRegion(s.Section("region"));
    const bool lattice = g.filling == dx::Filling::kLattice;
    if (g.filling != dx::Filling::kRained && s.Has("clump")) {
      for (KeyedSection& m : s.Sections("clump")) {
        g.clump.push_back({ToVec3(m.Vector("at")), m.Number("radius")});
        m.Finish();
      }
    }
    if (g.filling == dx::Filling::kScattered) {
      ReadScattered(s, &g);
      return g;
    }
    if (placed) {
      s.Finish();
      return g;
    }
    g.count = static_cast<std::int64_t>(lattice ? s.CountOr("count", 0, kMostCount)
                                                : s.Count("count", kMostCount));
    g.pitch_m = s.NumberOr("pitch_m", 0);
    if (g.filling == dx::Filling::kRained) g.speed_m_per_s = s.NumberOr("speed_m_per_s", 0);
    s.Finish();
    return g;
  }

  static void ReadScattered(KeyedSection& s, dx::Grains* g) {
    if (s.Has("count") == s.Has("areal_fraction")) {
      s.yaml().Fail("count",
                    s.Has("count") ? "it beside areal_fraction" : "neither it nor areal_fraction",
                    "one of them");
    }
    if (s.Has("count")) g->count = static_cast<std::int64_t>(s.Count("count", kMostCount));
    if (s.Has("areal_fraction")) {
      g->areal_fraction = s.yaml().Number("areal_fraction", kPositive);
    }
    s.Finish();
  }

  std::string ReadOther(KeyedSection& s, const char* key) {
    const std::filesystem::path given = s.Text(key);
    const std::string path = given.is_absolute() ? given : std::filesystem::path(folder_) / given;
    out_.others.push_back({path, ""});
    try {
      return records::ReadFileBytes(path);
    } catch (const std::exception& error) {
      s.yaml().Fail(key, error.what(), "a file that can be read");
    }
  }

  std::vector<dem::GrainState> ReadList(KeyedSection& s) {
    const std::string text = ReadOther(s, "file");
    std::vector<dem::GrainState> out;
    std::istringstream in(text);
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
      if (line.empty() || line == "\r" || line[0] == '#') continue;
      if (number == 1 && line.find_first_of("xX") != std::string::npos) continue;  // names
      double v[7] = {};
      const char* at = line.data();
      const char* end = at + line.size();
      const auto commas = std::count(line.begin(), line.end(), ',');
      const int columns = commas == 6 ? 7 : 4;
      bool good = commas == columns - 1;
      for (int k = 0; k < columns && good; ++k) {
        while (at < end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
        const auto [stop, error] = std::from_chars(at, end, v[k]);
        good = error == std::errc() && std::isfinite(v[k]) &&
               (k == columns - 1 || (stop < end && *stop == ','));
        at = stop + (k < columns - 1);
      }
      while (at < end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
      good = good && at == end;
      if (!good) {
        s.yaml().Fail("file", fmt::format("line {}: '{}'", number, line.substr(0, 60)),
                      "x,y,z,r or x,y,z,r,v_x,v_y,v_z");
      }
      dem::GrainState g = {};
      g.x_m = v[0];
      g.y_m = v[1];
      g.z_m = v[2];
      g.radius_m = v[3];
      g.v_x = v[4];
      g.v_y = v[5];
      g.v_z = v[6];
      out.push_back(g);
    }
    return out;
  }

  dx::PartSpec ReadPart(KeyedSection& s) {
    using S = dx::PartShape;
    dx::PartSpec p;
    p.shape = static_cast<S>(s.Choice("shape"));
    if (s.Has("at_m")) p.at_m = ToVec3(s.Vector("at_m"));
    if (s.Has("turn_deg")) p.turn = TurnOf(s.Vector("turn_deg"));
    const auto is = [&](std::initializer_list<S> shapes) {
      return std::find(shapes.begin(), shapes.end(), p.shape) != shapes.end();
    };
    if (is({S::kBox})) p.size_m = ToVec3(s.Vector("size_m"));
    if (is({S::kCylinder, S::kTube, S::kDisc, S::kCone, S::kSphere, S::kWheel, S::kSpheres})) {
      p.radius_m = Length(s, "radius_m");
    }
    if (is({S::kCylinder, S::kTube})) p.length_m = Length(s, "length_m");
    if (is({S::kTube})) p.wall_m = s.Number("wall_m");
    if (is({S::kAnnulus, S::kRing, S::kVanes})) {
      p.inner_radius_m = Length(s, "inner_radius_m");
      p.outer_radius_m = Length(s, "outer_radius_m");
      if (!(p.outer_radius_m > p.inner_radius_m)) {
        s.yaml().Fail("outer_radius_m", fmt::format("{}", p.outer_radius_m),
                      "more than inner_radius_m");
      }
    }
    if (is({S::kRing, S::kVanes, S::kCone})) p.height_m = Length(s, "height_m");
    if (is({S::kVanes})) {
      p.thickness_m = Length(s, "thickness_m");
      p.count = static_cast<int>(s.Count("count", 1000));
      if (p.count < 1) s.yaml().Fail("count", "0", "1 to 1000 bars");
    }
    if (is({S::kCone})) {
      p.shaft_radius_m = s.Has("shaft_radius_m") ? Length(s, "shaft_radius_m") : p.radius_m;
      p.shaft_length_m = s.Has("shaft_length_m") ? Length(s, "shaft_length_m") : 0;
    }
    if (is({S::kSpheres})) ReadSpheres(s, &p);
    if (is({S::kWheel})) {
      p.width_m = Length(s, "width_m");
      if (s.Has("treads")) {
        for (KeyedSection& t : s.Sections("treads")) p.treads.push_back(ReadTread(t));
      }
    }
    if (is({S::kMesh})) p.mesh = ReadMeshFile(s);
    s.Finish();
    return p;
  }

  /// Spheres on a circle: by number, or by the gap between neighbours along it.
  static void ReadSpheres(KeyedSection& s, dx::PartSpec* p) {
    p->ring_radius_m = Length(s, "ring_radius_m");
    if (s.Has("count") == s.Has("spacing")) {
      s.yaml().Fail("count", s.Has("count") ? "it beside spacing" : "neither it nor spacing",
                    "one of them");
    }
    double count = 0;
    if (s.Has("count")) count = static_cast<double>(s.Count("count", 10000));
    if (s.Has("spacing")) {
      const double gap = s.yaml().Number("spacing", kNonNegative);
      const double half = (1 + gap) * p->radius_m / p->ring_radius_m;  // of the chord
      count = half < 1 ? std::floor(M_PI / std::asin(half) * (1 + 1e-9)) : 1;
    }
    if (!(count >= 1 && count <= 10000)) {
      s.yaml().Fail(s.Has("count") ? "count" : "spacing", fmt::format("{} spheres", count),
                    "1 to 10000");
    }
    p->count = static_cast<int>(count);
  }

  static double Length(KeyedSection& s, const char* key) {
    return s.yaml().Number(key, {0.0, 1e4, true});
  }

  static dem::Tread ReadTread(KeyedSection& s) {
    dem::Tread t;
    t.count = static_cast<int>(s.Count("count", 1000));
    t.height_m = s.Number("height_m");
    t.root_thickness_m = s.Number("root_thickness_m");
    t.tip_thickness_m = s.NumberOr("tip_thickness_m", 0);
    t.width_m = s.NumberOr("width_m", 0);
    t.offset_m = s.NumberOr("offset_m", 0);
    t.lean_rad = s.NumberOr("lean_deg", 0);
    s.Finish();
    return t;
  }

  dem::TriangleSoup ReadMeshFile(KeyedSection& s) {
    const std::string bytes = ReadOther(s, "file");
    const double scale = s.Has("scale") ? s.yaml().Number("scale", {0.0, 1e6, true}) : 1.0;
    const int axle = s.ChoiceOr("axle", 1);
    const auto solid = static_cast<dem::SolidSide>(s.ChoiceOr("solid", 0));
    const bool repair = s.Switch("repair", true);
    const std::string name = Described(out_.others.back());
    dem::TriangleSoup soup;
    const auto at_key = [&](const char* key, const char* expected, auto&& f) {
      try {
        return f();
      } catch (const std::invalid_argument& error) {
        s.yaml().Fail(key, error.what(), expected);
      }
    };
    const dem::MeshReport report = at_key("file", "a mesh in STL or OBJ", [&] {
      soup = dem::ReadMesh(bytes, name);
      return dem::RepairMesh(&soup, name, solid);
    });
    std::string& note = out_.others.back().note;
    note = report.Words();
    if (!repair && report.Changed()) {
      s.yaml().Fail("repair", "off, but " + name + " needs it: " + note, "on, or a sound mesh");
    }
    if (axle == kFindAxle) {
      note += "; " + at_key("axle", "a mesh of rotational symmetry",
                            [&] { return dx::PutOnAxle(&soup, name); });
      for (auto& v : soup.vertices) v = dem::Scale(scale, v);
      return soup;
    }
    for (auto& v : soup.vertices) {  // cyclic, so that it stays right-handed
      const std::array<double, 3> old = v;
      for (int k = 0; k < 3; ++k) v[(k + 4 - axle) % 3] = scale * old[k];
    }
    return soup;
  }

  dx::BodySpec ReadBody(KeyedSection& s) {
    dx::BodySpec b;
    b.name = s.Text("name");
    b.material = s.Text("material");
    for (KeyedSection& p : s.Sections("parts")) b.parts.push_back(ReadPart(p));
    b.position_m = ToVec3(s.Vector("position_m"));
    if (s.Has("turn_deg")) b.turn = TurnOf(s.Vector("turn_deg"));
    if (s.Has("above_surface_m")) b.above_surface_m = s.Number("above_surface_m");
    b.mass_kg = s.NumberOr("mass_kg", 0);
    if (s.Has("centre_m")) b.centre_m = ToVec3(s.Vector("centre_m"));
    if (s.Has("inertia_kg_m2")) b.inertia_kg_m2 = ToVec3(s.Vector("inertia_kg_m2"));
    if (s.Has("centre_m") != s.Has("inertia_kg_m2")) {
      s.yaml().Fail(s.Has("centre_m") ? "inertia_kg_m2" : "centre_m", "none beside the other",
                    "both, or neither");
    }
    b.while_preparing = s.Switch("while_preparing", false);
    if (s.Has("motion")) {
      for (KeyedSection& m : s.Sections("motion")) b.motion.push_back(ReadStep(m));
    }
    s.Finish();
    return b;
  }

  static dx::Probe ReadProbe(KeyedSection& s) {
    using K = dx::Probe::Kind;
    dx::Probe p;
    p.kind = static_cast<K>(s.Choice("kind"));
    if (p.kind == K::kWrench || p.kind == K::kPose || p.kind == K::kVelocity ||
        p.kind == K::kTreads || p.kind == K::kTouching || p.kind == K::kRuts) {
      p.body = s.Text("body");
    }
    if (p.kind == K::kJoint) p.of = s.Text("joint");
    if (p.kind == K::kSpring) p.of = s.Text("spring");
    if (p.kind == K::kWrench || p.kind == K::kJoint) p.body_frame = s.ChoiceOr("frame", 0) == 1;
    if (s.Has("region")) p.region = ReadRegion(s.Section("region"));
    if (p.kind == K::kMixing) p.diameter_m = s.Number("diameter_m");
    if (dx::HasTable(p)) {
      p.name = s.Text("name");
      p.every_s = s.NumberOr("every_s", 0);
    }
    if (p.kind == K::kRings) p.rings = static_cast<int>(s.Count("rings", 1000000));
    if (p.kind == K::kRings || p.kind == K::kRuts) p.from_s = s.NumberOr("from_s", 0);
    if (p.kind == K::kBins || p.kind == K::kSurface || p.kind == K::kMixing || p.kind == K::kRuts) {
      const auto n = s.Counts("n", 1000000);
      for (int k = 0; k < 3; ++k) p.n[k] = static_cast<int>(n[static_cast<std::size_t>(k)]);
    }
    s.Finish();
    return p;
  }

  ExperimentFile& out_;
  std::string folder_;
};

}  // namespace

ExperimentFile ReadExperiment(YamlSection root, const std::string& folder,
                              const dem::WorkLimits& limits) {
  ExperimentFile out;
  out.resolved = root.Dump();
  Reader(&out, folder).Read(KeyedSection(root, ""));
  try {
    dx::PlanOf(out.experiment, limits);
  } catch (const dem::SpecError& error) {
    root.FailAtPath(error.field(), error.got(), error.expected());
  }
  return out;
}

ExperimentFile ReadExperiment(const std::string& text, const std::string& file,
                              const std::string& folder, const dem::WorkLimits& limits,
                              const std::vector<std::string>& sets) {
  YamlSection root = YamlSection::OfText(text, file);
  PutSets(sets, &root);
  ExperimentFile out = ReadExperiment(root, folder, limits);
  out.text = text;
  out.sets = sets;
  return out;
}

void PutSets(const std::vector<std::string>& sets, YamlSection* root) {
  for (const std::string& set : sets) {
    const std::size_t equals = set.find('=');
    if (equals == std::string::npos) {
      throw InputError(fmt::format("--set {}: no '=', expected KEY=VALUE", set));
    }
    root->Set(set.substr(0, equals), set.substr(equals + 1));
  }
}

std::string Described(const NamedFile& file) {
  const std::string name = std::filesystem::path(file.path).filename();
  return file.note.empty() ? name : name + ": " + file.note;
}

ExperimentFile LoadExperiment(const std::string& file, const dem::WorkLimits& limits,
                              const std::vector<std::string>& sets) {
  return ReadExperiment(ReadYamlText(file), file,
                        std::filesystem::path(file).parent_path().string(), limits, sets);
}

}  // namespace grouser::campaign
