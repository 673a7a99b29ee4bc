#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "dem_offline/engine/bench/bed.h"
#include "dem_offline/engine/core/json.h"
#include "dem_offline/engine/gpu/check/check.h"

namespace grouser::dem::gpu::check {
namespace {

// Between back ends: docs/engine.md, "Determinism".
constexpr double kOneStep = 1e-5, kHundredSteps = 1e-3, kBedMeans = 0.01;

std::vector<World*> Pointers(const Worlds& worlds) {
  std::vector<World*> out;
  for (const auto& w : worlds) out.push_back(w.get());
  return out;
}

template <class T>
bool SameBits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

std::vector<GrainLoad> LoadsOf(const World& w) {
  return {w.loads().begin(), w.loads().begin() + w.count()};
}
std::vector<Grain> GrainsOf(const World& w) {
  return {w.grains().begin(), w.grains().begin() + w.count()};
}

struct Vector {
  double x, y, z;
};
/// Largest difference over the largest value.
template <class T, class F>
double Apart(const std::vector<T>& a, const std::vector<T>& b, F&& of) {
  double most = 0, apart = 0;
  const auto length = [](const Vector& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); };
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vector p = of(a[i]), q = of(b[i]);
    most = std::max(most, length(p));
    const double d = length({p.x - q.x, p.y - q.y, p.z - q.z});
    apart = std::isfinite(d) ? std::max(apart, d) : INFINITY;
  }
  return most > 0 ? apart / most : INFINITY;
}
Vector ForceOf(const GrainLoad& f) { return {f.fx, f.fy, f.fz}; }
Vector MomentOf(const GrainLoad& f) { return {f.tx, f.ty, f.tz}; }
Vector VelocityOf(const Grain& g) { return {g.vx, g.vy, g.vz}; }

const char* Bits(bool same) { return same ? "equal to the bit" : "not to the bit"; }

/// After so many steps: forces and velocities of device and CPU.
void Steps(Device& device, const std::string& name, Worlds worlds, std::int64_t steps, double limit,
           std::vector<Row>* out) {
  Ensemble all(Pointers(worlds), device);
  all.Run(steps);
  double apart = 0;
  bool same = true;
  for (int w = 0; w < all.size(); ++w) {
    World& cpu = *worlds[w];
    if (cpu.Run(steps) != all.fault(w)) apart = INFINITY;
    const auto loads = all.Loads(w);
    const auto grains = all.Grains(w);
    apart =
        std::max({apart, Apart(LoadsOf(cpu), loads, ForceOf), Apart(LoadsOf(cpu), loads, MomentOf),
                  Apart(GrainsOf(cpu), grains, VelocityOf)});
    same = same && SameBits(GrainsOf(cpu), grains) && SameBits(LoadsOf(cpu), loads);
  }
  out->push_back({name, apart, limit, Bits(same)});
}

void SingleContacts(Device& device, std::vector<Row>* out) {
  const ContactProperties f = {.restitution = 0.6, .friction = 0.4, .rolling_friction = 0.1};
  const ContactModel contacts = OneMaterial({1e7, 0.3}, f);
  Worlds worlds;
  for (const double at : {0.0, 0.7}) worlds.push_back(TwoGrains(at, contacts));
  Ensemble all(Pointers(worlds), device);
  all.Run(400);
  const auto head_on = all.Grains(0);
  const double e = std::abs(head_on[1].vx - head_on[0].vx) / 0.2;
  out->push_back({"restitution of a head-on contact, error", std::abs(e - 0.6), 5e-3, ""});
  for (int w = 0; w < 2; ++w) worlds[w]->Run(400);
  double apart = 0;
  bool same = true;
  for (int w = 0; w < 2; ++w) {
    apart = std::max(apart, Apart(GrainsOf(*worlds[w]), all.Grains(w), VelocityOf));
    same = same && SameBits(GrainsOf(*worlds[w]), all.Grains(w));
  }
  out->push_back({"single contacts, head on and glancing", apart, kOneStep, Bits(same)});
}

void SettledBed(Device& device, bool quick, std::vector<Row>* out) {
  bench::BedSource source;
  source.grains = quick ? 1000 : 20000;
  const bench::Bed bed = bench::MakeBed(source);
  const std::int64_t steps = quick ? 500 : 5000;
  World on_device(bench::BenchConfig(bed, 1), bench::BenchContents(bed));
  World on_cpu(bench::BenchConfig(bed, 1), bench::BenchContents(bed));
  Ensemble all({&on_device}, device);
  all.Run(steps);
  all.Pull(0);
  on_cpu.Run(steps);
  const auto a = bench::Measure(on_cpu, bench::StressVolume(bed));
  const auto b = bench::Measure(on_device, bench::StressVolume(bed));
  const auto row = [&](const char* name, double x, double y) {
    char note[80];
    std::snprintf(note, sizeof(note), "CPU %.6g, device %.6g", x, y);
    out->push_back({std::string("settled bed, ") + name, std::abs(y / x - 1), kBedMeans, note});
  };
  row("mean overlap", a.mean_overlap_over_radius, b.mean_overlap_over_radius);
  row("coordination", a.coordination, b.coordination);
  row("stress zz", a.stress_zz_pa, b.stress_zz_pa);
}

