// usbip_board PORT rig|full-speed|max: the firmware's core as a full-speed device behind USB/IP
// (Documentation/usb/ usbip_protocol.rst, version 1.1.1), for a kernel that takes it for real. Simulated; it
// keeps its power when unplugged.
#include "simulated/board.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace {

using namespace tunnelrig;

constexpr std::size_t kHeader = 48;
constexpr int kFullSpeedPackets = 19;  // of 64 bytes per millisecond
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4;

std::uint32_t get32(const std::uint8_t* p) {
  return std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 | p[3];
}
void put32(std::uint8_t* p, std::uint32_t v) {
  for (int i = 3; i >= 0; --i, v >>= 8) p[i] = static_cast<std::uint8_t>(v);
}

bool read_all(int fd, void* to, std::size_t size) {
  for (auto* p = static_cast<char*>(to); size > 0;) {
    const ssize_t got = ::read(fd, p, size);
    if (got <= 0) return false;
    p += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

bool write_all(int fd, const void* from, std::size_t size) {
  for (const auto* p = static_cast<const char*>(from); size > 0;) {
    const ssize_t put = ::write(fd, p, size);
    if (put <= 0) return false;
    p += put;
    size -= static_cast<std::size_t>(put);
  }
  return true;
}

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

class Device {
 public:
  explicit Device(const std::string& pace)
      : real_time_(pace == "rig"), limited_(pace != "max"), clock_s_(now_s()), bus_s_(now_s()) {}

  /// Time passes, plugged in or not.
  void step() {
    if (!real_time_) {
      board_.fill();
      clock_s_ = now_s();
      return;
    }
    const double frame_s = 1 / board_.frame_rate_hz();
    const double due = (now_s() - clock_s_) / frame_s;
    if (due < 1) return;
    board_.advance(static_cast<std::uint64_t>(due));
    clock_s_ += static_cast<double>(static_cast<std::uint64_t>(due)) * frame_s;
  }

  void plug(int fd) {
    fd_ = fd;
    pending_.clear();
    board_.controller.reset();
  }

  /// A command of the host. False where the connection is to be closed.
  bool command() {
    std::array<std::uint8_t, kHeader> header{};
    if (!read_all(fd_, header.data(), header.size())) return false;
    const std::uint32_t command = get32(&header[0]), sequence = get32(&header[4]);
    if (command == kUnlink) return unlink(sequence, get32(&header[20]));
    return command == kSubmit && submit(header.data(), sequence);
  }

  bool pending() const { return !pending_.empty(); }

  /// Moves packets of the stream; false where the connection is gone.
  bool serve() {
    int budget = 4096;
    if (limited_) {
      const double frames = (now_s() - bus_s_) * 1000;
      if (frames < 1) return true;
      budget =
          static_cast<int>(std::min(frames, 20.0)) * kFullSpeedPackets;  // no more than 20 ms are made up for
      bus_s_ = frames > 20 ? now_s() : bus_s_ + static_cast<int>(frames) / 1000.0;
    }
    while (!pending_.empty() && budget > 0) {
      step();
      board_.poll();
      Urb& urb = pending_.front();
      int status = 1;
      while (status == 1 && budget > 0) {
        const int size =
            board_.controller.in_packet(urb.data.data() + urb.filled, urb.data.size() - urb.filled);
        if (size == simulated::kNak) {
          board_.poll();
          if (!more_at_once()) return true;
          continue;
        }
        if (size < 0) {
          status = size;
          break;
        }
        --budget;
        urb.filled += static_cast<std::size_t>(size);
        if (size < USB_PACKET || urb.filled == urb.data.size()) status = 0;
      }
      if (status == 1) return true;
      const Urb done = std::move(urb);
      pending_.pop_front();
      if (!answer(done.sequence, status, done.data.data(), done.filled, done.filled)) return false;
    }
    return true;
  }

 private:
  struct Urb {
    std::uint32_t sequence;
    std::vector<std::uint8_t> data;
    std::size_t filled = 0;
  };

  /// After a NAK: only where the ring goes on at once.
  bool more_at_once() const { return board_.core.in_flight; }

  bool answer(std::uint32_t sequence, int status, const std::uint8_t* data, std::size_t size,
              std::size_t actual) {
    std::vector<std::uint8_t> out(kHeader + size);
    put32(&out[0], kSubmitted);
    put32(&out[4], sequence);
    put32(&out[20], static_cast<std::uint32_t>(status));
    put32(&out[24], static_cast<std::uint32_t>(actual));
    put32(&out[32], 0xFFFFFFFFu);
    if (size > 0) std::memcpy(&out[kHeader], data, size);
    return write_all(fd_, out.data(), out.size());
  }

  bool unlink(std::uint32_t sequence, std::uint32_t victim) {
    int status = 0;
    for (auto urb = pending_.begin(); urb != pending_.end(); ++urb) {
      if (urb->sequence != victim) continue;
      const Urb taken_back = std::move(*urb);
      pending_.erase(urb);
      status = taken_back.filled > 0 ? 0 : -ECONNRESET;
      // What it holds already the host has acknowledged: a short transfer that was just done.
      if (status == 0 && !answer(victim, 0, taken_back.data.data(), taken_back.filled, taken_back.filled))
        return false;
      break;
    }
    std::array<std::uint8_t, kHeader> out{};
    put32(&out[0], kUnlinked);
    put32(&out[4], sequence);
    put32(&out[20], static_cast<std::uint32_t>(status));
    return write_all(fd_, out.data(), out.size());
  }

  bool submit(const std::uint8_t* header, std::uint32_t sequence) {
    const bool in = get32(header + 12) != 0;
    const std::uint32_t endpoint = get32(header + 16), length = get32(header + 24);
    if (length > (1u << 20)) return false;
    std::vector<std::uint8_t> data(std::max<std::size_t>(length, 64));
    if (!in && length > 0 && !read_all(fd_, data.data(), length)) return false;
    if (endpoint != 0) {
      data.resize(length);
      pending_.push_back({sequence, std::move(data), 0});
      return true;
    }
    const int size = board_.controller.control(header + 40, data.data());
    const std::size_t moved = size > 0 ? static_cast<std::size_t>(size) : 0;
    return answer(sequence, size < 0 ? -EPIPE : 0, data.data(), in ? moved : 0, moved);
  }

  simulated::Board board_;
  bool real_time_, limited_;
  double clock_s_, bus_s_;
  int fd_ = -1;
  std::deque<Urb> pending_;
};

/// OP_REQ_IMPORT, answered with the device; false for anything else.
bool import(int fd) {
  std::array<std::uint8_t, 40> request{};
  if (!read_all(fd, request.data(), request.size()) || request[2] != 0x80 || request[3] != 0x03) return false;
  std::array<std::uint8_t, 8 + 312> reply{0x01, 0x11, 0x00, 0x03};
  std::memcpy(&reply[8], "/sys/devices/simulated/1-1", 26);
  std::memcpy(&reply[8 + 256], "1-1", 3);
  put32(&reply[8 + 288], 1);
  put32(&reply[8 + 292], 2);
  put32(&reply[8 + 296], 2);  // full speed
  const std::array<std::uint8_t, 12> numbers = {0x12, 0x09, 0x00, 0x01, 0x01, 0x00, 0xFF, 0, 0, 0, 1, 1};
  std::memcpy(&reply[8 + 300], numbers.data(), numbers.size());
  return write_all(fd, reply.data(), reply.size());
}

int listen_on(int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0), on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 || ::listen(fd, 4) != 0) {
    std::perror("usbip_board");
    std::exit(1);
  }
  return fd;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::signal(SIGPIPE, SIG_IGN);
  const int listener = listen_on(std::atoi(argv[1]));
  Device device(argv[2]);
  for (int connection = -1;;) {
    pollfd waiting{connection >= 0 ? connection : listener, POLLIN, 0};
    const bool idle = connection < 0 || !device.pending();
    ::poll(&waiting, 1, idle ? 5 : std::strcmp(argv[2], "max") == 0 ? 0 : 1);
    device.step();
    if (connection < 0) {
      if (waiting.revents == 0) continue;
      connection = ::accept(listener, nullptr, nullptr);
      const int on = 1;
      ::setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      if (import(connection)) {
        device.plug(connection);
        continue;
      }
    } else if ((waiting.revents == 0 || device.command()) && device.serve()) {
      continue;
    }
    ::close(connection);
    connection = -1;
  }
}
