/* What host and board say to each other over USB besides the stream: identifiers, vendor control requests and
 * the layout of their data. One header for both ends: C11 and C++20. All integers are little-endian.
 * docs/usb.md. */
#ifndef TUNNELRIG_USB_H
#define TUNNELRIG_USB_H

#include "tunnelrig_wire.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  TRW_USB_VENDOR = 0x1209, /* pid.codes; the product is its number for tests, docs/usb.md */
  TRW_USB_PRODUCT = 0x0001,
  TRW_USB_INTERFACE = 0,
  TRW_USB_STREAM_IN = 0x81, /* the bulk endpoint; carries the packets of tunnelrig_wire.h */
  TRW_USB_PROTOCOL = 1,
  TRW_USB_UNIQUE_ID_SIZE = 12,
  TRW_USB_DESCRIBE_SIZE = 48
};

/* bRequest of a vendor request to the device (bmRequestType 0xC0 in, 0x40 out). Anything else is stalled. */
enum {
  TRW_USB_IDENTIFY = 1, /* in: trw_identity */
  TRW_USB_START = 2,    /* out, no data; wValue 0: converter, 1: counter test pattern. Running: goes on */
  TRW_USB_STOP = 3,     /* out, no data; frames not yet sent are dropped */
  TRW_USB_SET_RATE = 4, /* out: trw_rate_wish; only when stopped, only what the timer makes exactly */
  TRW_USB_GET_RATE = 5, /* in: trw_rate, what is really set */
  TRW_USB_SET_AMPLIFIER = 6, /* out: trw_amplifier, wValue: channel 0 to 3; stalled where none is fitted */
  TRW_USB_GET_AMPLIFIER = 7, /* in: trw_amplifier */
  TRW_USB_STATISTICS = 8,    /* in: trw_statistics */
  TRW_USB_LOADER = 9,        /* out, no data, wValue TRW_USB_LOADER_KEY: reboots into the ROM's DFU loader */
  TRW_USB_MS_OS = 0x20       /* in, wIndex 7: Microsoft OS 2.0 descriptors */
};
enum { TRW_USB_LOADER_KEY = 0xDF0B };

enum { TRW_PATTERN_OFF = 0, TRW_PATTERN_COUNTER = 1 };
enum { TRW_VARIANT_F405 = 1, TRW_VARIANT_EMULATOR = 2, TRW_VARIANT_SIMULATED = 3 };

/* Bits of trw_identity.flags. */
enum { TRW_FLAG_RUNNING = 1, TRW_FLAG_CLOCK_FAULT = 2, TRW_FLAG_FAULT_RECORD = 4 };

typedef struct {
  uint16_t protocol;
  uint16_t firmware; /* major * 256 + minor */
  uint32_t boot_id;
  uint8_t unique_id[TRW_USB_UNIQUE_ID_SIZE];
  uint32_t ring_frames; /* how many frames wait on the board at most */
  uint32_t tick_hz;
  uint8_t amplifier_mask; /* bit c: channel c has an adjustable amplifier */
  uint8_t variant;        /* TRW_VARIANT_ */
  uint8_t reset_cause;    /* RCC_CSR bits 24 to 31 */
  uint8_t flags;          /* TRW_FLAG_ */
  uint32_t fault_pc, fault_lr, fault_cfsr, fault_hfsr,
      fault_address;                    /* of the last hard fault, if recorded */
  uint32_t clock_fault;                 /* which step of the clock set-up timed out */
  char describe[TRW_USB_DESCRIBE_SIZE]; /* git describe, ends with a 0 */
} trw_identity;
enum { TRW_IDENTITY_SIZE = 4 + 2 + 2 + 4 + TRW_USB_UNIQUE_ID_SIZE + 4 + 4 + 4 + 24 + TRW_USB_DESCRIBE_SIZE };

/* A frame rate as a fraction, so that 4000/3 Hz can be said exactly. */
typedef struct {
  uint32_t numerator_hz, denominator;
  uint32_t oversampling; /* conversions per frame: 1, or 8 with the decimation filter */
} trw_rate_wish;
enum { TRW_RATE_WISH_SIZE = 12 };

typedef struct {
  uint32_t tick_hz, ticks_per_frame; /* the rate is their quotient */
  uint32_t oversampling;
} trw_rate;
enum { TRW_RATE_SIZE = 12 };

typedef struct {
  uint16_t gain, offset; /* codes of the fitted part */
} trw_amplifier;
enum { TRW_AMPLIFIER_SIZE = 4 };

