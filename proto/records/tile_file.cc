#include "proto/records/hdf5_file.h"
#include "proto/records/run_file.h"

namespace grouser::records {
namespace {

using internal::H5Image;

constexpr char kTileFormat[] = "grouser-tile";
constexpr int kTileSchema = 1;

template <typename Map>
void WriteGroup(H5Image& file, const std::string& group, const Map& arrays) {
  file.CreateGroup(group);
  for (const auto& [name, values] : arrays) file.WriteArray(group + "/" + name, values);
}

template <typename Map>
void ReadGroup(const H5Image& file, const std::string& group, Map* arrays) {
  for (const std::string& name : file.List(group)) {
    file.ReadArray(group + "/" + name, &(*arrays)[name]);
  }
}

}  // namespace

void WriteTileFile(const std::string& path, const TileFile& tile) {
  H5Image file = H5Image::Create(path);
  file.WriteFormat(kTileFormat, kTileSchema);
  file.WriteText("meta_json", tile.meta_json);
  WriteGroup(file, "/doubles", tile.doubles);
  WriteGroup(file, "/floats", tile.floats);
  WriteGroup(file, "/ints", tile.ints);
  file.Save();
}

TileFile ReadTileFile(const std::string& path) {
  const H5Image file = H5Image::Open(path);
  file.CheckFormat(kTileFormat, kTileSchema);
  TileFile tile;
  tile.meta_json = file.ReadText("meta_json");
  ReadGroup(file, "/doubles", &tile.doubles);
  ReadGroup(file, "/floats", &tile.floats);
  ReadGroup(file, "/ints", &tile.ints);
  return tile;
}

}  // namespace grouser::records
