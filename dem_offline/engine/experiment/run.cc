// An experiment from its beginning to its end.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "dem_offline/engine/core/byte_archive.h"
#include "dem_offline/engine/experiment/drive.h"
#include "dem_offline/engine/experiment/ground.h"
#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/probes.h"
#include "dem_offline/engine/experiment/snapshot.h"

namespace grouser::dem::experiment {
namespace {

constexpr std::int64_t kLookSteps = 200;  // between looks at open sides

using Clock = std::chrono::steady_clock;

/// Bounds of the steps of a program [s].
std::vector<double> MostTimes(const Experiment& e, const BodySpec& body) {
  std::vector<double> out;
  for (const MotionStep& s : body.motion) out.push_back(MostTime(e, body, s));
  return out;
}

class Run {
 public:
  Run(const Experiment& e, const Plan& plan, const SinkFn& sink, const ProgressFn& progress,
      const WorkLimits& limits, const RunExtras& extras)
      : e_(e),
        plan_(plan),
        progress_(progress),
        extras_(extras),
        frames_(e.frames),
        reader_(extras.resume),
        ground_(extras.resume.empty() ? Ground(e, plan.dt_s, Preparing(), limits)
                                      : Ground(e, plan.dt_s, reader_)) {
    out_.prepared_s = ground_.prepared_s();
    if (extras.resume.empty() && plan.program_dt_s != plan.dt_s)
      ground_.world().SetTimeStep(plan.program_dt_s);
    Surroundings around;
    around.dt_s = plan.program_dt_s;
    around.gravity_m_per_s2 = e.gravity_m_per_s2;
    around.unit_s = GravityTime(e);
    around.done = [this](const std::string& name) {
      return std::all_of(drives_.begin(), drives_.end(),
                         [&](const Drive& d) { return d.name() != name || d.done(); });
    };
    around.restlessness = [this] { return Restlessness(ground_.world()); };
    for (std::size_t b = 0; b < e.bodies.size(); ++b) {
      if (e.bodies[b].motion.empty()) continue;
      const BodySpec& body = e.bodies[b];
      const bool free = std::any_of(body.motion.begin(), body.motion.end(), HasFreedom);
      const FreeMass mass =
          free ? FreeMassOf(body, MaterialOf(e, body.material), body.name) : FreeMass{};
      drives_.emplace_back(body, ground_.BodyOf(b), ground_.Built(b), MostTimes(e, body), mass,
                           around);
    }
    mechanism_ = ground_.MakeMechanism();
    probes_ = std::make_unique<Probes>(e, ground_, mechanism_.get(), sink);
  }

  Result Go() {
    World& world = ground_.world();
    out_.grains = static_cast<std::uint64_t>(world.count());
    if (probes_->energy()) world.SetEnergy(true);
    if (extras_.resume.empty()) {
      probes_->Begin();
      TakeFrame(frames_.Due(0));
    } else {
      Walk(reader_);
    }
    while (OneStep()) {
    }
    probes_->End();
    TakeFrame(frames_.Wanted() && framed_s_ != Time());
    out_.steps = static_cast<std::uint64_t>(steps_);
    out_.run_s = Time();
    Report();
    return out_;
  }

 private:
  /// Preparation is the share of the whole that its grain-steps are.
  ProgressFn Preparing() {
    if (!progress_) return nullptr;
    const double all = plan_.preparation_grain_steps + plan_.program_grain_steps;
    share_ = all > 0 ? plan_.preparation_grain_steps / all : 0;
    return [this](double fraction, const std::string& stage) {
      return progress_(share_ * fraction, stage);
    };
  }

  bool End(const std::string& reason) {
    out_.reason = reason;
    out_.done = reason.empty();
    return false;
  }

