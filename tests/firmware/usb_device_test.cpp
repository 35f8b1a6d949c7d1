// Every request of USB 2.0, chapter 9, as a host makes it, well and badly.
#include "simulated/board.h"
#include "support/seeds.h"

#include <array>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using simulated::Board;
using simulated::kHang;
using simulated::kNak;
using simulated::kStall;

constexpr std::uint8_t kDeviceIn = 0x80, kDeviceOut = 0x00, kInterfaceIn = 0x81, kInterfaceOut = 0x01,
                       kEndpointIn = 0x82, kEndpointOut = 0x02, kVendorIn = 0xC0, kVendorOut = 0x40;

class UsbDevice : public testing::Test {
 protected:
  int in(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
         std::uint16_t length) {
    return board.control(type, request, value, index, length, data.data());
  }
  int out(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index) {
    return board.control(type, request, value, index, 0, nullptr);
  }
  int descriptor(std::uint8_t type, std::uint8_t number, std::uint16_t length = 1024) {
    return in(kDeviceIn, 6, static_cast<std::uint16_t>(type << 8 | number),
              type == 3 && number > 0 ? 0x0409 : 0, length);
  }
  std::string text(std::uint8_t number) {
    const int size = descriptor(3, number);
    std::string ascii;
    for (int i = 2; i + 1 < size; i += 2) ascii += static_cast<char>(data[static_cast<std::size_t>(i)]);
    return ascii;
  }

  Board board;
  std::array<std::uint8_t, 2048> data{};
};

TEST_F(UsbDevice, DescribesItself) {
  ASSERT_EQ(descriptor(1, 0), 18);
  EXPECT_EQ(data[0], 18);
  EXPECT_EQ(trw_get16(&data[2]), 0x0201) << "2.1: hosts then ask for the BOS descriptor";
  EXPECT_EQ(data[7], 64);
  EXPECT_EQ(trw_get16(&data[8]), TRW_USB_VENDOR);
  EXPECT_EQ(trw_get16(&data[10]), TRW_USB_PRODUCT);
  EXPECT_EQ(data[17], 1) << "configurations";
  EXPECT_EQ(descriptor(1, 0, 8), 8) << "the first request of every host";
  EXPECT_EQ(descriptor(1, 1), kStall);
  EXPECT_EQ(descriptor(6, 0), kStall) << "a full-speed device has no qualifier";
  EXPECT_EQ(descriptor(7, 0), kStall);
  EXPECT_EQ(in(kInterfaceIn, 6, 0x2200, 0, 64), kStall);
}

TEST_F(UsbDevice, ConfigurationIsWhole) {
  const int size = descriptor(2, 0);
  ASSERT_EQ(size, 25);
  EXPECT_EQ(trw_get16(&data[2]), size);
  EXPECT_EQ(data[4], 1);
  int interfaces = 0, endpoints = 0;
  for (int at = 0; at < size; at += data[static_cast<std::size_t>(at)]) {
    ASSERT_GT(data[static_cast<std::size_t>(at)], 0);
    const std::uint8_t* d = &data[static_cast<std::size_t>(at)];
    if (d[1] == 4) {
      ++interfaces;
      EXPECT_EQ(d[4], 1) << "endpoints";
      EXPECT_EQ(d[5], 0xFF) << "vendor class";
    }
    if (d[1] == 5) {
      ++endpoints;
      EXPECT_EQ(d[2], 0x81);
      EXPECT_EQ(d[3], 2) << "bulk";
      EXPECT_EQ(trw_get16(d + 4), 64);
    }
  }
  EXPECT_EQ(interfaces, 1);
  EXPECT_EQ(endpoints, 1);
  EXPECT_EQ(descriptor(2, 0, 9), 9);
}

TEST_F(UsbDevice, StringsNameMakerProductAndUniqueId) {
  ASSERT_EQ(descriptor(3, 0), 4);
  EXPECT_EQ(trw_get16(&data[2]), 0x0409);
  EXPECT_EQ(text(1), "tunnelrig");
  EXPECT_EQ(text(2), "tunnelrig load-cell board");
  EXPECT_EQ(text(3), "5A5B5C5D5E5F606162636465");
  EXPECT_EQ(descriptor(3, 4), kStall);
  EXPECT_EQ(in(kDeviceIn, 6, 0x0301, 0x0407, 64), kStall) << "no German strings";
}

