// Grains come into the box and are prepared.
#include "dem_offline/engine/experiment/ground.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/scatter.h"
#include "dem_offline/engine/experiment/validate.h"
#include "dem_offline/engine/rig/bed_feed.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/packing.h"
#include "dem_offline/engine/rig/preparation.h"

namespace grouser::dem::experiment {
namespace {

constexpr std::int64_t kLookSteps = 200;
constexpr double kKick = 0.34;     // [sqrt(g d)] first velocity of poured grains, along an axis
constexpr double kDrag = 5.0 / 3;  // [sqrt(d/g)] of the viscous fall
constexpr double kMargin = 8;      // [largest diameters] around a box that is not periodic

/// Frame of a box: walls are half spaces, which see the shorter way round the period.
Frame FrameOf(const Experiment& e) {
  const double margin = kMargin * LargestDiameter(e);
  const auto period = [&](double side, Side kind) {
    return kind == Side::kPeriodic ? side : 2.2 * side + margin;
  };
  const double least = e.box.follow.body.empty() ? 0 : Follower::kLeastSpan;
  return {period(e.box.length_m, e.box.x), period(e.box.width_m, e.box.y),
          std::max(least, 4 * e.box.height_m)};
}

std::vector<std::int32_t> PlacesById(const World& world) {
  std::vector<std::int32_t> out(world.count());
  for (std::int64_t i = 0; i < world.count(); ++i) {
    out[world.grains()[i].id] = static_cast<std::int32_t>(i);
  }
  return out;
}

/// Area of a disc under a height.
double DiscBelow(double z, double radius, double height) {
  const double h = std::clamp((height - z) / radius, -1.0, 1.0);
  return radius * radius * (M_PI - std::acos(h) + h * std::sqrt(1 - h * h));
}

double SphereBelow(double z, double radius, double height) {
  const double h = std::clamp(height - z, -radius, radius);
  return M_PI * (radius * radius * (h + radius) - (h * h * h + radius * radius * radius) / 3);
}

}  // namespace

double Restlessness(const World& world) {
  double weight = 0, kinetic = 0;
  const double g = Norm(world.config().gravity_m_per_s2);
  const auto add = [&](double mass, double diameter, const Vec3d& v) {
    weight += mass * diameter;
    kinetic += 0.5 * mass * DotD(v, v);
  };
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const Grain& grain = world.grains()[i];
    if (grain.kind & kMember) continue;
    const GrainState s = world.State(i);
    add(grain.mass, 2 * s.radius_m, {s.v_x, s.v_y, s.v_z});
  }
  for (const ClumpEntry& c : world.state().clumps) {
    const double radius = world.state().templates[c.state.shape].members[0].radius_m;
    add(c.mass_kg, 2 * radius, c.state.velocity_m_per_s);
  }
  return kinetic / (g > 0 ? g * weight : 1.0);
}

Ground::Ground(const Experiment& e, double dt_s, const ProgressFn& progress,
               const WorkLimits& limits)
    : e_(e), dt_(dt_s), progress_(progress), random_(0) {
  Configure();
  expected_steps_ = std::max(1.0, (RainTime(e) + 1) / dt_s);
  for (const Preparation& p : e.preparation) {
    const bool shake = p.kind == Preparation::Kind::kShake;
    expected_steps_ += TurnTime(p) / dt_s;
    if (p.kind == Preparation::Kind::kTurn) continue;
    expected_steps_ += (shake ? p.for_s : 0.5 * SettlingOf(e, p).most_s) / dt_s;
  }
  const auto target = std::find_if(e.preparation.begin(), e.preparation.end(),
                                   [](const Preparation& p) { return p.solid_fraction > 0; });
  if (target == e.preparation.end()) {
    Fill(limits);
  } else {
    FillTo(target->solid_fraction, target - e.preparation.begin(), limits);
  }
  prepared_s_ = world_->time_s();
  if (!e.box.follow.body.empty()) OpenWindow();
  for (std::size_t b = 0; b < e.bodies.size(); ++b) {
    if (body_number_[b] < 0) AddBodyOf(b);
  }
}

