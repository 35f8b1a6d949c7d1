#include "datasets/campaign_folder.h"

#include "datasets/calibration_doubts.h"
#include "datasets/error.h"
#include "datasets/import_doubts.h"
#include "datasets/npy.h"
#include "datasets/snapshot.h"
#include "datasets/staged_output.h"
#include "datasets/statistics_store.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <fstream>
#include <future>
#include <map>
#include <memory>
#include <set>
#include <system_error>

namespace tunnelrig {
namespace {

namespace fs = std::filesystem;

constexpr double kMostLost = 1e15;   // frames of one gap: some 20000 years
constexpr double kLargest_V = 1e12;  // beyond it squares leave what statistics can hold

struct FolderText {
  CampaignInfo info;
  Sheet runs, calibration;
  std::optional<Sheet> propellers;
  std::vector<Run> parsed_runs;
};

Sheet read_sheet(const fs::path& folder, const std::string& name) {
  Sheet sheet = read_csv(folder / name);
  sheet.file = name;
  return sheet;
}

FolderText read_folder_text(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError::in(folder.string(), "{}", absence(error, "there is no such campaign folder"));
  for (const char* name : {"campaign.toml", "calibration.csv", "runs.csv"}) {
    if (!fs::exists(folder / name, error))
      throw InputError::in(folder.string(), "the file {} {}", name, absence(error, "is missing"));
  }
  FolderText text;
  text.info = parse_campaign_toml(read_text(folder / "campaign.toml"), "campaign.toml");
  text.calibration = read_sheet(folder, "calibration.csv");
  parse_calibration(text.calibration, text.info.rig.rotors);
  if (fs::exists(folder / "propellers.csv", error)) {
    text.propellers = read_sheet(folder, "propellers.csv");
    parse_propellers(*text.propellers, text.info.rig.rotors);
  }
  text.runs = read_sheet(folder, "runs.csv");
  text.parsed_runs = parse_runs(text.runs, text.info);
  if (text.parsed_runs.empty()) throw InputError::in("runs.csv", "holds no run");
  return text;
}

fs::path raw_path(const fs::path& folder, const Run& run) {
  const fs::path relative(run.raw);
  const bool escapes =
      relative.is_absolute() ||
      std::any_of(relative.begin(), relative.end(), [](const fs::path& part) { return part == ".."; });
  if (escapes) {
    throw InputError::at("runs.csv", run.line, "column raw: '{}' must be a path inside the campaign folder",
                         run.raw);
  }
  std::error_code error;
  if (!fs::is_regular_file(folder / relative, error)) {
    throw InputError::at("runs.csv", run.line, "run {}: the raw file {} {}", run.run, run.raw,
                         absence(error, "is missing"));
  }
  return folder / relative;
}

fs::path gaps_path(fs::path raw) { return raw.replace_extension(".gaps.csv"); }

std::vector<Gap> read_gaps(const fs::path& path, std::uint64_t frames) {
  std::error_code error;
  if (!fs::exists(path, error)) return {};
  const Sheet sheet = read_csv(path);
  std::vector<Gap> gaps;
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    const double first = sheet.require_number(row, "first_frame");
    const double lost = sheet.require_number(row, "frames_lost");
    if (first != std::floor(first) || first < 0 || first > static_cast<double>(frames) ||
        (!gaps.empty() && first < static_cast<double>(gaps.back().first_frame))) {
      throw InputError(fmt::format("{}: {:g} is no frame index from 0 to {}, in ascending order",
                                   sheet.where(row, "first_frame"), first, frames));
    }
    if (lost != std::floor(lost) || lost < 1 || lost > kMostLost) {
      throw InputError(fmt::format("{}: {:g} is no whole number of frames, 1 {}",
                                   sheet.where(row, "frames_lost"), lost,
                                   lost > kMostLost ? "to 1e15" : "or more"));
    }
    const std::string& estimated = sheet.text(row, "estimated");
    if (!estimated.empty() && estimated != "0" && estimated != "1")
      throw InputError(fmt::format("{}: '{}' is neither 0 nor 1", sheet.where(row, "estimated"), estimated));
    gaps.push_back({static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(lost),
                    sheet.text(row, "cause"), estimated == "1"});
  }
  return gaps;
}

/// Gaps that belong to none of the arrays, by their name: what they say is lost would not count.
std::vector<std::string> unread_gaps(const fs::path& folder, const std::vector<Run>& runs) {
  std::set<fs::path> read, places;
  for (const Run& run : runs) {
    if (run.raw.empty()) continue;
    const fs::path gaps = gaps_path((folder / run.raw).lexically_normal());
    read.insert(gaps);
    places.insert(gaps.parent_path());
  }
  std::vector<std::string> doubts;
  for (const fs::path& place : places) {
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(place, error))
      if (entry.path().filename().string().ends_with(".gaps.csv") && !read.contains(entry.path()))
        doubts.push_back(fmt::format("{}: not read, since no run has an array of that name beside it",
                                     entry.path().lexically_relative(folder).generic_string()));
  }
  std::ranges::sort(doubts);
  return doubts;
}