typedef struct {
  uint64_t frames;     /* sampled since the boot */
  uint32_t ring_peak;  /* most frames that ever waited */
  uint32_t overruns;   /* frames lost because the ring was full */
  uint32_t stalls;     /* control requests and endpoints stalled */
  uint32_t resets;     /* bus resets */
  uint32_t suspends;   /* bus suspends */
  uint32_t adc_errors; /* converter or DMA errors */
  uint32_t transfers;  /* bulk transfers finished */
  uint32_t isr_cycles; /* longest sampling interrupt, processor cycles (0: not measured) */
} trw_statistics;
enum { TRW_STATISTICS_SIZE = 40 };

static inline void trw_put_identity(uint8_t* out, const trw_identity* id) {
  memcpy(out, "TRWB", 4);
  trw_put16(out + 4, id->protocol);
  trw_put16(out + 6, id->firmware);
  trw_put32(out + 8, id->boot_id);
  memcpy(out + 12, id->unique_id, sizeof id->unique_id);
  trw_put32(out + 24, id->ring_frames);
  trw_put32(out + 28, id->tick_hz);
  out[32] = id->amplifier_mask;
  out[33] = id->variant;
  out[34] = id->reset_cause;
  out[35] = id->flags;
  trw_put32(out + 36, id->fault_pc);
  trw_put32(out + 40, id->fault_lr);
  trw_put32(out + 44, id->fault_cfsr);
  trw_put32(out + 48, id->fault_hfsr);
  trw_put32(out + 52, id->fault_address);
  trw_put32(out + 56, id->clock_fault);
  memcpy(out + 60, id->describe, sizeof id->describe);
}

/* False where this is not a tunnelrig board's answer. */
static inline bool trw_get_identity(const uint8_t* in, size_t size, trw_identity* id) {
  if (size < (size_t)TRW_IDENTITY_SIZE || memcmp(in, "TRWB", 4) != 0) return false;
  id->protocol = trw_get16(in + 4);
  id->firmware = trw_get16(in + 6);
  id->boot_id = trw_get32(in + 8);
  memcpy(id->unique_id, in + 12, sizeof id->unique_id);
  id->ring_frames = trw_get32(in + 24);
  id->tick_hz = trw_get32(in + 28);
  id->amplifier_mask = in[32];
  id->variant = in[33];
  id->reset_cause = in[34];
  id->flags = in[35];
  id->fault_pc = trw_get32(in + 36);
  id->fault_lr = trw_get32(in + 40);
  id->fault_cfsr = trw_get32(in + 44);
  id->fault_hfsr = trw_get32(in + 48);
  id->fault_address = trw_get32(in + 52);
  id->clock_fault = trw_get32(in + 56);
  memcpy(id->describe, in + 60, sizeof id->describe);
  id->describe[sizeof id->describe - 1] = 0;
  return true;
}

static inline void trw_put_rate_wish(uint8_t* out, const trw_rate_wish* wish) {
  trw_put32(out, wish->numerator_hz);
  trw_put32(out + 4, wish->denominator);
  trw_put32(out + 8, wish->oversampling);
}

static inline void trw_get_rate_wish(const uint8_t* in, trw_rate_wish* wish) {
  wish->numerator_hz = trw_get32(in);
  wish->denominator = trw_get32(in + 4);
  wish->oversampling = trw_get32(in + 8);
}

static inline void trw_put_rate(uint8_t* out, const trw_rate* rate) {
  trw_put32(out, rate->tick_hz);
  trw_put32(out + 4, rate->ticks_per_frame);
  trw_put32(out + 8, rate->oversampling);
}

static inline void trw_get_rate(const uint8_t* in, trw_rate* rate) {
  rate->tick_hz = trw_get32(in);
  rate->ticks_per_frame = trw_get32(in + 4);
  rate->oversampling = trw_get32(in + 8);
}

static inline void trw_put_statistics(uint8_t* out, const trw_statistics* s) {
  trw_put64(out, s->frames);
  trw_put32(out + 8, s->ring_peak);
  trw_put32(out + 12, s->overruns);
  trw_put32(out + 16, s->stalls);
  trw_put32(out + 20, s->resets);
  trw_put32(out + 24, s->suspends);
  trw_put32(out + 28, s->adc_errors);
  trw_put32(out + 32, s->transfers);
  trw_put32(out + 36, s->isr_cycles);
}

static inline void trw_get_statistics(const uint8_t* in, trw_statistics* s) {
  s->frames = trw_get64(in);
  s->ring_peak = trw_get32(in + 8);
  s->overruns = trw_get32(in + 12);
  s->stalls = trw_get32(in + 16);
  s->resets = trw_get32(in + 20);
  s->suspends = trw_get32(in + 24);
  s->adc_errors = trw_get32(in + 28);
  s->transfers = trw_get32(in + 32);
  s->isr_cycles = trw_get32(in + 36);
}

#ifdef __cplusplus
}
#endif

#endif /* TUNNELRIG_USB_H */
