// Decoder and recorder at full speed, as multiples of the rig's 1333 frames/s.
#include "daq/logging.h"
#include "daq/loss_ledger.h"
#include "daq/packet_decoder.h"

#include <benchmark/benchmark.h>

namespace tunnelrig {
namespace {

constexpr double kRig_hz = 4000.0 / 3.0;
constexpr std::uint64_t kFrames = 1600000;  // 20 minutes of the rig
constexpr std::uint8_t kPerPacket = 16;

const std::vector<std::byte>& stream() {
  static const std::vector<std::byte> bytes = [] {
    std::vector<std::byte> all;
    for (std::uint64_t first = 0; first < kFrames; first += kPerPacket) {
      const trw_header header{.boot_id = 1,
                              .tick_hz = 84000000,
                              .first_sequence = first,
                              .first_ticks = first * 63000,
                              .ticks_per_frame = 63000,
                              .frame_count = kPerPacket};
      trw_frame frames[kPerPacket];
      for (std::size_t i = 0; i < kPerPacket; ++i) {
        const auto value = static_cast<std::int16_t>(1500 + (first * 37 + i * 911) % 1000);
        frames[i] = {
            {value, static_cast<std::int16_t>(value + 5), static_cast<std::int16_t>(value - 9), value}, 0};
      }
      std::uint8_t packet[TRW_MAX_PACKET];
      const std::size_t size = trw_encode(packet, &header, frames);
      const auto* begin = reinterpret_cast<const std::byte*>(packet);
      all.insert(all.end(), begin, begin + size);
    }
    return all;
  }();
  return bytes;
}

void report(benchmark::State& state) {
  const auto frames = static_cast<double>(state.iterations()) * static_cast<double>(kFrames);
  state.counters["frames/s"] = benchmark::Counter(frames, benchmark::Counter::kIsRate);
  state.counters["x rig"] = benchmark::Counter(frames / kRig_hz, benchmark::Counter::kIsRate);
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(stream().size()));
}

class Discard : public FrameSink {
 public:
  void frames(std::span<const std::byte> data) override { benchmark::DoNotOptimize(data.data()); }
  void gap(const Gap& /*gap*/) override {}
};

void decoder(benchmark::State& state) {
  for ([[maybe_unused]] auto _ : state) {
    struct Into : PacketSink {
      void packet(const Packet& packet) override { tracker.take(packet, 0, discard); }
      LossTracker tracker{0};
      Discard discard;
    } into;
    PacketDecoder decoder;
    for (std::size_t at = 0; at < stream().size(); at += 65536) {
      decoder.push(std::span(stream()).subspan(at, std::min<std::size_t>(65536, stream().size() - at)), into);
    }
    if (into.tracker.ledger().frames_stored != kFrames) state.SkipWithError("frames are missing");
  }
  report(state);
}
BENCHMARK(decoder)->Unit(benchmark::kMillisecond)->UseRealTime();

/// A stream in memory.
class MemorySource : public PacketSource {
 public:
  ReadResult read(std::span<std::byte> buffer, std::chrono::milliseconds /*timeout*/) override {
    const std::size_t size = std::min(buffer.size(), stream().size() - at_);
    std::copy_n(stream().begin() + static_cast<std::ptrdiff_t>(at_), size, buffer.begin());
    at_ += size;
    return {size > 0 ? ReadResult::Status::kData : ReadResult::Status::kEnd, size, 0};
  }
  bool reopen() override { return false; }
  std::string name() const override { return "memory"; }

 private:
  std::size_t at_ = 0;
};

void decoder_and_recorder(benchmark::State& state) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  int run = 0;
  for ([[maybe_unused]] auto _ : state) {
    MemorySource source;
    const LogOutcome outcome = log_run(source, file, test::cells("R" + std::to_string(++run)),
                                       {.duration_s = static_cast<double>(kFrames) / kRig_hz},
                                       test::summarizer(), {}, test::never_stop());
    if (outcome.ledger.frames_stored != kFrames) state.SkipWithError("frames are missing");
  }
  report(state);
}
BENCHMARK(decoder_and_recorder)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace tunnelrig

BENCHMARK_MAIN();