Ground::Ground(const Experiment& e, double dt_s, ByteReader& saved) : e_(e), dt_(dt_s), random_(0) {
  Configure();
  Load(saved);
}

void Ground::Configure() {
  config_.frame = FrameOf(e_);
  config_.gravity_m_per_s2 = {0, 0, -e_.gravity_m_per_s2};
  config_.dt_s = dt_;
  config_.skin_m = 0.3 * LargestSphere(e_);
  config_.contacts = ContactsOf(e_);
  config_.planar = e_.box.planar;
  if (e_.box.disc_thickness_m > 0) config_.inertia_factor = 0.5;
  built_.resize(e_.bodies.size());
}

void Ground::OpenWindow() {
  while (e_.bodies[followed_].name != e_.box.follow.body) ++followed_;
  const double density = MaterialOf(e_, e_.grains[0].material).density_kg_per_m3;
  follower_ = std::make_unique<Follower>(e_, *world_, density, e_.bodies[followed_].position_m[0]);
  config_.contacts = ContactsOf(e_);
  world_ = follower_->Open(config_);
  walls_ = 0;
  AddWalls();
  follower_->Restore(*world_);
}

bool Ground::Follow() {
  if (!follower_) return true;
  const Body& body = world_->body(body_number_[followed_]);
  return follower_->Follow(*world_, body.position_m[0], body.shape.reach);
}

void Ground::Fill(const WorkLimits& limits) {
  random_ = RandomOfSeed(e_.seed);
  body_number_.assign(e_.bodies.size(), -1);
  walls_ = 0;
  surface_ = solid_fraction_ = 0;
  if (e_.grains[0].filling == Filling::kBed) {
    OpenOnTile(limits);
  } else {
    Open();
  }
  Rain();
  for (const Preparation& p : e_.preparation) Prepare(p);
  world_->SetDrag(1);
  world_->SetContacts(ContactsOf(e_));
  Look();
}

/// As the tile of a wheel test: the friction of the settling is what changes the packing.
void Ground::FillTo(double solid_fraction, std::size_t step, const WorkLimits& limits) {
  const double rolling = e_.preparation[step].rolling_friction;
  const GrainFriction own = FrictionOf(BedOf(e_, e_.grains[0]).soil);
  BedPreparation given;
  if (rolling >= 0) given.rolling_friction = rolling;
  PackingSearch search(given, own, Rolls(config_.contacts.laws(0, 0)), 0.5);
  double loosest = 1, densest = 0;
  expected_steps_ *= 0.5 * PackingSearch::kTries;
  for (bool more = true; more;) {
    tried_.friction = search.next().friction;
    if (search.next().rolling_friction != own.rolling_friction) {
      tried_.rolling_friction = search.next().rolling_friction;
    }
    Fill(limits);
    CheckMeasured(step);
    const double error = solid_fraction_ - solid_fraction;
    if (std::abs(error) <= kFractionTolerance) return;
    loosest = std::min(loosest, solid_fraction_);
    densest = std::max(densest, solid_fraction_);
    more = search.Tried(error);
  }
  throw SpecError("preparation[" + std::to_string(step) + "].solid_fraction", Short(solid_fraction),
                  "one that can be reached; tried: " + Short(loosest) + " to " + Short(densest));
}

void Ground::CheckMeasured(std::size_t step) const {
  if (!thin_) return;
  throw SpecError("preparation[" + std::to_string(step) + "].solid_fraction",
                  "it with grains " + Short(surface_) + " m deep",
                  "more than 5 diameters of the largest, or 3 where they are cut: it is measured "
                  "without the layers at floor and surface");
}

