#include "datasets/raw_store.h"

#include "datasets/error.h"
#include "datasets/raw_key.h"
#include "datasets/sqlite.h"

#include <algorithm>
#include <array>

namespace tunnelrig {
namespace {

constexpr std::array<std::string_view, 3> kStates = {"recording", "complete", "partial"};

constexpr std::string_view kInterrupted = "the recorder ended before the run did";

RunState state_from_name(const std::string& name) {
  const auto found = std::find(kStates.begin(), kStates.end(), name);
  return static_cast<RunState>(found - kStates.begin());
}

void write_ledger(const Database& database, std::int64_t raw_run, const Ledger& ledger) {
  Statement(
      database,
      "INSERT OR REPLACE INTO ledgers (raw_run, frames_emitted, frames_stored, frames_lost, "
      "frames_duplicate, "
      "frames_late, packets_corrupt, bytes_skipped, frames_overrun, frames_adc_error, reboots, silences, "
      "boot_id, first_sequence, board_rate_hz, rate_interval_hz, drift_ppm_h, drift_interval_ppm_h, "
      "end_reason, source, frames_clipped, frames_test_pattern, board_serial, conversions_per_frame) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)")
      .bind(raw_run)
      .bind(as_sql(ledger.frames_emitted))
      .bind(as_sql(ledger.frames_stored))
      .bind(as_sql(ledger.frames_lost))
      .bind(as_sql(ledger.frames_duplicate))
      .bind(as_sql(ledger.frames_late))
      .bind(as_sql(ledger.packets_corrupt))
      .bind(as_sql(ledger.bytes_skipped))
      .bind(as_sql(ledger.frames_overrun))
      .bind(as_sql(ledger.frames_adc_error))
      .bind(as_sql(ledger.reboots))
      .bind(as_sql(ledger.silences))
      .bind(std::int64_t{ledger.boot_id})
      .bind(as_sql(ledger.first_sequence))
      .bind(ledger.board_rate_hz)
      .bind(ledger.rate_interval_hz)
      .bind(ledger.drift_ppm_h)
      .bind(ledger.drift_interval_ppm_h)
      .bind(ledger.end_reason)
      .bind(ledger.source)
      .bind(as_sql(ledger.frames_clipped))
      .bind(as_sql(ledger.frames_test_pattern))
      .bind(ledger.board_serial)
      .bind(std::int64_t{ledger.conversions_per_frame})
      .run();
}

void write_gap(const Database& database, std::int64_t raw_run, const Gap& gap) {
  Statement(database,
            "INSERT INTO gaps (raw_run, first_frame, frames_lost, cause, estimated) VALUES (?, ?, ?, ?, ?)")
      .bind(raw_run)
      .bind(as_sql(gap.first_frame))
      .bind(as_sql(gap.frames_lost))
      .bind(gap.cause)
      .bind(std::int64_t{gap.estimated})
      .run();
}

constexpr std::string_view kSelectRuns =
    "SELECT id, run, state, sample_type, channels, frames, hash FROM raw_runs";

RawRun run_from(const Statement& row) {
  return {.id = row.integer(0),
          .run = row.text(1),
          .state = state_from_name(row.text(2)),
          .format = {sample_type_from_name(row.text(3)), static_cast<int>(row.integer(4))},
          .frames = from_sql(row.integer(5)),
          .hash = row.text(6)};
}

/// Hands a run's gaps out at their places between the frames.
class GapCursor {
 public:
  GapCursor(std::vector<Gap> gaps, FrameSink& sink) : gaps_(std::move(gaps)), sink_(sink) {}

  /// Passes on `data`, whose first frame has index `first`, cut where gaps lie within it.
  void frames(std::uint64_t first, std::span<const std::byte> data, std::size_t frame_size) {
    while (next_ < gaps_.size() && gaps_[next_].first_frame < first + data.size() / frame_size) {
      const std::size_t before = (gaps_[next_].first_frame - first) * frame_size;
      if (before > 0) sink_.frames(data.first(before));
      data = data.subspan(before);
      first = gaps_[next_].first_frame;
      sink_.gap(gaps_[next_++]);
    }
    if (!data.empty()) sink_.frames(data);
  }

  void rest() {
    while (next_ < gaps_.size()) sink_.gap(gaps_[next_++]);
  }

