// What was set up and recorded.
#include "analysis/exports/table_builder.h"
#include "analysis/exports/tables.h"
#include "datasets/lower_case.h"
#include "datasets/recorded_rate.h"

#include <algorithm>
#include <set>
#include <utility>

namespace tunnelrig::exports {
namespace {

constexpr std::size_t kLongestKey = 55;  // MATLAB's 63 less what its variables begin with

/// Makes names different even where capitals are not told apart, by a number behind them.
class NamesTaken {
 public:
  std::string take(const std::string& wanted, std::size_t longest = 63) {
    std::string name = wanted;
    for (int n = 2; !taken_.insert(lower_case(name)).second; ++n) {
      const std::string number = fmt::format("_{}", n);
      name = wanted.substr(0, std::min(wanted.size(), longest - number.size())) + number;
    }
    return name;
  }

 private:
  std::set<std::string> taken_;
};

std::string key_of(const std::map<std::string, std::string>& keys, const std::string& run) {
  const auto found = keys.find(run);
  return found == keys.end() ? std::string() : found->second;
}

struct Recorded {
  RawRun raw;
  std::string key;
  std::uint64_t lost = 0;
  std::optional<Ledger> ledger;
};

std::vector<Recorded> recorded(const CampaignFile& file, const std::vector<RawRun>& raw,
                               const std::map<std::string, std::string>& keys) {
  std::vector<Recorded> all;
  for (const RawRun& run : raw) {
    Recorded one{.raw = run, .key = key_of(keys, run.run), .ledger = ledger_of(file, run.id)};
    for (const Gap& gap : gaps_of(file, run.id)) one.lost += gap.frames_lost;
    all.push_back(std::move(one));
  }
  return all;
}

/// Of a recording that has a ledger; imported ones have none.
template <typename Member>
auto ledger_number(Member member) {
  return [member](const Recorded& one) -> std::optional<double> {
    if (!one.ledger) return {};
    const auto& value = (*one.ledger).*member;
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>)
      return static_cast<double>(value);
    else
      return value;
  };
}

auto ledger_text(std::string Ledger::*member) {
  return [member](const Recorded& one) { return one.ledger ? (*one.ledger).*member : std::string(); };
}

struct LostFrames {
  std::string run, key;
  Gap gap;
  std::uint64_t first_lost = 0;
};

struct ChannelOfRun {
  std::string run;
  std::size_t channel = 0;
  const ChannelStatistics* statistics = nullptr;
};

}  // namespace

std::map<std::string, std::string> recording_keys(const std::vector<RawRun>& raw) {
  NamesTaken names;
  std::map<std::string, std::string> keys;
  for (const bool own : {true, false}) {  // who has a plain name keeps it
    for (const RawRun& run : raw) {
      const std::string plain = plain_name(run.run).substr(0, kLongestKey);
      if ((plain == run.run) == own) keys.emplace(run.run, names.take(plain, kLongestKey));
    }
  }
  return keys;
}

Table campaign_table(const CampaignInfo& info) {
  const std::vector<CampaignInfo> one{info};
  using Info = const CampaignInfo&;
  const auto tunnel = [](double Tunnel::*side) {
    return [side](Info c) { return c.tunnel ? std::optional((*c.tunnel).*side) : std::nullopt; };
  };
  return TableBuilder("campaign", "Rig, tunnel and electronics", one)
      .column("name", "", "Of the campaign", &CampaignInfo::name)
      .column("rotors", "1", "Number of rotors", [](Info c) { return c.rig.rotors; })
      .column("propeller_radius_m", "R", [](Info c) { return c.rig.propeller_radius_m; })
      .column("rotor_area_m2", "A of the thrust coefficient", [](Info c) { return c.rig.rotor_area_m2; })
      .column("arm_length_m", "Centre of the vehicle to a rotor's axis",
              [](Info c) { return c.rig.arm_length_m; })
      .column("vehicle_width_m", "w_q, tip to tip", [](Info c) { return c.rig.vehicle_width_m; })
      .column("vehicle_height_m", "h_q", [](Info c) { return c.rig.vehicle_height_m; })
      .column("nominal_speed_rpm", "Speed that the motors are set to",
              [](Info c) { return c.rig.nominal_speed_rpm; })
      .column("blade_chord_m", "At 0.5 R", [](Info c) { return c.rig.blade_chord_m; })
      .column("tunnel_width_m", "w_t; not known in open space", tunnel(&Tunnel::width_m))
      .column("tunnel_height_m", "h_t; not known in open space", tunnel(&Tunnel::height_m))
      .column("sample_rate_hz", "Frames per second", [](Info c) { return c.daq.sample_rate_hz; })
      .column("adc_bits", "1", "Of the converter", [](Info c) { return c.daq.adc_bits; })
      .column("adc_reference_V", "Of the converter", [](Info c) { return c.daq.adc_reference_V; })
      .column("volts_per_count", "V", "Volts are counts times this",
              [](Info c) { return c.daq.volts_per_count(); })
      .take();
}

