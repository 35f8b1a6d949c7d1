#include "simulated/device_text.h"

#include <array>
#include <cstdio>

namespace tunnelrig::simulated {
namespace {

std::string hex_descriptors(Board& board) {
  std::string text;
  for (const std::uint16_t value : {std::uint16_t{0x0100}, std::uint16_t{0x0200}}) {
    std::array<std::uint8_t, 256> data{};
    const int size = board.control(0x80, 6, value, 0, 255, data.data());
    for (int i = 0; i < size; ++i) {
      char byte[3];
      std::snprintf(byte, sizeof byte, "%02x", data[static_cast<std::size_t>(i)]);
      text += byte;
    }
  }
  return text;
}

}  // namespace

std::string device_text(Board& board, int number, const std::string& node) {
  std::array<char, 2048> text{};
  std::snprintf(
      text.data(), text.size(),
      "P: /devices/usb1/1-1\nN: bus/usb/001/%03d\nE: DEVNAME=%s\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\n"
      "E: BUSNUM=001\nE: DEVNUM=%03d\nE: MAJOR=189\nE: MINOR=%d\nE: PRODUCT=1209/1/100\nA: busnum=1\\n\n"
      "A: devnum=%d\\n\nA: speed=12\\n\nA: bConfigurationValue=1\\n\nA: idVendor=1209\\n\nA: "
      "idProduct=0001\\n\n"
      "H: descriptors=%s\n",
      number, node.c_str(), number, number - 1, number, hex_descriptors(board).c_str());
  return text.data();
}

}  // namespace tunnelrig::simulated
