#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/experiment/ground.h"

namespace grouser::dem::experiment {

/// What of an experiment is drawn, at one time. Grains by place in memory.
struct Snapshot {
  double time_s = 0;
  Vec3d box_m = {0, 0, 0};  ///< its sides
  bool planar = false;
  std::vector<GrainState> grains;
  std::vector<std::int32_t> ids;
  std::vector<Vec3f> force_n;                      ///< sum of the contacts of a grain
  std::vector<float> overlap;                      ///< deepest with another grain, over the radius
  std::vector<float> contacts;                     ///< of a grain
  std::vector<std::array<std::int32_t, 2>> bonds;  ///< intact, by place
  std::vector<std::string> bodies;                 ///< their names
  TriangleSoup triangles;                          ///< of all bodies, in the world [m]
  std::vector<std::int32_t> body_of;               ///< [triangles]
  std::vector<BodyContact> touches;                ///< point in the world, body by place in bodies
};
Snapshot SnapshotOf(const Experiment& e, const Ground& ground, double time_s);

/// The surface of a shape in body coordinates, round parts in `segments` flat faces; half spaces
/// have none.
TriangleSoup TrianglesOf(const Shape& shape, int segments = 48);

/// Times of the snapshots of an experiment: those asked for, and the end.
class SnapshotTimes {
 public:
  explicit SnapshotTimes(const FrameSpec& spec) : spec_(spec) {}
  bool Wanted() const { return spec_.every_s > 0 || !spec_.times_s.empty(); }
  /// Whether one is due; it then counts as taken.
  bool Due(double time_s);
  std::int64_t taken() const { return taken_; }
  void SetTaken(std::int64_t n) { taken_ = n; }

 private:
  FrameSpec spec_;
  std::int64_t taken_ = 0;
};

}  // namespace grouser::dem::experiment
