#pragma once

#include <string>

#include "dem_offline/engine/rig/wheel_test.h"
#include "grouser/v1alpha1/run.pb.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {

/// Messages and files <-> the engine's plain structs. Field for field; no
/// defaults are added (ValidateSpec in the engine refuses what is missing).
void ConvertContact(const v1alpha1::ContactLaws& laws, dem::ContactChoice* out);
dem::WheelTestSpec ToEngine(const v1alpha1::WheelTestSpec& spec);

/// What a finished run is stored under, besides its result.
struct RunContext {
  v1alpha1::WheelTestSpec spec;
  std::string run_id;
  std::string tile_sha256;
  std::string engine_version;
  std::string isa;
  google::protobuf::Timestamp created;
};
records::RunFile ToRunFile(const RunContext& context, const dem::Tile& tile,
                           const dem::WheelTestResult& result);

/// `tile_key` goes into the file and is checked on the way back: ToTile throws
/// std::runtime_error naming the missing or wrong part (`path` is for the
/// message).
records::TileFile ToTileFile(const dem::Tile& tile, const std::string& tile_key);
dem::Tile ToTile(const records::TileFile& file, const std::string& tile_key,
                 const std::string& path);

}  // namespace grouser::campaign