template <typename Float>
void check_volts(std::span<const std::byte> data, int channels, const std::string& file) {
  for (std::size_t i = 0; i < data.size() / sizeof(Float); ++i) {
    Float value;
    std::memcpy(&value, data.data() + i * sizeof(Float), sizeof(Float));
    if (std::abs(static_cast<double>(value)) <= kLargest_V) continue;
    const auto wide = static_cast<std::size_t>(channels);
    throw InputError::in(file, "frame {}, channel {} is {:g}; every voltage must be {}", i / wide,
                         i % wide + 1, static_cast<double>(value),
                         std::isfinite(value) ? "at most 1e12 V, either way" : "a finite number");
  }
}

void check_samples(const NpyFile& npy, const CampaignInfo& info, const Run& run) {
  if (npy.frames() == 0)
    throw InputError::at("runs.csv", run.line, "run {}: {} holds zero frames", run.run, run.raw);
  if (npy.format().channels < info.rig.rotors) {
    throw InputError::at("runs.csv", run.line, "run {}: {} has {} channels for {} rotors", run.run, run.raw,
                         npy.format().channels, info.rig.rotors);
  }
  if (npy.format().type == SampleType::kFloat32)
    check_volts<float>(npy.data(), npy.format().channels, run.raw);
  if (npy.format().type == SampleType::kFloat64)
    check_volts<double>(npy.data(), npy.format().channels, run.raw);
}

/// What the numbers of a run show that its bytes do not.
void check_statistics(const RunStatistics& statistics, const CampaignInfo& info, const RawFormat& format,
                      const Run& run, bool allow_stuck) {
  const double top_V = info.daq.highest_count() * info.daq.volts_per_count();
  for (std::size_t c = 0; c < static_cast<std::size_t>(info.rig.rotors); ++c) {
    const ChannelStatistics& channel = statistics.channels[c];
    if (is_counts(format.type) && (channel.lowest_V < 0 || channel.highest_V > top_V)) {
      throw InputError::at(
          "runs.csv", run.line,
          "run {}: channel {} of {} leaves the converter's range of {} bits (0 to {} counts)", run.run, c + 1,
          run.raw, info.daq.adc_bits, info.daq.highest_count());
    }
    if (channel.stuck() && run.kind == RunKind::kThrust && !allow_stuck) {
      throw InputError::at(
          "runs.csv", run.line,
          "run {}: channel {} of {} is stuck at {:g} V for the {}; take the run out of runs.csv, "
          "or import with --allow-stuck to keep it marked",
          run.run, c + 1, run.raw, channel.lowest_V, statistics.frames == 1 ? "one frame" : "whole run");
    }
  }
}

void play(std::span<const std::byte> data, std::size_t frame_size, std::span<const Gap> gaps,
          FrameSink& sink) {
  std::uint64_t at = 0;
  for (const Gap& gap : gaps) {
    sink.frames(data.subspan(at * frame_size, (gap.first_frame - at) * frame_size));
    sink.gap(gap);
    at = gap.first_frame;
  }
  sink.frames(data.subspan(at * frame_size));
}

/// Stores raw runs one after the other; the statistics of the last few are computed meanwhile on other cores.
class RawImport {
 public:
  RawImport(CampaignFile& file, fs::path folder, const CampaignInfo& info, const ImportOptions& options,
            ImportSummary& summary)
      : file_(file),
        folder_(std::move(folder)),
        info_(info),
        options_(options),
        summary_(summary),
        volts_(info),
        overlaps_(info),
        stuck_tares_(info) {}