TEST_F(UsbDevice, WindowsFindsWinUsb) {
  ASSERT_EQ(descriptor(15, 0), 33);
  EXPECT_EQ(trw_get16(&data[2]), 33);
  EXPECT_EQ(data[4], 1);
  EXPECT_EQ(data[5], 28);
  EXPECT_EQ(data[7], 5) << "platform capability";
  const std::uint16_t total = trw_get16(&data[5 + 24]);
  const std::uint8_t request = data[5 + 26];
  ASSERT_EQ(in(kVendorIn, request, 0, 7, total), total);
  EXPECT_EQ(trw_get16(&data[0]), 10);
  EXPECT_EQ(trw_get16(&data[8]), total);
  int at = 10;
  bool winusb = false, guid = false;
  while (at < total) {
    const std::uint8_t* d = &data[static_cast<std::size_t>(at)];
    const std::uint16_t length = trw_get16(d), type = trw_get16(d + 2);
    ASSERT_GT(length, 4);
    if (type == 3) winusb = std::string(reinterpret_cast<const char*>(d + 4)) == "WINUSB";
    if (type == 4) {
      guid = true;
      const std::uint16_t name = trw_get16(d + 6), value = trw_get16(d + 8 + name);
      EXPECT_EQ(8 + name + 2 + value, length);
      EXPECT_EQ(d[10 + name], '{');
    }
    at += length;
  }
  EXPECT_EQ(at, total);
  EXPECT_TRUE(winusb);
  EXPECT_TRUE(guid);
  EXPECT_EQ(in(kVendorIn, request, 0, 5, 64), kStall) << "an index that is not served";
}

TEST_F(UsbDevice, AddressAndConfigurationFollowTheStates) {
  EXPECT_EQ(in(kDeviceIn, 8, 0, 0, 1), 1);
  EXPECT_EQ(data[0], 0);
  EXPECT_EQ(out(kDeviceOut, 5, 42, 0), 0);
  EXPECT_EQ(board.controller.address(), 42);
  EXPECT_EQ(out(kDeviceOut, 5, 128, 0), kStall);
  EXPECT_EQ(out(kDeviceOut, 9, 2, 0), kStall) << "there is no second configuration";
  EXPECT_FALSE(board.controller.stream_open());
  EXPECT_EQ(out(kDeviceOut, 9, 1, 0), 0);
  EXPECT_TRUE(board.controller.stream_open());
  EXPECT_EQ(in(kDeviceIn, 8, 0, 0, 1), 1);
  EXPECT_EQ(data[0], 1);
  EXPECT_EQ(out(kDeviceOut, 5, 3, 0), kStall) << "not when configured";
  EXPECT_EQ(out(kDeviceOut, 9, 0, 0), 0);
  EXPECT_FALSE(board.controller.stream_open());
  board.enumerate();
  board.controller.reset();
  EXPECT_EQ(board.controller.address(), 0);
  EXPECT_EQ(board.core.usb.configuration, 0);
}

TEST_F(UsbDevice, InterfaceHasOneSetting) {
  EXPECT_EQ(in(kInterfaceIn, 10, 0, 0, 1), kStall) << "before it is configured";
  EXPECT_EQ(out(kInterfaceOut, 11, 0, 0), kStall);
  board.enumerate();
  EXPECT_EQ(in(kInterfaceIn, 10, 0, 0, 1), 1);
  EXPECT_EQ(data[0], 0);
  EXPECT_EQ(out(kInterfaceOut, 11, 0, 0), 0);
  EXPECT_EQ(out(kInterfaceOut, 11, 1, 0), kStall);
  EXPECT_EQ(in(kInterfaceIn, 10, 0, 1, 1), kStall);
}

TEST_F(UsbDevice, StatusAndFeatures) {
  EXPECT_EQ(in(kDeviceIn, 0, 0, 0, 2), 2);
  EXPECT_EQ(trw_get16(data.data()), 0) << "bus-powered, no remote wake-up";
  EXPECT_EQ(in(kEndpointIn, 0, 0, 0x81, 2), kStall) << "before it is configured";
  EXPECT_EQ(in(kEndpointIn, 0, 0, 0x80, 2), 2);
  board.enumerate();
  EXPECT_EQ(in(kInterfaceIn, 0, 0, 0, 2), 2);
  EXPECT_EQ(in(kInterfaceIn, 0, 0, 1, 2), kStall);
  EXPECT_EQ(out(kEndpointOut, 3, 0, 0x81), 0);
  EXPECT_EQ(in(kEndpointIn, 0, 0, 0x81, 2), 2);
  EXPECT_EQ(data[0], 1);
  EXPECT_EQ(board.controller.in_packet(data.data(), 64), kStall);
  EXPECT_EQ(out(kEndpointOut, 1, 0, 0x81), 0);
  EXPECT_EQ(in(kEndpointIn, 0, 0, 0x81, 2), 2);
  EXPECT_EQ(data[0], 0);
  EXPECT_EQ(board.controller.in_packet(data.data(), 64), kNak);
  EXPECT_EQ(out(kEndpointOut, 1, 0, 0x00), 0) << "endpoint 0 never halts, so to clear it is granted";
  EXPECT_EQ(out(kEndpointOut, 3, 0, 0x02), kStall) << "no such endpoint";
  EXPECT_EQ(out(kDeviceOut, 3, 1, 0), kStall) << "remote wake-up";
  EXPECT_EQ(out(kDeviceOut, 3, 2, 0x0100), kStall) << "test modes are for high speed";
}

