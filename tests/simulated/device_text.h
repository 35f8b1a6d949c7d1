// A board as udev shows it, for umockdev.
#pragma once

#include "simulated/board.h"

#include <string>

namespace tunnelrig::simulated {

/// Of a board that is device `number` of bus 1, with its node at `node`.
std::string device_text(Board& board, int number, const std::string& node);

}  // namespace tunnelrig::simulated
