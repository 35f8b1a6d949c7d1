/* The packet format between the board and the host, version 1. One header for both ends: C11 and C++20.
 *
 * docs/wire-format.md is the specification for people who write a device of their own; this file is the
 * same thing as code. All integers are little-endian; nothing here depends on the compiler's struct layout.
 *
 *   offset  size  field
 *        0     4  sync word 54 52 57 A5 ("TRW", then A5)
 *        4     1  version, 1
 *        5     1  packet type, 1 = frames
 *        6     1  frame count n, 1 to 64
 *        7     1  channel count, 4
 *        8     4  boot id: drawn anew each time the board starts
 *       12     4  tick rate of the device clock, Hz
 *       16     8  sequence number of the first frame, counted where the sample is taken
 *       24     8  device clock at the first frame, ticks since the boot
 *       32     4  ticks per frame
 *       36     4  frames lost to overrun on the board since the boot (information only)
 *       40  10*n  frames: four int16 samples, then the uint16 status of the frame
 *  40+10*n     4  CRC-32C of everything before it
 *
 * The frames of a packet follow each other without a gap: frame i has sequence first + i.
 */
#ifndef TUNNELRIG_WIRE_H
#define TUNNELRIG_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  TRW_VERSION = 1,
  TRW_TYPE_FRAMES = 1,
  TRW_CHANNELS = 4,
  TRW_MAX_FRAMES = 64,
  TRW_HEADER_SIZE = 40,
  TRW_FRAME_SIZE = 10,
  TRW_CRC_SIZE = 4,
  TRW_MAX_PACKET = TRW_HEADER_SIZE + TRW_MAX_FRAMES * TRW_FRAME_SIZE + TRW_CRC_SIZE
};

/* Status bits of one frame. Bit 0 to 3: channel 1 to 4 was at the end of the converter's range. */
enum {
  TRW_STATUS_CLIPPED_MASK = 0x000F,
  TRW_STATUS_OVERRUN = 0x0010,     /* frames before this one were lost on the board */
  TRW_STATUS_ADC_ERROR = 0x0020,   /* the converter or its DMA reported an error */
  TRW_STATUS_TEST_PATTERN = 0x0040 /* the samples are a counter, not measurements */
};

typedef struct {
  int16_t sample[TRW_CHANNELS]; /* converter counts of channel 1 to 4 */
  uint16_t status;              /* TRW_STATUS_ bits */
} trw_frame;

typedef struct {
  uint32_t boot_id;
  uint32_t tick_hz;
  uint64_t first_sequence;
  uint64_t first_ticks;
  uint32_t ticks_per_frame;
  uint32_t overruns;
  uint8_t frame_count;
} trw_header;

/* What trw_parse found at the start of a byte string. */
typedef enum {
  TRW_OK = 0,     /* a whole, valid packet */
  TRW_NEED_MORE,  /* a valid beginning; more bytes are needed to decide */
  TRW_BAD_SYNC,   /* no packet starts here */
  TRW_BAD_HEADER, /* sync word, but another version, type, or an impossible count */
  TRW_BAD_CRC     /* a whole packet whose checksum is wrong */
} trw_result;

static inline void trw_put16(uint8_t* p, uint16_t v) {
  p[0] = (uint8_t)v;
  p[1] = (uint8_t)(v >> 8);
}

static inline void trw_put32(uint8_t* p, uint32_t v) {
  trw_put16(p, (uint16_t)v);
  trw_put16(p + 2, (uint16_t)(v >> 16));
}

static inline void trw_put64(uint8_t* p, uint64_t v) {
  trw_put32(p, (uint32_t)v);
  trw_put32(p + 4, (uint32_t)(v >> 32));
}

static inline uint16_t trw_get16(const uint8_t* p) {
  return (uint16_t)((uint32_t)p[0] | ((uint32_t)p[1] << 8));
}

static inline uint32_t trw_get32(const uint8_t* p) {
  return (uint32_t)trw_get16(p) | ((uint32_t)trw_get16(p + 2) << 16);
}

static inline uint64_t trw_get64(const uint8_t* p) {
  return (uint64_t)trw_get32(p) | ((uint64_t)trw_get32(p + 4) << 32);
}

/* CRC-32C (Castagnoli, reflected 0x82F63B78, start and final xor of all ones), as in iSCSI, RFC 3720 B.4.
 * Four bits at a time: 64 bytes of table suit the board. `crc` is 0 for the first piece of a message. */
static inline uint32_t trw_crc32c(uint32_t crc, const uint8_t* data, size_t size) {
  static const uint32_t table[16] = {
      0x00000000u, 0x105EC76Fu, 0x20BD8EDEu, 0x30E349B1u, 0x417B1DBCu, 0x5125DAD3u, 0x61C69362u, 0x7198540Du,
      0x82F63B78u, 0x92A8FC17u, 0xA24BB5A6u, 0xB21572C9u, 0xC38D26C4u, 0xD3D3E1ABu, 0xE330A81Au, 0xF36E6F75u};
  crc = ~crc;
  for (size_t i = 0; i < size; ++i) {
    crc ^= data[i];
    crc = (crc >> 4) ^ table[crc & 15u];
    crc = (crc >> 4) ^ table[crc & 15u];
  }
  return ~crc;
}

