// Raw runs in the campaign file: written blob by blob with their loss ledger, read back verified.
#pragma once

#include "datasets/campaign_file.h"
#include "datasets/raw_data.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tunnelrig {

enum class RunState { kRecording, kComplete, kPartial };
std::string_view name_of(RunState state);

/// The loss ledger of a run: every frame that the board sampled between the first and the last one seen is
/// either stored or lost. docs/loss-ledger.md.
struct Ledger {
  std::uint64_t frames_emitted = 0;
  std::uint64_t frames_stored = 0;
  std::uint64_t frames_lost = 0;
  std::uint64_t frames_duplicate = 0;
  std::uint64_t frames_late = 0;
  std::uint64_t packets_corrupt = 0;
  std::uint64_t bytes_skipped = 0;
  std::uint64_t frames_overrun = 0;
  std::uint64_t frames_adc_error = 0;
  std::uint64_t frames_clipped = 0;       // a channel at the end of the converter's range
  std::uint64_t frames_test_pattern = 0;  // a counter instead of measurements
  std::uint64_t reboots = 0;
  std::uint64_t silences = 0;
  std::uint32_t boot_id = 0;
  std::uint64_t first_sequence = 0;
  std::optional<double> board_rate_hz;
  std::optional<double> rate_interval_hz, drift_ppm_h, drift_interval_ppm_h;  // where the rate was fitted
  std::string end_reason;
  std::string source;
  std::string board_serial;                 // empty: the source does not know
  std::uint32_t conversions_per_frame = 0;  // 0: likewise

  bool closed() const { return frames_emitted == frames_stored + frames_lost; }
};

/// More than a link that now and then sends twice.
inline bool much_came_again(const Ledger& ledger) {
  return ledger.frames_duplicate > ledger.frames_emitted / 100;
}

struct RawRun {
  std::int64_t id = 0;
  std::string run;
  RunState state = RunState::kComplete;
  RawFormat format;
  std::uint64_t frames = 0;
  std::string hash;
};

/// Receives a run's frames and gaps in the order of time.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void frames(std::span<const std::byte> data) = 0;  // whole frames
  virtual void gap(const Gap& gap) = 0;
};

inline constexpr double kChunk_s = 0.1;  // no blob holds more of a run

/// Writes one run. Frames collect in memory until `commit`, which makes them and the ledger durable in one
/// transaction (inside a staged campaign: joins its transaction).
class RawWriter : public FrameSink {
 public:
  /// `max_chunk_frames` is kChunk_s of frames at most. Throws InputError where the run exists already.
  RawWriter(CampaignFile& file, const std::string& run, const RawFormat& format,
            std::size_t max_chunk_frames);

  void frames(std::span<const std::byte> data) override;
  void gap(const Gap& gap) override;

  std::uint64_t frames_stored() const { return frames_; }
  bool pending() const { return !buffer_.empty() || !gaps_.empty(); }

  void commit(const std::optional<Ledger>& ledger);

  /// Commits the rest, the run's state, hash and statistics. Returns the hash.
  std::string finish(RunState state, const std::optional<Ledger>& ledger);

  std::int64_t id() const { return id_; }

 private:
  void write_pending(const std::optional<Ledger>& ledger);

  CampaignFile& file_;
  std::int64_t id_ = 0;
  RawFormat format_;
  std::size_t chunk_bytes_;
  std::vector<std::byte> buffer_;   // frames not yet written
  std::uint64_t buffer_first_ = 0;  // index of the first of them
  std::uint64_t frames_ = 0;        // taken so far
  std::vector<Gap> gaps_, all_gaps_;
  RawHasher hasher_;
};

std::vector<RawRun> raw_runs(const CampaignFile& file);
std::optional<RawRun> raw_run(const CampaignFile& file, const std::string& run);
std::vector<Gap> gaps_of(const CampaignFile& file, std::int64_t raw_run);
std::optional<Ledger> ledger_of(const CampaignFile& file, std::int64_t raw_run);

/// Plays a stored run into `sink`. Throws StorageError naming the run where a blob fails its CRC or one is
/// missing.
void read_raw(const CampaignFile& file, const RawRun& run, FrameSink& sink);

/// The hash of what is stored of a run, as RawWriter makes it; of what can be read where it is damaged.
struct StoredHash {
  std::string hash;
  bool damaged = false;  // a blob fails its CRC, or one is missing
};
StoredHash hash_of_raw(const CampaignFile& file, const RawRun& run);

/// Runs in state "recording": one is under way, or its recorder was killed.
std::vector<std::string> unfinished_runs(const CampaignFile& file);

/// Runs left in state "recording" belong to a recorder that was killed: marks them partial, with their hash
/// and, in the ledger, the reason. The file must be open for recording, so that nobody can still be writing
/// them. Returns their names.
std::vector<std::string> close_interrupted_runs(CampaignFile& file);

}  // namespace tunnelrig
