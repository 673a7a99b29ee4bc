// What an experiment means in numbers: materials, lattices, times, work.
#include "dem_offline/engine/experiment/plan.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "dem_offline/engine/experiment/bonded_grain.h"
#include "dem_offline/engine/experiment/scatter.h"
#include "dem_offline/engine/experiment/validate.h"
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/laws/time_step.h"
#include "dem_offline/engine/rig/preparation.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kPitch = 1.12;         // of loose lattices, over the largest diameter
constexpr double kLatticePitch = 1.02;  // of a lattice that stands
constexpr double kRestTime = 100;       // [sqrt(d/g)] waiting for rest, at most
constexpr double kRowBytes = 8 * 200;   // of a sample, written as text
constexpr double kBytesPerBond = 600;
constexpr double kBytesPerTriangle =
    400;  // of a mesh, its search tree, and the copies it is made of
constexpr double kBytesPerPart = 500;

/// Names of materials in the order of the world.
std::vector<std::string> Order(const Experiment& e) {
  std::vector<std::string> out;
  const auto add = [&](const std::string& name) {
    if (std::find(out.begin(), out.end(), name) == out.end()) out.push_back(name);
  };
  for (const Grains& g : e.grains) add(g.material);
  for (const Material& m : e.materials) add(m.name);
  return out;
}

/// How many of them are of grains: the first.
int GrainMaterials(const Experiment& e) {
  std::set<std::string> names;
  for (const Grains& g : e.grains) names.insert(g.material);
  return static_cast<int>(names.size());
}

/// Radius of the smallest sphere of a grain of diameter 1.
double SmallestOf(const Grains& g) {
  if (g.bonds.fragments > 0) return 0.5 * g.bonds.fragment_m / g.sizes[0].diameter_m;
  double r = g.clump.empty() ? 0.5 : kNever;
  for (const auto& m : g.clump) r = std::min(r, m.radius_m);
  return r;
}

}  // namespace

double LargestOf(const Grains& g) {
  double d = 0;
  for (const SizeBin& b : g.sizes) d = std::max(d, ReachOf(g) * b.diameter_m);
  for (const GrainState& s : g.listed) d = std::max(d, 2 * s.radius_m);
  return d;
}

double ReachOf(const Grains& g) {
  double reach = g.clump.empty() ? 0.5 : 0;
  for (const auto& m : g.clump) reach = std::max(reach, Norm(m.offset_m) + m.radius_m);
  return 2 * reach;
}

int MaterialNumber(const Experiment& e, const std::string& name, const std::string& field) {
  const auto order = Order(e);
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (order[k] == name && std::any_of(e.materials.begin(), e.materials.end(),
                                        [&](const Material& m) { return m.name == name; })) {
      return static_cast<int>(k);
    }
  }
  std::string known;
  for (const Material& m : e.materials) known += (known.empty() ? "" : ", ") + m.name;
  throw SpecError(field, "'" + name + "'", "one of the materials: " + known);
}

const Material& MaterialOf(const Experiment& e, const std::string& name) {
  return *std::find_if(e.materials.begin(), e.materials.end(),
                       [&](const Material& m) { return m.name == name; });
}

namespace {

/// Without frictions that laws have of their own: another one of the preparation takes their place.
template <class Choice>
Choice WithoutFriction(Choice choice) {
  std::erase_if(choice.settings,
                [](const NamedSetting& s) { return s.name.ends_with("friction"); });
  return choice;
}

/// The experiment's laws, but for those that the interface names. Throws as LawsByName.
LawChoice LawsOfPair(const ContactChoice& all, const PairProperties& f) {
  return LawsByName(f.normal.value_or(all.normal), f.tangential.value_or(all.tangential),
                    f.rolling.value_or(all.rolling), f.cohesion.value_or(all.cohesion));
}

}  // namespace

