#include "analysis/implausible_thrust.h"
#include "analysis/maps/measured_region.h"
#include "analysis/maps/write_maps.h"
#include "analysis/model/model_store.h"
#include "analysis/reduction_output.h"
#include "cli/console.h"
#include "cli/result.h"
#include "cli/verb.h"
#include "datasets/error.h"
#include "datasets/first_few.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::cli {
namespace {

constexpr std::size_t kNamedLocations = 6;  // in a warning

struct MapOptions {
  std::string db, out, method = "gaussian-process", model, terms;
  int nodes = 41;
  bool json = false;
};

nlohmann::ordered_json fit_json(const FitSummary& fit) {
  nlohmann::ordered_json json{{"leave_one_out_rms_percent", fit.leave_one_out.rms_percent},
                              {"hyperparameters", fit.hyperparameters}};
  if (fit.leave_one_out.standardised_rms)
    json["leave_one_out_standardised"] = *fit.leave_one_out.standardised_rms;
  if (fit.offset) {
    json["offset_percent"] = fit.offset->value_percent;
    json["offset_u95_percent"] = fit.offset->u95_percent;
  }
  return json;
}

/// So that the greatest of them has two digits that count; `least` at least.
int decimals_for(std::initializer_list<double> values, int least) {
  constexpr int kMostDecimals = 6;
  double greatest = 0;
  for (const double value : values) greatest = std::max(greatest, std::abs(value));
  if (!(greatest > 0) || !std::isfinite(greatest)) return least;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(greatest))), least, kMostDecimals);
}

/// Without the sign of what is rounded to 0.
std::string rounded_text(double value, int decimals) {
  const double unit = std::pow(10, decimals);
  return fmt::format("{:.{}f}", std::round(value * unit) / unit + 0.0, decimals);
}

/// With its uncertainty, where that is known.
std::string offset_text(const RigOffset& offset) {
  const int decimals = decimals_for({offset.u95_percent}, 2);
  const std::string value = rounded_text(offset.value_percent, decimals);
  return std::isnan(offset.u95_percent)
             ? fmt::format("{} %, of unknown uncertainty", value)
             : fmt::format("{} ± {} %", value, rounded_text(offset.u95_percent, decimals));
}

void print(const WrittenMaps& written, double beyond) {
  Table table(
      {"map", "lowest [%]", "highest [%]", "median U95 [%]", "leave-one-out rms [%]", "standardised"});
  const auto row = [&](const char* name, const MapLayer& layer, const FitSummary& fit) {
    std::vector<double> u95 = layer.u95_known() ? layer.u95_percent : std::vector<double>();
    std::nth_element(u95.begin(), u95.begin() + static_cast<std::ptrdiff_t>(u95.size() / 2), u95.end());
    const auto [low, high] = std::minmax_element(layer.value_percent.begin(), layer.value_percent.end());
    const auto& standardised = fit.leave_one_out.standardised_rms;
    const double left_out = fit.leave_one_out.rms_percent;
    const std::optional<double> median = u95.empty() ? std::nullopt : std::optional(u95[u95.size() / 2]);
    const int decimals = decimals_for({*low, *high}, 2),
              of_errors = decimals_for({median.value_or(left_out), left_out}, 3);
    table.add({name, rounded_text(*low, decimals), rounded_text(*high, decimals),
               median ? rounded_text(*median, of_errors) : "-", rounded_text(left_out, of_errors),
               standardised ? fmt::format("{:.2f}", *standardised) : "-"});
  };
  row("change of C_T against OT", written.map.delta_ct, written.map.delta_ct_fit);
  row("uneven thrust U", written.map.uneven_thrust, written.map.uneven_thrust_fit);
  table.print();
  fmt::print("\n");
  if (const auto& offset = written.map.uneven_thrust_fit.offset)
    fmt::print("offset of the rig in U, taken out of the map: {}\n", offset_text(*offset));
  fmt::print("{:.0f} % of the square is beyond the locations and their mirror images\n", 100 * beyond);
  fmt::print("{} locations, {}; {} files in {}\n", written.map.locations.size(), written.map.method,
             written.files.size(), written.files.empty() ? "" : written.files[0].parent_path().string());
}

/// Where no location is on the far side, neither method's uncertainty holds what it says. `share`: of the
/// square.
void warn_of_extrapolation(double share) {
  constexpr double kMore = 0.1;  // than around the thesis's locations, which leave 6 %
  if (share <= kMore) return;
  warn(fmt::format(
      "{:.0f} % of the square is beyond the measured locations and their mirror images (hatched): "
      "the map extrapolates there, and its U95 is too small; measure closer to walls, ground and "
      "ceiling",
      100 * share));
}

/// Before anything is reduced and fitted.
void check_nodes(int nodes) {
  if (is_grid_size(nodes)) return;
  throw InputError(fmt::format(
      "--nodes {}: an odd number from 3 to {}, so that a node is at OT and the maps fit into memory", nodes,
      kMostNodes));
}