static inline size_t trw_packet_size(uint8_t frame_count) {
  return (size_t)TRW_HEADER_SIZE + (size_t)frame_count * (size_t)TRW_FRAME_SIZE + (size_t)TRW_CRC_SIZE;
}

static inline void trw_put_header(uint8_t* out, const trw_header* header) {
  out[0] = 0x54u;
  out[1] = 0x52u;
  out[2] = 0x57u;
  out[3] = 0xA5u;
  out[4] = (uint8_t)TRW_VERSION;
  out[5] = (uint8_t)TRW_TYPE_FRAMES;
  out[6] = header->frame_count;
  out[7] = (uint8_t)TRW_CHANNELS;
  trw_put32(out + 8, header->boot_id);
  trw_put32(out + 12, header->tick_hz);
  trw_put64(out + 16, header->first_sequence);
  trw_put64(out + 24, header->first_ticks);
  trw_put32(out + 32, header->ticks_per_frame);
  trw_put32(out + 36, header->overruns);
}

static inline void trw_put_frame(uint8_t* out, const trw_frame* frame) {
  for (size_t c = 0; c < (size_t)TRW_CHANNELS; ++c) {
    trw_put16(out + 2 * c, (uint16_t)frame->sample[c]);
  }
  trw_put16(out + 2 * (size_t)TRW_CHANNELS, frame->status);
}

static inline void trw_get_frame(const uint8_t* in, trw_frame* frame) {
  for (size_t c = 0; c < (size_t)TRW_CHANNELS; ++c) {
    frame->sample[c] = (int16_t)trw_get16(in + 2 * c);
  }
  frame->status = trw_get16(in + 2 * (size_t)TRW_CHANNELS);
}

/* Writes a whole packet; `out` has room for trw_packet_size(header->frame_count). Returns its size. */
static inline size_t trw_encode(uint8_t* out, const trw_header* header, const trw_frame* frames) {
  trw_put_header(out, header);
  size_t at = (size_t)TRW_HEADER_SIZE;
  for (size_t i = 0; i < header->frame_count; ++i, at += (size_t)TRW_FRAME_SIZE) {
    trw_put_frame(out + at, &frames[i]);
  }
  trw_put32(out + at, trw_crc32c(0, out, at));
  return at + (size_t)TRW_CRC_SIZE;
}

/* Looks at the beginning of `in` without the checksum: what a packet there would be. */
static inline trw_result trw_parse_header(const uint8_t* in, size_t size, trw_header* header) {
  static const uint8_t sync[4] = {0x54u, 0x52u, 0x57u, 0xA5u};
  for (size_t i = 0; i < 4; ++i) {
    if (i == size) return TRW_NEED_MORE;
    if (in[i] != sync[i]) return TRW_BAD_SYNC;
  }
  if (size < 8) return TRW_NEED_MORE;
  if (in[4] != (uint8_t)TRW_VERSION || in[5] != (uint8_t)TRW_TYPE_FRAMES || in[6] == 0 ||
      in[6] > (uint8_t)TRW_MAX_FRAMES || in[7] != (uint8_t)TRW_CHANNELS) {
    return TRW_BAD_HEADER;
  }
  if (size < (size_t)TRW_HEADER_SIZE) return TRW_NEED_MORE;
  header->frame_count = in[6];
  header->boot_id = trw_get32(in + 8);
  header->tick_hz = trw_get32(in + 12);
  header->first_sequence = trw_get64(in + 16);
  header->first_ticks = trw_get64(in + 24);
  header->ticks_per_frame = trw_get32(in + 32);
  header->overruns = trw_get32(in + 36);
  return TRW_OK;
}

/* Parses the packet at the start of `in`. On TRW_OK the packet is trw_packet_size(header->frame_count)
 * long and its frames start at in + TRW_HEADER_SIZE. After any TRW_BAD_ result the caller drops one byte
 * and tries again: a packet cut short by another one is then found. Nothing is ever read beyond `size`. */
static inline trw_result trw_parse(const uint8_t* in, size_t size, trw_header* header) {
  trw_result found = trw_parse_header(in, size, header);
  if (found != TRW_OK) return found;
  size_t whole = trw_packet_size(header->frame_count);
  if (size < whole) return TRW_NEED_MORE;
  size_t body = whole - (size_t)TRW_CRC_SIZE;
  return trw_get32(in + body) == trw_crc32c(0, in, body) ? TRW_OK : TRW_BAD_CRC;
}

#ifdef __cplusplus
}
#endif

#endif /* TUNNELRIG_WIRE_H */
