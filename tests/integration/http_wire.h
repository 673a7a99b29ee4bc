#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <string>

namespace grouser::testing {

inline constexpr int kAnswerMs = 30000;

/// A plain connection, to send what no library would.
class Wire {
 public:
  explicit Wire(const std::string& address)
      : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.find(':') + 1))));
    EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  }
  ~Wire() { ::close(fd_); }
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  void Send(const std::string& bytes) const {
    for (std::size_t at = 0; at < bytes.size();) {
      const auto sent = ::send(fd_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
      if (sent <= 0) return;  // refused meanwhile; what it answered is still to be read
      at += static_cast<std::size_t>(sent);
    }
  }
  /// Everything until the other side closes.
  std::string ReadToEnd() const {
    std::string all;
    pollfd waiting{fd_, POLLIN, 0};
    while (::poll(&waiting, 1, kAnswerMs) == 1) {
      char bytes[65536];
      const auto got = ::recv(fd_, bytes, sizeof bytes, 0);
      if (got <= 0) return all;
      all.append(bytes, static_cast<std::size_t>(got));
    }
    ADD_FAILURE() << "stays open after: " << all.substr(0, 200);
    return all;
  }
  bool IsClosed() const {
    char byte;
    const auto got = ::recv(fd_, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    return got == 0 || (got < 0 && errno != EAGAIN);
  }

 private:
  int fd_;
};

struct HttpResult {
  int status = 0;
  std::string head, body;
};

inline HttpResult Exchange(const std::string& address, const std::string& bytes) {
  const Wire wire(address);
  wire.Send(bytes);
  const std::string all = wire.ReadToEnd();
  HttpResult result;
  const std::size_t end = all.find("\r\n\r\n");
  if (!all.starts_with("HTTP/1.1 ") || end == std::string::npos) return result;
  result.status = std::stoi(all.substr(9, 3));
  result.head = all.substr(0, end + 2);
  result.body = all.substr(end + 4);
  return result;
}

inline HttpResult Get(const std::string& address, const std::string& path,
                      const std::string& headers = "Host: localhost\r\n") {
  return Exchange(address, "GET " + path + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n");
}

inline HttpResult Post(const std::string& address, const std::string& path, const std::string& body,
                       const std::string& headers = "Content-Type: application/json\r\n") {
  return Exchange(address, "POST " + path + " HTTP/1.1\r\nHost: localhost\r\n" + headers +
                               "Connection: close\r\nContent-Length: " +
                               std::to_string(body.size()) + "\r\n\r\n" + body);
}

}  // namespace grouser::testing
