// The sampling driver against a model of the registers, alone and with the core as the board's main file
// wires them: the order of the writes that the reference manual (RM0090) asks for, and what is a frame.
#include "firmware/register_model.h"
#include "rig_board.h"

#include <gtest/gtest.h>

extern "C" {
#include "otg_fs.h"
#include "sampling.h"
#include "stm32f405.h"
}

namespace tunnelrig {
namespace {

using test::RegisterModel;

TEST(Sampling, TimerConverterAndDmaAreSetUpInTheManualsOrder) {
  RegisterModel model;
  sampling_init();
  EXPECT_EQ(model.values[GPIOA + GPIO_MODER] & 0xFFu, 0xFFu) << "analogue inputs";
  EXPECT_EQ((model.values[ADC_SQR1] >> 20) + 1, 4u);
  EXPECT_EQ(model.values[ADC_SQR3], 0u | 1u << 5 | 2u << 10 | 3u << 15);
  sampling_start(63000, 1);
  const int dma_set = model.first_with(DMA2_S0CR, BIT(18)),
            dma_on = model.first_with(DMA2_S0CR, BIT(18) | BIT(0)),
            adc_on = model.first_with(ADC_CR2, BIT(0)), timer_on = model.first_with(TIM2 + TIM_CR1, BIT(0)),
            update = model.first_with(TIM2 + TIM_EGR, BIT(0));
  EXPECT_LT(model.first_with(DMA2_LIFCR, 0x3D), dma_on) << "10.3.17: flags cleared first";
  EXPECT_LT(dma_set, dma_on);
  EXPECT_LT(dma_on, adc_on) << "no request before the stream listens";
  EXPECT_LT(adc_on, timer_on);
  EXPECT_LT(update, adc_on) << "18.4.2: UG is a trigger";
  EXPECT_EQ((model.values[TIM2 + TIM_CR2] >> 4) & 7u, 2u) << "the update is the trigger output";
  EXPECT_EQ(model.values[TIM2 + TIM_ARR], 62999u);
  EXPECT_EQ(model.values[TIM2 + TIM_PSC], 0u);
  EXPECT_EQ(model.values[DMA2_S0NDTR], 4u);
  EXPECT_EQ(model.values[DMA2_S0PAR], ADC_DR);
  const std::uint32_t cr = model.values[DMA2_S0CR];
  EXPECT_EQ(cr >> 25, 0u) << "channel 0";
  EXPECT_EQ((cr >> 6) & 3u, 0u) << "peripheral to memory";
  EXPECT_EQ((cr >> 11) & 3u, 1u) << "16 bits";
  EXPECT_EQ((cr >> 13) & 3u, 1u) << "16 bits";
  EXPECT_NE(cr & BIT(10), 0u) << "memory counts up";
  EXPECT_NE(cr & BIT(4), 0u) << "interrupt on completion";
  const std::uint32_t adc = model.values[ADC_CR2];
  EXPECT_EQ((adc >> 24) & 15u, 6u) << "table 69: TIM2_TRGO";
  EXPECT_EQ((adc >> 28) & 3u, 1u) << "rising edge";
  EXPECT_EQ(adc & (BIT(8) | BIT(9)), BIT(8) | BIT(9)) << "DMA, and for ever";
  EXPECT_NE(model.values[ADC_CR1] & BIT(8), 0u) << "scan";
  EXPECT_NE(model.values[ADC_CR1] & BIT(26), 0u) << "interrupt on overrun";
  sampling_stop();
  sampling_start(63000 / 8, 8);
  EXPECT_EQ(model.values[DMA2_S0NDTR], 32u);
  sampling_stop();
  EXPECT_EQ(model.values[TIM2 + TIM_CR1], 0u);
  EXPECT_EQ(model.values[ADC_CR2], 0u);
  EXPECT_EQ(model.values[DMA2_S0CR] & BIT(0), 0u);
}

TEST(Sampling, BuffersComeInTurnAndErrorsStartAnew) {
  RegisterModel model;
  sampling_init();
  sampling_start(63000, 1);
  const uint16_t *first = nullptr, *second = nullptr, *third = nullptr;
  EXPECT_EQ(sampling_take(&first), SAMPLING_NOTHING) << "an interrupt without a frame";
  model.values[DMA2_LISR] = BIT(5);
  SET(DMA2_S0CR, BIT(19));  // the hardware has gone on to buffer 1
  ASSERT_EQ(sampling_take(&first), SAMPLING_FRAME);
  EXPECT_EQ(model.writes.back(), (RegisterModel::Write{DMA2_LIFCR, BIT(5)}));
  CLEAR(DMA2_S0CR, BIT(19));
  ASSERT_EQ(sampling_take(&second), SAMPLING_FRAME);
  EXPECT_NE(first, second);
  CLEAR(DMA2_S0CR, BIT(19));  // and again the same: one was overwritten before anybody came
  EXPECT_EQ(sampling_take(&third), SAMPLING_ERROR);
  for (const std::uint32_t error : {BIT(2), BIT(3)}) {
    model.values[DMA2_LISR] = error;
    model.writes.clear();
    EXPECT_EQ(sampling_take(&third), SAMPLING_ERROR);
    EXPECT_LT(model.first_with(DMA2_S0CR, BIT(0) | BIT(18)), model.last_with(ADC_CR2, BIT(0)));
    EXPECT_EQ(model.last_with(TIM2 + TIM_CR1, 0), -1) << "the timer runs on: time is not lost";
  }
  model.values[DMA2_LISR] = BIT(0);
  model.writes.clear();
  EXPECT_EQ(sampling_take(&third), SAMPLING_NOTHING) << "10.3.18: in direct mode no data are lost";
  EXPECT_EQ(model.writes, (std::vector<RegisterModel::Write>{{DMA2_LIFCR, BIT(0)}}))
      << "cleared, and no more";
  model.values[DMA2_LISR] = 0;
  model.values[ADC_SR] = BIT(5);
  EXPECT_EQ(sampling_take(&third), SAMPLING_ERROR);
  EXPECT_EQ(model.values[ADC_SR], 0u) << "13.8.1: OVR cleared";
}

TEST(Sampling, AStreamThatDoesNotStopIsNotWaitedForForEver) {
  RegisterModel model;
  model.on_read[DMA2_S0CR] = [](std::uint32_t v) { return v | BIT(0); };
  sampling_init();
  sampling_start(63000, 1);
  sampling_stop();
  EXPECT_LT(model.reads, 100000u);
  EXPECT_EQ(model.first_with(ADC_CR2, BIT(0)), -1) << "a converter without its stream would only overrun";
}

/// Sampling driver and core together, as the board's main file wires them.
class SamplingRuns : public testing::Test {
 protected:
  SamplingRuns() {
    port_ = {.start_sampling = [](void*, std::uint32_t ticks,
                                  std::uint32_t scans) { sampling_start(ticks, scans); },
             .stop_sampling = [](void*) { sampling_stop(); },
             .ticks = [](void* self) { return static_cast<SamplingRuns*>(self)->now_ticks; },
             .lock = [](void*) -> std::uint32_t { return 0; },
             .unlock = [](void*, std::uint32_t) {},
             .set_amplifier = nullptr,
             .reboot_to_loader = [](void*) {}};
    trw_identity identity{};
    identity.tick_hz = 84000000;
    board_init(&core, &port_, this, &otg_fs, nullptr, &identity, 10000, SAMPLING_SCAN_TICKS);
    sampling_init();
  }
  void on_sampling() {
    ++interrupts;
    const std::uint16_t* scans = nullptr;
    const sampling_result result = sampling_take(&scans);
    if (result == SAMPLING_FRAME) board_on_scans(&core, scans);
    if (result == SAMPLING_ERROR) board_on_adc_error(&core, board_frames_missed(&core, now_ticks));
  }
  void pass(std::uint32_t scans) {
    for (; scans > 0; --scans) {
      now_ticks += core.rate.ticks_per_frame / core.rate.oversampling;
      hardware.scan_is_due();
    }
  }
  bool stream_on() { return (model.values[DMA2_S0CR] & BIT(0)) != 0; }
  bool converter_on() { return (model.values[ADC_CR2] & BIT(0)) != 0; }

