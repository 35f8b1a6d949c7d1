/* Eight conversions to one: a Kaiser-windowed low-pass of 96 taps per channel, then every eighth
 * output.
 *
 * At 10666.7 conversions/s: flat within 0.01 dB to 460 Hz, -6 dB at 666.7 Hz, below -57 dB from 867 Hz on;
 * what folds back onto 0 to 460 Hz is thereby suppressed by at least 57 dB. Group delay 47.5 conversions
 * (4.45 ms). docs/hardware.md. */
#ifndef TUNNELRIG_DECIMATOR_H
#define TUNNELRIG_DECIMATOR_H

#include "tunnelrig_wire.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { DECIMATION = 8, DECIMATOR_TAPS = 96, DECIMATOR_BLOCKS = DECIMATOR_TAPS / DECIMATION };

typedef struct {
  int16_t history[DECIMATOR_BLOCKS][TRW_CHANNELS][DECIMATION]; /* blocks of one frame each, a ring */
  uint32_t newest;                                             /* index of the newest block */
  bool primed;
} decimator;

/* Symmetric, in units of 2^-15, sum 32768. */
extern const int16_t decimator_taps[DECIMATOR_TAPS];

void decimator_reset(decimator* filter);

/* DECIMATION scans of TRW_CHANNELS conversions (0 to 4095) make one frame, in counts. The first block fills
 * the whole history, so that a start rings no more than the signal. */
void decimator_step(decimator* filter, const uint16_t* scans, int16_t frame[TRW_CHANNELS]);

#ifdef __cplusplus
}
#endif

#endif