Table runs_table(const std::vector<Run>& runs, const std::map<std::string, std::string>& keys) {
  TableBuilder<Run> table("runs", "runs.csv: one row per run", runs);
  table.column("run", "", "Name of the run", &Run::run)
      .column("key", "", "Name of its recording here; empty where it has none",
              [&](const Run& run) { return key_of(keys, run.run); })
      .column("location", "", "Where it was flown", &Run::location)
      .column("repeat", "1", "Number of the repeat", &Run::repeat)
      .column("session", "", "One set-up of the rig on one day", &Run::session)
      .column("start_utc", "", "First frame, ISO 8601",
              [](const Run& run) { return format_utc(run.start_s); })
      .column("start_s", "First frame, seconds since 1970-01-01T00:00Z", &Run::start_s)
      .column("kind", "", "thrust, or tare: motors stopped",
              [](const Run& run) { return run.kind == RunKind::kTare ? "tare" : "thrust"; })
      .column("y_norm", "Normalised tunnel coordinate, right is positive", &Run::y_norm)
      .column("z_norm", "Normalised tunnel coordinate, up is positive", &Run::z_norm);
  NamesTaken names;
  for (const char* known :
       {"run", "key", "location", "repeat", "session", "start_utc", "start_s", "kind", "y_norm", "z_norm"})
    names.take(known);
  std::set<std::string> numbers, labels;
  for (const Run& run : runs) {
    for (const auto& [name, value] : run.numbers) numbers.insert(name);
    for (const auto& [name, value] : run.labels) labels.insert(name);
  }
  for (const char* known : {"y_norm", "z_norm"}) numbers.erase(known);
  for (const std::string& name : numbers) {
    table.column(names.take(plain_name(name)), std::string(unit_in_name(name)),
                 fmt::format("Column {} of runs.csv", name),
                 [&](const Run& run) { return run.number(name); });
  }
  for (const std::string& name : labels) {
    table.column(names.take(plain_name(name)), "", fmt::format("Column {} of runs.csv", name),
                 [&](const Run& run) {
                   const auto found = run.labels.find(name);
                   return found == run.labels.end() ? std::string() : found->second;
                 });
  }
  return table.take();
}

Table recordings_table(const CampaignFile& file, const std::vector<RawRun>& raw,
                       const std::map<std::string, std::string>& keys, const Daq& daq) {
  const std::vector<Recorded> rows = recorded(file, raw, keys);
  return TableBuilder("recordings", "One row per recording, with its loss ledger (empty where imported)",
                      rows)
      .column("run", "", "Name of the run", [](const Recorded& one) { return one.raw.run; })
      .column("key", "", "Name of its recording here", &Recorded::key)
      .column("state", "", "complete, partial, or recording",
              [](const Recorded& one) { return std::string(name_of(one.raw.state)); })
      .column("sample_type", "", "int16, uint16: counts; float32, float64: volts",
              [](const Recorded& one) { return std::string(name_of(one.raw.format.type)); })
      .column("channels", "1", "Channels of a frame",
              [](const Recorded& one) { return one.raw.format.channels; })
      .column("frames", "1", "Frames that are stored", [](const Recorded& one) { return one.raw.frames; })
      .column("frames_lost", "1", "Frames that are missing between them", &Recorded::lost)
      .column("sample_rate_hz", "Frames per second",
              [&](const Recorded& one) { return recorded_rate_hz(one.ledger, daq.sample_rate_hz); })
      .column("board_rate_hz", "Frames per second as fitted against the computer's clock",
              ledger_number(&Ledger::board_rate_hz))
      .column("rate_interval_hz", "Half of that rate's 95 % interval",
              ledger_number(&Ledger::rate_interval_hz))
      .column("drift_ppm_h", "Change of that rate", ledger_number(&Ledger::drift_ppm_h))
      .column("frames_emitted", "1", "Stored and lost", ledger_number(&Ledger::frames_emitted))
      .column("frames_duplicate", "1", "Arrived again, dropped", ledger_number(&Ledger::frames_duplicate))
      .column("frames_late", "1", "Arrived too late, dropped", ledger_number(&Ledger::frames_late))
      .column("frames_overrun", "1", "With the board's flag", ledger_number(&Ledger::frames_overrun))
      .column("frames_adc_error", "1", "With the board's flag", ledger_number(&Ledger::frames_adc_error))
      .column("frames_clipped", "1", "With the board's flag of a channel at the converter's end",
              ledger_number(&Ledger::frames_clipped))
      .column("frames_test_pattern", "1", "With the board's flag: no measurements",
              ledger_number(&Ledger::frames_test_pattern))
      .column("packets_corrupt", "1", "Could not be used", ledger_number(&Ledger::packets_corrupt))
      .column("bytes_skipped", "1", "Could not be used", ledger_number(&Ledger::bytes_skipped))
      .column("reboots", "1", "Of the board", ledger_number(&Ledger::reboots))
      .column("silences", "1", "Seconds without a new frame", ledger_number(&Ledger::silences))
      .column("boot_id", "1", "Of the first frame", ledger_number(&Ledger::boot_id))
      .column("first_sequence", "1", "Number that the board gave frame 0",
              ledger_number(&Ledger::first_sequence))
      .column("end_reason", "", "Why the recording ended", ledger_text(&Ledger::end_reason))
      .column("source", "", "Where the bytes came from", ledger_text(&Ledger::source))
      .column("board_serial", "", "Serial number of the board, where its source knows",
              ledger_text(&Ledger::board_serial))
      .column("conversions_per_frame", "1", "Of each channel, by the board; 0: its source does not know",
              ledger_number(&Ledger::conversions_per_frame))
      .column("hash", "", "Of the raw data", [](const Recorded& one) { return one.raw.hash; })
      .take();
}

