/* 168 MHz from a crystal of 8 or 12 MHz. */
#ifndef TUNNELRIG_CLOCK_H
#define TUNNELRIG_CLOCK_H

#include <stdint.h>

#ifndef CRYSTAL_HZ
#define CRYSTAL_HZ 8000000u
#endif

enum { CPU_HZ = 168000000, TIMER_HZ = 84000000 };

/* Which step did not come about. The board then runs on at 16 MHz from the internal oscillator, without USB,
 * and blinks it. */
typedef enum {
  CLOCK_GOOD = 0,
  CLOCK_NO_CRYSTAL = 1,
  CLOCK_NO_PLL = 2,
  CLOCK_NO_SWITCH = 3,
  CLOCK_NO_FLASH = 4
} clock_fault;

/* RM0090 7.2 and 3.5.1: voltage scale, crystal, wait states, PLL, bus dividers, switch, each wait bounded. */
clock_fault clock_start(uint32_t crystal_hz);

#endif