TEST_F(UsbDevice, WhatIsNotThereIsStalledAndTheNextRequestIsServed) {
  board.enumerate();
  const std::uint32_t before = board.core.usb.stalls;
  EXPECT_EQ(board.control(kDeviceOut, 7, 0x0100, 0, 18, data.data()), kStall) << "SET_DESCRIPTOR";
  EXPECT_EQ(in(kEndpointIn, 12, 0, 0x81, 2), kStall) << "SYNCH_FRAME";
  EXPECT_EQ(in(0xA1, 0x21, 0, 0, 7), kStall) << "class requests";
  EXPECT_EQ(in(0xE0, 1, 0, 0, 7), kStall) << "reserved type";
  EXPECT_EQ(in(kDeviceIn, 2, 0, 0, 2), kStall) << "reserved request";
  EXPECT_EQ(board.core.usb.stalls, before + 5);
  EXPECT_EQ(descriptor(1, 0), 18);
}

TEST_F(UsbDevice, ASetupCutsOffWhatWasUnderWay) {
  const std::uint8_t wanted[8] = {kDeviceIn, 6, 0, 2, 0, 0, 25, 0};
  board.controller.setup_only(wanted);
  EXPECT_EQ(descriptor(1, 0), 18);
  const std::uint8_t sent[8] = {kVendorOut, TRW_USB_SET_RATE, 0, 0, 0, 0, TRW_RATE_WISH_SIZE, 0};
  board.controller.setup_only(sent);
  EXPECT_EQ(descriptor(1, 0), 18);
}

TEST_F(UsbDevice, AnAnswerThatEndsOnAFullPacketIsEndedByAnEmptyOne) {
  // a device whose identity takes 128 bytes, two whole packets
  const usb_application application = {
      .vendor_in = [](void*, const usb_setup*, std::uint8_t*) { return 128; },
      .vendor_out = [](void*, const usb_setup*, const std::uint8_t*) { return true; },
      .configured = [](void*, bool) {},
      .sent = [](void*) {},
      .halted = [](void*, bool) {},
  };
  usb_device usb{};
  simulated::Controller controller(usb);
  const std::uint8_t id[TRW_USB_UNIQUE_ID_SIZE] = {};
  usb_init(&usb, &simulated::Controller::table(), &controller, &application, nullptr, id);
  const std::uint8_t longer[8] = {kVendorIn, 1, 0, 0, 0, 0, 200, 0},
                     exact[8] = {kVendorIn, 1, 0, 0, 0, 0, 128, 0};
  EXPECT_EQ(controller.control(longer, data.data()), 128);
  EXPECT_EQ(controller.control(exact, data.data()), 128);
}

TEST_F(UsbDevice, AnySetupPacketIsAnsweredOrStalled) {
  const std::uint64_t seed = test::seed();
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::vector<std::uint8_t> room(65536);
  for (int round = 0; round < 200000; ++round) {
    std::uint8_t setup[8];
    for (std::uint8_t& byte : setup) byte = static_cast<std::uint8_t>(random());
    if (random() % 2 == 0) setup[0] = static_cast<std::uint8_t>(setup[0] & 0xC3);
    if (random() % 2 == 0) setup[1] = static_cast<std::uint8_t>(setup[1] % 13);
    if (random() % 2 == 0) setup[7] = 0;
    const int result = board.controller.control(setup, room.data());
    ASSERT_TRUE(result >= 0 || result == kStall) << result;
    board.advance(1);
    board.poll();
  }
  board.enumerate();
  EXPECT_EQ(descriptor(1, 0), 18);
}

}  // namespace
}  // namespace tunnelrig
