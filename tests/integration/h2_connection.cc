#include "tests/integration/h2_connection.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace grouser::testing {
namespace {

enum FrameType { kData = 0, kHeaders = 1, kReset = 3, kSettings = 4, kPing = 6, kWindow = 8 };
constexpr int kEndStream = 0x1, kAck = 0x1, kEndHeaders = 0x4, kPadded = 0x8, kPriority = 0x20;
constexpr int kTableSize = 1, kMaxStreams = 3, kInitialWindow = 4, kMaxFrame = 5;
constexpr std::size_t kFrameHead = 9;
// The largest frame that the server may send: few heads to look at.
constexpr std::uint32_t kAskedFrame = 1 << 20;
// The connection's window is topped up after so many bytes.
constexpr std::uint32_t kTopUp = 1 << 20;

void AppendNumber(std::string* out, std::uint32_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) {
    out->push_back(static_cast<char>(value >> shift));
  }
}

std::uint32_t Number(const std::string& bytes, std::size_t at, int count) {
  std::uint32_t value = 0;
  for (int i = 0; i < count; ++i) {
    value = value << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(i)]);
  }
  return value;
}

/// A field without index and without Huffman code; both lengths are below 127.
void AppendField(std::string* out, const std::string& name, const std::string& value) {
  out->push_back(0);
  out->push_back(static_cast<char>(name.size()));
  out->append(name);
  out->push_back(static_cast<char>(value.size()));
  out->append(value);
}

/// The number that a field of text has in a header block of literals; `none` where it is not.
int FieldOf(const std::string& block, const std::string& name, int none) {
  const std::size_t at = block.find(name);
  if (at == std::string::npos || at + name.size() >= block.size()) return none;
  const auto length = static_cast<unsigned char>(block[at + name.size()]);
  return std::atoi(block.substr(at + name.size() + 1, length).c_str());
}

void AppendSetting(std::string* out, int id, std::uint32_t value) {
  AppendNumber(out, static_cast<std::uint32_t>(id), 2);
  AppendNumber(out, value, 4);
}

}  // namespace

H2Connection::H2Connection(const std::string& address, std::uint32_t stream_window)
    : gives_window_(stream_window > 0) {
  const std::size_t colon = address.rfind(':');
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  if (::inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr) != 1) {
    throw std::runtime_error("'" + address + "', expected an IPv4 address and a port");
  }
  fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd_ < 0 || ::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    const std::string why = std::strerror(errno);
    if (fd_ >= 0) ::close(fd_);
    throw std::runtime_error("cannot connect to " + address + ": " + why);
  }
  const int on = 1;
  ::setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  ::fcntl(fd_, F_SETFL, O_NONBLOCK);
  out_ = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  std::string settings;
  AppendSetting(&settings, kTableSize, 0);  // so that every field comes as a literal
  AppendSetting(&settings, kInitialWindow, stream_window);
  AppendSetting(&settings, kMaxFrame, kAskedFrame);
  Frame(kSettings, 0, 0, settings.data(), settings.size());
  if (gives_window_) {
    std::string more;
    AppendNumber(&more, kLargestWindow - 65535, 4);
    Frame(kWindow, 0, 0, more.data(), more.size());
  }
  Flush();
}

H2Connection::~H2Connection() { ::close(fd_); }

void H2Connection::Frame(int type, int flags, std::uint32_t stream, const char* data,
                         std::size_t size) {
  AppendNumber(&out_, static_cast<std::uint32_t>(size), 3);
  out_.push_back(static_cast<char>(type));
  out_.push_back(static_cast<char>(flags));
  AppendNumber(&out_, stream, 4);
  out_.append(data, size);
}

