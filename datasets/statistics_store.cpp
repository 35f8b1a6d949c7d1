#include "datasets/statistics_store.h"

#include "datasets/error.h"
#include "datasets/sqlite.h"

#include <cstring>
#include <span>

namespace tunnelrig {

void store_statistics(CampaignFile& file, std::int64_t raw_run, const RunStatistics& statistics) {
  JoinedTransaction transaction(file.database());
  for (const std::string_view table : {"run_statistics", "run_lines", "run_windows"}) {
    Statement(file.database(), fmt::format("DELETE FROM {} WHERE raw_run = ?", table)).bind(raw_run).run();
  }
  Statement insert(
      file.database(),
      "INSERT INTO run_statistics (raw_run, channel, hash, frames, mean_V, std_V, standard_error_V, "
      "drift_V, drift_z, lowest_V, highest_V, clipped, shaft_hz) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  Statement line(
      file.database(),
      "INSERT OR REPLACE INTO run_lines (raw_run, channel, frequency_hz, amplitude_V, prominence, name) "
      "VALUES (?, ?, ?, ?, ?, ?)");
  for (std::size_t c = 0; c < statistics.channels.size(); ++c) {
    const ChannelStatistics& channel = statistics.channels[c];
    const auto number = static_cast<std::int64_t>(c) + 1;
    insert.bind(raw_run)
        .bind(number)
        .bind(statistics.hash)
        .bind(as_sql(statistics.frames))
        .bind(channel.mean_V)
        .bind(channel.std_V)
        .bind(channel.standard_error_V)
        .bind(channel.drift_V)
        .bind(channel.drift_z)
        .bind(channel.lowest_V)
        .bind(channel.highest_V)
        .bind(as_sql(channel.clipped))
        .bind(channel.shaft_hz)
        .run();
    for (const SpectralLine& found : channel.lines) {
      line.bind(raw_run)
          .bind(number)
          .bind(found.frequency_hz)
          .bind(found.amplitude_V)
          .bind(found.prominence)
          .bind(found.name)
          .run();
    }
  }
  Statement(file.database(), "INSERT INTO run_windows (raw_run, window_s, means_V) VALUES (?, ?, ?)")
      .bind(raw_run)
      .bind(statistics.window_s)
      .bind(std::as_bytes(std::span(statistics.window_means_V)))
      .run();
  transaction.commit();
}

std::map<std::int64_t, RunStatistics> all_statistics(const CampaignFile& file) {
  std::map<std::int64_t, RunStatistics> all;
  Statement select(
      file.database(),
      "SELECT raw_run, hash, frames, mean_V, std_V, standard_error_V, drift_V, drift_z, lowest_V, "
      "highest_V, clipped, shaft_hz FROM run_statistics ORDER BY raw_run, channel");
  while (select.step()) {
    RunStatistics& run = all[select.integer(0)];
    run.hash = select.text(1);
    run.frames = from_sql(select.integer(2));
    run.channels.push_back({.mean_V = select.real(3),
                            .std_V = select.real(4),
                            .standard_error_V = select.real(5),
                            .drift_V = select.real(6),
                            .drift_z = select.real(7),
                            .lowest_V = select.real(8),
                            .highest_V = select.real(9),
                            .clipped = from_sql(select.integer(10)),
                            .shaft_hz = select.maybe_real(11),
                            .lines = {}});
  }
  Statement lines(file.database(),
                  "SELECT raw_run, channel, frequency_hz, amplitude_V, prominence, name FROM run_lines");
  while (lines.step()) {
    auto& channels = all[lines.integer(0)].channels;
    const auto channel = static_cast<std::size_t>(lines.integer(1)) - 1;
    if (channel >= channels.size()) continue;
    channels[channel].lines.push_back({lines.real(2), lines.real(3), lines.real(4), lines.text(5)});
  }
  return all;
}

void read_windows(const CampaignFile& file, std::map<std::int64_t, RunStatistics>& statistics) {
  Statement select(file.database(),
                   "SELECT window_s, means_V, run FROM run_windows JOIN raw_runs ON raw_runs.id = raw_run "
                   "WHERE raw_run = ?");
  for (auto& [raw_run, own] : statistics) {
    select.bind(raw_run);
    if (!select.step()) {
      select.reset();
      continue;
    }
    const auto blob = select.blob(1);
    if (blob.size() % sizeof(double) != 0)
      throw StorageError(fmt::format("{}: run {}: the means of its windows are damaged", file.path().string(),
                                     select.text(2)),
                         false);
    own.window_s = select.real(0);
    own.window_means_V.resize(blob.size() / sizeof(double));
    if (!blob.empty()) std::memcpy(own.window_means_V.data(), blob.data(), blob.size());
    select.reset();
  }
}

}  // namespace tunnelrig
