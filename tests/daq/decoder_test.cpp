#include "daq/packet_decoder.h"
#include "daq/packets.h"
#include "support/seeds.h"

#include <random>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::packet_bytes;
using test::PacketList;

void append(std::vector<std::byte>& stream, const std::vector<std::byte>& bytes) {
  stream.insert(stream.end(), bytes.begin(), bytes.end());
}

TEST(Decoder, PiecesOfAnySizeGiveTheSamePackets) {
  std::vector<std::byte> stream;
  for (std::uint64_t i = 0; i < 20; ++i) append(stream, packet_bytes({.first = 16 * i}));
  for (const std::size_t piece : {1u, 7u, 204u, 205u, 1000u, 100000u}) {
    PacketDecoder decoder;
    PacketList list;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      decoder.push(std::span(stream).subspan(at, std::min(piece, stream.size() - at)), list);
    }
    ASSERT_EQ(list.seen.size(), 20u) << "pieces of " << piece;
    EXPECT_EQ(list.seen[19].header.first_sequence, 304u);
    EXPECT_EQ(decoder.bytes_skipped(), 0u);
    EXPECT_EQ(decoder.corrupt(), 0u);
  }
}

TEST(Decoder, FindsEveryWholePacketBetweenGarbage) {
  const std::uint64_t seed = test::seed();
  SCOPED_TRACE(seed);
  std::mt19937_64 engine(seed);
  std::vector<std::byte> stream;
  std::uint64_t garbage = 0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const std::size_t size = engine() % 400;
    for (std::size_t k = 0; k < size; ++k) stream.push_back(static_cast<std::byte>(engine()));
    garbage += size;
    append(stream, packet_bytes({.first = 16 * i}));
  }
  PacketDecoder decoder;
  PacketList list;
  decoder.push(stream, list);
  decoder.finish(list);
  ASSERT_EQ(list.seen.size(), 200u);
  EXPECT_EQ(decoder.bytes_skipped(), garbage);
}

TEST(Decoder, APacketCutShortDoesNotTakeTheNextOneWithIt) {
  std::vector<std::byte> cut = packet_bytes({.first = 0, .count = 64});
  cut.resize(100);
  std::vector<std::byte> stream = cut;
  append(stream, packet_bytes({.first = 64}));
  append(stream, packet_bytes({.first = 80}));
  PacketDecoder decoder;
  PacketList list;
  decoder.push(stream, list);
  decoder.finish(list);
  ASSERT_EQ(list.seen.size(), 2u);
  EXPECT_EQ(list.seen[0].header.first_sequence, 64u);
  EXPECT_EQ(decoder.bytes_skipped(), 100u);
}

TEST(Decoder, WrongChecksumIsCountedOnce) {
  std::vector<std::byte> stream = packet_bytes({.first = 0});
  stream[60] ^= std::byte{1};
  append(stream, packet_bytes({.first = 16}));
  PacketDecoder decoder;
  PacketList list;
  decoder.push(stream, list);
  EXPECT_EQ(list.seen.size(), 1u);
  EXPECT_EQ(decoder.corrupt(), 1u);
}

}  // namespace
}  // namespace tunnelrig