std::uint32_t H2Connection::Call(const std::string& path, const std::string& message,
                                 int timeout_ms, std::size_t send) {
  const std::uint32_t id = next_stream_;
  next_stream_ += 2;
  std::string block;
  AppendField(&block, ":method", "POST");
  AppendField(&block, ":scheme", "http");
  AppendField(&block, ":path", path);
  AppendField(&block, ":authority", "test");
  AppendField(&block, "content-type", "application/grpc");
  AppendField(&block, "te", "trailers");
  if (timeout_ms > 0) AppendField(&block, "grpc-timeout", std::to_string(timeout_ms) + "m");
  Frame(kHeaders, kEndHeaders, id, block.data(), block.size());
  Stream& stream = streams_[id];
  stream.answer.stream = id;
  stream.window = first_window_;
  stream.unsent.reserve(5 + std::min(send, message.size()));
  stream.unsent.push_back(0);  // not compressed
  AppendNumber(&stream.unsent, static_cast<std::uint32_t>(message.size()), 4);
  stream.unsent.append(message, 0, send);
  stream.ends = send >= message.size();
  SendData(id, stream);
  return id;
}

void H2Connection::SendData(std::uint32_t id, Stream& stream) {
  while (stream.at < stream.unsent.size()) {
    const auto room = std::min(window_, stream.window);
    if (room <= 0) return;
    const std::size_t size = std::min(
        {stream.unsent.size() - stream.at, static_cast<std::size_t>(room), largest_frame_});
    const bool last = stream.ends && stream.at + size == stream.unsent.size();
    Frame(kData, last ? kEndStream : 0, id, stream.unsent.data() + stream.at, size);
    stream.at += size;
    stream.window -= static_cast<std::int64_t>(size);
    window_ -= static_cast<std::int64_t>(size);
  }
  if (!stream.unsent.empty()) std::string().swap(stream.unsent);
  stream.at = 0;
}

void H2Connection::SendAllData() {
  for (auto& [id, stream] : streams_) SendData(id, stream);
}

void H2Connection::Flush() {
  while (open_ && wants_write()) {
    const auto n = ::send(fd_, out_.data() + sent_, out_.size() - sent_, MSG_NOSIGNAL);
    if (n < 0) {
      if (errno == EINTR) continue;
      if (errno != EAGAIN) Close();
      return;
    }
    sent_ += static_cast<std::size_t>(n);
  }
  out_.clear();
  sent_ = 0;
}

void H2Connection::SendRaw(const std::string& bytes) {
  out_ += bytes;
  Flush();
}

void H2Connection::Close() {
  open_ = false;
  out_.clear();
  sent_ = 0;
  for (auto& [id, stream] : streams_) ended_.push_back(stream.answer);
  streams_.clear();
}

void H2Connection::Read(const std::function<void(const H2Answer&)>& on_end) {
  // Small, since most of what comes is DATA, which is skipped from the second frame on.
  static constexpr std::size_t kChunk = 16 * 1024;
  char chunk[kChunk];
  while (open_) {
    if (skip_ > 0 && !SkipData()) break;
    const auto n = ::recv(fd_, chunk, kChunk, 0);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) Close();
    if (n <= 0) break;
    in_.append(chunk, static_cast<std::size_t>(n));
    TakeFrames();
  }
  if (gives_window_ && taken_ > kTopUp) {
    std::string more;
    AppendNumber(&more, taken_, 4);
    Frame(kWindow, 0, 0, more.data(), more.size());
    taken_ = 0;
  }
  Flush();
  const auto ended = std::exchange(ended_, {});
  for (const H2Answer& answer : ended) on_end(answer);
}

/// False: the rest of the frame has not come yet.
bool H2Connection::SkipData() {
  while (skip_ > 0) {
    // MSG_TRUNC: the kernel drops what it has instead of copying it.
    const auto n = ::recv(fd_, nullptr, skip_, MSG_TRUNC);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) Close();
    if (n <= 0) return false;
    skip_ -= static_cast<std::size_t>(n);
  }
  if (skip_ends_) End(skip_stream_);
  return true;
}