ContactModel ContactsOf(const Experiment& e, const BedPreparation& meanwhile,
                        std::optional<double> surface_energy_j_per_m2) {
  ContactModel model(LawsOf(e.laws));
  std::set<std::string> of_grains;
  for (const Grains& g : e.grains) of_grains.insert(g.material);
  for (const std::string& name : Order(e)) {
    const Material& m = MaterialOf(e, name);
    model.AddMaterial({m.youngs_modulus_pa > 0 ? m.youngs_modulus_pa : kRigid, m.poisson_ratio});
  }
  const auto names = Order(e);
  const auto numbers = [&](const std::string& name, const std::string& field) {
    std::vector<int> out;
    for (std::size_t k = 0; k < names.size() && name == kAny; ++k)
      out.push_back(static_cast<int>(k));
    if (out.empty()) out.push_back(MaterialNumber(e, name, field));
    return out;
  };
  const auto grains = [&](int k) { return of_grains.count(names[k]) > 0; };
  const auto rigid = [&](int k) { return model.material(k).youngs_modulus_pa == kRigid; };
  // Those of named pairs stand over those with any, whatever their order.
  for (int anys = 2; anys >= 0; --anys) {
    for (std::size_t i = 0; i < e.interfaces.size(); ++i) {
      const PairProperties& f = e.interfaces[i];
      if ((f.a == kAny) + (f.b == kAny) != anys) continue;
      const std::string entry = "interfaces[" + std::to_string(i) + "]", at = entry + ".between";
      ContactProperties p;
      p.restitution = f.restitution;
      PutInto(p, e.laws, f.numbers);
      const double own_energy = p.surface_energy_j_per_m2;
      for (const int a : numbers(f.a, at)) {
        for (const int b : numbers(f.b, at)) {
          if (rigid(a) && rigid(b)) continue;  // bodies do not meet
          const bool between = grains(a) && grains(b);
          const bool own = between && meanwhile.friction.has_value();
          p.friction = own ? *meanwhile.friction : f.friction;
          p.rolling_friction = between ? meanwhile.rolling_friction.value_or(f.rolling_friction)
                                       : f.rolling_friction;
          p.surface_energy_j_per_m2 =
              between ? surface_energy_j_per_m2.value_or(own_energy) : own_energy;
          try {
            model.SetContactProperties(
                a, b, p,
                own ? SettingsOf(WithoutFriction(e.laws), WithoutFriction(f.numbers))
                    : SettingsOf(e.laws, f.numbers),
                LawsOfPair(e.laws, f));
          } catch (const std::invalid_argument& error) {
            if (!f.normal && !f.tangential && !f.rolling && !f.cohesion) throw;
            throw SpecError(entry, names[a] + " and " + names[b] + ": " + error.what(),
                            "laws and settings that `grouser-dem laws` lists");
          }
        }
      }
    }
  }
  for (int a = 0; a < model.materials(); ++a) {
    for (int b = a; b < model.materials(); ++b) {
      if (model.has_contact_properties(a, b) || (rigid(a) && rigid(b))) continue;
      if (grains(a) || grains(b)) {
        throw SpecError("interfaces", "none of " + names[a] + " and " + names[b],
                        "one that is between them, or between one of them and any");
      }
      model.SetContactProperties(a, b, {}, {}, model.laws(0, 0));  // two bodies: never used
    }
  }
  return model;
}

namespace {

/// About its centre, of the volume of a sphere of diameter 1.
void Normalise(std::size_t group, std::vector<ClumpTemplate::Member>* members) {
  if (members->empty()) return;
  try {
    const ClumpTemplate clump = MakeClump(*members);
    const double scale = 1 / std::cbrt(6 / M_PI * clump.volume_m3);
    *members = clump.members;
    for (auto& m : *members) m = {Scale(scale, m.offset_m), scale * m.radius_m};
  } catch (const std::invalid_argument& error) {
    throw SpecError("grains[" + std::to_string(group) + "].clump", error.what(),
                    "spheres that make a clump");
  }
}

}  // namespace

