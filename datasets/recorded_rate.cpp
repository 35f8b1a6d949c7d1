#include "datasets/recorded_rate.h"

#include <cmath>

namespace tunnelrig {

bool is_another_rate(const std::optional<double>& board_rate_hz, double campaign_rate_hz) {
  constexpr double kSame = 1e-3;
  return board_rate_hz && std::abs(*board_rate_hz / campaign_rate_hz - 1) > kSame;
}

double recorded_rate_hz(const std::optional<Ledger>& ledger, double campaign_rate_hz) {
  return ledger && is_another_rate(ledger->board_rate_hz, campaign_rate_hz) ? *ledger->board_rate_hz
                                                                            : campaign_rate_hz;
}

}  // namespace tunnelrig