  void add(const Run& run) {
    const fs::path path = raw_path(folder_, run);
    auto raw = std::make_unique<RunInWork>(run, path);
    check_samples(raw->npy, info_, run);
    raw->gaps = read_gaps(gaps_path(path), raw->npy.frames());
    const RawFormat format = raw->npy.format();
    raw->summarizer = options_.summarizer(at_speed(info_, run.number("speed_rpm")), format);
    raw->statistics = std::async(std::launch::async, [&work = *raw, frame = format.frame_size()] {
      play(work.npy.data(), frame, work.gaps, *work.summarizer);
      return work.summarizer->finish("");
    });
    RawWriter writer(file_, run.run, format, static_cast<std::size_t>(kChunk_s * info_.daq.sample_rate_hz));
    play(raw->npy.data(), format.frame_size(), raw->gaps, writer);
    raw->hash = writer.finish(RunState::kComplete, {});
    raw->id = writer.id();
    in_work_.push_back(std::move(raw));
    if (in_work_.size() > kMostInWork) settle_oldest();
  }

  void finish() {
    while (!in_work_.empty()) settle_oldest();
    for (const std::string& doubt : volts_.doubts()) summary_.doubts.push_back(doubt);
    for (const std::string& doubt : overlaps_.doubts()) summary_.doubts.push_back(doubt);
    for (const std::string& doubt : stuck_tares_.doubts()) summary_.doubts.push_back(doubt);
  }

 private:
  static constexpr std::size_t kMostInWork = 2;

  struct RunInWork {
    RunInWork(const Run& planned, const fs::path& path) : run(planned), npy(path) {}

    Run run;
    NpyFile npy;
    std::vector<Gap> gaps;
    std::unique_ptr<RunSummarizer> summarizer;
    std::string hash;
    std::int64_t id = 0;
    std::future<RunStatistics> statistics;  // last: its thread, which uses the others, ends first
  };

  void settle_oldest() {
    const std::unique_ptr<RunInWork> raw = std::move(in_work_.front());
    in_work_.pop_front();
    RunStatistics statistics = raw->statistics.get();
    statistics.hash = raw->hash;
    check_statistics(statistics, info_, raw->npy.format(), raw->run, options_.allow_stuck);
    volts_.look_at(raw->run, raw->npy.format(), statistics);
    overlaps_.look_at(raw->run, statistics, raw->gaps);
    stuck_tares_.look_at(raw->run, statistics);
    store_statistics(file_, raw->id, statistics);
    summary_.raw_runs += 1;
    summary_.frames += raw->npy.frames();
    summary_.raw_bytes += raw->npy.data().size();
  }

  CampaignFile& file_;
  fs::path folder_;
  const CampaignInfo& info_;
  const ImportOptions& options_;
  ImportSummary& summary_;
  VoltDoubt volts_;
  OverlapDoubt overlaps_;
  StuckTareDoubt stuck_tares_;
  std::deque<std::unique_ptr<RunInWork>> in_work_;
};

/// Writes a stored run as .npy while it is read.
class NpySink : public FrameSink {
 public:
  NpySink(const fs::path& path, const RawRun& run) : out_(path, std::ios::binary) {
    out_ << format_npy_header(run.format, run.frames);
  }
  void frames(std::span<const std::byte> data) override {
    out_.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  }
  void gap(const Gap& gap) override { gaps_.push_back(gap); }
  bool close() {
    out_.close();
    return out_.good();
  }
  const std::vector<Gap>& gaps() const { return gaps_; }

 private:
  std::ofstream out_;
  std::vector<Gap> gaps_;
};

/// The two columns that there must be, and of those that there may be the ones that say something: what came
/// with two goes with two.
Sheet gap_sheet(const std::vector<Gap>& gaps) {
  Sheet sheet{.file = "", .columns = {"first_frame", "frames_lost"}, .rows = {}};
  const bool causes = std::ranges::any_of(gaps, [](const Gap& gap) { return !gap.cause.empty(); });
  const bool estimates = std::ranges::any_of(gaps, [](const Gap& gap) { return gap.estimated; });
  if (causes) sheet.columns.emplace_back("cause");
  if (estimates) sheet.columns.emplace_back("estimated");
  for (const Gap& gap : gaps) {
    std::vector<std::string> cells{fmt::format("{}", gap.first_frame), fmt::format("{}", gap.frames_lost)};
    if (causes) cells.push_back(gap.cause);
    if (estimates) cells.emplace_back(gap.estimated ? "1" : "0");
    sheet.rows.push_back({std::move(cells), 0});
  }
  return sheet;
}

