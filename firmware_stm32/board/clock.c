#include "clock.h"

#include "stm32f405.h"

enum {
  kPolls = 200000, /* 50 ms at 16 MHz: a crystal starts within a few */
  kPllN = 336,
  kPllQ = 7,      /* VCO 336 MHz, / 2: 168 MHz, / 7: 48 MHz for USB */
  kWaitStates = 5 /* table 10: 168 MHz at 2.7 to 3.6 V */
};

clock_fault clock_start(uint32_t crystal_hz) {
  SET(RCC_APB1ENR, BIT(28));
  SET(PWR_CR, BIT(14)); /* scale 1, needed above 144 MHz */

  SET(RCC_CR, BIT(16));
  if (!wait_for(RCC_CR, BIT(17), BIT(17), kPolls)) {
    CLEAR(RCC_CR, BIT(16));
    return CLOCK_NO_CRYSTAL;
  }

  /* Wait states before the clock rises (3.5.1), and read back that they are in force. */
  WR(FLASH_ACR, kWaitStates | BIT(8) | BIT(9) | BIT(10));
  if (!wait_for(FLASH_ACR, 7u, kWaitStates, kPolls)) return CLOCK_NO_FLASH;

  /* Dividers before the clock rises: APB1 at most 42 MHz, APB2 at most 84 MHz. */
  WR(RCC_CFGR, (5u << 10) | (4u << 13));

  /* M makes 1 MHz of the crystal; P = 2 is 00; source HSE is bit 22. */
  WR(RCC_PLLCFGR, (crystal_hz / 1000000u) | ((uint32_t)kPllN << 6) | BIT(22) | ((uint32_t)kPllQ << 24));
  SET(RCC_CR, BIT(24));
  if (!wait_for(RCC_CR, BIT(25), BIT(25), kPolls)) return CLOCK_NO_PLL;

  SET(RCC_CFGR, 2u);
  return wait_for(RCC_CFGR, 3u << 2, 2u << 2, kPolls) ? CLOCK_GOOD : CLOCK_NO_SWITCH;
}
