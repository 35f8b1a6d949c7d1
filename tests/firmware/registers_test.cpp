// The drivers of board/ against a model of the registers: the order of the writes that the reference manual
// (RM0090) asks for, the values, and every way in which a bounded wait can run out.
#include "firmware/register_model.h"
#include "simulated/board.h"

#include <array>

#include <gtest/gtest.h>

extern "C" {
#include "clock.h"
#include "otg_fs.h"
#include "sampling.h"
#include "stm32f405.h"
}

namespace tunnelrig {
namespace {

using test::OtgHost;
using test::RegisterModel;

TEST(Clock, ComesUpInTheManualsOrder) {
  for (const std::uint32_t crystal_hz : {8000000u, 12000000u}) {
    RegisterModel model;
    test::behave_well(model);
    ASSERT_EQ(clock_start(crystal_hz), CLOCK_GOOD);
    const int power = model.first_with(RCC_APB1ENR, BIT(28)), scale = model.first_with(PWR_CR, BIT(14)),
              crystal = model.first_with(RCC_CR, BIT(16)), flash = model.first_with(FLASH_ACR, 5),
              pll = model.first_with(RCC_PLLCFGR, BIT(22)), pll_on = model.first_with(RCC_CR, BIT(24)),
              change = model.first_with(RCC_CFGR, 2);
    EXPECT_LT(power, scale);
    EXPECT_LT(scale, pll_on) << "5.1.4: VOS only while the PLL is off";
    EXPECT_LT(crystal, pll_on);
    EXPECT_LT(pll, pll_on) << "7.3.2: PLLCFGR only while the PLL is off";
    EXPECT_LT(flash, change) << "3.5.1: wait states before the clock rises";
    EXPECT_LT(pll_on, change);
    const std::uint32_t word = model.values[RCC_PLLCFGR];
    const double vco_hz = static_cast<double>(crystal_hz) / (word & 63u) * ((word >> 6) & 511u);
    EXPECT_EQ(vco_hz / (2 * (((word >> 16) & 3u) + 1)), 168e6);
    EXPECT_EQ(vco_hz / ((word >> 24) & 15u), 48e6) << "USB";
    EXPECT_EQ(crystal_hz / (word & 63u), 1000000u) << "PLL input of 1 to 2 MHz";
    EXPECT_EQ((model.values[RCC_CFGR] >> 10) & 7u, 5u) << "APB1 = 42 MHz";
    EXPECT_EQ((model.values[RCC_CFGR] >> 13) & 7u, 4u) << "APB2 = 84 MHz";
  }
}

TEST(Clock, EveryStepThatDoesNotComeIsNamed) {
  const auto with = [](std::uint32_t address, std::function<std::uint32_t(std::uint32_t)> answer) {
    RegisterModel model;
    test::behave_well(model);
    model.on_read[address] = std::move(answer);
    const clock_fault fault = clock_start(8000000);
    EXPECT_LT(model.reads, 1000000u) << "bounded";
    EXPECT_EQ(model.values[RCC_CFGR] & 3u, fault == CLOCK_NO_SWITCH ? 2u : 0u)
        << "stays on the internal oscillator";
    return fault;
  };
  EXPECT_EQ(with(RCC_CR, [](std::uint32_t v) { return v; }), CLOCK_NO_CRYSTAL);
  EXPECT_EQ(with(RCC_CR, [](std::uint32_t v) { return v | BIT(17); }), CLOCK_NO_PLL);
  EXPECT_EQ(with(RCC_CFGR, [](std::uint32_t v) { return v; }), CLOCK_NO_SWITCH);
  EXPECT_EQ(with(FLASH_ACR, [](std::uint32_t) { return 0u; }), CLOCK_NO_FLASH);
}

/// The OTG driver above the model, with the whole core on top.
class OtgFs : public testing::Test {
 protected:
  OtgFs() {
    test::behave_well(model);
    const board_port port = {.start_sampling = [](void*, std::uint32_t, std::uint32_t) {},
                             .stop_sampling = [](void*) {},
                             .ticks = [](void*) -> std::uint64_t { return 0; },
                             .lock = [](void*) -> std::uint32_t { return 0; },
                             .unlock = [](void*, std::uint32_t) {},
                             .set_amplifier = nullptr,
                             .reboot_to_loader = [](void*) {}};
    port_ = port;
    trw_identity identity{};
    identity.tick_hz = 84000000;
    board_init(&core, &port_, nullptr, &otg_fs, nullptr, &identity, 10000, SAMPLING_SCAN_TICKS);
  }
  std::vector<std::uint8_t> control_in(const std::vector<std::uint8_t>& packet) {
    host->setup(packet);
    std::vector<std::uint8_t> all, part;
    do {
      part = host->in(0);
      all.insert(all.end(), part.begin(), part.end());
    } while (part.size() == 64 && all.size() < packet[6] + 256u * packet[7]);
    host->out({});
    return all;
  }
  void control_out(const std::vector<std::uint8_t>& packet) {
    host->setup(packet);
    EXPECT_TRUE(host->in(0).empty());
  }
  void start() {
    ASSERT_TRUE(otg_fs_init(&core.usb));
    host.emplace(model);
    host->bus_reset();
    host->enumeration_done();
  }

