// Wheel tests of an ensemble.
#include "dem_offline/engine/gpu/ensemble.h"

namespace grouser::dem::gpu {

void Ensemble::AddWheels(const std::vector<WheelSetup>& setups, int wheel_body) {
  std::vector<WheelRecord> records;
  std::int64_t bins = 0;
  for (int w = 0; w < size(); ++w) {
    const WheelSetup& from = setups.at(w);
    WheelRecord r = {};
    r.drive = from.drive;
    r.limit = from.limit;
    r.state = from.state;
    r.grid = from.grid;
    r.body = static_cast<std::int32_t>(IndexOf(w, wheel_body));
    r.stress_stride = from.stress_stride;
    r.first_bin = 3 * bins;
    bins += from.grid.bins();
    records.push_back(r);
  }
  memory_.AllocateWheels(device_, records.size(), static_cast<std::size_t>(bins));
  memory_.wheels.now.Upload(records);
  memory_.stress.now.Upload(std::vector<double>(3 * bins, 0.0));
}

std::vector<Ensemble::WheelNews> Ensemble::Visit() {
  std::vector<WheelRecord> records = memory_.wheels.now.Download();
  std::vector<WheelNews> out;
  bool told = false;
  for (WheelRecord& r : records) {
    WheelNews news;
    news.state = r.state;
    news.events = r.events;
    news.samples.assign(r.sample, r.sample + r.samples);
    told |= r.events != 0 || r.samples != 0;
    r.events = r.samples = 0;
    out.push_back(news);
  }
  if (told) memory_.wheels.now.Upload(records);
  return out;
}

Ensemble::WheelStress Ensemble::TakeStress(int world) {
  std::vector<WheelRecord> r = memory_.wheels.now.Download(world, 1);
  WheelStress out;
  out.steps = r[0].stress_steps;
  out.sums = memory_.stress.now.Download(r[0].first_bin, 3 * r[0].grid.bins());
  r[0].stress_steps = 0;
  memory_.wheels.now.Upload(r, world);
  memory_.stress.now.Upload(std::vector<double>(out.sums.size(), 0.0), r[0].first_bin);
  return out;
}

void Ensemble::SetLimit(int world, const BedLimit& limit) {
  std::vector<WheelRecord> r = memory_.wheels.now.Download(world, 1);
  r[0].limit = limit;
  memory_.wheels.now.Upload(r, world);
}

void Ensemble::SetEnergy(int world, bool on) {
  worlds_[world]->SetEnergy(on);
  views_[world].energy = on;
  SendTables();
}

}  // namespace grouser::dem::gpu
