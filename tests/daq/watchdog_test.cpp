#include "daq/watchdog.h"

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using Verdict = Watchdog::Verdict;

constexpr double kSilence_s = 0.25, kGiveUp_s = 30, kPacket_s = 0.01;

TEST(Watchdog, GivesUpAfterItsTime) {
  Watchdog watchdog(kSilence_s, kGiveUp_s);
  double time_s = 100;
  EXPECT_EQ(watchdog.look(5, time_s, kPacket_s), Verdict::kFine);
  int alarms = 0;
  for (; time_s < 100 + kGiveUp_s; time_s += 0.05) {
    const Verdict verdict = watchdog.look(5, time_s, kPacket_s);
    ASSERT_NE(verdict, Verdict::kGiveUp) << time_s;
    alarms += verdict == Verdict::kBecameSilent ? 1 : 0;
  }
  EXPECT_EQ(alarms, 1);
  EXPECT_EQ(watchdog.look(5, time_s + 0.05, kPacket_s), Verdict::kGiveUp);
}

/// The source's clock goes on while the computer sleeps, and the board may be there when it wakes.
TEST(Watchdog, ASleepIsNoSilenceOfItsLength) {
  Watchdog watchdog(kSilence_s, kGiveUp_s);
  EXPECT_EQ(watchdog.look(5, 100, kPacket_s), Verdict::kFine);
  EXPECT_EQ(watchdog.look(5, 700, kPacket_s), Verdict::kBecameSilent);
  EXPECT_EQ(watchdog.look(6, 700.05, kPacket_s), Verdict::kFine);
}

}  // namespace
}  // namespace tunnelrig
