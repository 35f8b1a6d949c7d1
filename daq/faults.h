// What can go wrong between a board and its host, for the virtual board to suffer on purpose.
#pragma once

#include <string>

namespace tunnelrig {

/// Probabilities are per packet. `stall` and `reboot` happen once.
struct Faults {
  double drop = 0;
  double duplicate = 0;
  double reorder = 0;                     // swapped with the packet behind it
  double corrupt = 0;                     // one bit flipped
  double truncate = 0;                    // cut short
  double garbage = 0;                     // random bytes before it
  double stall_at_s = -1, stall_s = 0;    // sends nothing; its ring holds 3 s, older frames are overrun
  double reboot_at_s = -1, reboot_s = 0;  // starts anew: other boot id, counts from 0

  bool any() const {
    return drop + duplicate + reorder + corrupt + truncate + garbage > 0 || stall_at_s >= 0 ||
           reboot_at_s >= 0;
  }
};

/// "drop=0.001,corrupt=0.01,stall=10:2,reboot=20:0.5": times in seconds, at and for how long. Throws
/// InputError.
Faults parse_faults(const std::string& text);

}  // namespace tunnelrig
