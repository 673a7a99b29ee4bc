// A timing as JSON and as text.
#include <algorithm>
#include <cstdio>

#include "dem_offline/engine/bench/wheel.h"
#include "dem_offline/engine/bench/workload.h"
#include "dem_offline/engine/core/json.h"

namespace grouser::dem::bench {
namespace {

std::string PhasesJson(const BenchResult& r) {
  JsonObject out;
  for (const BenchPhase& p : r.phases) out.Number(p.name + "_s", p.seconds);
  return out.Done();
}

std::string PhysicsJson(const BenchResult& r) {
  return JsonObject()
      .Number("mean_overlap_over_radius", r.physics.mean_overlap_over_radius)
      .Number("coordination", r.physics.coordination)
      .Number("stress_zz_pa", r.physics.stress_zz_pa)
      .Number("stress_xz_pa", r.physics.stress_xz_pa)
      .Number("inertial_number", r.inertial_number)
      .Done();
}

/// What a peer needs to do the same.
std::string SetupJson(int sides) {
  const WheelBench b;
  return JsonObject()
      .Number("radius_m", b.wheel.radius_m)
      .Number("width_m", b.wheel.width_m)
      .Number("load_n", b.load_n)
      .Number("slip", b.slip)
      .Number("speed_m_per_s", b.speed_m_per_s)
      .Number("damper_n_s_per_m", b.damper_n_s_per_m)
      .Number("clearance_m", b.clearance_m)
      .Number("sample_s", b.sample_s)
      .Number("look_s", b.look_s)
      .Number("longest_s", b.longest_s)
      .Number("sides", sides)
      .Done();
}

}  // namespace

std::string ToJson(const WheelVerdict& w) {
  JsonObject out;
  out.Flag("stopped", w.stopped)
      .Text("drifting", w.drifting)
      .Number("from_s", w.from_s)
      .Number("time_s", w.time_s)
      .Number("travel_m", w.travel_m)
      .Number("contact_length_m", w.contact_length_m);
  for (const auto& [name, m] : {std::pair<std::string, BlockMean>{"f_x_n", w.f_x_n},
                                {"f_y_n", w.f_y_n},
                                {"f_z_n", w.f_z_n},
                                {"torque_n_m", w.torque_n_m},
                                {"sinkage_m", w.sinkage_m}}) {
    out.Number(name, m.mean).Number("se_" + name, m.standard_error);
  }
  return out.Done();
}

std::string ToJson(const BenchResult& r) {
  const BenchOptions& o = r.options;
  JsonObject out;
  out.Text("workload", o.workload)
      .Number("particles", static_cast<double>(r.particles))
      .Number("worlds", o.worlds)
      .Number("cores", o.cores)
      .Text("device", o.device)
      .Text("isa", r.isa)
      .Text("order", o.order)
      .Number("particle_steps_per_s", r.Rate())
      .Number("contacts_per_particle", r.contacts_per_particle)
      .Number("rebuilds", r.rebuilds)
      .Raw("phases", PhasesJson(r))
      .Number("bytes_per_particle_step", r.bytes_per_particle_step)
      .Number("share_of_copy_rate", r.ShareOfCopyRate())
      .Number("copy_bytes_per_s", r.copy_bytes_per_s)
      .Number("device_bytes", r.device_bytes)
      .Number("steps", static_cast<double>(o.steps))
      .Number("warmup", static_cast<double>(o.warmup))
      .Number("dt_s", r.dt_s)
      .Number("threads_per_world", r.threads_per_world)
      .Number("free_particles", static_cast<double>(r.free_particles))
      .Text("tangential", o.laws.tangential)
      .Text("rolling", o.laws.rolling)
      .Numbers("wall_s", r.wall_s)
      .Numbers("cpu_s", r.cpu_s)
      .Numbers("rates", r.rates)
      .Raw("physics", PhysicsJson(r));
  if (o.workload == "wheel") {
    out.Text("scene", o.scene).Raw("wheel", ToJson(r.wheel)).Raw("setup", SetupJson(o.wheel_sides));
  }
  return out.Done();
}

std::string ToText(const BenchResult& r) {
  const BenchOptions& o = r.options;
  const auto [least, most] = std::minmax_element(r.rates.begin(), r.rates.end());
  char line[400];
  std::snprintf(line, sizeof(line),
                "%s, %lld grains, %s, %d world(s) on %d core(s), %s: %.3g particle-steps/s "
                "(%.3g to %.3g in %zu)\n",
                o.workload.c_str(), static_cast<long long>(r.particles), o.order.c_str(), o.worlds,
                o.cores, r.isa.c_str(), r.Rate(), *least, *most, r.rates.size());
  std::string out = line;
  std::snprintf(
      line, sizeof(line),
      "  contacts %.3f, rebuilds %.0f in %lld steps, %.0f B per particle-step: %.0f %% of "
      "the copy rate %.3g B/s\n",
      r.contacts_per_particle, r.rebuilds, static_cast<long long>(o.steps),
      r.bytes_per_particle_step, 100 * r.ShareOfCopyRate(), r.copy_bytes_per_s);
  out += line;
  for (const BenchPhase& p : r.phases) {
    std::snprintf(line, sizeof(line), "  %-8s %8.4f s\n", p.name.c_str(), p.seconds);
    out += line;
  }
  std::snprintf(line, sizeof(line),
                "  overlap/R %.5f, coordination %.4f, stress zz %.2f Pa, xz %.2f Pa",
                r.physics.mean_overlap_over_radius, r.physics.coordination, r.physics.stress_zz_pa,
                r.physics.stress_xz_pa);
  out += line;
  if (o.workload == "wheel") {
    std::snprintf(line, sizeof(line),
                  "\n  %s scene, %s after %.2f s: F_x %.3f +- %.3f N, F_y %.3f +- %.3f N, torque "
                  "%.4f +- %.4f N m, sinkage %.2f mm",
                  o.scene.c_str(), r.wheel.stopped ? "stopped" : "not precise", r.wheel.time_s,
                  r.wheel.f_x_n.mean, r.wheel.f_x_n.standard_error, r.wheel.f_y_n.mean,
                  r.wheel.f_y_n.standard_error, r.wheel.torque_n_m.mean,
                  r.wheel.torque_n_m.standard_error, 1e3 * r.wheel.sinkage_m.mean);
    out += line;
  }
  if (o.workload == "shear") {
    std::snprintf(line, sizeof(line), ", inertial number %.4f", r.inertial_number);
    out += line;
  }
  return out + "\n";
}

}  // namespace grouser::dem::bench
