#include "analysis/implausible_thrust.h"
#include "analysis/misread_runs.h"
#include "analysis/model/model_store.h"
#include "analysis/reduction_output.h"
#include "analysis/table_reduction.h"
#include "cli/console.h"
#include "cli/result.h"
#include "cli/verb.h"
#include "datasets/error.h"
#include "datasets/output_place.h"
#include "datasets/statistics_store.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::cli {
namespace {

struct ReduceOptions {
  std::string db, csv, runs_csv, plot, convention, model, terms;
  bool from_raw = false, no_spectra = false, json = false;
};

std::string inputs_json(const CampaignData& data, const Reduction& reduction) {
  return nlohmann::json{{"calibration", data.certificate_id},
                        {"points", data.certificate ? data.certificate->points_hash : ""},
                        {"model", reduction.model.version}}
      .dump();
}

/// Without spectra the lines that are stored stay: effects of an adopted model may go by them.
void keep_lines(const RunStatistics& stored, RunStatistics& computed) {
  for (std::size_t c = 0; c < std::min(stored.channels.size(), computed.channels.size()); ++c) {
    computed.channels[c].lines = stored.channels[c].lines;
    computed.channels[c].shaft_hz = stored.channels[c].shaft_hz;
  }
}

/// Recomputes what is stored of the raw data and says where the two differ; afterwards the new values count.
/// True where all agreed.
bool refresh_from_raw(const ReduceOptions& options, CampaignData& data) {
  ProgressBar bar("from raw");
  auto computed = statistics_from_raw(options.db, !options.no_spectra, show_on(bar));
  const auto lines = disagreements(data.statistics, computed);
  for (const std::string& line : lines) warn(line);
  const bool anew = !options.no_spectra && !lines.empty();
  if (anew && !can_be_changed(options.db)) {
    warn(fmt::format("{}: cannot be written, so the new statistics are not stored in it", options.db));
  } else if (anew) {
    CampaignFile file(options.db, CampaignFile::Access::kWrite);
    file.atomically([&] {
      for (const auto& [run, statistics] : computed) store_statistics(file, data.raw.at(run).id, statistics);
    });
    tell(fmt::format("{}: the statistics of {} runs were stored anew\n", options.db, computed.size()));
  }
  for (auto& [run, statistics] : computed) {
    if (options.no_spectra) keep_lines(data.statistics[run], statistics);
    data.statistics[run] = std::move(statistics);
  }
  return lines.empty();
}

void print_summary(const CampaignData& data, const Reduction& reduction, const Summary& summary,
                   Convention convention) {
  const double factor = convert_coefficient(1, Convention::kThesis, convention, data.info.rig);
  const bool has_u = data.info.rig.rotors == kMaxRotors;
  const auto number = [](double value, const char* format) {
    return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
  };
  const auto place = [](std::optional<double> value) { return value ? fmt::format("{:g}", *value) : "-"; };
  const bool is_whole = summary.u95_without.empty();
  Table table({"location", "y_norm", "z_norm", "runs", "C_T", "std", is_whole ? "U95" : "U95*", "U [%]",
               "std [%]", is_whole ? "U95 [%]" : "U95* [%]", "thrust [N]"});
  for (const LocationSummary& location : summary.locations) {
    table.add({location.label, place(location.y_norm), place(location.z_norm),
               fmt::format("{}", location.runs), number(factor * location.c_t.mean, "{:.5f}"),
               number(factor * location.c_t.std, "{:.5f}"), number(factor * location.c_t.u95, "{:.5f}"),
               has_u ? number(location.u_percent.mean, "{:.3f}") : "-",
               has_u ? number(location.u_percent.std, "{:.3f}") : "-",
               has_u ? number(location.u_percent.u95, "{:.3f}") : "-", number(location.thrust_N, "{:.3f}")});
  }
  table.print();
  fmt::print("\n{} runs at {} locations; model {}, convention {}\n", reduction.runs.size(),
             summary.locations.size(), reduction.model_name(), name_of(convention));
  if (!is_whole)
    fmt::print("*: without the scatter between {}, which this campaign does not show: too small\n",
               fmt::join(summary.u95_without, " and "));
  for (const std::string& note : summary.notes) fmt::print("note: {}\n", note);
}

/// True where it is a mistake for certain.
bool warn_of(const std::optional<ImplausibleThrust>& doubt) {
  if (doubt) warn(fmt::format("{}: {}", doubt->found, doubt->advice));
  return doubt && doubt->certain;
}

/// Tares whose zeros clipped samples bias.
std::size_t clipped_tares(const CampaignData& data) {
  const auto tares = recorded_runs(data, RunKind::kTare);
  const std::ptrdiff_t rotors = data.info.rig.rotors;
  return static_cast<std::size_t>(std::ranges::count_if(tares, [&](std::size_t tare) {
    const auto& channels = data.statistics.at(data.runs[tare].run).channels;
    return std::any_of(channels.begin(), channels.begin() + rotors,
                       [](const ChannelStatistics& channel) { return channel.clipped > 0; });
  }));
}

/// Says what was left out, and what cannot be. True where that needs mending.
bool warn_of_left_out(const CampaignData& data, const Reduction& reduction) {
  bool problem = false;
  for (const LeftOutRun& run : reduction.left_out) {
    warn(fmt::format("run {} is left out: {}", run.run, run.reason));
    problem |= run.problem;
  }
  std::size_t clipped = 0, moving = 0, untared = 0;
  for (const RunCoefficients& run : reduction.runs) {
    clipped += run.clipped > 0 ? 1 : 0;
    moving += run.stationary ? 0 : 1;
    untared += run.zero_from_calibration ? 1 : 0;
  }
  if (const std::size_t tares = clipped_tares(data); clipped + tares > 0)
    warn(fmt::format("{} runs{} hold clipped samples, which bias their means (`tunnelrig doctor`)",
                     clipped + tares, tares > 0 ? fmt::format(" ({} of them tares)", tares) : ""));
  if (moving > 0)
    warn(fmt::format("{} runs drift by more than their noise explains (`tunnelrig doctor`)", moving));
  if (untared > 0 && data.certificate) {
    warn(fmt::format("{} runs have no tare in their session; their zero is the calibration's, extrapolated",
                     untared));
  }
  for (const std::string& misread : in_words(misread_runs(data))) {
    warn(misread);
    problem = true;
  }
  problem |= warn_of(implausible_thrust(data, reduction));
  return problem;
}

int reduce_campaign(const ReduceOptions& options, const CLI::App& verb, const CampaignFile& file) {
  refuse_given(verb, {"--plot"},
               "draws a table of observations; `map` and `report --figures` draw a campaign");
  if (!options.from_raw) refuse_given(verb, {"--no-spectra"}, "goes with --from-raw, which computes them");
  CampaignData data = read_campaign_data(file);
  const bool agreed = !options.from_raw || refresh_from_raw(options, data);
  const Convention convention =
      convention_from_name(options.convention.empty() ? "thesis" : options.convention);
  const Reduction reduction = reduce_by(data, choose_model(file, options.model, options.terms));
  const Summary summary = summarize_locations(data, reduction);
  const bool problem = warn_of_left_out(data, reduction);
  const std::string json = reduction_json(data, reduction, summary, convention);
  if (!options.csv.empty())
    write_text(options.csv, locations_csv(summary, reduction, data.info.rig, convention));
  if (!options.runs_csv.empty()) write_text(options.runs_csv, runs_csv(data, reduction, convention));
  keep_result(options.db, "reduction", inputs_json(data, reduction), json);
  if (options.json)
    fmt::print("{}\n", json);
  else
    print_summary(data, reduction, summary, convention);
  return problem || !agreed ? kProblemFound : kWell;
}

void print_table(const TableReduction& reduction, Convention convention) {
  Table table({"group", "rows", "speed from [rpm]", "to [rpm]", "C_T median", "spread", "C_T at the lowest",
               "at the highest"});
  const auto number = [](double value, int decimals) {
    return std::isnan(value) ? "-" : fmt::format("{:.{}f}", value, decimals);
  };
  for (const TableGroup& group : reduction.groups) {
    table.add({group.name, fmt::format("{}", group.rows.size()), number(group.lowest_speed_rpm, 0),
               number(group.highest_speed_rpm, 0), number(group.median, 5), number(group.spread, 5),
               number(group.at_lowest, 5), number(group.at_highest, 5)});
  }
  table.print();
  fmt::print("\n{} observations in {} groups; convention {}\n", reduction.rows.size(),
             reduction.groups.size(), name_of(convention));
  if (reduction.at_rest > 0) {
    fmt::print("{} rows are left out: the motor stood, or its tachometer had not locked\n",
               reduction.at_rest);
  }
}

/// Says what of a table is not to be believed. True where that needs mending.
bool warn_of_table(const TableReduction& reduction) {
  if (!reduction.doubtful.empty()) {
    warn(
        fmt::format("{} rows have a C_T more than three times off their group's median; the first is {}: is "
                    "the speed right?",
                    reduction.doubtful.size(), reduction.doubtful.front()));
  }
  const auto pulls = std::count_if(reduction.groups.begin(), reduction.groups.end(),
                                   [](const TableGroup& group) { return group.median < 0; });
  if (pulls > 0) {
    warn(fmt::format("{} groups have a negative C_T: their propeller pulled on the stand the other way",
                     pulls));
  }
  if (reduction.unknown > 0) {
    warn(fmt::format("{} rows are left out: their speed, air or propeller diameter is not known",
                     reduction.unknown));
  }
  const bool implausible = warn_of(implausible_thrust(reduction));
  return reduction.unknown > 0 || implausible;
}

int reduce_table(const ReduceOptions& options, const CLI::App& verb, const CampaignFile& file) {
  if (!options.model.empty() && options.model != "thesis")
    throw InputError(fmt::format("--model {}: a table is reduced as it is, without a model", options.model));
  refuse_given(verb, {"--with"}, "a table is reduced as it is, without a model");
  refuse_given(verb, {"--runs-csv"}, "a table has no runs; --csv writes a row per observation");
  refuse_given(verb, {"--from-raw", "--no-spectra"}, "a table has no raw data");
  const Convention convention =
      convention_from_name(options.convention.empty() ? "propeller" : options.convention);
  const TableReduction reduction = reduce_table_rows(observations_of(file), convention);
  if (!options.csv.empty()) write_text(options.csv, observations_csv(reduction));
  if (!options.plot.empty()) {
    if (const auto reason = draw_coefficients(reduction, options.plot))
      throw InputError(fmt::format("--plot {}: {}", options.plot, *reason));
  }
  if (options.json)
    fmt::print("{}\n", table_reduction_json(reduction));
  else
    print_table(reduction, convention);
  return warn_of_table(reduction) ? kProblemFound : kWell;
}

int run_reduce(const ReduceOptions& options, const CLI::App& verb) {
  check_distinct({{"--csv", options.csv}, {"--runs-csv", options.runs_csv}, {"--plot", options.plot}});
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  return file.text("table.toml") ? reduce_table(options, verb, file) : reduce_campaign(options, verb, file);
}

}  // namespace

