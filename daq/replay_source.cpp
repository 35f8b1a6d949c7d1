// Replay: a recorded byte stream (`log --capture FILE`), and open_source.

#include "daq/sources.h"
#include "datasets/error.h"

#include <ctime>
#include <fstream>
#include <utility>

namespace tunnelrig {
namespace {

/// A recorded stream carries no time of reception: its clock stands still, and gaps from reboots count what
/// is certain.
class ReplaySource : public PacketSource {
 public:
  ReplaySource(std::string name, const std::string& file)
      : name_(std::move(name)), in_(file, std::ios::binary) {
    if (!in_ || in_.peek() == std::ifstream::traits_type::eof()) {
      throw InputError::in(name_, "cannot be read, or is empty");
    }
  }

  std::string name() const override { return name_; }
  bool reopen() override { return false; }

  ReadResult read(std::span<std::byte> buffer, std::chrono::milliseconds /*timeout*/) override {
    in_.read(reinterpret_cast<char*>(buffer.data()), static_cast<std::streamsize>(buffer.size()));
    const auto size = static_cast<std::size_t>(in_.gcount());
    return {size > 0 ? ReadResult::Status::kData : ReadResult::Status::kEnd, size, 0};
  }

 private:
  std::string name_;
  std::ifstream in_;
};

bool take_prefix(std::string_view& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  return true;
}

}  // namespace

std::unique_ptr<PacketSource> open_replay(const std::string& name, std::string_view file) {
  return std::make_unique<ReplaySource>(name, std::string(file));
}

std::unique_ptr<PacketSource> open_source(const std::string& name) {
  std::string_view rest = name;
  if (take_prefix(rest, "tcp:")) return open_tcp(name, rest);
  if (take_prefix(rest, "serial:")) return open_serial(name, rest);
  if (rest == "usb") return open_usb(name, "");
  if (take_prefix(rest, "usb:")) return open_usb(name, rest);
  if (take_prefix(rest, "replay:")) return open_replay(name, rest);
  throw InputError::in(
      name, "is no source; write virtual, usb[:SERIAL], tcp:HOST:PORT, serial:DEVICE or replay:FILE");
}

double steady_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_BOOTTIME, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace tunnelrig
