// TCP and serial: a file descriptor that is polled.

#include "daq/sources.h"
#include "datasets/csv.h"
#include "datasets/error.h"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

constexpr std::chrono::milliseconds kConnectTimeout{2000};
constexpr int kDefaultBaud = 921600;  // 1333 frames/s take 170 kbit/s

/// What both have in common: read with a time-out from a descriptor that `connect` opens.
class DescriptorSource : public PacketSource {
 public:
  explicit DescriptorSource(std::string name) : name_(std::move(name)) {}
  ~DescriptorSource() override { close(); }
  DescriptorSource(const DescriptorSource&) = delete;
  DescriptorSource& operator=(const DescriptorSource&) = delete;

  std::string name() const override { return name_; }

  ReadResult read(std::span<std::byte> buffer, std::chrono::milliseconds timeout) override {
    if (fd_ < 0) return {ReadResult::Status::kBroken, 0, steady_seconds()};
    pollfd waiting{fd_, POLLIN, 0};
    const int ready = ::poll(&waiting, 1, static_cast<int>(timeout.count()));
    if (ready == 0 || (ready < 0 && errno == EINTR))
      return {ReadResult::Status::kNothing, 0, steady_seconds()};
    const ssize_t size = ready < 0 ? -1 : ::read(fd_, buffer.data(), buffer.size());
    if (size > 0) return {ReadResult::Status::kData, static_cast<std::size_t>(size), steady_seconds()};
    if (size < 0 && (errno == EAGAIN || errno == EINTR))
      return {ReadResult::Status::kNothing, 0, steady_seconds()};
    close();  // end of file: the peer is gone; an error: so is the device
    return {ReadResult::Status::kBroken, 0, steady_seconds()};
  }

  /// At most a megabyte, so that a peer that sends without end holds nobody up.
  void idle() override {
    std::array<std::byte, 4096> unwanted;
    for (int i = 0; i < 256; ++i)
      if (read(unwanted, std::chrono::milliseconds(0)).status != ReadResult::Status::kData) return;
  }

  bool reopen() override {
    close();
    std::string why;
    fd_ = connect(why);
    return fd_ >= 0;
  }

  void open_or_throw() {
    std::string why;
    fd_ = connect(why);
    if (fd_ < 0) throw InputError::in(name_, "cannot be opened: {}", why);
  }

 protected:
  /// A descriptor, or -1 and the reason.
  virtual int connect(std::string& why) = 0;

 private:
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

  std::string name_;
  int fd_ = -1;
};

std::string reason(int error) { return std::generic_category().message(error); }

/// Connects without waiting longer than kConnectTimeout; -1 and errno's text otherwise.
int connect_with_timeout(const addrinfo& address, std::string& why) {
  const int fd =
      ::socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, address.ai_protocol);
  if (fd < 0) {
    why = reason(errno);
    return -1;
  }
  int error = ::connect(fd, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
  if (error == EINPROGRESS) {
    pollfd waiting{fd, POLLOUT, 0};
    socklen_t length = sizeof error;
    if (::poll(&waiting, 1, static_cast<int>(kConnectTimeout.count())) <= 0)
      error = ETIMEDOUT;
    else if (::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &length) != 0)
      error = errno;
  }
  if (error == 0) {
    const int on = 1;
    ::setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
    return fd;
  }
  why = reason(error);
  ::close(fd);
  return -1;
}

class TcpSource : public DescriptorSource {
 public:
  TcpSource(const std::string& name, std::string host, std::string port)
      : DescriptorSource(name), host_(std::move(host)), port_(std::move(port)) {}

 protected:
  int connect(std::string& why) override {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    const int failed = ::getaddrinfo(host_.c_str(), port_.c_str(), &hints, &found);
    if (failed != 0) {
      why = ::gai_strerror(failed);
      return -1;
    }
    int fd = -1;
    for (const addrinfo* address = found; address != nullptr && fd < 0; address = address->ai_next) {
      fd = connect_with_timeout(*address, why);
    }
    ::freeaddrinfo(found);
    return fd;
  }

 private:
  std::string host_, port_;
};

struct Baud {
  int value;
  speed_t code;
};
constexpr std::array<Baud, 9> kBauds = {{{115200, B115200},
                                         {230400, B230400},
                                         {460800, B460800},
                                         {500000, B500000},
                                         {921600, B921600},
                                         {1000000, B1000000},
                                         {1500000, B1500000},
                                         {2000000, B2000000},
                                         {3000000, B3000000}}};

std::optional<speed_t> baud_code(int value) {
  for (const Baud& known : kBauds) {
    if (known.value == value) return known.code;
  }
  return {};
}

class SerialSource : public DescriptorSource {
 public:
  SerialSource(const std::string& name, std::string device, speed_t speed)
      : DescriptorSource(name), device_(std::move(device)), speed_(speed) {}

 protected:
  int connect(std::string& why) override {
    const int fd = ::open(device_.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    termios raw{};
    if (fd >= 0 && ::tcgetattr(fd, &raw) == 0) {
      ::cfmakeraw(&raw);
      raw.c_cflag |= CLOCAL | CREAD;
      ::cfsetspeed(&raw, speed_);
      if (::tcsetattr(fd, TCSANOW, &raw) == 0) return fd;
    }
    why = reason(errno);
    if (errno == EACCES) why += " (add yourself to the group dialout)";
    if (fd >= 0) ::close(fd);
    return -1;
  }

 private:
  std::string device_;
  speed_t speed_;
};

}  // namespace

std::unique_ptr<PacketSource> open_tcp(const std::string& name, std::string_view address) {
  const auto colon = address.rfind(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == address.size()) {
    throw InputError::in(name, "write tcp:HOST:PORT");
  }
  const std::string_view port = address.substr(colon + 1);
  unsigned number = 0;  // what is above 65535 would count from 0 again
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (error != std::errc() || end != port.data() + port.size() || number < 1 || number > 65535)
    throw InputError::in(name, "port {}: must be a number from 1 to 65535", port);
  auto source = std::make_unique<TcpSource>(name, std::string(address.substr(0, colon)), std::string(port));
  source->open_or_throw();
  return source;
}

std::unique_ptr<PacketSource> open_serial(const std::string& name, std::string_view device) {
  int baud = kDefaultBaud;
  const auto at = device.rfind('@');
  if (at != std::string_view::npos) {
    const auto value = parse_number(device.substr(at + 1));
    baud = value && *value > 0 && *value < 1e8 ? static_cast<int>(*value) : 0;
    device = device.substr(0, at);
  }
  const auto code = baud_code(baud);
  if (!code || device.empty()) {
    throw InputError::in(
        name, "write serial:DEVICE[@BAUD] with a baud rate of 115200 to 3000000 (default {})", kDefaultBaud);
  }
  auto source = std::make_unique<SerialSource>(name, std::string(device), *code);
  source->open_or_throw();
  return source;
}

}  // namespace tunnelrig
