#include "cli/run_warnings.h"

#include "cli/console.h"
#include "datasets/recorded_rate.h"

#include <utility>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

bool warn_of_losses(const std::string& run, const Ledger& ledger) {
  if (ledger.frames_lost == 0) return false;
  warn(
      fmt::format("run {}: {} of {} frames lost ({} late, {} corrupt packets, {} reboots, {} silences); "
                  "the ledger has where",
                  run, ledger.frames_lost, ledger.frames_emitted, ledger.frames_late, ledger.packets_corrupt,
                  ledger.reboots, ledger.silences));
  return true;
}

/// Says what arrived and could not be used. True where it is a problem: what came twice is not.
bool warn_of_unusable(const std::string& run, const Ledger& ledger) {
  if (ledger.frames_stored == 0 && ledger.bytes_skipped > 0)
    warn(fmt::format("run {}: {} bytes arrived that are no packets of version 1 (docs/wire-format.md)", run,
                     ledger.bytes_skipped));
  if (ledger.packets_corrupt > 0)
    warn(
        fmt::format("run {}: {} refused: a wrong checksum, a number that is not believed, or "
                    "other frames under numbers that had passed",
                    run,
                    ledger.packets_corrupt == 1 ? "1 packet was"
                                                : fmt::format("{} packets were", ledger.packets_corrupt)));
  if (much_came_again(ledger))
    warn(
        fmt::format("run {}: {} frames came under numbers that had passed and were dropped; a board that "
                    "restarts needs a new boot id",
                    run, ledger.frames_duplicate));
  return ledger.packets_corrupt > 0;
}

/// Says where the board's rate is not the campaign's. True where it is a problem.
bool warn_of_rate(const std::string& run, const Ledger& ledger, double campaign_rate_hz) {
  if (ledger.frames_stored > 0 && !ledger.board_rate_hz) {
    warn(fmt::format(
        "run {}: the board says no rate (0 ticks a second, or a frame); {:.3f} Hz, campaign.toml's, "
        "is taken for it",
        run, campaign_rate_hz));
    return true;
  }
  if (!is_another_rate(ledger.board_rate_hz, campaign_rate_hz)) return false;
  warn(fmt::format(
      "run {}: the board samples at {:.3f} Hz, campaign.toml says {:.3f} Hz; by the board the run is "
      "{:.3f} s long, but its spectrum and times go by campaign.toml",
      run, *ledger.board_rate_hz, campaign_rate_hz,
      static_cast<double>(ledger.frames_emitted) / *ledger.board_rate_hz));
  return true;
}

/// Frames of which the board says itself that they are no measurements, or no good ones.
bool warn_of_flags(const std::string& run, const Ledger& ledger) {
  bool problem = ledger.frames_test_pattern > 0;
  if (problem)
    warn(fmt::format("run {}: {} frames are the board's test pattern, no measurements", run,
                     ledger.frames_test_pattern));
  for (const auto& [frames, what] :
       {std::pair(ledger.frames_adc_error, "errors of the converter"), {ledger.frames_clipped, "clipped"}}) {
    if (frames == 0) continue;
    warn(fmt::format("run {}: the board flags {} frames as {}", run, frames, what));
    problem = true;
  }
  return problem;
}

bool warn_of_channels(const std::string& run, const RunStatistics& statistics, int rotors) {
  bool problem = statistics.frames == 1;
  if (problem) warn(fmt::format("run {}: it has one frame only, too short for a mean", run));
  for (std::size_t c = 0; c < statistics.channels.size() && c < static_cast<std::size_t>(rotors); ++c) {
    const ChannelStatistics& channel = statistics.channels[c];
    if (channel.clipped > 0)
      warn(fmt::format("run {}: channel {} clipped in {} samples", run, c + 1, channel.clipped));
    if (channel.stuck() && statistics.frames > 1)
      warn(fmt::format("run {}: channel {} is stuck at {:.4f} V", run, c + 1, channel.lowest_V));
    problem |= channel.stuck() || channel.clipped > 0;
  }
  return problem;
}

}  // namespace

bool warn_of_run(const std::string& run, const LogOutcome& outcome, const CampaignInfo& info) {
  const Ledger& ledger = outcome.ledger;
  bool problem = outcome.state != RunState::kComplete;
  if (problem) warn(fmt::format("run {} is partial: {}", run, ledger.end_reason));
  problem |= warn_of_losses(run, ledger);
  problem |= warn_of_unusable(run, ledger);
  problem |= warn_of_flags(run, ledger);
  problem |= warn_of_rate(run, ledger, info.daq.sample_rate_hz);
  problem |= warn_of_channels(run, outcome.statistics, info.rig.rotors);
  return problem;
}

}  // namespace tunnelrig::cli
