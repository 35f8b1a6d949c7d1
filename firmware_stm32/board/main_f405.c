/* The board: core/ above the F405's clock, converter and USB. */
#include "clock.h"
#include "otg_fs.h"
#include "rig_board.h"
#include "sampling.h"
#include "startup.h"
#include "stm32f405.h"

#ifndef GIT_DESCRIBE
#define GIT_DESCRIBE "unknown"
#endif

enum {
  kFirmware = 0x0100,
  kHighestRate_hz = 10000,
  kTick_hz = 1000,
  kLed = 13,         /* PC13, lit when low */
  kPriorityBits = 4, /* of 8, PM0214 4.3.7 */
  kRngPolls = 1000,
  kWatchdogReload = 500, /* of 500 Hz: 1 s */
  kLoaderDelay_ms = 20   /* the status stage of the request goes out first */
};

static rig_board instrument;
static volatile uint32_t milliseconds;
static uint64_t device_ticks; /* TIM5, widened; guarded by the lock */
static uint32_t loader_at_ms; /* 0: never */
static bool usb_works;

/* --- the port
 * --------------------------------------------------------------------------------------------------- */

static uint32_t lock(void* context) {
  (void)context;
  uint32_t before;
  __asm volatile("mrs %0, primask\n cpsid i" : "=r"(before) : : "memory");
  return before;
}

static void unlock(void* context, uint32_t before) {
  (void)context;
  __asm volatile("msr primask, %0" : : "r"(before) : "memory");
}

/* TIM5 runs through 2^32 in 51 s; somebody looks at least every millisecond. */
static uint64_t ticks(void* context) {
  uint32_t key = lock(context);
  uint32_t now = RD(TIM5 + TIM_CNT);
  device_ticks += now - (uint32_t)device_ticks;
  uint64_t result = device_ticks;
  unlock(context, key);
  return result;
}

static void start(void* context, uint32_t ticks_per_scan, uint32_t scans_per_frame) {
  (void)context;
  sampling_start(ticks_per_scan, scans_per_frame);
}

static void stop(void* context) {
  (void)context;
  sampling_stop();
}

static void want_loader(void* context) {
  (void)context;
  loader_at_ms = (milliseconds + kLoaderDelay_ms) | 1u;
}

static const board_port port = {start, stop, ticks, lock, unlock, NULL, want_loader};

/* --- interrupts
 * ------------------------------------------------------------------------------------------------- */

void on_sampling(void) {
  uint32_t began = RD(DWT_CYCCNT);
  const uint16_t* scans = NULL;
  sampling_result result = sampling_take(&scans);
  if (result == SAMPLING_FRAME) {
    board_on_scans(&instrument, scans);
  } else if (result == SAMPLING_ERROR) {
    board_on_adc_error(&instrument, board_frames_missed(&instrument, ticks(NULL)));
  }
  uint32_t took = RD(DWT_CYCCNT) - began;
  /* cppcheck-suppress unsignedLessThanZero ; the two reads are of a running counter */
  if (took > instrument.isr_cycles) instrument.isr_cycles = took;
}

void on_usb(void) { otg_fs_interrupt(); }

void on_tick(void) {
  ++milliseconds;
  (void)ticks(NULL);
}

/* --- start
 * ------------------------------------------------------------------------------------------------------ */

static void start_timers(uint32_t cpu_hz) {
  SET(RCC_APB1ENR, BIT(3));
  WR(TIM5 + TIM_PSC, 0);
  WR(TIM5 + TIM_ARR, 0xFFFFFFFFu);
  WR(TIM5 + TIM_EGR, BIT(0));
  WR(TIM5 + TIM_CR1, BIT(0));
  SET(DEMCR, BIT(24));
  WR(DWT_CYCCNT, 0);
  SET(DWT_CTRL, BIT(0));
  WR(SYST_RVR, cpu_hz / kTick_hz - 1u);
  WR(SYST_CVR, 0);
  WR(SYST_CSR, 7u);
}

static void priority(uint32_t irq, uint32_t level) {
  uint32_t shift = 8u * (irq % 4u);
  uint32_t address = NVIC_IPR(irq / 4u);
  WR(address, (RD(address) & ~(0xFFu << shift)) | (level << (shift + 8u - kPriorityBits)));
  WR(NVIC_ISER(irq / 32u), BIT(irq % 32u));
}

/* Sampling above all; USB below it; the tick lowest (PM0214 4.4.8). */
static void enable_interrupts(void) {
  WR(SCB_SHPR3, 15u << (24u + 8u - kPriorityBits));
  priority(IRQ_ADC, 0);
  priority(IRQ_DMA2_STREAM0, 0);
  priority(IRQ_OTG_FS, 4);
}

/* A number that the last boot did not have: the chip's noise (24.3.1), else its id and what the RAM and clock
 * happened to hold. */
