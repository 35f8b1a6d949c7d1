#include "decimator.h"

/* sinc of 666.7 Hz under a Kaiser window, beta 5.65 (60 dB), rounded; the middle two made up for the sum. */
const int16_t decimator_taps[DECIMATOR_TAPS / 2] = {
    -1,  -3,   -7,   -11,  -13,  -14,  -11,  -5,   6,   19,  34,   47,   54,   53,   40,   16,
    -18, -59,  -99,  -131, -146, -138, -103, -40,  45,  140, 233,  303,  335,  314,  231,  90,
    -99, -313, -521, -684, -764, -728, -550, -220, 255, 850, 1524, 2222, 2883, 3446, 3855, 4067};

void decimator_reset(decimator* filter) {
  filter->newest = 0;
  filter->primed = false;
}

static void store(decimator* filter, uint32_t block, const uint16_t* scans) {
  for (uint32_t i = 0; i < DECIMATION; ++i) {
    for (uint32_t c = 0; c < TRW_CHANNELS; ++c) {
      filter->history[block][c][i] = (int16_t)scans[i * TRW_CHANNELS + c];
    }
  }
}

void decimator_step(decimator* filter, const uint16_t* scans, int16_t frame[TRW_CHANNELS]) {
  filter->newest = (filter->newest + 1u) % DECIMATOR_BLOCKS;
  store(filter, filter->newest, scans);
  if (!filter->primed) {
    for (uint32_t block = 0; block < DECIMATOR_BLOCKS; ++block) store(filter, block, scans);
    filter->primed = true;
  }
  int32_t sums[TRW_CHANNELS] = {0};
  uint32_t block = filter->newest; /* the oldest is the one behind it */
  for (uint32_t b = 0; b < DECIMATOR_BLOCKS; ++b) {
    block = block + 1u == DECIMATOR_BLOCKS ? 0u : block + 1u;
    for (uint32_t i = 0; i < DECIMATION; ++i) {
      uint32_t tap = b * DECIMATION + i;
      int32_t weight = decimator_taps[tap < DECIMATOR_TAPS / 2 ? tap : DECIMATOR_TAPS - 1u - tap];
      for (uint32_t c = 0; c < TRW_CHANNELS; ++c) sums[c] += weight * filter->history[block][c][i];
    }
  }
  /* |sums| <= 4095 * 51480 < 2^31; a step may overshoot the converter's range by a little, which int16 holds.
   */
  for (uint32_t c = 0; c < TRW_CHANNELS; ++c) frame[c] = (int16_t)((sums[c] + (1 << 14)) >> 15);
}