/// The tile of a wheel test, its floor at z = 0, with the history of its contacts.
void Ground::OpenOnTile(const WorkLimits& limits) {
  const Grains& g = e_.grains[0];
  const BedSpec bed = BedOf(e_, g);
  const Tile tile = [&] {
    try {
      return PrepareBed(bed, progress_, limits);
    } catch (const SpecError& error) {
      throw InGrains(error, "grains[0]");
    }
  }();
  level_ = g.depth_m + tile.surface_m;
  top_solid_fraction_ = tile.top_solid_fraction;
  for (int layer = 0; layer < 2; ++layer) {
    packed_with_[layer] = {tile.preparation_friction[layer],
                           tile.preparation_rolling_friction[layer]};
  }
  PlaceAsTile();
  const BedFeed feed(tile, bed.soil.density_kg_per_m3, config_.contacts.layout().words);
  BedPiece piece = feed.Between(0, tile.length_m);
  for (GrainState& s : piece.grains) s.z_m += g.depth_m;
  world_ = std::make_unique<World>(config_, piece.grains);
  AddWalls();
  const std::vector<std::int32_t> place = PlacesById(*world_);
  std::vector<std::int32_t> by_grain(piece.grains.size());
  for (std::size_t p = 0; p < piece.tile_places.size(); ++p) {
    by_grain[piece.tile_places[p].grain] = place[p];
  }
  for (const BedTouch& t : piece.touches) {
    world_->list().SetHistory(by_grain[t.a.grain], by_grain[t.b.grain], t.words);
  }
  for (const FloorTouch& t : piece.floor) world_->SetBodyHistory(place[t.in], 0, 0, t.words);
}

void Ground::PlaceAsTile() {
  const double depth = e_.grains[0].depth_m;
  config_.frame.z_span_m = std::max(config_.frame.z_span_m, TileZSpan(depth));
  config_.origin_m = {0, 0, depth};
}

void Ground::Open() {
  bonded_grain_of_id_.clear();
  OpenWith(First());
}

void Ground::OpenWith(const Contents& contents) {
  share_of_id_.clear();
  if (!contents.clumps.empty()) share_of_id_.assign(contents.grains.size(), 1);
  for (const ClumpState& c : contents.clumps) {
    const ClumpTemplate& shape = contents.templates[c.shape];
    double spheres = 0;
    for (const auto& m : shape.members) spheres += 4.0 / 3 * M_PI * std::pow(m.radius_m, 3);
    share_of_id_.insert(share_of_id_.end(), shape.members.size(), shape.volume_m3 / spheres);
  }
  world_ = std::make_unique<World>(config_, contents);
  AddWalls();
  for (std::size_t b = 0; b < e_.bodies.size(); ++b) {
    if (e_.bodies[b].while_preparing) AddBodyOf(b);
  }
}

void Ground::AddWalls() {
  const int material = MaterialNumber(e_, e_.box.material, "box.material");
  const auto add = [&](const Vec3d& normal, const Vec3d& at) {
    Body wall;
    wall.shape = HalfSpace(normal.data());
    wall.material = material;
    wall.position_m = at;
    world_->AddBody(wall);
    ++walls_;
  };
  add({0, 0, 1}, {0, 0, 0});
  if (e_.box.x == Side::kWall) {
    add({1, 0, 0}, {0, 0, 0});
    add({-1, 0, 0}, {e_.box.length_m, 0, 0});
  }
  if (e_.box.y == Side::kWall) {
    add({0, 1, 0}, {0, 0, 0});
    add({0, -1, 0}, {0, e_.box.width_m, 0});
  }
  if (IsTurned(e_)) AddLid();
}

