// `--source usb[:SERIAL][,OPTION…]`.
#pragma once

#include "daq/packet_source.h"
#include "daq/usb_stream.h"

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

namespace tunnelrig {

struct UsbSourceSettings {
  std::string serial;              // or its beginning; empty: the only board there is
  bool pattern = false;            // counter instead of measurements
  std::uint32_t oversampling = 0;  // conversions per frame; 0: as the board is set when it is opened first
  std::uint32_t rate_numerator_hz = 0, rate_denominator = 1;  // 0: likewise
  std::chrono::milliseconds silence{250};  // without a byte for so long, the stream counts as broken
  UsbStreamSettings stream;
};

/// "SERIAL,test-pattern,rate=4000/3,oversampling=8", all of it optional. Throws InputError.
UsbSourceSettings parse_usb_source(const std::string& name, std::string_view text);

/// Throws InputError where the board cannot be had or refuses its settings.
std::unique_ptr<PacketSource> open_usb_source(const std::string& name, const UsbSourceSettings& settings);

}  // namespace tunnelrig