  RegisterModel model;
  rig_board core{};
  board_port port_{};
  std::optional<OtgHost> host;
};

TEST_F(OtgFs, StartsInTheManualsOrder) {
  ASSERT_TRUE(otg_fs_init(&core.usb));
  const int clock = model.first_with(RCC_AHB2ENR, BIT(7)), phy = model.first_with(OTG_GUSBCFG, BIT(6)),
            reset = model.first_with(OTG_GRSTCTL, BIT(0)), power = model.first_with(OTG_GCCFG, BIT(16)),
            device = model.first_with(OTG_GUSBCFG, BIT(30)), off = model.first_with(OTG_DCTL, BIT(1)),
            interrupts = model.first_with(OTG_GAHBCFG, BIT(0));
  EXPECT_GE(clock, 0);
  EXPECT_LT(clock, phy);
  EXPECT_LT(phy, reset);
  EXPECT_LT(reset, power);
  EXPECT_LT(power, device);
  EXPECT_LT(off, interrupts);
  EXPECT_EQ(model.writes.back().address, OTG_DCTL) << "connected last of all";
  EXPECT_EQ(model.values[OTG_DCTL] & BIT(1), 0u);
  EXPECT_NE(model.values[OTG_GCCFG] & BIT(21), 0u) << "NOVBUSSENS, the F405's way";
  EXPECT_EQ(model.values[OTG_DCFG] & 3u, 3u) << "full speed";
  EXPECT_EQ((model.values[GPIOA + GPIO_AFRH] >> 12) & 0xFFu, 0xAAu) << "PA11, PA12: alternate function 10";
}

TEST_F(OtgFs, FifosFitTheirMemoryAndDoNotOverlap) {
  start();
  const std::uint32_t receive = model.values[OTG_GRXFSIZ], control = model.values[OTG_DIEPTXF0],
                      stream = model.values[OTG_DIEPTXF1];
  EXPECT_EQ(control & 0xFFFFu, receive);
  EXPECT_EQ(stream & 0xFFFFu, receive + (control >> 16));
  EXPECT_LE((stream & 0xFFFFu) + (stream >> 16), 320u) << "1.25 KiB";
  EXPECT_GE(control >> 16, 16u);
  EXPECT_GE(receive, 5u + 8u + (64u / 4 + 1) + 2u + 1u) << "34.11.1";
}

TEST_F(OtgFs, EveryWaitThatRunsOutIsReported) {
  const auto fails = [&](std::uint32_t address, std::function<std::uint32_t(std::uint32_t)> answer) {
    const auto before = model.on_read;
    model.on_read[address] = std::move(answer);
    EXPECT_FALSE(otg_fs_init(&core.usb));
    EXPECT_EQ(model.first_with(OTG_GAHBCFG, BIT(0)), -1);
    model.on_read = before;
    model.writes.clear();
  };
  fails(OTG_GRSTCTL, [](std::uint32_t) { return 0u; });                    // AHB never idle
  fails(OTG_GRSTCTL, [](std::uint32_t) { return 0x80000000u | BIT(0); });  // reset never ends
  fails(OTG_GINTSTS, [](std::uint32_t) { return BIT(0); });                // never a device
  fails(OTG_GRSTCTL, [](std::uint32_t) { return 0x80000000u | BIT(4); });  // flush never ends
}

TEST_F(OtgFs, AHostEnumeratesItAndReadsTheStream) {
  start();
  EXPECT_EQ(control_in({0x80, 6, 0, 1, 0, 0, 64, 0}).size(), 18u);
  control_out({0x00, 5, 9, 0, 0, 0, 0, 0});
  EXPECT_EQ((model.values[OTG_DCFG] >> 4) & 127u, 9u);
  EXPECT_EQ(control_in({0x80, 6, 0, 2, 0, 0, 255, 0}).size(), 25u);
  EXPECT_EQ(control_in({0xC0, TRW_USB_IDENTIFY, 0, 0, 0, 0, TRW_IDENTITY_SIZE, 0}).size(),
            std::size_t{TRW_IDENTITY_SIZE})
      << "in two packets";
  EXPECT_EQ(control_in({0xC0, TRW_USB_MS_OS, 0, 0, 7, 0, 162, 0}).size(), 162u);
  control_out({0x00, 9, 1, 0, 0, 0, 0, 0});
  EXPECT_NE(model.values[OTG_DIEPCTL(1)] & BIT(15), 0u) << "active";
  EXPECT_EQ((model.values[OTG_DIEPCTL(1)] >> 18) & 3u, 2u) << "bulk";
  EXPECT_EQ((model.values[OTG_DIEPCTL(1)] >> 22) & 15u, 1u) << "FIFO 1";
  control_out({0x40, TRW_USB_START, 0, 0, 0, 0, 0, 0});
  for (std::uint16_t i = 0; i < 200; ++i) {
    const std::array<std::uint16_t, 4> scans = {i, 1, 2, 3};
    board_on_scans(&core, scans.data());
  }
  board_poll(&core);
  const std::vector<std::uint8_t> bytes = host->in(1);
  trw_header header{};
  ASSERT_EQ(trw_parse(bytes.data(), bytes.size(), &header), TRW_OK) << "through FIFO words and back";
  EXPECT_EQ(header.first_sequence, 0u);
  EXPECT_EQ(header.frame_count, 64);
}

TEST_F(OtgFs, DataOutReachesTheCommand) {
  start();
  host->setup({0x40, TRW_USB_SET_RATE, 0, 0, 0, 0, TRW_RATE_WISH_SIZE, 0});
  std::vector<std::uint8_t> data(TRW_RATE_WISH_SIZE);
  const trw_rate_wish wish{1000, 1, 1};
  trw_put_rate_wish(data.data(), &wish);
  host->out(data);
  EXPECT_TRUE(host->in(0).empty());
  EXPECT_EQ(core.rate.ticks_per_frame, 84000u);
}

TEST_F(OtgFs, StallsAndIsSetUpAgain) {
  start();
  host->setup({0x80, 6, 0, 7, 0, 0, 64, 0});
  EXPECT_NE(model.values[OTG_DIEPCTL(0)] & BIT(21), 0u);
  EXPECT_NE(model.values[OTG_DOEPCTL(0)] & BIT(21), 0u);
  model.values[OTG_DIEPCTL(0)] &= ~BIT(21);  // the core's own doing at the next setup
  EXPECT_EQ(control_in({0x80, 6, 0, 1, 0, 0, 18, 0}).size(), 18u);
}

TEST_F(OtgFs, HaltTakesTheTransferBackAndItGoesOutAgain) {
  start();
  control_out({0x00, 9, 1, 0, 0, 0, 0, 0});
  control_out({0x40, TRW_USB_START, 0, 0, 0, 0, 0, 0});
  for (std::uint16_t i = 0; i < 64; ++i) {
    const std::array<std::uint16_t, 4> scans = {i, 1, 2, 3};
    board_on_scans(&core, scans.data());
  }
  board_poll(&core);
  ASSERT_TRUE(host->in_armed(1));
  control_out({0x02, 3, 0, 0, 0x81, 0, 0, 0});
  EXPECT_NE(model.values[OTG_DIEPCTL(1)] & BIT(21), 0u);
  EXPECT_FALSE(host->in_armed(1)) << "34.17.5: disabled, and its FIFO flushed";
  EXPECT_GE(model.last_with(OTG_GRSTCTL, BIT(5) | (1u << 6)), 0);
  control_out({0x02, 1, 0, 0, 0x81, 0, 0, 0});
  EXPECT_EQ(model.values[OTG_DIEPCTL(1)] & BIT(21), 0u);
  EXPECT_GE(model.last_with(OTG_DIEPCTL(1), BIT(28)), 0) << "DATA0";
  board_poll(&core);
  EXPECT_EQ(host->in(1).size(), trw_packet_size(64));
}

TEST_F(OtgFs, ResetAndSuspendReachTheCore) {
  start();
  control_out({0x00, 9, 1, 0, 0, 0, 0, 0});
  host->bus_reset();
  EXPECT_EQ(core.usb.configuration, 0);
  EXPECT_EQ((model.values[OTG_DCFG] >> 4) & 127u, 0u);
  model.values[OTG_GINTSTS] |= BIT(11);
  otg_fs_interrupt();
  EXPECT_TRUE(core.usb.suspended);
  model.values[OTG_GINTSTS] |= 0x80000000u;
  otg_fs_interrupt();
  EXPECT_FALSE(core.usb.suspended);
}

}  // namespace
}  // namespace tunnelrig
