#pragma once

#include <string>
#include <vector>

#include "dem_offline/engine/gpu/ensemble_memory.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem::gpu {

/// Independent worlds that advance together on one device. A world's result
/// does not depend on its batch-mates: bitwise the same alone and among others.
/// Forces are summed in the order of the CPU's engine, by the same bodies.
class Ensemble {
 public:
  /// Takes the worlds' state; they must outlive the ensemble. Throws NotElsewhere
  /// naming the world and what it has that is not on the
  /// device: bonds, meshes, more than kMostBodies bodies, laws other than the first
  /// world's; std::runtime_error with sizes where it does not fit the device.
  Ensemble(const std::vector<World*>& worlds, Device& device, const ListSizes& sizes = {});

  /// Advances every world that has not failed. Lists that are too short are
  /// regrown and the steps since the last checkpoint done again.
  void Run(std::int64_t steps);
  /// Each world to its own step; those that are there wait. Worlds with
  /// WorldConfig::sort_steps are sorted on the way, as World does it.
  void RunTo(const std::vector<std::int64_t>& until);

  /// Brings the state of a world to its World, where anything may be done to it
  /// (its grains frozen, exchanged); Push takes it to the device again. Both end
  /// with a search, so that a pulled World and the device go on alike only if it
  /// is pushed.
  void Pull(int world);
  void Push(int world);

  /// Wheel tests: body `wheel_body` of every world is steered and watched. A
  /// world waits at once after a step whose events only the host can take.
  struct WheelSetup {
    WheelDrive drive;
    BedLimit limit;
    WheelState state;
    StressGrid grid;
    int stress_stride = 1;
  };
  void AddWheels(const std::vector<WheelSetup>& setups, int wheel_body);
  /// What the wheels have to tell since the last visit, of all in one transfer;
  /// stresses (sums of forces [N] by StressGrid's bins, as StressRecorder::AddSums
  /// takes them) are asked for apart, and begin anew.
  struct WheelNews {
    WheelState state;
    std::int32_t events = 0;
    std::vector<WheelSample> samples;
  };
  std::vector<WheelNews> Visit();
  struct WheelStress {
    long steps = 0;
    std::vector<double> sums;  ///< [bins x 3]
  };
  WheelStress TakeStress(int world);
  void SetLimit(int world, const BedLimit& limit);
  /// Whether a world books its energy; the World's own flag follows.
  void SetEnergy(int world, bool on);

  int size() const { return static_cast<int>(worlds_.size()); }
  std::int64_t steps(int world) const { return states_[world].steps; }
  StepFault fault(int world) const;
  std::int32_t rebuilds(int world) const { return states_[world].rebuilds; }
  int sorts() const { return sorts_; }
  int regrowths() const { return regrowths_; }  ///< of lists that were too short
  /// Grains and loads of a world as they are now, in the order of its memory.
  std::vector<Grain> Grains(int world) const;
  std::vector<GrainLoad> Loads(int world) const;
  /// A body as it is now, and what the last step did to it.
  RigidBody BodyOf(int world, int body) const;
  BodyTrack TrackOf(int world, int body) const;
  MemoryPlan Plan() const { return PlanOf(layout_, words_); }
  /// Bytes that one step reads and writes at least, each array counted once a
  /// pass: neighbours, whose lines lie in caches, are not counted again.
  double BytesPerStep() const;

 private:
  void CheckWorld(std::size_t number) const;
  WorldView ViewOfWorld(std::size_t number) const;
  void AddBodies();
  void SendShapes();
  void SendTables();
  void SendMembers();
  void SendClumpOf();
  void SendWorld(int world);
  void SendLists(int world, const DeviceState& h);
  void SendBodies(int world, const DeviceState& h);
  BodyRecord RecordOf(std::size_t body, const DeviceBodyState& h) const;
  void Begin();
  void Regrow(std::int32_t overflow);
  void Advance();
  void SortDue(const std::vector<std::int64_t>& until, const std::vector<bool>& open);
  std::int64_t NextStop(int world, std::int64_t until) const;
  void Relayout(const Layout& next);
  bool Overflowed(std::int32_t* bits);
  bool Fitted();
  EnsembleView View();
  std::size_t IndexOf(int world, int body) const;

  Device& device_;
  std::vector<World*> worlds_;
  Layout layout_;
  EnsembleMemory memory_;
  std::vector<WorldView> views_;
  std::vector<WorldState> states_;
  std::vector<std::int64_t> first_clump_;  ///< [worlds]
  std::vector<ClumpRecord> clumps_;        ///< as they were sent at first
  std::vector<EnergySums> sent_energy_;    ///< [worlds] when they were sent
  std::vector<ShapeView> shapes_;          ///< [bodies] in the device's memory
  std::vector<std::int64_t> sorted_at_;    ///< [worlds] step of the last sort
  int combination_ = -1, words_ = 0, regrowths_ = 0, sorts_ = 0;
};

}  // namespace grouser::dem::gpu
