// A host's requests to the board, over the simulated controller.
#pragma once

#include "simulated/board.h"

#include <array>
#include <cstdint>

#include <gtest/gtest.h>

namespace tunnelrig::test {

inline int vendor_out(simulated::Board& board, std::uint8_t request, std::uint16_t value = 0) {
  return board.control(0x40, request, value, 0, 0, nullptr);
}

inline trw_statistics statistics(simulated::Board& board) {
  std::array<std::uint8_t, TRW_STATISTICS_SIZE> data{};
  EXPECT_EQ(board.control(0xC0, TRW_USB_STATISTICS, 0, 0, TRW_STATISTICS_SIZE, data.data()),
            TRW_STATISTICS_SIZE);
  trw_statistics found{};
  trw_get_statistics(data.data(), &found);
  return found;
}

inline int set_rate(simulated::Board& board, std::uint32_t numerator, std::uint32_t denominator,
                    std::uint32_t oversampling) {
  std::array<std::uint8_t, TRW_RATE_WISH_SIZE> data{};
  const trw_rate_wish wish{numerator, denominator, oversampling};
  trw_put_rate_wish(data.data(), &wish);
  const int result = board.control(0x40, TRW_USB_SET_RATE, 0, 0, TRW_RATE_WISH_SIZE, data.data());
  return result == TRW_RATE_WISH_SIZE ? 0 : result;
}

inline trw_rate rate(simulated::Board& board) {
  std::array<std::uint8_t, TRW_RATE_SIZE> data{};
  EXPECT_EQ(board.control(0xC0, TRW_USB_GET_RATE, 0, 0, TRW_RATE_SIZE, data.data()), TRW_RATE_SIZE);
  trw_rate found{};
  trw_get_rate(data.data(), &found);
  return found;
}

}  // namespace tunnelrig::test