void export_raw_run(const CampaignFile& file, const RawRun& raw, const fs::path& path) {
  fs::create_directories(path.parent_path());
  NpySink sink(path, raw);
  read_raw(file, raw, sink);
  if (!sink.close()) throw InputError::in(path.string(), "cannot be written; is the disk full?");
  if (!sink.gaps().empty()) write_text(gaps_path(path), format_csv(gap_sheet(sink.gaps())));
}

using RecordingsByPath = std::map<fs::path, std::string>;  // path without extension: a hash

/// As the row says; where another recording is there already, another name beside it.
std::string path_of(const Run& run, const RawRun& raw, RecordingsByPath& taken) {
  const fs::path asked(run.raw);
  fs::path path = asked;
  const auto is_taken = [&] {
    fs::path key = path.lexically_normal().replace_extension();  // the gaps' file is named without it
    return taken.emplace(std::move(key), raw.hash).first->second != raw.hash;
  };
  for (int i = 2; is_taken(); ++i)
    path.replace_filename(fmt::format("{}-{}{}", asked.stem().string(), i, asked.extension().string()));
  return path.string();
}

/// A folder knows whole recordings only: what reduce leaves out of the file it must leave out of the
/// folder's.
void exclude_if_not_whole(const RawRun& raw, Sheet& runs, std::size_t row) {
  if (raw.state == RunState::kComplete) return;
  std::string& excluded = runs.rows[row].cells[runs.ensure("excluded")];
  if (excluded.empty()) excluded = "its recording is partial";
}

void write_folder(const CampaignFile& file, const fs::path& folder, const Progress& progress) {
  write_text(folder / "campaign.toml", file.info().toml);
  const Sheet no_points{.file = "", .columns = {"cell", "applied_force_N", "voltage_V"}, .rows = {}};
  write_text(folder / "calibration.csv", format_csv(file.sheet("calibration").value_or(no_points)));
  if (const auto sheet = file.sheet("propellers")) write_text(folder / "propellers.csv", format_csv(*sheet));
  auto sheet = file.sheet("runs");
  const std::vector<Run> runs = file.runs();
  RecordingsByPath taken;
  std::size_t done = 0;
  for (const Run& run : runs) {
    if (const auto raw = raw_run(file, run.run)) {
      const std::string path = path_of(run, *raw, taken);
      sheet->rows[run.row].cells[sheet->require("raw")] = path;
      exclude_if_not_whole(*raw, *sheet, run.row);
      export_raw_run(file, *raw, folder / path);
    }
    if (progress) progress(++done, runs.size());
  }
  if (sheet) write_text(folder / "runs.csv", format_csv(*sheet));
}

}  // namespace

ImportSummary import_campaign_folder(const fs::path& folder, const fs::path& file,
                                     const ImportOptions& options) {
  const FolderText text = read_folder_text(folder);
  StagedCampaign staged(file, options.replace);
  CampaignFile& campaign = staged.file();
  campaign.set_text("campaign.toml", text.info.toml);
  campaign.set_sheet("calibration", text.calibration);
  if (text.propellers) campaign.set_sheet("propellers", *text.propellers);
  campaign.set_sheet("runs", text.runs);
  ImportSummary summary{.runs = text.parsed_runs.size(),
                        .doubts = import_doubts(text.info, text.runs, text.parsed_runs)};
  std::size_t done = 0;
  RawImport raw(campaign, folder, text.info, options, summary);
  for (const Run& run : text.parsed_runs) {
    if (!run.raw.empty()) raw.add(run);
    if (options.progress) options.progress(++done, text.parsed_runs.size());
  }
  raw.finish();
  for (std::string& doubt : unread_gaps(folder, text.parsed_runs)) summary.doubts.push_back(std::move(doubt));
  for (std::string& doubt : calibration_doubts(campaign, campaign.calibration_points()))
    summary.doubts.push_back(std::move(doubt));
  staged.publish();
  return summary;
}

std::vector<std::string> export_campaign_folder(const CampaignFile& file, const fs::path& folder,
                                                const Progress& progress) {
  const Snapshot snapshot(file);
  StagedOutput staged(folder, StagedOutput::Kind::kFolder);
  staged.write([&] { write_folder(file, staged.path(), progress); });
  staged.publish();
  return unfinished_runs(file);
}

}  // namespace tunnelrig