Experiment Resolved(const Experiment& given) {
  Experiment e = given;
  for (std::size_t i = 0; i < e.grains.size(); ++i) Normalise(i, &e.grains[i].clump);
  const Region box = {{0, 0, 0}, {e.box.length_m, e.box.width_m, e.box.height_m}, 0};
  const auto fill = [&](Region& r) {
    if (r.high_m != r.low_m) return;
    r.low_m = box.low_m;
    r.high_m = box.high_m;
  };
  for (Grains& g : e.grains) {
    fill(g.region);
    if (g.areal_fraction > 0) g.count = CountByArea(g, e.box);
    if (!e.box.planar) continue;  // one row of places, in the middle
    const double half = 0.5 * SitesOf(g).pitch_m * (1 + 1e-6);
    g.region.low_m[1] = std::max(0.0, 0.5 * e.box.width_m - half);
    g.region.high_m[1] = std::min(e.box.width_m, 0.5 * e.box.width_m + half);
  }
  for (Probe& p : e.probes) {
    const bool whole = p.region.high_m == p.region.low_m;
    fill(p.region);
    if (whole && !e.box.follow.body.empty()) p.region.high_m[0] = e.box.follow.length_m;
  }
  const bool falls = std::any_of(e.grains.begin(), e.grains.end(), [](const Grains& g) {
    return g.filling == Filling::kPoured || g.filling == Filling::kRained;
  });
  if (e.preparation.empty() && falls) e.preparation = {Preparation{}};
  if (!e.probes.empty()) return e;
  const auto add = [&](Probe::Kind kind, const std::string& of) {
    Probe p;
    p.kind = kind;
    p.of = of;
    e.probes.push_back(p);
  };
  for (const Joint& j : e.joints) add(Probe::Kind::kJoint, j.name);
  for (const Spring& s : e.springs) add(Probe::Kind::kSpring, s.name);
  for (const BodySpec& b : e.bodies) {
    if (b.motion.empty() && !IsJointed(e, b.name)) continue;
    for (const auto kind : {Probe::Kind::kPose, Probe::Kind::kWrench, Probe::Kind::kVelocity}) {
      Probe p;
      p.kind = kind;
      p.body = b.name;
      e.probes.push_back(p);
    }
  }
  return e;
}

Sites SitesOf(const Grains& g) {
  const Region& r = g.region;
  const double usual = g.filling == Filling::kLattice ? kLatticePitch : kPitch;
  Sites s;
  s.pitch_m = g.pitch_m > 0 ? g.pitch_m : usual * LargestOf(g);
  const double x = r.high_m[0] - r.low_m[0], y = r.high_m[1] - r.low_m[1];
  const double slack = 1 + 1e-9;
  s.nx = std::floor(x / s.pitch_m * slack);
  s.ny = std::floor(y / s.pitch_m * slack);
  s.layers = std::floor((r.high_m[2] - r.low_m[2]) / s.pitch_m * slack);
  s.step_x_m = g.filling == Filling::kLattice ? s.pitch_m : x / s.nx;
  s.step_y_m = g.filling == Filling::kLattice ? s.pitch_m : y / s.ny;
  return s;
}

namespace {

Vec3d MiddleOf(const Region& r) { return Scale(0.5, Add(r.low_m, r.high_m)); }

template <class F>
void ForSites(const Sites& s, const Grains& g, F&& f) {
  const Region& r = g.region;
  const Vec3d middle = MiddleOf(r);
  const double room = r.radius_m - 0.5 * s.pitch_m;
  for (double ix = 0; ix < s.nx; ++ix) {
    for (double iy = 0; iy < s.ny; ++iy) {
      const double x = r.low_m[0] + (ix + 0.5) * s.step_x_m,
                   y = r.low_m[1] + (iy + 0.5) * s.step_y_m;
      if (r.radius_m > 0 && std::hypot(x - middle[0], y - middle[1]) > room) continue;
      f(x, y);
    }
  }
}

}  // namespace

std::vector<Vec3d> LayerOf(const Sites& s, const Grains& g, std::int64_t layer) {
  std::vector<Vec3d> out;
  const double z = g.region.low_m[2] + (static_cast<double>(layer) + 0.5) * s.pitch_m;
  ForSites(s, g, [&](double x, double y) { out.push_back({x, y, z}); });
  return out;
}