  bool OneStep() {
    World& world = ground_.world();
    for (Drive& d : drives_) d.Before(world);
    if (mechanism_) mechanism_->Advance();
    for (std::size_t b = 0; b < e_.bodies.size(); ++b) {
      const int number = ground_.BodyOf(b);
      if (world.body(number).motion == BodyMotion::kFixed) continue;
      const std::string fault = FaultOf(world.body(number), world.wrench(number));
      if (!fault.empty()) return End("body '" + e_.bodies[b].name + "' " + fault);
    }
    const StepFault fault = world.Step();
    ++steps_;
    if (fault != StepFault::kNone) {
      return End(std::string(Explain(fault)) + " at " + Short(Time()) + " s");
    }
    out_.particle_steps += static_cast<double>(world.count());
    if (!ground_.Follow()) {
      return End("body '" + e_.box.follow.body + "' has come to soil that its window dropped");
    }
    bool all_done = !drives_.empty();
    for (Drive& d : drives_) {
      if (!d.After(world)) return End(d.reason());
      all_done = all_done && d.done();
    }
    for (std::size_t b = 0; b < e_.bodies.size(); ++b) {
      const double z = world.body(ground_.BodyOf(b)).position_m[2];
      if (!(std::abs(z) < kMostHeight * e_.box.height_m)) {
        return End("body '" + e_.bodies[b].name + "' has left the box, at z = " + Short(z) + " m");
      }
    }
    if (steps_ % kLookSteps == 0) out_.left += ground_.TakeOutLeavers();
    probes_->AfterStep(steps_);
    TakeFrame(frames_.Due(Time()));
    if (all_done && !(e_.duration_s > 0 && Time() < e_.duration_s)) return End("");
    if (e_.duration_s > 0 && Time() * (1 + 1e-12) >= e_.duration_s) return End("");
    if (e_.checkpoint_every_s > 0 && steps_ % CheckpointSteps() == 0) TakeCheckpoint();
    if (progress_ && steps_ % PollSteps(ground_.world().count()) == 0) {
      const double part = std::min(1.0, Time() / plan_.program_s);
      if (!progress_(share_ + (1 - share_) * part, "run")) {
        throw std::runtime_error("stopped by caller");
      }
    }
    return true;
  }

  /// Why a body cannot take its next step; empty: it can.
  std::string FaultOf(const Body& b, const Wrench& w) const {
    const double dt = plan_.program_dt_s;
    Vec3d way = Scale(dt, b.velocity_m_per_s);
    if (b.motion == BodyMotion::kFree) {
      const Vec3d push = {w.fx, w.fy, w.fz - b.mass_kg * e_.gravity_m_per_s2};
      way = Add(way, Scale(dt * dt / b.mass_kg, push));
    }
    const double z = b.position_m[2] + way[2], turn = dt * Norm(b.spin_rad_per_s);
    if (!ground_.Holds(z)) return "has left the box, at z = " + Short(z) + " m";
    const double most = std::min({e_.box.length_m, e_.box.width_m, e_.box.height_m});
    if (!(Norm(way) < most)) return "moves " + Short(Norm(way)) + " m in a time step";
    if (!(turn < 1)) return "turns by " + Short(turn) + " rad in a time step";
    return "";
  }

  void TakeFrame(bool wanted) {
    if (!wanted) return;
    framed_s_ = Time();
    if (extras_.frame) extras_.frame(SnapshotOf(e_, ground_, framed_s_));
  }

  std::int64_t CheckpointSteps() const {
    return std::max<std::int64_t>(1, std::llround(e_.checkpoint_every_s / plan_.program_dt_s));
  }

  /// The state of the run beside that of the grains and bodies.
  template <class Archive>
  void Walk(Archive& a) {
    for (Drive& d : drives_) d.Walk(a);
    probes_->Walk(a);
    a(steps_), a(framed_s_), a(rebuilds_);
    std::int64_t frames = frames_.taken();
    a(frames);
    frames_.SetTaken(frames);
    a(out_.grains), a(out_.left), a(out_.particle_steps), a(out_.prepared_s);
  }

  /// Goes on from its own checkpoint, as a run does that is resumed from it.
  void TakeCheckpoint() {
    if (probes_->energy()) probes_->Forget(ground_.world().Balance().frozen);
    rebuilds_ += ground_.world().rebuilds();
    ByteWriter out;
    ground_.Save(out);
    const std::size_t ground = out.bytes().size();
    Walk(out);
    if (extras_.checkpoint) extras_.checkpoint(out.bytes());
    ByteReader in(out.bytes().substr(0, ground));
    ground_.Load(in);
  }