WrittenMaps write_with_progress(const MapOptions& options, const TunnelMaps& maps,
                                const std::string& provenance) {
  ProgressBar bar("map");
  return write_maps(options.out, maps,
                    {.nodes = options.nodes, .provenance = provenance, .progress = show_on(bar, "row")});
}

/// Of runs that the maps lack, or that no propeller can have made; whether there is a problem among them.
bool warn_of_runs(const CampaignData& data, const Reduction& reduction) {
  bool problem = false;
  for (const LeftOutRun& run : reduction.left_out) {
    problem = problem || run.problem;
    if (run.problem || run.reason.starts_with("excluded"))
      warn(fmt::format("run {} is left out: {}", run.run, run.reason));
  }
  if (const auto doubt = implausible_thrust(data, reduction); doubt && doubt->certain) {
    warn(fmt::format("{}: {}", doubt->found, doubt->advice));
    problem = true;
  }
  return problem;
}

void warn_of_maps(const WrittenMaps& written, bool scatter_known, double beyond) {
  if (!scatter_known)
    warn(fmt::format(
        "how far C_T and U scatter is not known (no location was repeated, and there are no raw data): {}",
        written.map.delta_ct.u95_known() ? "the maps' uncertainty is without it"
                                         : "nor is the maps' uncertainty, of which there is no picture"));
  if (const auto& offset = written.map.uneven_thrust_fit.offset; offset && offset->significant())
    warn(
        fmt::format("U of {} is seen where symmetry demands 0, which is the rig's and not the tunnel's "
                    "(check propellers.csv, "
                    "arms, cells); it has been taken out of the map",
                    offset_text(*offset)));
  warn_of_extrapolation(beyond);
  if (written.warning) warn(*written.warning);
}

void print_json(const WrittenMaps& written, const Reduction& reduction,
                const std::vector<std::string>& not_on_map, double beyond) {
  nlohmann::ordered_json json{{"format", "tunnelrig-map-summary/1"},
                              {"method", written.map.method},
                              {"model", reduction.model_name()},
                              {"locations", written.map.locations.size()},
                              {"not_on_the_map", not_on_map},
                              {"beyond_percent", 100 * beyond},
                              {"delta_ct", fit_json(written.map.delta_ct_fit)},
                              {"uneven_thrust", fit_json(written.map.uneven_thrust_fit)}};
  for (const auto& path : written.files) json["files"].push_back(path.string());
  fmt::print("{}\n", json.dump(1));
}

int run_map(const MapOptions& options) {
  check_nodes(options.nodes);
  const MapMethod method = naming("--method", [&] { return map_method(options.method); });
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  const CampaignData data = read_campaign_data(file);
  const Reduction reduction = reduce_by(data, choose_model(file, options.model, options.terms));
  const Summary summary = summarize_locations(data, reduction);
  const std::vector<std::string> not_on_map = not_on_the_map(data, summary);
  if (!not_on_map.empty())
    warn(fmt::format(
        "not on the map: {}; neither a label of the tunnel's grid nor y_norm and z_norm say where",
        first_few(not_on_map, kNamedLocations)));
  const TunnelMaps maps = fit_maps(map_input(data, summary, options.db), {.method = method});
  const nlohmann::json provenance{{"program", "tunnelrig " + program_version()},
                                  {"arguments", arguments()},
                                  {"campaign", data.info.name},
                                  {"calibration", data.certificate_id},
                                  {"model", reduction.model_name()},
                                  {"runs", reduction.runs.size()}};
  const WrittenMaps written = write_with_progress(options, maps, provenance.dump());
  keep_result(options.db, "map",
              nlohmann::json{{"calibration", data.certificate_id}, {"model", reduction.model.version}}.dump(),
              format_disturbance_map(written.map));
  const bool problem = warn_of_runs(data, reduction);
  const double beyond = measured_region(written.map).share_outside();
  warn_of_maps(written, maps.input.scatter_known, beyond);
  if (options.json) {
    print_json(written, reduction, not_on_map, beyond);
  } else {
    print(written, beyond);
    fmt::print("model {}\n", reduction.model_name());
  }
  return problem ? kProblemFound : kWell;
}

}  // namespace

void add_map(CLI::App& app, Work& work) {
  auto options = std::make_shared<MapOptions>();
  CLI::App* verb =
      app.add_subcommand("map", "Disturbance maps: change of C_T against OT, and uneven thrust U");
  verb->footer(
      "Writes grids (CSV), contour lines, pictures (SVG, PNG) and disturbance_map.json; docs/maps.md.\n\n"
      "Example: tunnelrig map --db my.db --out maps");
  verb->add_option("--db", options->db, "Campaign file")->required();
  verb->add_option("--out", options->out, "Folder for the files")->required();
  verb->add_option("--method", options->method, "gaussian-process or thin-plate-spline")
      ->capture_default_str();
  verb->add_option("--nodes", options->nodes,
                   fmt::format("Of the grid along each side, odd, at most {}", kMostNodes))
      ->capture_default_str();
  add_model_options(*verb, options->model, options->terms);
  verb->add_flag("--json", options->json, "Print the summary as JSON");
  verb->callback([options, &work] { work = [options] { return run_map(*options); }; });
}

}  // namespace tunnelrig::cli
