// The USB path at full speed: the real libusb logger above a bus simulated by umockdev, into a campaign file;
// then the same with faults injected into every part of it. Simulator and logger share the processor.
#include "bench/stand_in_ioctl.h"
#include "daq/logging.h"
#include "daq/packets.h"
#include "daq/usb_source.h"
#include "simulated/usb_bus.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <random>
#include <string>

#include <fmt/format.h>
#include <sys/resource.h>

namespace tunnelrig {
namespace {

constexpr double kRig_hz = 4000.0 / 3.0;
constexpr double kBytesPerFrame = 684.0 / 64;  // in the longest packets

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

UsbSourceSettings large_transfers() {
  UsbSourceSettings settings;
  settings.stream.transfer_bytes = 131072;
  return settings;
}

void throughput(double duration_s) {
  simulated::Board board;
  simulated::UsbBus bus(board, simulated::Pace::kUnlimited);
  bus.plug();
  const auto source = open_usb_source("usb", large_transfers());
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  const double began_s = now_s();
  const LogOutcome outcome = log_run(*source, file, test::cells("R1"), {.duration_s = duration_s},
                                     test::summarizer(), {}, test::never_stop());
  const double took_s = now_s() - began_s;
  fmt::print(
      "unpaced: {} frames in {:.2f} s: {:.1f} MB/s decoded and stored, {:.0f} times the rig; {} lost, {} "
      "doubled\n",
      outcome.ledger.frames_stored, took_s,
      static_cast<double>(outcome.ledger.frames_stored) * kBytesPerFrame / took_s / 1e6,
      static_cast<double>(outcome.ledger.frames_stored) / took_s / kRig_hz, outcome.ledger.frames_lost,
      outcome.ledger.frames_duplicate);
}

/// Faults of packets on the bus, each with one in ten: dropped, doubled, swapped with the next, cut short,
/// one bit flipped.
class Faulty {
 public:
  void operator()(const std::uint8_t* data, std::size_t size, std::vector<std::uint8_t>& out) {
    std::vector<std::uint8_t> packet(data, data + size);
    if (random_() % 10 == 0) {
      ++faults;
      switch (random_() % 5) {
        case 0:
          packet.clear();
          break;
        case 1:
          packet.insert(packet.end(), data, data + size);
          break;
        case 2:
          kept_.swap(packet);
          break;
        case 3:
          packet.resize(packet.size() / 2);
          break;
        default:
          if (!packet.empty())
            packet[random_() % packet.size()] ^= static_cast<std::uint8_t>(1u << (random_() % 8));
      }
    }
    out.insert(out.end(), packet.begin(), packet.end());
    if (!kept_.empty() && !packet.empty()) {
      out.insert(out.end(), kept_.begin(), kept_.end());
      kept_.clear();
    }
  }
  std::uint64_t faults = 0;