void Ground::AddBodyOf(std::size_t b) {
  const BodySpec& spec = e_.bodies[b];
  const std::string field = "bodies[" + std::to_string(b) + "]";
  built_[b] =
      BuildBody(spec, MaterialOf(e_, spec.material), MaterialNumber(e_, spec.material, field),
                MovesFreely(spec) || IsJointed(e_, spec.name), field);
  Body& body = built_[b].body;
  if (IsJointed(e_, spec.name)) body.motion = BodyMotion::kPrescribed;
  if (!std::isnan(spec.above_surface_m)) {
    body.position_m[2] += surface_ + spec.above_surface_m - LowestPoint(body);
  }
  if (!Holds(body.position_m[2])) {
    throw SpecError(field + ".above_surface_m",
                    "'" + spec.name + "' at z = " + Short(body.position_m[2]) + " m",
                    "an origin below " + Short(kMostHeight) + " heights of the box");
  }
  body_number_[b] = world_->AddBody(body);
}

bool Ground::Holds(double z_m) const {
  const double half = 0.5 * config_.frame.z_span_m;
  return std::abs(z_m) < kMostHeight * e_.box.height_m &&
         std::abs(z_m - config_.origin_m[2]) < 0.5 * kMostHeight * half;
}

GrainState Ground::Make(const Grains& g, const Vec3d& at, double play, double diameter) {
  GrainState s = {};
  const auto jitter = [&] { return play > 0 ? play * random_.Between(-1, 1) : 0.0; };
  s.x_m = at[0] + jitter();
  s.y_m = e_.box.planar ? at[1] : at[1] + jitter();
  s.z_m = at[2] + jitter();
  s.radius_m = 0.5 * diameter;
  s.density_kg_per_m3 = MaterialOf(e_, g.material).density_kg_per_m3;
  s.material = MaterialNumber(e_, g.material, "grains.material");
  const double thick = e_.box.disc_thickness_m;
  if (thick > 0) s.mass_kg = s.density_kg_per_m3 * M_PI * s.radius_m * s.radius_m * thick;
  return s;
}

/// A clump in place of a grain, turned at random (Shoemake, Graphics Gems III, 1992).
void Ground::AddClump(const Grains& g, const GrainState& at, Contents* out) {
  std::vector<ClumpTemplate::Member> members = g.clump;
  for (auto& m : members) {
    m = {Scale(2 * at.radius_m, m.offset_m), 2 * at.radius_m * m.radius_m};
  }
  auto& shapes = out->templates;
  auto shape = std::find_if(shapes.begin(), shapes.end(), [&](const ClumpTemplate& t) {
    return t.members.size() == members.size() &&
           std::abs(t.members[0].radius_m / members[0].radius_m - 1) < 1e-9;
  });
  if (shape == shapes.end()) shape = shapes.insert(shapes.end(), MakeClump(members));
  ClumpState c;
  c.shape = static_cast<int>(shape - shapes.begin());
  c.density_kg_per_m3 = at.density_kg_per_m3;
  c.material = at.material;
  c.position_m = {at.x_m, at.y_m, at.z_m};
  c.velocity_m_per_s = {at.v_x, at.v_y, at.v_z};
  const double u = random_.Uniform(), a = 2 * M_PI * random_.Uniform(),
               b = 2 * M_PI * random_.Uniform();
  c.orientation = {std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a),
                   std::sqrt(u) * std::sin(b), std::sqrt(u) * std::cos(b)};
  out->clumps.push_back(c);
}

