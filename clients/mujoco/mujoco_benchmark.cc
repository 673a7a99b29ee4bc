// Nanoseconds a wheel of SoilContact::Apply, world by world and all worlds in one batch:
// mujoco_benchmark [WORLDS]. Each world is a rover at another speed, driven for a while.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "grouser/mujoco.h"

namespace {

using grouser::mujoco::SoilContact;

double Now() {
  return std::chrono::duration<double, std::nano>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void ClearPassive(const mjModel* m, std::vector<mjData*>& worlds) {
  for (mjData* d : worlds) mju_zero(d->qfrc_passive, m->nv);
}

}  // namespace

int main(int argc, char** argv) try {
  const int count = argc > 1 ? std::atoi(argv[1]) : 1000;
  if (count < 1) throw std::runtime_error("WORLDS: expected 1 or more");
  char error[500];
  mjModel* m = mj_loadXML(ROVER, nullptr, error, sizeof error);
  if (m == nullptr) throw std::runtime_error(error);
  const grouser::Model sand = grouser::Model::Open(SAND);
  SoilContact soil(m, {{"wheel_*", &sand}}, "ground");
  std::vector<mjData*> worlds;
  for (int i = 0; i < count; ++i) {
    worlds.push_back(mj_makeData(m));
    for (int w = 0; w < 4; ++w)
      worlds[i]->ctrl[w] = 0.5 + 1.5 * ((i + 250 * (w % 2)) % count) / count;
  }
  double physics = 0, soil_time = 0;
  for (int step = 0; step < 200; ++step) {
    double from = Now();
    for (mjData* d : worlds) mj_step1(m, d);
    double to = Now();
    physics += to - from;
    soil.Apply(m, worlds);
    from = Now();
    soil_time += from - to;
    for (mjData* d : worlds) mj_step2(m, d);
    physics += Now() - from;
  }
  const double wheels = 4.0 * count;
  std::printf("%d worlds, 200 steps: MuJoCo %.0f ns, soil in one batch %.0f ns, a wheel and step\n",
              count, physics / 200 / wheels, soil_time / 200 / wheels);
  // The same states again and again: at the same time nothing is stepped.
  double batch = 1e300, singly = 1e300;
  std::vector<double> by_batch;
  for (int repetition = 0; repetition < 15; ++repetition) {
    ClearPassive(m, worlds);
    double from = Now();
    soil.Apply(m, worlds);
    batch = std::min(batch, Now() - from);
    by_batch.clear();
    for (mjData* d : worlds)
      by_batch.insert(by_batch.end(), d->qfrc_passive, d->qfrc_passive + m->nv);
    ClearPassive(m, worlds);
    from = Now();
    for (mjData* d : worlds) soil.Apply(m, d);
    singly = std::min(singly, Now() - from);
  }
  bool same = true;
  for (int i = 0; i < count; ++i) {
    same &= std::memcmp(worlds[i]->qfrc_passive, &by_batch[i * m->nv], m->nv * sizeof(double)) == 0;
  }
  std::printf(
      "least of 15: one batch %.0f ns a wheel, world by world %.0f ns (%.2f times), %s forces\n",
      batch / wheels, singly / wheels, singly / batch, same ? "the same" : "OTHER");
  for (mjData* d : worlds) mj_deleteData(d);
  mj_deleteModel(m);
  return same ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "mujoco_benchmark: %s\n", error.what());
  return 1;
}
