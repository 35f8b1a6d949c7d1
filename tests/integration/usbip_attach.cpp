// usbip_attach PORT: plugs the device that is served there into the virtual host controller of this kernel.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0), on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<unsigned short>(std::atoi(argv[1])));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (int attempt = 0; ::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0;
       ++attempt) {
    if (attempt == 200) return 1;
    ::usleep(10000);
  }
  std::array<char, 40> request{0x01, 0x11, static_cast<char>(0x80), 0x03, 0, 0, 0, 0, '1', '-', '1'};
  std::array<char, 320> reply{};
  if (::write(fd, request.data(), request.size()) != static_cast<ssize_t>(request.size())) return 1;
  for (std::size_t got = 0; got < reply.size();) {
    const ssize_t more = ::read(fd, reply.data() + got, reply.size() - got);
    if (more <= 0) return 1;
    got += static_cast<std::size_t>(more);
  }
  std::array<char, 64> line{};
  std::snprintf(line.data(), line.size(), "0 %d %d 2", fd,
                (1 << 16) | 2);  // port, socket, device id, full speed
  const int attach = ::open("/sys/devices/platform/vhci_hcd.0/attach", O_WRONLY);
  const auto length = static_cast<ssize_t>(std::strlen(line.data()));
  return attach >= 0 && ::write(attach, line.data(), static_cast<std::size_t>(length)) == length ? 0 : 1;
}