void Ground::Scattered(std::size_t group, Contents* out) {
  const Grains& g = e_.grains[group];
  std::vector<Body> standing;
  for (std::size_t b = 0; b < e_.bodies.size(); ++b) {
    const BodySpec& spec = e_.bodies[b];
    if (!spec.while_preparing) continue;
    const std::string field = "bodies[" + std::to_string(b) + "]";
    standing.push_back(BuildBody(spec, MaterialOf(e_, spec.material), 0, false, field).body);
  }
  std::vector<double> diameters, radii;
  for (std::int64_t k = 0; k < g.count; ++k) {
    diameters.push_back(DrawDiameter(g.sizes, random_));
    radii.push_back(0.5 * ReachOf(g) * diameters.back());
  }
  const auto poll = [&] {
    if (progress_ && !progress_(0, "scatter")) throw std::runtime_error("stopped by caller");
  };
  const std::string field = "grains[" + std::to_string(group) + "]." +
                            (g.areal_fraction > 0 ? "areal_fraction" : "count");
  const std::vector<Vec3d> places =
      Scatter(e_.box, g.region, radii, standing, field, &random_, poll);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const GrainState s = Make(g, places[k], 0, diameters[k]);
    if (g.clump.empty()) {
      out->grains.push_back(s);
    } else {
      AddClump(g, s, out);
    }
  }
}

/// All grains but those that rain; where all rain, the first layer, so that there is a world.
Contents Ground::First() {
  Contents out;
  for (const Grains& g : e_.grains) {
    if (g.filling == Filling::kListed) {
      for (const GrainState& given : g.listed) {
        GrainState s = Make(g, {given.x_m, given.y_m, given.z_m}, 0, 2 * given.radius_m);
        s.v_x = given.v_x;
        s.v_y = given.v_y;
        s.v_z = given.v_z;
        out.grains.push_back(s);
      }
      continue;
    }
    if (g.filling == Filling::kRained) continue;
    if (g.filling == Filling::kScattered) {
      Scattered(&g - e_.grains.data(), &out);
      continue;
    }
    if (g.filling == Filling::kPlaced) {
      for (const Vec3d& at : g.places_m) {
        AddGrain(g, Make(g, at, 0, DrawDiameter(g.sizes, random_)), &out);
      }
      continue;
    }
    const bool lattice = g.filling == Filling::kLattice;
    const Sites sites = SitesOf(g);
    const double kick = lattice ? 0 : kKick * std::sqrt(e_.gravity_m_per_s2 * LargestDiameter(e_));
    auto left = g.count > 0 ? g.count : static_cast<std::int64_t>(kMostGrains);
    for (std::int64_t layer = 0; left > 0; ++layer) {
      if (lattice && layer >= static_cast<std::int64_t>(sites.layers)) break;
      for (const Vec3d& at : LayerOf(sites, g, layer)) {
        if (left-- <= 0) break;
        const double d = DrawDiameter(g.sizes, random_);
        const bool loose = !lattice && g.clump.empty();
        GrainState s = Make(g, at, loose ? 0.5 * (sites.pitch_m - d) : 0, d);
        for (double* v : {&s.v_x, &s.v_y, &s.v_z}) *v = kick * random_.Between(-1, 1);
        if (e_.box.planar) s.v_y = 0;
        AddGrain(g, s, &out);
      }
    }
  }
  if (out.grains.empty() && out.clumps.empty()) {
    opened_with_ = &e_.grains[0];
    out.grains = RainLayer(e_.grains[0], 0);
  }
  return out;
}

std::vector<GrainState> Ground::RainLayer(const Grains& g, std::int64_t done) {
  const Sites sites = SitesOf(g);
  const double speed = sites.pitch_m / RainInterval(e_, g);
  std::vector<GrainState> out;
  for (const Vec3d& at : LayerOf(sites, g, static_cast<std::int64_t>(sites.layers) - 1)) {
    const auto k = static_cast<std::size_t>(done) + out.size();
    if (static_cast<std::int64_t>(k) >= g.count) break;
    // Every size once to begin with: a world keeps the range of its laws from its first grains.
    const double d = k < g.sizes.size() ? g.sizes[k].diameter_m : DrawDiameter(g.sizes, random_);
    GrainState s = Make(g, at, 0.5 * (sites.pitch_m - d), d);
    s.v_z = -speed;
    out.push_back(s);
  }
  return out;
}