/// Mean and standard error of blocks.
struct Mean {
  double value = 0, error = 0;
};
Mean MeanOf(const std::vector<double>& x) {
  Mean m;
  for (const double v : x) m.value += v / static_cast<double>(x.size());
  double square = 0;
  for (const double v : x) square += (v - m.value) * (v - m.value);
  const auto n = static_cast<double>(x.size());
  m.error = std::sqrt(square / (n - 1) / n);
  return m;
}

/// Means of the soil's forces on a wheel that rolls through it.
void Wheel(Device& device, bool quick, std::vector<Row>* out) {
  constexpr int kBlocks = 12;
  const std::int64_t steps = quick ? 25 : 250;
  const int layers = quick ? 7 : 14;
  const auto on_device = UnderWheel(1, layers), on_cpu = UnderWheel(1, layers);
  Ensemble all({on_device.get()}, device);
  std::vector<double> a[3], b[3];
  for (int k = 0; k < 2 * kBlocks; ++k) {
    all.Run(steps);
    on_cpu->Run(steps);
    if (k < kBlocks) continue;  // it comes down
    const Wrench x = on_cpu->wrench(1), y = all.TrackOf(0, 1).wrench;
    const double cpu[3] = {x.fx, x.fz, x.ty}, card[3] = {y.fx, y.fz, y.ty};
    for (int c = 0; c < 3; ++c) {
      a[c].push_back(cpu[c]);
      b[c].push_back(card[c]);
    }
  }
  const char* names[] = {"F_x", "F_z", "moment"};
  for (int c = 0; c < 3; ++c) {
    const Mean x = MeanOf(a[c]), y = MeanOf(b[c]);
    const double error = std::hypot(x.error, y.error);
    char note[120];
    std::snprintf(note, sizeof(note), "CPU %.5g, device %.5g: in standard errors", x.value,
                  y.value);
    out->push_back({std::string("wheel, mean ") + names[c],
                    error > 0 ? std::abs(x.value - y.value) / error : INFINITY, 3, note});
  }
}

/// A world alone and among others, and the same once more.
void Batch(Device& device, bool quick, std::vector<Row>* out) {
  const int others = quick ? 5 : 63, layers = quick ? 6 : 20;
  const std::int64_t steps = quick ? 200 : 1000;
  const auto run = [&](int worlds) {
    Worlds all;
    for (int w = 0; w < worlds; ++w) all.push_back(UnderWheel(1 + w, layers));
    Ensemble ensemble(Pointers(all), device);
    ensemble.Run(steps);
    std::vector<std::vector<Grain>> grains;
    for (int w = 0; w < worlds; ++w) grains.push_back(ensemble.Grains(w));
    return grains;
  };
  const auto alone = run(1), among = run(1 + others), again = run(1 + others);
  out->push_back({"a world alone and among " + std::to_string(others) + " others differ",
                  SameBits(alone[0], among[0]) ? 0.0 : 1.0, 0, "to the bit"});
  bool same = true;
  for (std::size_t w = 0; w < among.size(); ++w) same = same && SameBits(among[w], again[w]);
  out->push_back({"two runs differ", same ? 0.0 : 1.0, 0, "to the bit"});
}

}  // namespace

std::vector<Row> RunChecks(Device& device, bool quick) {
  std::vector<Row> out;
  const int layers = quick ? 5 : 30, worlds = quick ? 1 : 4;
  SingleContacts(device, &out);
  for (const NamedContacts& c : AllContacts()) {
    const auto made = [&] {
      Worlds all;
      for (int w = 0; w < worlds; ++w) all.push_back(Jostling(1 + w, c.contacts, layers));
      return all;
    };
    Steps(device, "one step, " + c.name, made(), 1, kOneStep, &out);
    Steps(device, "100 steps, " + c.name, made(), 100, kHundredSteps, &out);
  }
  Worlds wheels;
  wheels.push_back(UnderWheel(3, layers));
  Steps(device, "100 steps, floor and wheel", std::move(wheels), 100, kHundredSteps, &out);
  Worlds rubble;
  rubble.push_back(UnderRubble(4, layers));
  Steps(device, "100 steps, floor and clumps", std::move(rubble), 100, kHundredSteps, &out);
  SettledBed(device, quick, &out);
  Wheel(device, quick, &out);
  Batch(device, quick, &out);
  return out;
}

std::string ToJson(const std::vector<Row>& rows, const std::string& device) {
  std::string checks;
  for (const Row& r : rows) {
    JsonObject row;
    row.Text("name", r.name).Number("value", r.value).Number("limit", r.limit);
    row.Flag("kept", r.Kept()).Text("note", r.note);
    checks += (checks.empty() ? "\n" : ",\n") + row.Done();
  }
  return JsonObject().Text("device", device).Raw("checks", "[" + checks + "]").Done() + "\n";
}

}  // namespace grouser::dem::gpu::check