Table lost_frames_table(const CampaignFile& file, const std::vector<RawRun>& raw,
                        const std::map<std::string, std::string>& keys) {
  std::vector<LostFrames> rows;
  for (const RawRun& run : raw) {
    std::uint64_t lost = 0;
    for (const Gap& gap : gaps_of(file, run.id)) {
      rows.push_back({run.run, key_of(keys, run.run), gap, gap.first_frame + lost});
      lost += gap.frames_lost;
    }
  }
  return TableBuilder("lost_frames", "One row per gap: frames that were sampled and never arrived", rows)
      .column("run", "", "Name of the run", &LostFrames::run)
      .column("key", "", "Name of its recording here", &LostFrames::key)
      .column("frame", "1", "Number of the first lost frame; `frame` of the recording skips it",
              &LostFrames::first_lost)
      .column("frames_lost", "1", "How many are missing",
              [](const LostFrames& l) { return l.gap.frames_lost; })
      .column("row", "1", "Row of the recording, from 0, that stands behind the gap",
              [](const LostFrames& l) { return l.gap.first_frame; })
      .column("cause", "", "Why; docs/loss-ledger.md", [](const LostFrames& l) { return l.gap.cause; })
      .column("estimated", "1", "1: their number comes from a clock",
              [](const LostFrames& l) { return l.gap.estimated; })
      .take();
}

Table channel_statistics_table(const CampaignData& data) {
  std::vector<ChannelOfRun> rows;
  for (const Run& run : data.runs) {
    const auto found = data.statistics.find(run.run);
    if (found == data.statistics.end()) continue;
    for (std::size_t c = 0; c < found->second.channels.size(); ++c)
      rows.push_back({run.run, c + 1, &found->second.channels[c]});
  }
  const auto of = [](auto member) {
    return [member](const ChannelOfRun& row) { return row.statistics->*member; };
  };
  return TableBuilder("channel_statistics", "One row per run and channel; docs/run-statistics.md", rows)
      .column("run", "", "Name of the run", &ChannelOfRun::run)
      .column("channel", "1", "1 is rotor 1", &ChannelOfRun::channel)
      .column("mean_V", "Mean", of(&ChannelStatistics::mean_V))
      .column("std_V", "Standard deviation of the samples", of(&ChannelStatistics::std_V))
      .column("standard_error_V", "Of the mean, autocorrelation included",
              of(&ChannelStatistics::standard_error_V))
      .column("drift_V", "Straight line through the run, end minus start", of(&ChannelStatistics::drift_V))
      .column("drift_z", "1", "Drift over its standard error", of(&ChannelStatistics::drift_z))
      .column("lowest_V", "Lowest sample", of(&ChannelStatistics::lowest_V))
      .column("highest_V", "Highest sample", of(&ChannelStatistics::highest_V))
      .column("clipped", "1", "Samples at an end of the converter's range", of(&ChannelStatistics::clipped))
      .column("shaft_hz", "The shaft's line in the spectrum", of(&ChannelStatistics::shaft_hz))
      .take();
}

}  // namespace tunnelrig::exports
