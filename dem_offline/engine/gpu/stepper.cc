#include "dem_offline/engine/gpu/stepper.h"

#include "dem_offline/engine/gpu/ensemble.h"

namespace grouser::dem::gpu {
namespace {

/// Belongs to one World.
class DeviceStepper : public Stepper {
 public:
  explicit DeviceStepper(std::shared_ptr<Device> device) : device_(std::move(device)) {}
  StepFault Run(World& world, std::int64_t steps) override {
    if (all_ && world_ == &world) {
      all_->Push(0);
    } else {
      all_ = std::make_unique<Ensemble>(std::vector<World*>{&world}, *device_);
      world_ = &world;
    }
    all_->Run(steps);
    all_->Pull(0);
    return all_->fault(0);
  }

 private:
  std::shared_ptr<Device> device_;
  const World* world_ = nullptr;
  std::unique_ptr<Ensemble> all_;  ///< of the World seen last
};

}  // namespace

std::shared_ptr<Stepper> StepperOn(std::shared_ptr<Device> device) {
  return std::make_shared<DeviceStepper>(std::move(device));
}

}  // namespace grouser::dem::gpu
