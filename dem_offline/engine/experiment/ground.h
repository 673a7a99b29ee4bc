#pragma once

#include <memory>

#include "dem_offline/engine/core/random.h"
#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/engine/experiment/follow.h"
#include "dem_offline/engine/experiment/shapes.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
class ByteReader;
class ByteWriter;
}  // namespace grouser::dem

namespace grouser::dem::experiment {

/// Kinetic energy of translation of the grains over the sum of m g d; without gravity: in joules.
/// (No law resists a sphere that spins on the spot about the normal of a contact.)
double Restlessness(const World& world);

/// Whether the box is turned, and so has a lid; throws SpecError for a turn that cannot be.
bool IsTurned(const Experiment& e);
void CheckTurn(const Experiment& e, const std::string& at, const Preparation& step);

/// The box with its grains, prepared: the world that bodies then come into.
class Ground {
 public:
  /// `e` is Resolved and valid. Throws std::runtime_error where the caller stops it or a step
  /// fails.
  Ground(const Experiment& e, double dt_s, const ProgressFn& progress, const WorkLimits& limits);

  /// As it was saved by the same experiment. Throws std::invalid_argument for other bytes.
  Ground(const Experiment& e, double dt_s, ByteReader& saved);
  void Save(ByteWriter& out) const;
  /// A new world in place of the present one, with nothing that was not saved: after it, the one
  /// that was saved and one that is opened later go on to the bit alike.
  void Load(ByteReader& in);

  World& world() { return *world_; }
  const World& world() const { return *world_; }
  int BodyOf(std::size_t body) const { return body_number_[body]; }  ///< in the world
  const BuiltBody& Built(std::size_t body) const { return built_[body]; }
  /// Of the bodies in joints and springs; null: there are none.
  std::unique_ptr<Mechanism> MakeMechanism() {
    return experiment::MakeMechanism(e_, world_.get(), built_, body_number_);
  }
  /// Whether the frame holds a body there, with a margin: at its ends what leaves comes back.
  bool Holds(double z_m) const;
  double surface_m() const { return surface_; }
  /// From which sinkage counts: of a bed the plane of equal mass (Tile::surface_m), else the
  /// surface.
  double level_m() const { return level_; }
  double solid_fraction() const { return solid_fraction_; }
  double top_solid_fraction() const { return top_solid_fraction_; }
  /// Of a bed that was settled here and of its top layer (Tile::preparation_friction).
  const std::array<GrainFriction, 2>& packed_with() const { return packed_with_; }
  /// The share of a sphere's volume that counts: spheres of a clump overlap.
  double SolidShare(std::int64_t i) const {
    return share_of_id_.empty() ? 1 : share_of_id_[world_->grains()[i].id];
  }
  /// Number of the bonded grain that a sphere was part of; -1: none.
  int BondedGrainOf(std::int32_t id) const {
    const auto k = static_cast<std::size_t>(id);
    return k < bonded_grain_of_id_.size() ? bonded_grain_of_id_[k] : -1;
  }
  /// State of a grain, x and y as the box counts them (a wall is left at 0, not at the period).
  GrainState At(std::int64_t i) const;
  /// After a step, where a window follows a body. False: the body came to soil that was dropped.
  bool Follow();
  /// Back of that window; else 0 [m].
  double from_m() const { return follower_ ? follower_->window().from_m() : 0; }
  double prepared_s() const { return prepared_s_; }  ///< simulated
  /// Takes out grains beyond open sides; how many.
  std::uint64_t TakeOutLeavers();

 private:
  void Configure();
  void OpenOnTile(const WorkLimits& limits);
  void PlaceAsTile();
  void Open();
  void OpenWith(const Contents& contents);
  void Fill(const WorkLimits& limits);
  void FillTo(double solid_fraction, std::size_t step, const WorkLimits& limits);
  /// Throws SpecError where the grains are too shallow to have a solid fraction.
  void CheckMeasured(std::size_t step) const;
  void OpenWindow();
  void AddWalls();
  void AddBodyOf(std::size_t body);
  Contents First();
  void Scattered(std::size_t group, Contents* out);
  void AddGrain(const Grains& g, const GrainState& at, Contents* out);
  void AddBonded(const Grains& g, const GrainState& at, Contents* out);
  void AddClump(const Grains& g, const GrainState& at, Contents* out);
  GrainState Make(const Grains& g, const Vec3d& at, double play, double diameter);
  std::vector<GrainState> RainLayer(const Grains& g, std::int64_t done);
  void Rain();
  void Prepare(const Preparation& step);
  void Settle(const Preparation& step);
  void Shake(const Preparation& step);
  void AddLid();
  void Turn(const Preparation& step);
  void Cut(double height_m);
  void StepFor(double time_s, const char* stage);
  void Step(const char* stage);
  void Look();

  const Experiment& e_;
  double dt_;
  ProgressFn progress_;
  Random random_;
  WorldConfig config_;
  std::unique_ptr<World> world_;
  int walls_ = 0;  ///< bodies [0, walls_) are floor and walls
  int lid_ = -1;
  std::vector<int> body_number_;
  std::vector<BuiltBody> built_;
  std::vector<double> share_of_id_;      ///< empty: no clumps
  std::vector<int> bonded_grain_of_id_;  ///< shorter than the ids: no bonded grains after it
  const Grains* opened_with_ = nullptr;  ///< rain whose first layer opened the world
  double surface_ = 0, level_ = 0, solid_fraction_ = 0, top_solid_fraction_ = 0,
         expected_steps_ = 1;
  std::array<GrainFriction, 2> packed_with_ = {};
  bool thin_ = false;  ///< hardly a layer lies between floor and surface
  std::unique_ptr<Follower> follower_;
  std::size_t followed_ = 0;  ///< body of the file
  double prepared_s_ = 0;
  BedPreparation tried_;  ///< of a settling to a solid fraction
  std::int64_t steps_ = 0;
};

}  // namespace grouser::dem::experiment
