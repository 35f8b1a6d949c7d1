#include "analysis/exports/recordings.h"

#include "analysis/exports/tables.h"
#include "datasets/recorded_rate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <numeric>

#include <fmt/format.h>

namespace tunnelrig::exports {
namespace {

constexpr std::size_t kBlockFrames = 1 << 16;

static_assert(std::endian::native == std::endian::little, "blocks are passed on as they lie in memory");

Element element_of(SampleType type) {
  switch (type) {
    case SampleType::kInt16:
      return Element::kInt16;
    case SampleType::kUInt16:
      return Element::kUInt16;
    case SampleType::kFloat32:
      return Element::kFloat32;
    case SampleType::kFloat64:
      return Element::kFloat64;
  }
  return Element::kFloat64;
}

ThrustLine thrust_line(const CampaignData& data, const Tares& tares, const RawRun& raw, const Run* run) {
  const Certificate& certificate = *data.certificate;
  const auto statistics = data.statistics.find(raw.run);
  const double middle_s = statistics == data.statistics.end()
                              ? 0
                              : 0.5 * statistics->second.elapsed_s(data.info.daq.sample_rate_hz);
  const auto tare = run != nullptr ? tares.zero_at(run->session, run->start_s + middle_s) : std::nullopt;
  const double volts = is_counts(raw.format.type) ? data.info.daq.volts_per_count() : 1;
  ThrustLine line;
  for (int rotor = 0; rotor < data.info.rig.rotors; ++rotor) {
    const auto zero_V =
        tare ? std::optional(tare->zero_V[static_cast<std::size_t>(rotor)]) : std::optional<double>();
    const ForceReading at_zero = certificate.force(rotor + 1, 0, zero_V);
    const double factor = certificate.propellers.factor(rotor);
    line.offset_N.push_back(at_zero.force_N / factor);
    line.slope_N.push_back(at_zero.d_voltage_N_per_V * volts / factor);
  }
  return line;
}

std::vector<Series> series_of(const RawRun& raw, std::uint64_t frames_lost, const Parts& parts,
                              const std::optional<ThrustLine>& thrust) {
  const bool wide = raw.frames + frames_lost > std::numeric_limits<std::uint32_t>::max();
  std::vector<Series> series{
      {"frame", "1",
       "Number of the frame since the recording began, lost ones counted; time_s = frame / "
       "sample_rate_hz",
       wide ? Element::kUInt64 : Element::kUInt32, 1}};
  const auto channels = static_cast<std::size_t>(raw.format.channels);
  if (parts.raw && is_counts(raw.format.type))
    series.push_back(
        {"counts", "1", "As the converter gave them, by channel", element_of(raw.format.type), channels});
  if (parts.raw && !is_counts(raw.format.type))
    series.push_back(
        {"voltage_V", "V", "As they were imported, by channel", element_of(raw.format.type), channels});
  if (thrust) {
    series.push_back({"thrust_N", "N", "Calibrated, by rotor; not corrected by adopted effects",
                      Element::kFloat32, thrust->slope_N.size()});
  }
  return series;
}

template <typename Sample>
void to_thrust(std::span<const std::byte> samples, std::size_t channels, const ThrustLine& line,
               std::vector<float>& thrusts) {
  const std::size_t frames = samples.size() / (channels * sizeof(Sample)), rotors = line.slope_N.size();
  thrusts.resize(frames * rotors);
  std::array<Sample, kMaxRotors> frame{};
  for (std::size_t f = 0; f < frames; ++f) {
    std::memcpy(frame.data(), samples.data() + f * channels * sizeof(Sample), channels * sizeof(Sample));
    for (std::size_t i = 0; i < rotors; ++i)
      thrusts[f * rotors + i] =
          static_cast<float>(line.offset_N[i] + line.slope_N[i] * static_cast<double>(frame[i]));
  }
}

/// Collects frames until there are enough for a block, and passes the block on. Buffers serve one recording
/// after the other: new ones would be new pages each time.
class BlockSink : public FrameSink {
 public:
  explicit BlockSink(Writer& writer) : writer_(writer) {}

  void start(const RecordingSource& source) {
    source_ = &source;
    next_ = 0;
    samples_.reserve(kBlockFrames * source.raw.format.frame_size());
    numbers_.reserve(kBlockFrames);
  }