  RegisterModel model;
  test::SamplingHardware hardware{model, [this] { on_sampling(); }};
  rig_board core{};
  board_port port_{};
  int interrupts = 0;
  std::uint64_t now_ticks = 1000;
};

TEST_F(SamplingRuns, AFrameComesWhenItsTimeHasPassedAndNotAtTheStart) {
  for (const std::uint32_t oversampling : {1u, 8u}) {
    const trw_rate_wish wish{4000, 3, oversampling};
    ASSERT_TRUE(board_set_rate(&core, &wish));
    for (int run = 0; run < 2; ++run) {
      const std::uint32_t before = core.ring.head;
      const std::uint64_t sequence = core.sequence;
      board_start(&core, false);
      EXPECT_EQ(core.ring.head, before) << "the timer's first update has not come yet";
      pass(3 * oversampling - 1);
      EXPECT_EQ(core.ring.head, before + 2);
      pass(1);
      EXPECT_EQ(core.ring.head, before + 3);
      // The converter is deaf for the time of two frames: both are counted.
      now_ticks += 2 * core.rate.ticks_per_frame;
      hardware.overrun();
      EXPECT_EQ(core.sequence, sequence + 5);
      board_stop(&core);
    }
  }
}

TEST_F(SamplingRuns, AStopIsNoFrameAndNoError) {
  for (std::uint32_t run = 0; run < 3; ++run) {
    board_start(&core, false);
    EXPECT_TRUE(stream_on() && converter_on());
    const std::uint32_t first = core.ring.head;
    for (std::uint32_t frame = 0; frame <= run; ++frame) hardware.fill_buffer();  // odd and even ones
    ASSERT_EQ(core.ring.head, first + run + 1);
    EXPECT_EQ(core.slots[first].frame.status & TRW_STATUS_ADC_ERROR, 0) << "run " << run;
    interrupts = 0;
    board_stop(&core);
    EXPECT_FALSE(stream_on()) << "run " << run;
    EXPECT_FALSE(converter_on()) << "run " << run;
    EXPECT_EQ(interrupts, 0) << "clearing EN sets TCIF, which nobody is to be told of";
    EXPECT_EQ(core.adc_errors, 0u);
    EXPECT_EQ(core.ring.head, first + run + 1);
  }
}

TEST_F(SamplingRuns, AnInterruptThatComesIntoAStopIsEndedAndIgnored) {
  for (const bool overrun : {false, true}) {
    board_start(&core, false);
    const std::uint32_t frames = core.ring.head;
    // The timer is off, but the last scan is not yet over.
    model.on_write[TIM2 + TIM_CR1] = [&](std::uint32_t) {
      overrun ? hardware.overrun() : hardware.fill_buffer();
    };
    board_stop(&core);
    model.on_write.erase(TIM2 + TIM_CR1);
    EXPECT_EQ(core.ring.head, frames);
    EXPECT_FALSE(stream_on() || converter_on());
    EXPECT_EQ(core.adc_errors, 0u);
  }
  EXPECT_EQ(interrupts, 2);
}

TEST_F(SamplingRuns, AnErrorStartsBothAnewWithOneInterrupt) {
  board_start(&core, false);
  hardware.fill_buffer();
  hardware.overrun();
  EXPECT_TRUE(stream_on() && converter_on());
  EXPECT_EQ(interrupts, 2) << "the stream's being stopped is no interrupt of its own";
  EXPECT_EQ(core.adc_errors, 1u);
  model.values[DMA2_S0CR] &= ~BIT(19);
  hardware.fill_buffer();
  EXPECT_EQ(core.ring.head, 2u);
  EXPECT_EQ(core.slots[1].frame.status & TRW_STATUS_ADC_ERROR, TRW_STATUS_ADC_ERROR);
}

TEST_F(SamplingRuns, AConverterThatOnlyErrsMakesNoFrames) {
  board_start(&core, false);
  pass(2);
  EXPECT_EQ(board_frames_made(&core), 2u);
  for (int i = 0; i < 3; ++i) {
    now_ticks += core.rate.ticks_per_frame;
    hardware.overrun();
  }
  EXPECT_EQ(core.sequence, 5u);
  EXPECT_EQ(board_frames_made(&core), 2u) << "by which the watchdog is fed";
  pass(BOARD_RING_FRAMES);
  EXPECT_EQ(board_frames_made(&core), 2u + BOARD_RING_FRAMES) << "those that found the ring full as well";
}

TEST_F(SamplingRuns, WhatOneRunLeftPendingIsNotTheNextOnes) {
  board_start(&core, false);
  hardware.overrun();
  board_stop(&core);
  board_start(&core, false);
  hardware.fill_buffer();
  EXPECT_EQ(core.slots[0].frame.status & TRW_STATUS_ADC_ERROR, 0);
}

}  // namespace
}  // namespace tunnelrig