static uint32_t draw_boot_id(void) {
  uint32_t id = survived.boots * 0x9E3779B9u ^ RD(UNIQUE_ID) ^ RD(UNIQUE_ID + 8u) ^ RD(DWT_CYCCNT);
  SET(RCC_AHB2ENR, BIT(6));
  SET(RNG_CR, BIT(2));
  for (uint32_t draw = 0; draw < 2; ++draw) { /* the first is not to be used */
    if (wait_for(RNG_SR, BIT(0), BIT(0), kRngPolls)) id ^= RD(RNG_DR);
  }
  CLEAR(RNG_CR, BIT(2));
  return id;
}

static trw_identity identity(clock_fault fault) {
  trw_identity id = {
      .firmware = kFirmware, .tick_hz = TIMER_HZ, .variant = TRW_VARIANT_F405, .describe = GIT_DESCRIBE};
  id.boot_id = draw_boot_id();
  for (uint32_t i = 0; i < TRW_USB_UNIQUE_ID_SIZE; i += 4) trw_put32(id.unique_id + i, RD(UNIQUE_ID + i));
  id.reset_cause = (uint8_t)(RD(RCC_CSR) >> 24);
  SET(RCC_CSR, BIT(24));
  id.clock_fault = (uint32_t)fault;
  if (fault != CLOCK_GOOD) id.flags |= TRW_FLAG_CLOCK_FAULT;
  if (survived.magic == FAULT_RECORDED) {
    id.flags |= TRW_FLAG_FAULT_RECORD;
    id.fault_pc = survived.pc;
    id.fault_lr = survived.lr;
    id.fault_cfsr = survived.cfsr;
    id.fault_hfsr = survived.hfsr;
    id.fault_address = survived.address;
  }
  return id;
}

static void start_watchdog(void) {
  WR(IWDG_KR, 0x5555u); /* 21.3.2 */
  WR(IWDG_PR, 4u);      /* 32 kHz / 64 */
  WR(IWDG_RLR, kWatchdogReload);
  WR(IWDG_KR, 0xCCCCu);
}

/* --- main loop
 * -------------------------------------------------------------------------------------------------- */

/* Fed while the main loop turns and, where it should be sampling, frames come: a converter that has died is a
 * reset, too, and so is one that only ever starts anew. */
static void feed_watchdog(void) {
  static uint32_t frames_seen, seen_at_ms;
  uint32_t key = lock(NULL);
  uint32_t frames = board_frames_made(&instrument), now = milliseconds;
  uint32_t patience = 500u + 2000u * (instrument.rate.ticks_per_frame / (TIMER_HZ / 1000u)) / 1000u;
  bool running = instrument.running;
  unlock(NULL, key);
  if (!running || frames != frames_seen) seen_at_ms = now;
  frames_seen = frames;
  if (now - seen_at_ms < patience) WR(IWDG_KR, 0xAAAAu);
}

/* Off and on by the bits of a pattern, 125 ms each: blinking slowly: no host; lit: configured; quickly:
 * sampling; two short flashes: a fault was recorded; three: no USB, since the clock or the USB core did not
 * start. */
static void show_state(void) {
  uint32_t pattern = 0x0F0Fu;
  if (!usb_works) {
    pattern = 0x0015u;
  } else if (instrument.running) {
    pattern = 0x5555u;
  } else if (instrument.usb.configuration != 0) {
    pattern = 0xFFFFu;
  } else if ((instrument.identity.flags & TRW_FLAG_FAULT_RECORD) != 0) {
    pattern = 0x0005u;
  }
  bool lit = ((pattern >> ((milliseconds / 125u) % 16u)) & 1u) != 0;
  WR(GPIOC + GPIO_BSRR, lit ? BIT(kLed + 16) : BIT(kLed));
}

int main(void) {
  clock_fault fault = clock_start(CRYSTAL_HZ);
  start_timers(fault == CLOCK_GOOD ? (uint32_t)CPU_HZ : 16000000u);
  SET(RCC_AHB1ENR, BIT(2));
  SET(GPIOC + GPIO_MODER, BIT(2 * kLed));
  trw_identity id = identity(fault);
  survived.magic = 0;
  board_init(&instrument, &port, NULL, &otg_fs, NULL, &id, kHighestRate_hz, SAMPLING_SCAN_TICKS);
  sampling_init();
  enable_interrupts();
  usb_works = fault == CLOCK_GOOD && otg_fs_init(&instrument.usb);
  start_watchdog();
  for (;;) {
    board_poll(&instrument);
    feed_watchdog();
    show_state();
    if (loader_at_ms != 0 && (int32_t)(milliseconds - loader_at_ms) >= 0) reset_into_loader();
    __asm volatile("wfi");
  }
}