  double Time() const { return static_cast<double>(steps_) * plan_.program_dt_s; }

  void Report() {
    const World& world = ground_.world();
    out_.dt_s = plan_.program_dt_s;
    out_.rayleigh_time_s = plan_.rayleigh_time_s;
    out_.list_rebuilds = rebuilds_ + world.rebuilds();
    out_.solid_fraction = ground_.solid_fraction();
    out_.surface_m = ground_.surface_m();
    out_.level_m = ground_.level_m();
    out_.top_solid_fraction = ground_.top_solid_fraction();
    out_.packed_with = ground_.packed_with();
    out_.coordination = world.MeanContacts();
    const auto quantum = world.config().frame.Quantum();
    out_.quantum_m = *std::max_element(quantum.begin(), quantum.end());
    std::vector<float> overlaps = world.OverlapRatios();
    std::sort(overlaps.begin(), overlaps.end());
    if (!overlaps.empty()) {
      out_.overlap_p99 = overlaps[static_cast<std::size_t>(0.99 * overlaps.size())];
      out_.overlap_max = overlaps.back();
    }
    if (!probes_->energy()) return;
    const EnergyBalance end = world.Balance(), begin = probes_->first_balance();
    out_.energy_residual_j = end.Total() - begin.Total();
    out_.energy_input_j = end.body_work - begin.body_work;
  }

  const Experiment& e_;
  const Plan& plan_;
  const ProgressFn& progress_;
  const RunExtras& extras_;
  double share_ = 0, framed_s_ = -1;
  SnapshotTimes frames_;
  ByteReader reader_;
  Ground ground_;
  std::vector<Drive> drives_;
  std::unique_ptr<Mechanism> mechanism_;
  std::unique_ptr<Probes> probes_;
  std::int64_t steps_ = 0;
  std::uint64_t rebuilds_ = 0;  ///< of worlds before the present one
  Result out_;
};

}  // namespace

Result RunExperiment(const Experiment& given, const SinkFn& sink, const ProgressFn& progress,
                     const WorkLimits& limits, const RunExtras& extras) {
  const Plan plan = PlanOf(given, limits);
  const Experiment e = Resolved(given);
  const auto begin = Clock::now();
  Result out = Run(e, plan, sink, progress, limits, extras).Go();
  out.wall_s = std::chrono::duration<double>(Clock::now() - begin).count();
  return out;
}

double MeasureRate(const Experiment& given) {
  constexpr int kSide = 12, kSteps = 60;
  const Experiment e = Resolved(given);
  const double r = SmallestRadius(e), pitch = 1.99 * r;
  WorldConfig c;
  c.frame = {kSide * pitch, kSide * pitch, 4 * kSide * pitch};
  c.gravity_m_per_s2 = {0, 0, 0};
  c.contacts = ContactsOf(e);
  const Material& m = MaterialOf(e, e.grains[0].material);
  c.dt_s = 0.1 * RayleighTime(r, m.density_kg_per_m3, m.youngs_modulus_pa, m.poisson_ratio);
  std::vector<GrainState> grains;
  for (int i = 0; i < kSide * kSide * kSide; ++i) {
    GrainState s = {};
    s.x_m = (i % kSide + 0.5) * pitch;
    s.y_m = (i / kSide % kSide + 0.5) * pitch;
    s.z_m = (i / kSide / kSide + 0.5 - 0.5 * kSide) * pitch;
    s.radius_m = r;
    s.density_kg_per_m3 = m.density_kg_per_m3;
    grains.push_back(s);
  }
  World world(c, grains);
  world.Run(5);
  const auto begin = Clock::now();
  world.Run(kSteps);
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return kSteps * static_cast<double>(grains.size()) / std::max(seconds, 1e-9);
}

}  // namespace grouser::dem::experiment
