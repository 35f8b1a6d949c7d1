// What the model in force gained: every run before and after, and the error on blocks held out.
#include "analysis/report/figures/figures.h"
#include "datasets/locations.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

constexpr const char* kResidualFigure = "residual_before_after";

/// How far each run's C_T is from the mean of its location, in per cent, in order of time.
std::vector<std::vector<double>> residuals_percent(const CampaignData& data, const Reduction& reduction) {
  std::map<std::string, std::pair<double, int>> sums;
  const auto sum_of = [&](const RunCoefficients& run) -> std::pair<double, int>& {
    return sums[canonical_location(data.runs[run.run].location)];
  };
  for (const RunCoefficients& run : reduction.runs) {
    auto& [sum, runs] = sum_of(run);
    sum += run.c_t;
    ++runs;
  }
  std::vector<const RunCoefficients*> in_order;
  for (const RunCoefficients& run : reduction.runs)
    if (sum_of(run).second > 1) in_order.push_back(&run);
  std::stable_sort(in_order.begin(), in_order.end(), [&](const auto* a, const auto* b) {
    return data.runs[a->run].start_s < data.runs[b->run].start_s;
  });
  std::vector<std::vector<double>> rows;
  for (const RunCoefficients* run : in_order) {
    const auto& [sum, runs] = sum_of(*run);
    rows.push_back({static_cast<double>(rows.size() + 1), 100 * (run->c_t * runs / sum - 1)});
  }
  return rows;
}

double rms_percent(const std::vector<std::vector<double>>& rows) {
  double sum = 0;
  for (const auto& row : rows) sum += row[1] * row[1];
  return rows.empty() ? 0 : std::sqrt(sum / static_cast<double>(rows.size()));
}

/// The reach of both panels: all but one run in two hundred.
double reach_of(const std::vector<std::vector<double>>& before,
                const std::vector<std::vector<double>>& after) {
  std::vector<double> sizes;
  for (const auto* rows : {&before, &after})
    for (const auto& row : *rows) sizes.push_back(std::abs(row[1]));
  std::sort(sizes.begin(), sizes.end());
  return sizes.empty() ? 1 : std::max(1e-6, 1.15 * sizes[(sizes.size() - 1) * 199 / 200]);
}

bool has_errors(const Json& explanation) {
  const auto is_error = [&](const char* key) {
    const Json error = explanation.value(key, Json());
    return error.is_object() && error.value("held_out_rmse", Json()).is_number() &&
           error.value("held_out_ci95", Json()).is_array() && error["held_out_ci95"].size() == 2 &&
           error["held_out_ci95"][0].is_number() && error["held_out_ci95"][1].is_number();
  };
  return explanation.is_object() && is_error("before") && is_error("after") &&
         explanation.value("noise_floor", Json()).is_number();
}

/// Before, after, and the floor, with their 95 % intervals.
std::string error_panel(const Json& explanation) {
  const auto row = [&](const char* key, double y) -> std::vector<double> {
    const Json& error = explanation[key];
    return {error["held_out_rmse"].get<double>(), y, error["held_out_ci95"][0].get<double>(),
            error["held_out_ci95"][1].get<double>()};
  };
  const double floor = explanation["noise_floor"].get<double>();
  return data_block("before", {row("before", 2)}) + data_block("after", {row("after", 1)}) +
         data_block("floor", {{floor, 0}}) +
         fmt::format(
             "set xrange [0:*]\nset yrange [-0.6:2.6]\nset ytics ('before' 2, 'after' 1, 'noise floor' 0)\n"

             "plot $before using 3:2:($4-$3):(0) {0} linecolor rgb '{1}' linewidth 0.9, $before using 1:2 "
             "with points "
             "linecolor rgb '{1}' pointtype 5 pointsize 0.5, "
             "$after using 3:2:($4-$3):(0) {0} linecolor rgb '{2}' linewidth 0.9, $after using 1:2 with "
             "points "
             "linecolor rgb '{2}' pointtype 7 pointsize 0.5, "
             "$floor using 1:2 with points linecolor rgb '#000000' pointtype 13 pointsize 0.6\n",
             kBars, category_colour(1), category_colour(0));
}

}  // namespace

Figures residual_figures(const Material& material, double width_mm) {
  if (!material.reduction) return {{}, {{kResidualFigure, material.not_reduced}}};
  if (!material.settings.model.version)
    return {{},
            {{kResidualFigure, "no effect is adopted in the model in force (`tunnelrig explain --adopt`)"}}};
  const Json explanation = Json::parse(material.settings.model.version->explanation, nullptr, false);
  if (!has_errors(explanation))
    return {{}, {{kResidualFigure, "the model in force says nothing of its errors"}}};
  const Reduction thesis = reduce_by(material.data, {});
  const auto before = residuals_percent(material.data, thesis),
             after = residuals_percent(material.data, *material.reduction);
  const double reach = reach_of(before, after);
  constexpr double kPlotTop_mm = 2, kPanel_mm = 27, kGap_mm = 3, kLabel_mm = 9, kErrors_mm = 15,
                   kLeftEdge_mm = 17;
  const Sheet sheet{width_mm, kPlotTop_mm + 2 * kPanel_mm + kGap_mm + kLabel_mm + kErrors_mm + kLabel_mm + 2};
  std::string script = look() + "set multiplot\n";
  script += fmt::format("set xrange [0:{}]\nset yrange [{:.6g}:{:.6g}]\n", before.size() + 1, -reach, reach);
  double top = sheet.height_mm - kPlotTop_mm;
  for (const auto* rows : {&before, &after}) {
    const bool first = rows == &before;
    script += kNextPanel + sheet.axes({kLeftEdge_mm, width_mm - 3, top - kPanel_mm, top},
                                      first ? "" : "number of the run, in order of time [–]",
                                      "C_T − its mean [%]", 12);
    script += data_block("runs", *rows) +
              fmt::format(
                  "set label 1 '{}: rms {:.3f} %' at graph 0.03,0.91 font ',{}' front\nset format x '{}'\n"
                  "plot $runs using 1:2 with points pointtype 7 pointsize 0.18 linecolor "
                  "rgb '{}'\n",
                  first ? "before" : "after", rms_percent(*rows), kSmallFont_pt, first ? "" : "%g",
                  category_colour(first ? 1 : 0));
    top -= kPanel_mm + kGap_mm;
  }
  top -= kLabel_mm - kGap_mm + 1;
  const std::string unit = explanation.value("unit", "");
  script += kNextPanel +
            sheet.axes({kLeftEdge_mm, width_mm - 3, top - kErrors_mm, top},
                       fmt::format("rms error on blocks held out [{}]", unit == "1" ? "–" : unit), "") +
            error_panel(explanation) + "unset multiplot\n";
  return {
      {{kResidualFigure, sheet, script,
        fmt::format(
            "What {} gained over the thesis's model. Above: how far each run's C_T is from the mean of its "
            "location, in per cent, before and after. Below: the root mean square error on blocks that the "
            "search had not seen, with 95 % intervals by resampling the blocks, and the floor, which an "
            "exact "
            "model would leave.",
            material.settings.model.name())}},
      {}};
}

}  // namespace tunnelrig::report