double CountInLayer(const Sites& s, const Grains& g) {
  if (!(g.region.radius_m > 0) || s.PerLayer() > 1e7) return s.PerLayer();
  double n = 0;
  ForSites(s, g, [&](double, double) { ++n; });
  return n;
}

double LargestDiameter(const Experiment& e) {
  double d = 0;
  for (const Grains& g : e.grains) d = std::max(d, LargestOf(g));
  return d;
}

double LargestSphere(const Experiment& e) {
  double d = 0;
  for (const Grains& g : e.grains) {
    d = std::max(d, g.bonds.fragments > 0 ? g.bonds.fragment_m : LargestOf(g));
  }
  return d;
}

double SmallestRadius(const Experiment& e) {
  double r = kNever;
  for (const Grains& g : e.grains) {
    for (const SizeBin& b : g.sizes) r = std::min(r, SmallestOf(g) * b.diameter_m);
    for (const GrainState& s : g.listed) r = std::min(r, s.radius_m);
  }
  return r;
}

double GravityTime(const Experiment& e) {
  const double g = e.gravity_m_per_s2 > 0 ? e.gravity_m_per_s2 : 9.81;
  return std::sqrt(LargestSphere(e) / g);
}

SettlingTimes SettlingOf(const Experiment& e, const Preparation& step) {
  // As the stages of a bed (rig/preparation.h): twice the free fall; with drag at its final speed.
  const double unit = GravityTime(e), g = e.gravity_m_per_s2, h = e.box.height_m;
  const double fall = std::sqrt(4 * h / g), drag = 5.0 / 3 * unit;
  const double slow = step.kind == Preparation::Kind::kSettle ? 2.5 * h / (g * drag) : 0;
  const double least = step.kind == Preparation::Kind::kSettle ? 10 * unit : 5.0 / 3 * unit;
  const double most = step.most_s > 0 ? step.most_s : 2.5 * (fall + slow) + 20 * unit;
  return {std::min(least, most), most};
}

double TurnTime(const Preparation& p) {
  return p.kind == Preparation::Kind::kTurn ? 2 * M_PI * p.turns / p.rate_rad_per_s : 0;
}

double RainInterval(const Experiment& e, const Grains& g) {
  const double speed =
      g.speed_m_per_s > 0 ? g.speed_m_per_s : std::sqrt(e.gravity_m_per_s2 * LargestOf(g));
  return SitesOf(g).pitch_m / speed;
}

double RainTime(const Experiment& e) {
  double time = 0;
  for (const Grains& g : e.grains) {
    if (g.filling != Filling::kRained) continue;
    const double per_layer = CountInLayer(SitesOf(g), g);
    time += std::ceil(static_cast<double>(g.count) / per_layer) * RainInterval(e, g);
  }
  return time;
}

double MostTime(const Experiment& e, const BodySpec& body, const MotionStep& s) {
  double most = s.for_s;
  const double speed = Norm(s.velocity_m_per_s), spin = Norm(s.spin_rad_per_s);
  if (speed > 0) most = std::min(most, s.distance_m / speed + s.ramp_s);
  if (spin > 0) most = std::min(most, s.angle_rad / spin + s.ramp_s);
  if (s.most_s > 0) most = std::min(most, s.most_s);
  if (std::isfinite(most)) return most;
  if (speed > 0 && (s.touch || std::isfinite(s.force_n))) {
    return e.box.height_m / speed + s.ramp_s;
  }
  if (s.rest > 0) return kRestTime * GravityTime(e);
  for (const BodySpec& other : e.bodies) {
    if (other.name != s.until_done || other.name == body.name) continue;
    double sum = 0;
    for (const MotionStep& o : other.motion) {
      sum += o.until_done.empty() ? MostTime(e, other, o) : o.most_s;
    }
    return sum;
  }
  return kNever;
}

namespace {

/// The interface that holds between two materials, as ContactsOf takes it: one that names both
/// stands over one with any, whatever their order. Null: there is none.
const PairProperties* InterfaceOf(const Experiment& e, const std::string& a, const std::string& b) {
  const auto is = [](const std::string& name, const std::string& of) {
    return name == kAny || name == of;
  };
  const PairProperties* found = nullptr;
  int fewest = 2;
  for (const PairProperties& f : e.interfaces) {
    const int anys = (f.a == kAny) + (f.b == kAny);
    if (anys > fewest || !((is(f.a, a) && is(f.b, b)) || (is(f.a, b) && is(f.b, a)))) continue;
    found = &f;
    fewest = anys;
  }
  return found;
}

}  // namespace

