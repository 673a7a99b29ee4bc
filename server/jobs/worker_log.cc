#include "server/jobs/worker_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <sstream>
#include <string_view>
#include <vector>

#include "proto/records/os/regular_file.h"

namespace grouser::server {
namespace {

constexpr char kWord[] = "progress ";
constexpr std::size_t kMaxLine = 4096;

std::string Printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
  return text;
}

}  // namespace

std::optional<ProgressLine> ParseProgress(const std::string& line) {
  if (!line.starts_with(kWord)) return std::nullopt;
  const char* begin = line.data() + sizeof(kWord) - 1;
  const char* end = line.data() + line.size();
  ProgressLine out;
  const auto [rest, bad] = std::from_chars(begin, end, out.fraction);
  if (bad != std::errc() || !(out.fraction >= 0 && out.fraction <= 1)) return std::nullopt;
  if (rest != end && *rest != ' ') return std::nullopt;
  constexpr std::string_view kEta = "eta=";
  std::string_view stage(rest, end);
  const auto skip_spaces = [&] {
    stage.remove_prefix(std::min(stage.find_first_not_of(' '), stage.size()));
  };
  skip_spaces();
  if (stage.starts_with(kEta)) {
    double eta = 0;
    const char* from = stage.data() + kEta.size();
    const auto [after, wrong] = std::from_chars(from, end, eta);
    if (wrong != std::errc() || !(eta >= 0) || (after != end && *after != ' ')) return std::nullopt;
    out.eta_s = eta;
    stage = std::string_view(after, end);
    skip_spaces();
  }
  out.stage = Printable(std::string(stage.substr(0, 200)));
  return out;
}

std::optional<ProgressLine> ProgressTail::Poll() {
  std::ifstream in(path_, std::ios::binary);
  if (!in || !in.seekg(offset_)) return std::nullopt;
  std::optional<ProgressLine> last;
  char chunk[8192];
  while (in.read(chunk, sizeof chunk) || in.gcount() > 0) {
    offset_ += in.gcount();
    partial_.append(chunk, static_cast<std::size_t>(in.gcount()));
    std::size_t begin = 0;
    for (std::size_t end; (end = partial_.find('\n', begin)) != std::string::npos;
         begin = end + 1) {
      if (auto parsed = ParseProgress(partial_.substr(begin, end - begin))) last = parsed;
    }
    partial_.erase(0, begin);
    if (partial_.size() > kMaxLine) partial_.clear();  // no progress line is that long
  }
  return last;
}

std::string LastWords(const std::string& log_path, std::size_t most) {
  constexpr off_t kLook = 16384;
  std::string tail(kLook, '\0');
  try {
    // Not by a stream: opening a FIFO that stands in the log's place would wait.
    const os::UniqueFd fd = os::OpenRegular(log_path, O_RDONLY);
    const off_t size = ::lseek(fd.get(), 0, SEEK_END);
    const ssize_t n = ::pread(fd.get(), tail.data(), tail.size(), std::max<off_t>(0, size - kLook));
    tail.resize(static_cast<std::size_t>(std::max<ssize_t>(0, n)));
  } catch (const std::exception&) {
    return "";
  }
  std::istringstream in(tail);
  std::string text;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line.starts_with(kWord)) continue;
    text += (text.empty() ? "" : " | ") + Printable(line);
  }
  return text.size() > most ? text.substr(text.size() - most) : text;
}

}  // namespace grouser::server
