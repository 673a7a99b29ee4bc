#pragma once

#include <string>
#include <vector>

#include "dem_offline/engine/experiment/snapshot.h"

namespace grouser::campaign {

/// Snapshots as VTK XML files (ParaView): FOLDER/grains_000000.vtp with radius, velocity, force,
/// overlap, contacts and id of every grain (bonds as lines), FOLDER/bodies_000000.vtp with the
/// triangles of all bodies, FOLDER/contacts_000000.vtp with their contacts (force on the body,
/// normal out of it), FOLDER/bodies.csv with the names by number, and FOLDER/frames.pvd, which
/// gives their times. Every file is written aside and renamed. Throws std::system_error or
/// std::runtime_error naming the file.
class FrameFiles {
 public:
  explicit FrameFiles(std::string folder) : folder_(std::move(folder)) {}
  void Write(const dem::experiment::Snapshot& snapshot);

  const std::vector<double>& times_s() const { return times_; }
  void SetTimes(std::vector<double> times_s) { times_ = std::move(times_s); }

 private:
  std::string folder_;
  std::vector<double> times_;
};

/// One PolyData file: points, lines and polygons with named arrays, raw appended, little endian.
std::string GrainsVtp(const dem::experiment::Snapshot& snapshot);
std::string BodiesVtp(const dem::experiment::Snapshot& snapshot);
std::string ContactsVtp(const dem::experiment::Snapshot& snapshot);

}  // namespace grouser::campaign