BedSpec BedOf(const Experiment& e, const Grains& g) {
  BedSpec bed;
  const Material& m = MaterialOf(e, g.material);
  bed.soil.density_kg_per_m3 = m.density_kg_per_m3;
  bed.soil.youngs_modulus_pa = m.youngs_modulus_pa;
  bed.soil.poisson_ratio = m.poisson_ratio;
  bed.soil.contact = e.laws;
  const PairProperties* own = InterfaceOf(e, g.material, g.material);
  const PairProperties* floor = InterfaceOf(e, g.material, e.box.material);
  if (own) {
    bed.soil.restitution = own->restitution;
    bed.soil.friction = own->friction;
    bed.soil.rolling_friction = own->rolling_friction;
    ContactChoice& laws = bed.soil.contact;
    laws.settings.insert(laws.settings.end(), own->numbers.settings.begin(),
                         own->numbers.settings.end());
    if (own->numbers.rolling_damping) laws.rolling_damping = *own->numbers.rolling_damping;
    if (own->numbers.surface_energy_j_per_m2) {
      laws.surface_energy_j_per_m2 = *own->numbers.surface_energy_j_per_m2;
    }
  }
  if (floor && floor != own) bed.soil.contact.floor = floor->numbers;
  bed.soil.solid_fraction = g.solid_fraction;
  bed.soil.preparation = g.preparation;
  bed.soil.top = g.top;
  bed.soil.gravity_m_per_s2 = e.gravity_m_per_s2;
  bed.soil.sizes = g.sizes;
  bed.length_m = e.box.length_m;
  bed.width_m = e.box.width_m;
  bed.depth_m = g.depth_m;
  bed.rayleigh_fraction = e.rayleigh_fraction;
  bed.seed = e.seed;
  return bed;
}

bool MovesFreely(const BodySpec& body) {
  return std::any_of(body.motion.begin(), body.motion.end(),
                     [](const MotionStep& s) { return s.free; });
}

