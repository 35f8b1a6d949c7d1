#include "sampling.h"

#include "stm32f405.h"

#include <stddef.h>

enum {
  kPolls = 10000,
  kSampleTime = 4,  /* 84 cycles of 21 MHz, 4 us: enough for a pin with 33 nF behind 1 kOhm */
  kTriggerTim2 = 6, /* table 69: TIM2_TRGO */
  /* Direct mode and transfer error of stream 0. Not the FIFO's: in direct mode it tells of a memory bus that
   * was busy, the stream stays on and no data are lost (10.3.18); what is lost is the converter's overrun. */
  kErrors = BIT(2) | BIT(3),
  kComplete = BIT(5),
  kInterrupts = BIT(4) | BIT(2) | BIT(1), /* of DMA2_S0CR: completion, transfer and direct mode error */
  kOverrun = BIT(5),                      /* of ADC_SR */
  kOverrunInterrupt = BIT(26),            /* of ADC_CR1 */
  kAllFlags = 0x3D
};

static uint16_t buffers[2][SAMPLING_MOST_SCANS * SAMPLING_CHANNELS];
static uint32_t conversions, next_buffer;
static volatile bool sampling; /* between start and stop: a stop is pre-empted by the sampling interrupt */

void sampling_init(void) {
  SET(RCC_AHB1ENR, BIT(0) | BIT(22));
  SET(RCC_APB1ENR, BIT(0));
  SET(RCC_APB2ENR, BIT(8));
  SET(GPIOA + GPIO_MODER, 0xFFu); /* PA0 to PA3 analogue (8.4.1) */
  WR(ADC_CCR, BIT(16));           /* 84 MHz / 4 = 21 MHz; at most 36 (data sheet, table 67) */
  WR(ADC_SMPR2, kSampleTime | (kSampleTime << 3) | (kSampleTime << 6) | (kSampleTime << 9));
  WR(ADC_SQR1, (SAMPLING_CHANNELS - 1u) << 20);
  WR(ADC_SQR3, /* channel 0 first, then */ (1u << 5) | (2u << 10) | (3u << 15));
  WR(TIM2 + TIM_CR2, 2u << 4); /* the update is the trigger output */
}

static void forget_interrupt(uint32_t irq) { WR(NVIC_ICPR(irq / 32u), BIT(irq % 32u)); }

/* 10.3.17: the stream off and seen to be off, only then the converter. Clearing EN sets TCIF (AN4031),
 * which is no frame: the interrupt enables go with it, and so does what is pending. */
static bool halt(void) {
  CLEAR(ADC_CR1, kOverrunInterrupt);
  CLEAR(DMA2_S0CR, BIT(0) | kInterrupts);
  bool off = wait_for(DMA2_S0CR, BIT(0), 0, kPolls);
  WR(ADC_CR2, 0);
  WR(ADC_SR, 0);
  WR(DMA2_LIFCR, kAllFlags);
  forget_interrupt(IRQ_DMA2_STREAM0);
  forget_interrupt(IRQ_ADC);
  return off;
}

/* 10.3.17: a stream that is off, and whose flags are cleared, is configured, then on. */
static void start_dma(void) {
  WR(DMA2_S0PAR, ADC_DR);
  WR(DMA2_S0M0AR, (uint32_t)(uintptr_t)buffers[0]);
  WR(DMA2_S0M1AR, (uint32_t)(uintptr_t)buffers[1]);
  WR(DMA2_S0NDTR, conversions);
  WR(DMA2_S0FCR, 0); /* direct mode */
  /* channel 0, very high priority, double buffer, 16 bits to 16 bits, memory counts up, circular */
  WR(DMA2_S0CR, BIT(18) | (3u << 16) | BIT(13) | BIT(11) | BIT(10) | BIT(8) | kInterrupts);
  next_buffer = 0;
  SET(DMA2_S0CR, BIT(0));
}

/* 13.3.1 and 13.8.1: DMA with every conversion for ever (DDS), rising edge of TIM2_TRGO. */
static void start_adc(void) {
  /* An overrun stops the DMA, so that only this interrupt tells of it. */
  WR(ADC_CR1, BIT(8) | kOverrunInterrupt);
  WR(ADC_CR2, BIT(0) | BIT(8) | BIT(9) | ((uint32_t)kTriggerTim2 << 24) | BIT(28));
}

/* Where the stream does not stop no frame comes, and the watchdog has the last word. */
static void start_anew(void) {
  if (!halt()) return;
  start_dma();
  start_adc();
}

void sampling_start(uint32_t ticks_per_scan, uint32_t scans_per_frame) {
  conversions = scans_per_frame * SAMPLING_CHANNELS;
  WR(TIM2 + TIM_PSC, 0);
  WR(TIM2 + TIM_ARR, ticks_per_scan - 1u);
  WR(TIM2 + TIM_CNT, 0);
  /* Loads the prescaler. It is a trigger whatever the trigger output is (18.4.2, MMS 000: UG; 010: the update
   * that UG makes), so that the converter must not listen yet: it would scan at once, a frame too many. */
  WR(TIM2 + TIM_EGR, BIT(0));
  start_anew();
  sampling = true;
  WR(TIM2 + TIM_CR1, BIT(0));
}

void sampling_stop(void) {
  sampling = false;
  WR(TIM2 + TIM_CR1, 0);
  (void)halt();
}

sampling_result sampling_take(const uint16_t** scans) {
  uint32_t flags = RD(DMA2_LISR) & kAllFlags;
  WR(DMA2_LIFCR, flags);
  if (!sampling) { /* it came while the stop was under way: ended here, or it would come again and again */
    WR(ADC_SR, 0);
    return SAMPLING_NOTHING;
  }
  if ((flags & kErrors) != 0 || (RD(ADC_SR) & kOverrun) != 0) {
    start_anew(); /* 13.8.1: after an overrun the order of the channels is lost; the timer runs on */
    return SAMPLING_ERROR;
  }
  if ((flags & kComplete) == 0) return SAMPLING_NOTHING;
  /* CT names the buffer that is being filled now: ours is the other one, and another one than last time. */
  uint32_t buffer = (RD(DMA2_S0CR) & BIT(19)) != 0 ? 0u : 1u;
  if (buffer != next_buffer) {
    start_anew();
    return SAMPLING_ERROR;
  }
  next_buffer ^= 1u;
  *scans = buffers[buffer];
  return SAMPLING_FRAME;
}