/// Layer after layer under the top of the region, each when the last one has fallen its pitch.
void Ground::Rain() {
  for (const Grains& g : e_.grains) {
    if (g.filling != Filling::kRained) continue;
    std::int64_t done = &g == opened_with_ ? world_->count() : 0;
    if (done > 0) StepFor(RainInterval(e_, g), "rain");
    while (done < g.count) {
      GrainExchange exchange;
      exchange.in = RainLayer(g, done);
      done += static_cast<std::int64_t>(exchange.in.size());
      world_->Exchange(exchange);
      StepFor(RainInterval(e_, g), "rain");
    }
  }
}

void Ground::Step(const char* stage) {
  if (world_->Step() != StepFault::kNone) {
    throw std::runtime_error(std::string("preparation (") + stage + "): " +
                             Explain(world_->fault()) + " at " + Short(world_->time_s()) + " s");
  }
  if (++steps_ % kLookSteps == 0) TakeOutLeavers();
  if (!progress_ || steps_ % PollSteps(world_->count()) != 0) return;
  const double share = static_cast<double>(steps_) / expected_steps_;
  if (!progress_(std::min(1.0, share), stage)) throw std::runtime_error("stopped by caller");
}

void Ground::StepFor(double time_s, const char* stage) {
  const auto steps = static_cast<std::int64_t>(std::ceil(time_s / dt_));
  for (std::int64_t s = 0; s < steps; ++s) Step(stage);
}

void Ground::Prepare(const Preparation& p) {
  BedPreparation meanwhile = tried_;
  if (p.solid_fraction == 0) {
    meanwhile = {};
    if (p.friction >= 0) meanwhile.friction = p.friction;
    if (p.rolling_friction >= 0) meanwhile.rolling_friction = p.rolling_friction;
  }
  std::optional<double> energy;
  if (p.surface_energy_j_per_m2 >= 0) energy = p.surface_energy_j_per_m2;
  world_->SetContacts(ContactsOf(e_, meanwhile, energy));
  switch (p.kind) {
    case Preparation::Kind::kSettle:
    case Preparation::Kind::kRelax:
      return Settle(p);
    case Preparation::Kind::kShake:
      return Shake(p);
    case Preparation::Kind::kCut:
      return Cut(p.height_m);
    case Preparation::Kind::kTurn:
      return Turn(p);
  }
}

void Ground::Settle(const Preparation& p) {
  const bool drag = p.kind == Preparation::Kind::kSettle;
  world_->SetDrag(drag ? 1 - dt_ / (kDrag * GravityTime(e_)) : 1);
  const SettlingTimes times = SettlingOf(e_, p);
  const auto most = static_cast<std::int64_t>(times.most_s / dt_),
             least = static_cast<std::int64_t>(times.least_s / dt_);
  for (std::int64_t s = 0; s < most; ++s) {
    Step(drag ? "settle" : "relax");
    if (s >= least && s % kLookSteps == 0 && Restlessness(*world_) < p.rest) break;
  }
  world_->SetDrag(1);
}

/// Whole swings, so that the box ends where it began.
void Ground::Shake(const Preparation& p) {
  const double swings = std::max(1.0, std::round(p.for_s * p.frequency_hz));
  const auto steps = static_cast<std::int64_t>(std::ceil(swings / p.frequency_hz / dt_));
  std::vector<Vec3d> began_at;
  for (int b = 0; b < walls_; ++b) began_at.push_back(world_->body(b).position_m);
  const auto swing = [&](std::int64_t s) {
    return Scale(std::sin(2 * M_PI * swings * static_cast<double>(s) / static_cast<double>(steps)),
                 p.amplitude_m);
  };
  for (std::int64_t s = 0; s < steps; ++s) {
    const Vec3d v = Scale(1 / dt_, Sub(swing(s + 1), swing(s)));
    for (int b = 0; b < walls_; ++b) {
      world_->body(b).motion = BodyMotion::kPrescribed;
      world_->body(b).velocity_m_per_s = v;
    }
    Step("shake");
  }
  for (int b = 0; b < walls_; ++b) {
    Body& wall = world_->body(b);
    wall.motion = BodyMotion::kFixed;
    wall.velocity_m_per_s = {0, 0, 0};
    wall.position_m = began_at[b];
  }
}