  void frames(std::span<const std::byte> data) override {
    const std::size_t frame_size = source_->raw.format.frame_size();
    while (!data.empty()) {
      const std::size_t wanted = std::min(data.size() / frame_size, kBlockFrames - held_);
      samples_.insert(samples_.end(), data.begin(),
                      data.begin() + static_cast<std::ptrdiff_t>(wanted * frame_size));
      numbers_.resize(held_ + wanted);
      std::iota(numbers_.end() - static_cast<std::ptrdiff_t>(wanted), numbers_.end(), next_);
      next_ += wanted;
      held_ += wanted;
      data = data.subspan(wanted * frame_size);
      if (held_ == kBlockFrames) flush();
    }
  }

  void gap(const Gap& gap) override { next_ += gap.frames_lost; }

  void flush() {
    if (held_ == 0) return;
    Block block{.frames = held_, .series = {}};
    for (const Series& series : source_->description.series) block.series.push_back(bytes_of(series));
    writer_.block(block);
    samples_.clear();
    numbers_.clear();
    held_ = 0;
  }

 private:
  std::span<const std::byte> bytes_of(const Series& series) {
    if (series.name == "frame") {
      if (series.element == Element::kUInt64) return std::as_bytes(std::span(numbers_));
      narrow_.resize(held_);
      std::transform(numbers_.begin(), numbers_.end(), narrow_.begin(),
                     [](std::uint64_t number) { return static_cast<std::uint32_t>(number); });
      return std::as_bytes(std::span(narrow_));
    }
    if (series.name == "thrust_N") return thrusts();
    return samples_;
  }

  std::span<const std::byte> thrusts() {
    const auto channels = static_cast<std::size_t>(source_->raw.format.channels);
    switch (source_->raw.format.type) {
      case SampleType::kInt16:
        to_thrust<std::int16_t>(samples_, channels, *source_->thrust, thrusts_);
        break;
      case SampleType::kUInt16:
        to_thrust<std::uint16_t>(samples_, channels, *source_->thrust, thrusts_);
        break;
      case SampleType::kFloat32:
        to_thrust<float>(samples_, channels, *source_->thrust, thrusts_);
        break;
      case SampleType::kFloat64:
        to_thrust<double>(samples_, channels, *source_->thrust, thrusts_);
        break;
    }
    return std::as_bytes(std::span(thrusts_));
  }

  Writer& writer_;
  const RecordingSource* source_ = nullptr;
  std::uint64_t next_ = 0;  // number of the next frame
  std::size_t held_ = 0;
  std::vector<std::byte> samples_;
  std::vector<std::uint64_t> numbers_;
  std::vector<std::uint32_t> narrow_;
  std::vector<float> thrusts_;
};

}  // namespace

std::vector<RecordingSource> recording_sources(const CampaignFile& file, const CampaignData& data,
                                               const Parts& parts,
                                               const std::map<std::string, std::string>& keys,
                                               std::vector<Absent>& absent) {
  std::vector<RecordingSource> sources;
  if (!parts.raw && !parts.thrusts) return sources;
  std::map<std::string, const Run*> runs;
  for (const Run& run : data.runs) runs.emplace(run.run, &run);
  const Tares tares = tares_of(data);
  for (const RawRun& raw : raw_runs(file)) {
    if (raw.state == RunState::kRecording) {
      absent.push_back({fmt::format("the frames of run {}", raw.run),
                        "it is being recorded, or its recorder was killed; the next `tunnelrig log` on this "
                        "file closes it"});
      continue;
    }
    std::uint64_t lost = 0;
    for (const Gap& gap : gaps_of(file, raw.id)) lost += gap.frames_lost;
    const auto found = runs.find(raw.run);
    const Run* run = found == runs.end() ? nullptr : found->second;
    RecordingSource source{.raw = raw, .description = {}, .thrust = {}};
    if (parts.thrusts && data.certificate && raw.format.channels >= data.info.rig.rotors)
      source.thrust = thrust_line(data, tares, raw, run);
    source.description = {
        .key = keys.at(raw.run),
        .run = raw.run,
        .location = run != nullptr ? run->location : "",
        .sample_rate_hz = recorded_rate_hz(ledger_of(file, raw.id), data.info.daq.sample_rate_hz),
        .frames = raw.frames,
        .series = series_of(raw, lost, parts, source.thrust)};
    sources.push_back(std::move(source));
  }
  return sources;
}

void stream_recordings(const CampaignFile& file, const std::vector<RecordingSource>& sources, Writer& writer,
                       const Progress& progress) {
  BlockSink sink(writer);
  std::size_t done = 0;
  for (const RecordingSource& source : sources) {
    writer.begin(source.description);
    sink.start(source);
    read_raw(file, source.raw, sink);
    sink.flush();
    writer.end();
    if (progress) progress(++done, sources.size());
  }
}

}  // namespace tunnelrig::exports