void H2Connection::TakeFrames() {
  std::size_t at = 0;
  while (open_ && in_.size() - at >= kFrameHead) {
    const std::size_t size = Number(in_, at, 3);
    const int type = static_cast<unsigned char>(in_[at + 3]);
    const int flags = static_cast<unsigned char>(in_[at + 4]);
    const std::uint32_t id = Number(in_, at + 5, 4) & kLargestWindow;
    const std::size_t here = std::min(in_.size() - at - kFrameHead, size);
    if (type == kData) {
      taken_ += static_cast<std::uint32_t>(size);
      if (const auto it = streams_.find(id); it != streams_.end()) it->second.answer.bytes += size;
      skip_ = size - here;
      skip_stream_ = id;
      skip_ends_ = (flags & kEndStream) != 0;
      if (skip_ == 0 && skip_ends_) End(id);
    } else if (here < size) {
      break;
    } else {
      OnFrame(type, flags, id, in_.substr(at + kFrameHead, size));
    }
    at += kFrameHead + here;
  }
  in_.erase(0, std::min(at, in_.size()));
}

void H2Connection::OnFrame(int type, int flags, std::uint32_t id, const std::string& payload) {
  if (type == kSettings && !(flags & kAck)) OnSettings(payload);
  if (type == kPing && !(flags & kAck)) Frame(kPing, kAck, 0, payload.data(), payload.size());
  if (type == kHeaders) OnHeaders(id, flags, payload);
  if (type == kReset) End(id);
  if (type != kWindow) return;
  const std::uint32_t more = Number(payload, 0, 4) & kLargestWindow;
  if (id == 0) {
    window_ += more;
    SendAllData();
  } else if (const auto it = streams_.find(id); it != streams_.end()) {
    it->second.window += more;
    SendData(id, it->second);
  }
}

void H2Connection::OnSettings(const std::string& payload) {
  for (std::size_t at = 0; at + 6 <= payload.size(); at += 6) {
    const int id = static_cast<int>(Number(payload, at, 2));
    const std::uint32_t value = Number(payload, at + 2, 4);
    if (id == kMaxStreams) most_streams_ = value;
    if (id == kMaxFrame) largest_frame_ = std::min<std::size_t>(value, 65536);
    if (id != kInitialWindow) continue;
    for (auto& [stream_id, stream] : streams_) {
      stream.window += static_cast<std::int64_t>(value) - first_window_;
    }
    first_window_ = value;
  }
  Frame(kSettings, kAck, 0, nullptr, 0);
  SendAllData();
}

void H2Connection::OnHeaders(std::uint32_t id, int flags, const std::string& payload) {
  const auto it = streams_.find(id);
  if (it == streams_.end()) return;
  const std::size_t skipped = (flags & kPadded ? 1 : 0) + (flags & kPriority ? 5 : 0);
  const std::string block = payload.substr(std::min(skipped, payload.size()));
  H2Answer& answer = it->second.answer;
  answer.status = FieldOf(block, "grpc-status", answer.status);
  answer.pushback_ms = FieldOf(block, "grpc-retry-pushback-ms", answer.pushback_ms);
  if (flags & kEndStream) End(id);
}

void H2Connection::End(std::uint32_t id) {
  const auto it = streams_.find(id);
  if (it == streams_.end()) return;
  ended_.push_back(it->second.answer);
  streams_.erase(it);
}

bool H2Connection::Wait(int timeout_ms, H2Answer* answer) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(timeout_ms);
  for (bool found = false; open_;) {
    Read([&](const H2Answer& a) {
      *answer = a;
      found = true;
    });
    if (found) return true;
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd wait{fd_, static_cast<short>(POLLIN | (wants_write() ? POLLOUT : 0)), 0};
    ::poll(&wait, 1, static_cast<int>(left.count()));
    Flush();
  }
  return false;
}

}  // namespace grouser::testing