void Ground::Cut(double height_m) {
  GrainExchange exchange;
  for (std::int64_t i = 0; i < world_->count(); ++i) {
    const GrainState s = world_->State(i);
    if (s.z_m + s.radius_m > height_m) exchange.out.push_back(world_->grains()[i].id);
  }
  if (exchange.out.empty()) {
    throw std::runtime_error("preparation (cut): no grain reaches " + Short(height_m) +
                             " m: pour more, or cut lower");
  }
  if (static_cast<std::int64_t>(exchange.out.size()) == world_->count()) {
    throw std::runtime_error("preparation (cut): no grain would be left below " + Short(height_m) +
                             " m");
  }
  world_->Exchange(exchange);
  surface_ = height_m;
}

GrainState Ground::At(std::int64_t i) const {
  GrainState s = world_->State(i);
  const auto unwrap = [](double x, double side, double period, Side kind) {
    return kind != Side::kPeriodic && x > 0.5 * (side + period) ? x - period : x;
  };
  s.x_m = follower_ ? follower_->window().Unwrapped(world_->grains()[i].x)
                    : unwrap(s.x_m, e_.box.length_m, config_.frame.length_m, e_.box.x);
  s.y_m = unwrap(s.y_m, e_.box.width_m, config_.frame.width_m, e_.box.y);
  return s;
}

std::uint64_t Ground::TakeOutLeavers() {
  const bool x = e_.box.x == Side::kOpen, y = e_.box.y == Side::kOpen;
  if (!x && !y) return 0;
  GrainExchange exchange;
  for (std::int64_t i = 0; i < world_->count(); ++i) {
    const GrainState s = At(i);
    const bool out = (x && (s.x_m < 0 || s.x_m > e_.box.length_m)) ||
                     (y && (s.y_m < 0 || s.y_m > e_.box.width_m));
    if (out) exchange.out.push_back(world_->grains()[i].id);
  }
  const auto n = exchange.out.size();
  if (n == 0 || static_cast<std::int64_t>(n) == world_->count()) return 0;
  world_->Exchange(exchange);
  return n;
}

/// Surface and solid fraction of what was prepared.
void Ground::Look() {
  const bool bed = e_.grains[0].filling == Filling::kBed, flat = bed || surface_ > 0;
  if (bed) {
    surface_ = e_.grains[0].depth_m;
  } else if (!flat) {
    for (std::int64_t i = 0; i < world_->count(); ++i) {
      const GrainState s = world_->State(i);
      surface_ = std::max(surface_, s.z_m + s.radius_m);
    }
  }
  // A layer of the largest grains is left out at floor and surface, and two under a rough surface.
  const double d = LargestDiameter(e_);
  if (!bed) level_ = surface_;
  double low = d, high = surface_ - (flat ? d : 3 * d);
  if (bed) high -= e_.grains[0].top.thickness_m;
  thin_ = high < low + d;
  if (thin_) {  // no layer would be left, or hardly one
    low = std::min(d, 0.25 * surface_);
    high = 0.6 * surface_;
  }
  double solid = 0;
  for (std::int64_t i = 0; i < world_->count(); ++i) {
    const GrainState s = world_->State(i);
    const auto below = e_.box.planar ? DiscBelow : SphereBelow;
    solid += SolidShare(i) * (below(s.z_m, s.radius_m, high) - below(s.z_m, s.radius_m, low));
  }
  const double floor = e_.box.length_m * (e_.box.planar ? 1 : e_.box.width_m);
  solid_fraction_ = solid / (floor * (high - low));
}

}  // namespace grouser::dem::experiment