 private:
  std::vector<Gap> gaps_;
  FrameSink& sink_;
  std::size_t next_ = 0;
};

void write_state(const Database& database, std::int64_t raw_run, RunState state, std::uint64_t frames,
                 const std::string& hash) {
  Statement(database, "UPDATE raw_runs SET state = ?, frames = ?, hash = ? WHERE id = ?")
      .bind(name_of(state))
      .bind(as_sql(frames))
      .bind(hash)
      .bind(raw_run)
      .run();
}

}  // namespace

std::string_view name_of(RunState state) { return kStates[static_cast<std::size_t>(state)]; }

RawWriter::RawWriter(CampaignFile& file, const std::string& run, const RawFormat& format,
                     std::size_t max_chunk_frames)
    : file_(file),
      format_(format),
      chunk_bytes_(std::max<std::size_t>(1, max_chunk_frames) * format.frame_size()),
      hasher_(format) {
  if (raw_run(file, run)) throw InputError(fmt::format("run {} is in {} already", run, file.path().string()));
  Statement(file.database(),
            "INSERT INTO raw_runs (run, state, sample_type, channels) VALUES (?, 'recording', ?, ?)")
      .bind(run)
      .bind(name_of(format.type))
      .bind(std::int64_t{format.channels})
      .run();
  id_ = file.database().last_id();
}

void RawWriter::frames(std::span<const std::byte> data) {
  hasher_.add(data);
  frames_ += data.size() / format_.frame_size();
  buffer_.insert(buffer_.end(), data.begin(), data.end());
}

void RawWriter::gap(const Gap& gap) {
  gaps_.push_back(gap);
  all_gaps_.push_back(gap);
}

void RawWriter::write_pending(const std::optional<Ledger>& ledger) {
  Statement insert(file_.database(), "INSERT INTO raw_chunks (id, crc32c, data) VALUES (?, ?, ?)");
  for (std::span<const std::byte> left = buffer_; !left.empty();) {
    const auto chunk = left.first(std::min(left.size(), chunk_bytes_));
    insert.bind(chunk_key(id_, buffer_first_)).bind(std::int64_t{crc32c(chunk)}).bind(chunk).run();
    buffer_first_ += chunk.size() / format_.frame_size();
    left = left.subspan(chunk.size());
  }
  for (const Gap& gap : gaps_) write_gap(file_.database(), id_, gap);
  if (ledger) write_ledger(file_.database(), id_, *ledger);
}

void RawWriter::commit(const std::optional<Ledger>& ledger) {
  JoinedTransaction transaction(file_.database());
  write_pending(ledger);
  write_state(file_.database(), id_, RunState::kRecording, frames_, "");
  transaction.commit();
  buffer_.clear();
  gaps_.clear();
}

std::string RawWriter::finish(RunState state, const std::optional<Ledger>& ledger) {
  std::string hash = hasher_.finish(all_gaps_);
  JoinedTransaction transaction(file_.database());
  write_pending(ledger);
  write_state(file_.database(), id_, state, frames_, hash);
  transaction.commit();
  buffer_.clear();
  gaps_.clear();
  return hash;
}

std::vector<RawRun> raw_runs(const CampaignFile& file) {
  Statement select(file.database(), fmt::format("{} ORDER BY id", kSelectRuns));
  std::vector<RawRun> runs;
  while (select.step()) runs.push_back(run_from(select));
  return runs;
}

std::optional<RawRun> raw_run(const CampaignFile& file, const std::string& run) {
  Statement select(file.database(), fmt::format("{} WHERE run = ?", kSelectRuns));
  select.bind(run);
  if (!select.step()) return {};
  return run_from(select);
}

std::vector<Gap> gaps_of(const CampaignFile& file, std::int64_t raw_run) {
  Statement select(
      file.database(),
      "SELECT first_frame, frames_lost, cause, estimated FROM gaps WHERE raw_run = ? ORDER BY id");
  select.bind(raw_run);
  std::vector<Gap> gaps;
  while (select.step()) {
    gaps.push_back(
        {from_sql(select.integer(0)), from_sql(select.integer(1)), select.text(2), select.integer(3) != 0});
  }
  return gaps;
}

std::optional<Ledger> ledger_of(const CampaignFile& file, std::int64_t raw_run) {
  // A file of an older version that is only read has not got all columns.
  const std::int64_t version = file.database().scalar_integer("PRAGMA user_version");
  Statement select(
      file.database(),
      fmt::format(
          "SELECT frames_emitted, frames_stored, frames_lost, frames_duplicate, frames_late, "
          "packets_corrupt, "
          "bytes_skipped, frames_overrun, frames_adc_error, reboots, silences, boot_id, first_sequence, "
          "board_rate_hz, rate_interval_hz, drift_ppm_h, drift_interval_ppm_h, end_reason, source, {}, {} "
          "FROM "
          "ledgers "
          "WHERE raw_run = ?",
          version >= 2 ? "frames_clipped, frames_test_pattern" : "0, 0",
          version >= 3 ? "board_serial, conversions_per_frame" : "'', 0"));
  select.bind(raw_run);
  if (!select.step()) return {};
  return Ledger{.frames_emitted = from_sql(select.integer(0)),
                .frames_stored = from_sql(select.integer(1)),
                .frames_lost = from_sql(select.integer(2)),
                .frames_duplicate = from_sql(select.integer(3)),
                .frames_late = from_sql(select.integer(4)),
                .packets_corrupt = from_sql(select.integer(5)),
                .bytes_skipped = from_sql(select.integer(6)),
                .frames_overrun = from_sql(select.integer(7)),
                .frames_adc_error = from_sql(select.integer(8)),
                .frames_clipped = from_sql(select.integer(19)),
                .frames_test_pattern = from_sql(select.integer(20)),
                .reboots = from_sql(select.integer(9)),
                .silences = from_sql(select.integer(10)),
                .boot_id = static_cast<std::uint32_t>(select.integer(11)),
                .first_sequence = from_sql(select.integer(12)),
                .board_rate_hz = select.maybe_real(13),
                .rate_interval_hz = select.maybe_real(14),
                .drift_ppm_h = select.maybe_real(15),
                .drift_interval_ppm_h = select.maybe_real(16),
                .end_reason = select.text(17),
                .source = select.text(18),
                .board_serial = select.text(21),
                .conversions_per_frame = static_cast<std::uint32_t>(select.integer(22))};
}

void read_raw(const CampaignFile& file, const RawRun& run, FrameSink& sink) {
  Statement select(file.database(),
                   "SELECT id, crc32c, data FROM raw_chunks WHERE id BETWEEN ? AND ? ORDER BY id");
  select.bind(chunk_key(run.id, 0)).bind(chunk_key(run.id, kLastFrame));
  GapCursor cursor(gaps_of(file, run.id), sink);
  const std::size_t frame_size = run.format.frame_size();
  std::uint64_t next = 0;
  while (select.step()) {
    const std::uint64_t first = from_sql(select.integer(0)) & kLastFrame;
    const auto data = select.blob(2);
    if (first != next || data.size() % frame_size != 0 || crc32c(data) != select.integer(1)) {
      throw StorageError(fmt::format("{}: run {}: the raw data at frame {} are damaged", file.path().string(),
                                     run.run, next),
                         false);
    }
    cursor.frames(first, data, frame_size);
    next += data.size() / frame_size;
  }
  if (next != run.frames) {
    throw StorageError(fmt::format("{}: run {}: {} frames are stored where {} were recorded",
                                   file.path().string(), run.run, next, run.frames),
                       false);
  }
  cursor.rest();
}

StoredHash hash_of_raw(const CampaignFile& file, const RawRun& run) {
  struct Hash : FrameSink {
    explicit Hash(const RawFormat& format) : hasher(format) {}
    void frames(std::span<const std::byte> data) override { hasher.add(data); }
    void gap(const Gap& gap) override { gaps.push_back(gap); }
    RawHasher hasher;
    std::vector<Gap> gaps;
  } sink(run.format);
  bool damaged = false;
  try {
    read_raw(file, run, sink);
  } catch (const StorageError&) {
    damaged = true;
  }
  return {sink.hasher.finish(sink.gaps), damaged};
}

std::vector<std::string> unfinished_runs(const CampaignFile& file) {
  std::vector<std::string> names;
  for (const RawRun& run : raw_runs(file))
    if (run.state == RunState::kRecording) names.push_back(run.run);
  return names;
}

std::vector<std::string> close_interrupted_runs(CampaignFile& file) {
  std::vector<std::string> names;
  for (const RawRun& run : raw_runs(file)) {
    if (run.state != RunState::kRecording) continue;
    // Where it is damaged, who reads the run is told; the next one must not wait for it.
    const StoredHash stored = hash_of_raw(file, run);
    Statement(file.database(), "UPDATE ledgers SET end_reason = ? WHERE raw_run = ?")
        .bind(kInterrupted)
        .bind(run.id)
        .run();
    write_state(file.database(), run.id, RunState::kPartial, run.frames, stored.hash);
    names.push_back(run.run);
  }
  return names;
}

}  // namespace tunnelrig
