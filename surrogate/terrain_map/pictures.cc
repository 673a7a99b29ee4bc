#include "surrogate/terrain_map/pictures.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <vector>

namespace grouser::terrain_map {
namespace {

constexpr std::size_t kMostPixels = 900;

// Format version 1.0 of NumPy's files: magic, length and text of a header, then the numbers.
void WriteNpy(const std::filesystem::path& path, const std::vector<float>& values,
              std::size_t bands, std::size_t rows, std::size_t columns) {
  std::filesystem::create_directories(path.parent_path());
  std::string header = fmt::format(
      "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, {}), }}", bands, rows, columns);
  header.append(64 - (10 + header.size() + 1) % 64, ' ');
  header += '\n';
  std::ofstream out(path, std::ios::binary);
  out << "\x93NUMPY" << '\x01' << '\x00' << static_cast<char>(header.size() & 0xff)
      << static_cast<char>(header.size() >> 8) << header;
  out.write(reinterpret_cast<const char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(float)));
  out.close();
  if (!out) throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace

void KeepThinned(const std::filesystem::path& folder, RasterOutput* raster) {
  std::size_t columns = 0, rows = 0;
  const std::vector<float> values = raster->Thinned(kMostPixels, &columns, &rows);
  WriteNpy(folder / "thinned" / (raster->name() + ".npy"), values, values.size() / (columns * rows),
           rows, columns);
}

void KeepThinnedElevation(const std::filesystem::path& folder, const TerrainInput& terrain) {
  const Grid& g = terrain.grid();
  const std::size_t longest = std::max(g.columns, g.rows);
  const std::size_t columns = ThinnedSize(g.columns, longest, kMostPixels);
  const std::size_t rows = ThinnedSize(g.rows, longest, kMostPixels);
  std::vector<float> values, row;
  for (std::size_t r = 0; r < rows; ++r) {
    const std::size_t from = (2 * r + 1) * g.rows / (2 * rows);
    terrain.ReadElevation({0, static_cast<std::ptrdiff_t>(from), g.columns, 1}, &row);
    for (std::size_t c = 0; c < columns; ++c) {
      values.push_back(row[(2 * c + 1) * g.columns / (2 * columns)]);
    }
  }
  WriteNpy(folder / "thinned" / "elevation.npy", values, 1, rows, columns);
}

void DrawPictures(const std::string& script, const std::filesystem::path& folder,
                  const HeldSignals& signals, ProgressReport* progress) {
  std::string python = "/usr/bin/python3", file = script, place = folder.string();
  char* arguments[] = {python.data(), file.data(), place.data(), nullptr};
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setsigmask(&attributes, &signals.before());
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  pid_t child = -1;
  const int error = posix_spawn(&child, python.c_str(), nullptr, &attributes, arguments, environ);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) throw std::runtime_error(python + ": " + std::strerror(error));
  int status = 0;
  try {
    pid_t ended = 0;
    while ((ended = waitpid(child, &status, WNOHANG)) == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      progress->Tick(0);
    }
    if (ended < 0) throw std::runtime_error(script + ": " + std::strerror(errno));
  } catch (...) {
    kill(child, SIGTERM);
    waitpid(child, &status, 0);
    throw;
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw std::runtime_error(script + ": failed");
  }
  std::filesystem::remove_all(folder / "thinned");
}

void RemovePictures(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::remove_all(folder / "thinned", error);
  std::vector<std::filesystem::path> drawn;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".png") drawn.push_back(entry.path());
  }
  for (const auto& picture : drawn) std::filesystem::remove(picture, error);
}

}  // namespace grouser::terrain_map
