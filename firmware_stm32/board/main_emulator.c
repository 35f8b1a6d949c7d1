/* The same core in an emulator that has no converter, no working timer interrupt and no USB: the sample clock
 * is SysTick, the converter a formula, and the stream goes out on USART1. */
#include "rig_board.h"
#include "startup.h"
#include "stm32f405.h"

enum { kCpu_hz = 168000000, kTransmitPolls = 100000, kSamples = 4096, kStep = 7, kChannelOffset = 1000 };

static rig_board instrument;
static uint64_t device_ticks;

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

static uint64_t ticks(void* context) {
  (void)context;
  return device_ticks;
}

static void start(void* context, uint32_t ticks_per_scan, uint32_t scans_per_frame) {
  (void)context;
  (void)scans_per_frame;
  WR(SYST_RVR, ticks_per_scan - 1u);
  WR(SYST_CVR, 0);
  WR(SYST_CSR, 7u);
}

static void stop(void* context) {
  (void)context;
  WR(SYST_CSR, 0);
}

static void no_loader(void* context) { (void)context; }

static const board_port port = {start, stop, ticks, lock, unlock, NULL, no_loader};

/* There is no USB: a controller that does nothing. */
static void ignore_byte(void* context, uint8_t value) {
  (void)context;
  (void)value;
}
static void ignore_open(void* context, uint8_t endpoint, uint16_t size) {
  (void)context;
  (void)endpoint;
  (void)size;
}
static void ignore_send(void* context, uint8_t endpoint, const uint8_t* data, uint16_t size) {
  (void)context;
  (void)endpoint;
  (void)data;
  (void)size;
}
static void ignore_receive(void* context, uint8_t* data, uint16_t size) {
  (void)context;
  (void)data;
  (void)size;
}
static const usb_controller no_usb = {ignore_byte,    ignore_open, ignore_byte, ignore_send,
                                      ignore_receive, ignore_byte, ignore_byte};

/* The sample clock, and the synthetic converter: what tests/simulated/board.h calls sample_of. */
void on_tick(void) {
  device_ticks += instrument.rate.ticks_per_frame;
  uint16_t scans[TRW_CHANNELS];
  for (uint32_t c = 0; c < TRW_CHANNELS; ++c) {
    scans[c] = (uint16_t)((instrument.sequence * kStep + c * kChannelOffset) % kSamples);
  }
  board_on_scans(&instrument, scans);
}

void on_sampling(void) {}
void on_usb(void) {}

static void transmit(const uint8_t* data, uint32_t size) {
  for (uint32_t i = 0; i < size; ++i) {
    (void)wait_for(USART1_SR, BIT(7), BIT(7), kTransmitPolls);
    WR(USART1_DR, data[i]);
  }
}

int main(void) {
  WR(USART1_BRR, 84000000u / 921600u);
  WR(USART1_CR1, BIT(13) | BIT(3) | BIT(2));
  const trw_identity id = {
      .firmware = 0x0100, .boot_id = 0x454D5531u, .tick_hz = kCpu_hz, .variant = TRW_VARIANT_EMULATOR};
  board_init(&instrument, &port, NULL, &no_usb, NULL, &id, 10000, 0);
  board_start(&instrument, false);
  static uint8_t packet[TRW_MAX_PACKET];
  for (;;) {
    uint16_t size = board_next_packet(&instrument, packet);
    if (size > 0) {
      transmit(packet, size);
    } else {
      __asm volatile("wfi");
    }
  }
}
