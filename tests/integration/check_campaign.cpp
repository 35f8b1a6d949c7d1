// check_campaign DB RUN=FRAMES[?]…: each run is complete and holds exactly the samples that were sent, each
// in its place. None is lost; with a ?, only what was in the cable when it was pulled (USB/IP's buffers stand
// for it).
#include "datasets/campaign_file.h"
#include "datasets/raw_store.h"
#include "simulated/board.h"

#include <cstdio>
#include <cstring>
#include <exception>
#include <string>

namespace {

using namespace tunnelrig;

class Compare : public FrameSink {
 public:
  explicit Compare(std::uint64_t first) : sequence_(first) {}
  void frames(std::span<const std::byte> data) override {
    for (std::size_t at = 0; at < data.size(); at += 8, ++sequence_) {
      std::int16_t frame[4];
      std::memcpy(frame, data.data() + at, sizeof frame);
      for (std::size_t c = 0; c < 4; ++c) wrong += frame[c] != simulated::sample_of(sequence_, c) ? 1 : 0;
    }
  }
  void gap(const Gap& gap) override {
    lost += gap.frames_lost;
    sequence_ += gap.frames_lost;
    if (gap.cause != "unplugged" || gap.estimated) unexplained += gap.frames_lost;
  }
  std::uint64_t wrong = 0, lost = 0, unexplained = 0;

 private:
  std::uint64_t sequence_;
};

bool check(const CampaignFile& file, const std::string& name, std::uint64_t frames, bool pulled) {
  const auto run = raw_run(file, name);
  if (!run) return std::printf("%s: is missing\n", name.c_str()), false;
  const Ledger ledger = ledger_of(file, run->id).value();
  Compare compare(ledger.first_sequence);
  read_raw(file, *run, compare);
  const std::uint64_t allowed = pulled ? 2 * 8 * 16 : 0;  // two rounds of the transfers in flight
  const bool good = run->state == RunState::kComplete && ledger.closed() && ledger.frames_emitted == frames &&
                    compare.lost == ledger.frames_lost && compare.lost <= allowed &&
                    compare.unexplained == 0 && compare.wrong == 0 && ledger.packets_corrupt == 0;
  std::printf("%s: %llu frames stored, %llu lost, %llu sent twice and dropped, %llu samples wrong: %s\n",
              name.c_str(), static_cast<unsigned long long>(ledger.frames_stored),
              static_cast<unsigned long long>(ledger.frames_lost),
              static_cast<unsigned long long>(ledger.frames_duplicate),
              static_cast<unsigned long long>(compare.wrong), good ? "as sent" : "NOT as sent");
  return good;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  try {
    const CampaignFile file(argv[1], CampaignFile::Access::kRead);
    bool good = true;
    for (int i = 2; i < argc; ++i) {
      const std::string wish = argv[i];
      const auto equals = wish.find('=');
      good &= check(file, wish.substr(0, equals), std::stoull(wish.substr(equals + 1)), wish.ends_with('?'));
    }
    return good ? 0 : 1;
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
    return 1;
  }
}
