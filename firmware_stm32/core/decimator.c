#include "decimator.h"

/* sinc of 666.7 Hz under a Kaiser window, beta 5.65 (60 dB), rounded; the middle two made up for the sum. */
const int16_t decimator_taps[DECIMATOR_TAPS] = {
    -1,   -3,   -7,   -11,  -13,  -14,  -11,  -5,   6,    19,   34,   47,   54,   53,   40,   16,
    -18,  -59,  -99,  -131, -146, -138, -103, -40,  45,   140,  233,  303,  335,  314,  231,  90,
    -99,  -313, -521, -684, -764, -728, -550, -220, 255,  850,  1524, 2222, 2883, 3446, 3855, 4067,
    4067, 3855, 3446, 2883, 2222, 1524, 850,  255,  -220, -550, -728, -764, -684, -521, -313, -99,
    90,   231,  314,  335,  303,  233,  140,  45,   -40,  -103, -138, -146, -131, -99,  -59,  -18,
    16,   40,   53,   54,   47,   34,   19,   6,    -5,   -11,  -14,  -13,  -11,  -7,   -3,   -1};

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

#ifdef __ARM_FEATURE_SIMD32
#include <arm_acle.h>

/* Two products an instruction, which keeps the sampling interrupt short. */
static int32_t add_products(int32_t sum, const int16_t* taps, const int16_t* samples) {
#pragma GCC unroll 4
  for (uint32_t i = 0; i < DECIMATION; i += 2) {
    int16x2_t two_taps, two_samples;
    __builtin_memcpy(&two_taps, taps + i, sizeof two_taps);
    __builtin_memcpy(&two_samples, samples + i, sizeof two_samples);
    sum = __smlad(two_taps, two_samples, sum);
  }
  return sum;
}
#else
static int32_t add_products(int32_t sum, const int16_t* taps, const int16_t* samples) {
  for (uint32_t i = 0; i < DECIMATION; ++i) sum += taps[i] * samples[i];
  return sum;
}
#endif

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
    const int16_t* taps = &decimator_taps[b * DECIMATION];
    for (uint32_t c = 0; c < TRW_CHANNELS; ++c)
      sums[c] = add_products(sums[c], taps, filter->history[block][c]);
  }
  /* |sums| <= 4095 * 51480 < 2^31; a step may overshoot the converter's range by a little, which int16 holds.
   */
  for (uint32_t c = 0; c < TRW_CHANNELS; ++c) frame[c] = (int16_t)((sums[c] + (1 << 14)) >> 15);
}
