// Frames per second of a recording: the campaign's, or the board's where that is another.
#pragma once

#include "datasets/raw_store.h"

#include <optional>

namespace tunnelrig {

/// Whether a board's rate, where it is known, is another than campaign.toml's: by more than 0.1 %, which a
/// board's clock does not err by.
bool is_another_rate(const std::optional<double>& board_rate_hz, double campaign_rate_hz);

/// Of a recording: campaign.toml's, or its board's where that is another. Imported ones have no ledger.
double recorded_rate_hz(const std::optional<Ledger>& ledger, double campaign_rate_hz);

}  // namespace tunnelrig
