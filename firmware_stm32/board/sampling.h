/* TIM2 triggers ADC1, which scans PA0 to PA3; DMA2 stream 0 fills two buffers in turn, one frame each. */
#ifndef TUNNELRIG_SAMPLING_H
#define TUNNELRIG_SAMPLING_H

#include <stdbool.h>
#include <stdint.h>

enum {
  SAMPLING_CHANNELS = 4,
  SAMPLING_MOST_SCANS = 8,
  /* Of 84 MHz, from trigger to trigger: 84 + 12 of the converter's cycles a channel, and up to 3 until it
   * heeds the trigger (data sheet, table 67). */
  SAMPLING_SCAN_TICKS = 4 * (SAMPLING_CHANNELS * (84 + 12) + 3)
};

/* Clocks, pins, converter; once. */
void sampling_init(void);

/* A scan every `ticks_per_scan` of 84 MHz; an interrupt every `scans_per_frame` scans. */
void sampling_start(uint32_t ticks_per_scan, uint32_t scans_per_frame);
void sampling_stop(void);

typedef enum { SAMPLING_NOTHING, SAMPLING_FRAME, SAMPLING_ERROR } sampling_result;

/* In the interrupts of DMA and converter: the frame that is complete. After an error both are set up anew,
 * and frames of time are missing. A frame that was overwritten before anybody came for it is an error, too.
 */
sampling_result sampling_take(const uint16_t** scans);

#endif
