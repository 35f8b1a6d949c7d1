#include "rig.h"

#include "daq/loss_ledger.h"

#include <map>

#include <gtest/gtest.h>

namespace tunnelrig::test {

Logged log_usb(PacketSource& source, double duration_s,
               const std::function<void(const LogProgress&)>& progress, const std::atomic<bool>& stop) {
  const TemporaryFolder folder;
  CampaignFile file = new_campaign(folder / "c.db");
  Logged logged;
  logged.outcome =
      log_run(source, file, cells("R1"), {.duration_s = duration_s}, summarizer(), progress, stop);
  FrameList list;
  read_raw(file, raw_run(file, "R1").value(), list);
  logged.samples = list.samples;
  logged.gaps = list.gaps;
  EXPECT_TRUE(logged.outcome.ledger.closed());
  EXPECT_EQ(list.count(), logged.outcome.ledger.frames_stored);
  return logged;
}

void expect_every_frame_in_its_place(const Logged& logged) {
  std::map<std::uint64_t, Gap> before;
  std::uint64_t lost = 0;
  for (const Gap& gap : logged.gaps) {
    before[gap.first_frame] = gap;
    lost += gap.frames_lost;
  }
  EXPECT_EQ(lost, logged.outcome.ledger.frames_lost);
  std::uint64_t sequence = logged.outcome.ledger.first_sequence;
  for (std::size_t i = 0; i < logged.samples.size() / 4; ++i, ++sequence) {
    if (const auto gap = before.find(i); gap != before.end()) {
      sequence += gap->second.frames_lost;
      if (gap->second.estimated) {
        for (sequence = 0; simulated::sample_of(sequence, 0) != logged.samples[4 * i];) ++sequence;
      }
    }
    for (std::size_t c = 0; c < 4; ++c) {
      ASSERT_EQ(logged.samples[4 * i + c], simulated::sample_of(sequence, c)) << "stored frame " << i;
    }
  }
}

UsbSourceSettings small_transfers() {
  UsbSourceSettings settings;
  settings.stream.transfer_bytes = 4096;
  return settings;
}

double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace tunnelrig::test
