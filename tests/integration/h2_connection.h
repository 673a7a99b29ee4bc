#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

namespace grouser::testing {

/// How a call ended.
struct H2Answer {
  std::uint32_t stream = 0;
  int status = -1;        ///< grpc-status; -1: the stream was reset, or the connection closed
  int pushback_ms = -1;   ///< grpc-retry-pushback-ms; -1: none
  std::size_t bytes = 0;  ///< of DATA that came
};

/// A client of HTTP/2 frames made by hand, plain text, over a non-blocking socket: it takes a
/// tenth of a gRPC client's time for a call, and it can do what no gRPC client does (give no
/// window, stop amid a message). Calls are unary, or begin as if they were. One thread.
class H2Connection {
 public:
  static constexpr std::uint32_t kLargestWindow = 0x7fffffff;

  /// Connects to HOST:PORT (an IPv4 address) and says hello. `stream_window`: bytes that the server
  /// may send on a stream, which is never more; 0: nothing. Throws std::runtime_error.
  explicit H2Connection(const std::string& address, std::uint32_t stream_window = kLargestWindow);
  ~H2Connection();
  H2Connection(const H2Connection&) = delete;
  H2Connection& operator=(const H2Connection&) = delete;

  int fd() const { return fd_; }
  bool open() const { return open_; }
  /// Something waits for the socket to take it.
  bool wants_write() const { return sent_ < out_.size(); }
  std::uint32_t most_streams() const { return most_streams_; }
  std::size_t streams() const { return streams_.size(); }

  /// Calls `path` with one serialized message. `timeout_ms` 0: no deadline. `send`: bytes of the
  /// message that are sent, then silence; all by default. Returns the stream.
  std::uint32_t Call(const std::string& path, const std::string& message, int timeout_ms = 0,
                     std::size_t send = SIZE_MAX);
  /// Sends what the windows and the socket allow.
  void Flush();
  /// Takes what has come; `on_end` for every call that ended.
  void Read(const std::function<void(const H2Answer&)>& on_end);
  /// Waits until a call has ended, at most so long. False: none did.
  bool Wait(int timeout_ms, H2Answer* answer);
  /// Bytes that are no frame of anything, as they are.
  void SendRaw(const std::string& bytes);

 private:
  struct Stream {
    std::string unsent;  // of the message, behind the window
    std::size_t at = 0;
    bool ends = true;  // the message was whole
    std::int64_t window = 0;
    H2Answer answer;
  };

  void Frame(int type, int flags, std::uint32_t stream, const char* data, std::size_t size);
  void SendData(std::uint32_t id, Stream& stream);
  void SendAllData();
  bool SkipData();
  void TakeFrames();
  void OnFrame(int type, int flags, std::uint32_t id, const std::string& payload);
  void OnSettings(const std::string& payload);
  void OnHeaders(std::uint32_t id, int flags, const std::string& payload);
  void End(std::uint32_t id);
  void Close();

  int fd_ = -1;
  bool open_ = true;
  std::string out_, in_;
  std::size_t sent_ = 0;
  std::uint32_t next_stream_ = 1;
  std::uint32_t most_streams_ = UINT32_MAX;
  std::int64_t window_ = 65535, first_window_ = 65535;  // the server's
  std::size_t largest_frame_ = 16384;
  std::size_t skip_ = 0;  // bytes of DATA that are still to come, and are not looked at
  std::uint32_t skip_stream_ = 0;
  bool skip_ends_ = false;
  std::uint32_t taken_ = 0;  // bytes of DATA not yet given back to the connection's window
  bool gives_window_;
  std::unordered_map<std::uint32_t, Stream> streams_;
  std::vector<H2Answer> ended_;
};

}  // namespace grouser::testing
