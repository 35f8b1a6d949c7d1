// Bounds on what a clock on the wall says, which hold only where the program gets the processor.
#pragma once

namespace tunnelrig::test {

/// Whether a time may be compared with a promise. ThreadSanitizer makes a program ten times slower, and a
/// busy machine that again by what it likes: there, only what is recorded is looked at. (The label `clock`
/// marks the programs with such bounds; where they are kept, `./rig test` runs them with nothing beside them
/// and up to three times.)
#ifdef __SANITIZE_THREAD__
inline constexpr bool kClockCounts = false;
#else
inline constexpr bool kClockCounts = true;
#endif

/// How long to wait for what has to come within `promised_s`.
constexpr double patience_s(double promised_s) { return kClockCounts ? promised_s : 120; }

}  // namespace tunnelrig::test
