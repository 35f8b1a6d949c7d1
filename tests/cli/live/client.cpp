#include "cli/live/client.h"

#include <array>
#include <stdexcept>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace tunnelrig::test {
namespace {

using Clock = std::chrono::steady_clock;

int connect_to(int port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(socket);
    throw std::runtime_error(fmt::format("nobody listens on port {}", port));
  }
  return socket;
}

void send_all(int socket, const std::string& text) {
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t count = ::send(socket, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return;  // refused before all was sent
    sent += static_cast<std::size_t>(count);
  }
}

/// Appends what comes; false at the end or after `patience`.
bool receive(int socket, std::string& text, std::chrono::milliseconds patience) {
  pollfd waiting{socket, POLLIN, 0};
  if (::poll(&waiting, 1, static_cast<int>(patience.count())) <= 0) return false;
  std::array<char, 65536> buffer{};
  const ssize_t count = ::recv(socket, buffer.data(), buffer.size(), 0);
  if (count <= 0) return false;
  text.append(buffer.data(), static_cast<std::size_t>(count));
  return true;
}

}  // namespace

HttpReply ask(int port, const std::string& request) {
  const int socket = connect_to(port);
  send_all(socket, request);
  std::string text;
  while (receive(socket, text, std::chrono::seconds(10))) {
  }
  ::close(socket);
  const auto end = text.find("\r\n\r\n");
  if (end == std::string::npos || text.size() < 12) return {0, text, ""};
  return {std::stoi(text.substr(9, 3)), text.substr(0, end), text.substr(end + 4)};
}

HttpReply get(int port, const std::string& target) {
  return ask(port, fmt::format("GET {} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", target, port));
}

HttpReply post(int port, const std::string& json) {
  return ask(port,
             fmt::format("POST /command HTTP/1.1\r\nHost: 127.0.0.1:{0}\r\nOrigin: http://127.0.0.1:{0}\r\n"
                         "Content-Type: application/json\r\nContent-Length: {1}\r\n\r\n{2}",
                         port, json.size(), json));
}

EventStream::EventStream(int port, const std::string& target) : socket_(connect_to(port)) {
  send_all(socket_, fmt::format("GET {} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", target, port));
}

EventStream::~EventStream() { ::close(socket_); }

std::optional<std::string> EventStream::next(const std::string& name,
                                             const std::function<bool(const std::string&)>& wanted,
                                             std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  const std::string head = fmt::format("event: {}\ndata: ", name);
  while (true) {
    // Chunk sizes stand between events, which are chunks of their own.
    for (std::size_t at = received_.find(head); at != std::string::npos; at = received_.find(head)) {
      const std::size_t end = received_.find("\n\n", at);
      if (end == std::string::npos) break;
      const std::string data = received_.substr(at + head.size(), end - at - head.size());
      received_.erase(0, end + 2);
      if (!wanted || wanted(data)) return data;
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0 || !receive(socket_, received_, left)) return {};
  }
}

}  // namespace tunnelrig::test
