#include "datasets/raw_data.h"
#include "wire_in_c.h"

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

struct Example {
  trw_header header{.boot_id = 0xDEADBEEF,
                    .tick_hz = 84000000,
                    .first_sequence = 0x0123456789ABCDEF,
                    .first_ticks = 0xFEDCBA9876543210,
                    .ticks_per_frame = 63000,
                    .overruns = 7,
                    .frame_count = 2};
  std::array<trw_frame, 2> frames{{{{0, -1, 4095, -32768}, 0x0011}, {{1, 2, 3, 4}, 0x0040}}};
};

std::vector<std::uint8_t> encoded(const Example& example) {
  std::vector<std::uint8_t> bytes(trw_packet_size(example.header.frame_count));
  EXPECT_EQ(encode_in_c(bytes.data(), &example.header, example.frames.data()), bytes.size());
  return bytes;
}

TEST(Wire, ChecksumIsCrc32c) {
  const std::string digits = "123456789";
  const auto* data = reinterpret_cast<const std::uint8_t*>(digits.data());
  EXPECT_EQ(trw_crc32c(0, data, 9), 0xE3069283u);  // RFC 3720, B.4
  EXPECT_EQ(trw_crc32c(trw_crc32c(0, data, 4), data + 4, 5), 0xE3069283u);
  EXPECT_EQ(crc32c(std::as_bytes(std::span(digits))), 0xE3069283u);
}

TEST(Wire, LayoutIsByteForByteAsDocumented) {
  const std::vector<std::uint8_t> bytes = encoded(Example());
  const std::vector<std::uint8_t> expected = {
      0x54, 0x52, 0x57, 0xA5, 1,    1,    2,    4,                  // sync, version, type, frames, channels
      0xEF, 0xBE, 0xAD, 0xDE, 0x00, 0xBD, 0x01, 0x05,               // boot id, tick rate
      0xEF, 0xCD, 0xAB, 0x89, 0x67, 0x45, 0x23, 0x01,               // first sequence
      0x10, 0x32, 0x54, 0x76, 0x98, 0xBA, 0xDC, 0xFE,               // first ticks
      0x18, 0xF6, 0x00, 0x00, 0x07, 0x00, 0x00, 0x00,               // ticks per frame, overruns
      0x00, 0x00, 0xFF, 0xFF, 0xFF, 0x0F, 0x00, 0x80, 0x11, 0x00,   // frame 0
      0x01, 0x00, 0x02, 0x00, 0x03, 0x00, 0x04, 0x00, 0x40, 0x00};  // frame 1
  ASSERT_EQ(bytes.size(), expected.size() + 4);
  EXPECT_EQ(std::vector<std::uint8_t>(bytes.begin(), bytes.end() - 4), expected);
  EXPECT_EQ(trw_get32(bytes.data() + expected.size()), trw_crc32c(0, expected.data(), expected.size()));
}

TEST(Wire, HostReadsWhatTheFirmwareWrites) {
  const Example example;
  const std::vector<std::uint8_t> bytes = encoded(example);
  trw_header header{};
  ASSERT_EQ(trw_parse(bytes.data(), bytes.size(), &header), TRW_OK);
  EXPECT_EQ(header.boot_id, example.header.boot_id);
  EXPECT_EQ(header.tick_hz, example.header.tick_hz);
  EXPECT_EQ(header.first_sequence, example.header.first_sequence);
  EXPECT_EQ(header.first_ticks, example.header.first_ticks);
  EXPECT_EQ(header.ticks_per_frame, example.header.ticks_per_frame);
  EXPECT_EQ(header.overruns, example.header.overruns);
  for (std::size_t i = 0; i < 2; ++i) {
    trw_frame frame{};
    trw_get_frame(bytes.data() + TRW_HEADER_SIZE + i * TRW_FRAME_SIZE, &frame);
    EXPECT_EQ(std::memcmp(frame.sample, example.frames[i].sample, sizeof frame.sample), 0);
    EXPECT_EQ(frame.status, example.frames[i].status);
  }
}

TEST(Wire, EveryTruncationAsksForMoreAndEveryBitErrorIsFound) {
  std::vector<std::uint8_t> bytes = encoded(Example());
  trw_header header{};
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(parse_in_c(bytes.data(), size, &header), TRW_NEED_MORE) << size;
  }
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_NE(parse_in_c(bytes.data(), bytes.size(), &header), TRW_OK) << "bit " << bit;
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << (bit % 8)));
  }
}

}  // namespace
}  // namespace tunnelrig