namespace {

double StepOf(const Experiment& e, double* rayleigh) {
  const ContactModel contacts = ContactsOf(e);
  double step = kNever;
  *rayleigh = kNever;
  const auto look = [&](const Material& m, double r, double mass) {
    const double own = RayleighTime(r, m.density_kg_per_m3, m.youngs_modulus_pa, m.poisson_ratio);
    *rayleigh = std::min(*rayleigh, own);
    step = std::min({step, e.rayleigh_fraction * own,
                     PackedLimit(contacts, e.overlap, r, mass, GrainMaterials(e))});
  };
  for (const Grains& g : e.grains) {
    const Material& m = MaterialOf(e, g.material);
    const double thick = e.box.disc_thickness_m;
    const auto mass = [&](double r) {
      return m.density_kg_per_m3 * M_PI * r * r * (thick > 0 ? thick : 4.0 / 3 * r);
    };
    // A contact of a clump feels all of its mass, by at most its smallest sphere.
    for (const SizeBin& b : g.sizes) {
      const double smallest = SmallestOf(g) * b.diameter_m;
      look(m, smallest, mass(smallest));
      step = std::min(step, BondStep(g, m.density_kg_per_m3));
    }
    for (const GrainState& s : g.listed) look(m, s.radius_m, mass(s.radius_m));
  }
  return step;
}

double CountOf(const Experiment& e, const Grains& g) {
  switch (g.filling) {
    case Filling::kBed:
      return WorkOf(BedOf(e, g)).grains;
    case Filling::kListed:
      return static_cast<double>(g.listed.size());
    case Filling::kPlaced:
      return static_cast<double>(g.places_m.size());
    case Filling::kLattice:
      if (g.count == 0) {
        const Sites s = SitesOf(g);
        return CountInLayer(s, g) * s.layers;
      }
      [[fallthrough]];
    default:
      return static_cast<double>(g.count);
  }
}

/// Spheres in a group: members of its clumps, fragments.
double SpheresOf(const Experiment& e, const Grains& g) {
  return CountOf(e, g) *
         std::max({1.0, static_cast<double>(g.clump.size()), 1.0 * g.bonds.fragments});
}

double PreparationTime(const Experiment& e) {
  double time = RainTime(e);
  for (const Preparation& p : e.preparation) {
    time += TurnTime(p);
    if (p.kind == Preparation::Kind::kShake) time += p.for_s;
    if (p.kind == Preparation::Kind::kSettle || p.kind == Preparation::Kind::kRelax) {
      time += SettlingOf(e, p).most_s;
    }
  }
  const bool target = std::any_of(e.preparation.begin(), e.preparation.end(),
                                  [](const Preparation& p) { return p.solid_fraction > 0; });
  return target ? PackingSearch::kMostAttempts * time : time;
}

/// Memory of bodies: their meshes and parts. Throws SpecError for more than the limits allow.
double BytesOfBodies(const Experiment& e, const WorkLimits& limits) {
  double triangles = 0, parts = 0;
  for (const BodySpec& b : e.bodies) {
    for (const PartSpec& p : b.parts) {
      triangles += static_cast<double>(p.mesh.triangles.size());
      parts += std::max(1, p.count);
      for (const Tread& t : p.treads) parts += t.count;
    }
  }
  const double bytes = kBytesPerTriangle * triangles + kBytesPerPart * parts;
  const double gib = 1 << 30, most = MostBytes(limits);
  if (bytes <= most) return bytes;
  throw SpecError("bodies",
                  Short(triangles) + " triangles and " + Short(parts) + " parts in " +
                      Short(bytes / gib) + " GiB of memory",
                  "at most " + Short(most / gib) + " GiB of memory");
}

}  // namespace

double ProgramTime(const Experiment& e) {
  double longest = 0;
  for (const BodySpec& b : e.bodies) {
    double sum = 0;
    for (const MotionStep& s : b.motion) sum += MostTime(e, b, s);
    longest = std::max(longest, sum);
  }
  if (e.duration_s > 0) longest = longest > 0 ? std::min(longest, e.duration_s) : e.duration_s;
  return longest;
}

Plan PlanOf(const Experiment& given, const WorkLimits& limits) {
  const Experiment e = Resolved(given);
  Plan plan;
  plan.work.bytes = BytesOfBodies(e, limits);
  Validate(e, limits);
  plan.dt_s = StepOf(e, &plan.rayleigh_time_s);
  plan.program_dt_s = std::min(e.program_step * plan.dt_s, SpringStep(e));
  ValidateSpeeds(e, plan.dt_s);
  double bed_grain_steps = 0, bed_steps = 0;
  for (const Grains& g : e.grains) {
    plan.work.grains += SpheresOf(e, g);
    plan.work.bytes += kBytesPerBond * static_cast<double>(g.bonds.count) * CountOf(e, g);
    if (g.filling != Filling::kBed) continue;
    const Work bed = WorkOf(BedOf(e, g));
    bed_steps += bed.steps;
    bed_grain_steps += bed.steps * bed.grains;
  }
  plan.preparation_s = PreparationTime(e);
  plan.program_s = ProgramTime(e);
  const double preparation = plan.preparation_s / plan.dt_s,
               program = plan.program_s / plan.program_dt_s;
  plan.preparation_grain_steps = bed_grain_steps + preparation * plan.work.grains;
  const double share = e.box.follow.body.empty() ? 1 : e.box.follow.length_m / e.box.length_m;
  plan.program_grain_steps = program * share * plan.work.grains;
  plan.work.grains *= std::max(1.0, share);
  plan.work.steps = bed_steps + preparation + program;
  plan.work.bytes += kBytesPerGrain * plan.work.grains + kRowBytes * plan.program_s / e.sample_s;
  CheckWork("grains, bodies.motion", plan.work, limits);
  return plan;
}

}  // namespace grouser::dem::experiment
