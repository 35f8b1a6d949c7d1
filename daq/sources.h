// The sources that a name can open. Private to daq/: everybody else calls open_source.
#pragma once

#include "daq/packet_source.h"

#include <memory>
#include <string>
#include <string_view>

namespace tunnelrig {

std::unique_ptr<PacketSource> open_tcp(const std::string& name, std::string_view address);
std::unique_ptr<PacketSource> open_serial(const std::string& name, std::string_view device);
std::unique_ptr<PacketSource> open_usb(const std::string& name, std::string_view board);
std::unique_ptr<PacketSource> open_replay(const std::string& name, std::string_view file);

}  // namespace tunnelrig