 private:
  std::mt19937 random_{20260302};
  std::vector<std::uint8_t> kept_;
};

/// Every stored frame must be the one whose place it takes: the samples tell a frame's number modulo 4096.
struct Check : FrameSink {
  void frames(std::span<const std::byte> data) override {
    for (std::size_t at = 0; at < data.size(); at += 8, ++stored) {
      std::int16_t sample = 0;
      std::memcpy(&sample, data.data() + at, sizeof sample);
      const std::uint64_t number =
          static_cast<std::uint64_t>(sample) * 3511 % 4096;  // 7 * 3511 = 1 modulo 4096
      if (known && number != next % 4096) ++misplaced;
      known = true;
      next = number + 1;
    }
  }
  void gap(const Gap& gap) override {
    lost += gap.frames_lost;
    next += gap.frames_lost;
    if (gap.estimated) known = false;  // a reboot: the count starts anew
  }
  std::uint64_t stored = 0, lost = 0, misplaced = 0, next = 0;
  bool known = false;
};

/// What the logger costs in real time: the process without the simulated board's thread, umockdev's, and what
/// umockdev does within ioctl(), which stand for board and kernel.
void rig_rate(double duration_s) {
  simulated::Board board;
  simulated::UsbBus bus(board, simulated::Pace::kRig);
  bus.plug();
  const auto source = open_usb_source("usb", {});
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  rusage before{}, after{};
  ::getrusage(RUSAGE_SELF, &before);
  const double simulator_before_s = bus.processor_s();
  const double ioctl_before_s = ioctl_processor_s();
  const LogOutcome outcome = log_run(*source, file, test::cells("R1"), {.duration_s = duration_s},
                                     test::summarizer(), {}, test::never_stop());
  ::getrusage(RUSAGE_SELF, &after);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  const double used_s =
      seconds(after.ru_utime) + seconds(after.ru_stime) - seconds(before.ru_utime) - seconds(before.ru_stime);
  const double simulator_s = bus.processor_s() - simulator_before_s;
  const double ioctl_s = ioctl_processor_s() - ioctl_before_s;
  const auto percent = [&](double spent_s) { return 100 * spent_s / duration_s; };
  fmt::print(
      "rig rate, {:g} s: {:.2f} % of a core for the logger, and {:.2f} % within ioctl(), where umockdev "
      "stands for the kernel;\n{:.2f} % for the simulated board and umockdev's thread beside it; {:.1f} MB "
      "at "
      "most; {} lost\n",
      duration_s, percent(used_s - simulator_s - ioctl_s), percent(ioctl_s), percent(simulator_s),
      static_cast<double>(after.ru_maxrss) / 1024, outcome.ledger.frames_lost);
}

/// Runs until `wanted` faults have been injected, with a stall every 20 ms and a reboot every 50th of them.
void injected_faults(std::uint64_t wanted) {
  simulated::Board board;
  simulated::UsbBus bus(board, simulated::Pace::kUnlimited);
  bus.plug();
  Faulty faulty;
  std::uint64_t stalls = 0, reboots = 0;
  bus.set_mangle([&faulty](const std::uint8_t* data, std::size_t size, std::vector<std::uint8_t>& out) {
    faulty(data, size, out);
  });
  const auto source = open_usb_source("usb", large_transfers());
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  std::atomic<bool> stop{false};
  std::thread troublemaker([&] {
    while (!stop) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      bus.with_board([&](simulated::Board& b) {
        if (++stalls % 50 == 0) {
          ++reboots;  // without leaving the bus, as after a watchdog's bite that the host did not see
          b.power_cycle();
          b.enumerate();
          board_start(&b.core, false);
        } else {
          b.control(0x02, 3, 0, 0x81, 0, nullptr);
        }
        if (faulty.faults + stalls >= wanted) stop = true;
      });
    }
  });
  const double began_s = now_s();
  const LogOutcome outcome =
      log_run(*source, file, test::cells("R1"), {.duration_s = 1e7}, test::summarizer(), {}, stop);
  troublemaker.join();
  const RawRun run = raw_run(file, "R1").value();
  Check check;
  read_raw(file, run, check);
  const Ledger& ledger = outcome.ledger;
  const auto unaccounted =
      static_cast<std::int64_t>(ledger.frames_emitted) - static_cast<std::int64_t>(check.stored + check.lost);
  fmt::print(
      "faults: {} ({} of packets, {} stalls, {} reboots) in {:.0f} s: {} frames emitted, {} stored, {} lost "
      "in gaps, {} late, "
      "{} doubled, {} corrupt packets, {} reboots seen; {} unaccounted, {} not in their place\n",
      faulty.faults + stalls, faulty.faults, stalls - reboots, reboots, now_s() - began_s,
      ledger.frames_emitted, check.stored, check.lost, ledger.frames_late, ledger.frames_duplicate,
      ledger.packets_corrupt, ledger.reboots, unaccounted, check.misplaced);
}

}  // namespace
}  // namespace tunnelrig

int main(int argc, char** argv) {
  const std::uint64_t faults = argc > 1 ? std::stoull(argv[1]) : 1000000;
  tunnelrig::rig_rate(20);
  for (int round = 0; round < 3; ++round) tunnelrig::throughput(7200);
  tunnelrig::injected_faults(faults);
}