void add_reduce(CLI::App& app, Work& work) {
  auto options = std::make_shared<ReduceOptions>();
  CLI::App* verb =
      app.add_subcommand("reduce", "Runs to calibrated thrusts, C_T and U, per run and per location");
  verb->footer(
      "U95 is the expanded uncertainty (95 %); docs/reduction.md has its budget. A table of observations is "
      "reduced to C_T per row.\n\n"
      "Examples: tunnelrig reduce --db my.db --csv coefficients.csv\n"
      "          tunnelrig reduce --db my.db --model thesis --with air_pressure,rotor_speed --json");
  verb->add_option("--db", options->db, "Campaign file")->required();
  verb->add_option("--csv", options->csv, "Write one row per location (of a table: per observation)");
  verb->add_option("--runs-csv", options->runs_csv, "Write one row per run");
  add_model_options(*verb, options->model, options->terms);
  verb->add_option("--convention", options->convention,
                   "Of C_T: thesis, helicopter or propeller (thesis; of a table: propeller)");
  verb->add_option("--plot", options->plot, "Of a table: draw C_T against speed (.svg or .png)");
  verb->add_flag("--from-raw", options->from_raw,
                 "Compute the runs' statistics again from their raw data, and compare");
  verb->add_flag("--no-spectra", options->no_spectra, "With --from-raw: leave the spectra out");
  verb->add_flag("--json", options->json, "Print as JSON");
  verb->callback([options, verb, &work] { work = [options, verb] { return run_reduce(*options, *verb); }; });
}

}  // namespace tunnelrig::cli
