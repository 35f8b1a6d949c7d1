#include "analysis/misread_runs.h"
#include "analysis/reduction.h"
#include "analysis/residual/observations/campaign_conditions.h"
#include "analysis/residual/observations/campaign_response.h"
#include "analysis/spectrum.h"
#include "datasets/error.h"
#include "datasets/first_few.h"
#include "datasets/locations.h"
#include "datasets/open_space.h"
#include "datasets/run_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace tunnelrig {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kDuration = "duration_s";  // of a run whose thrusts came as means
constexpr const char* kTimeInRun = "time_in_run";
constexpr const char* kOpenSpace = "open space";  // group of all its runs
using Eigen::Index;
using Eigen::MatrixXd;

/// cos(π j (w + ½)/W) coefficients of a run's windows, in y's scale: volts times `scale`.
void set_course(const RunStatistics& statistics, Index row, Index channel, double scale,
                std::vector<MatrixXd>& shape) {
  const std::size_t channels = statistics.channels.size();
  const std::size_t windows = statistics.window_means_V.size() / channels;
  double sum = 0;
  std::size_t present = 0;
  const auto at = [&](std::size_t w) {
    return statistics.window_means_V[w * channels + static_cast<std::size_t>(channel)];
  };
  for (std::size_t w = 0; w < windows; ++w) {
    if (std::isnan(at(w))) continue;
    sum += at(w);
    ++present;
  }
  for (std::size_t j = 1; j <= shape.size(); ++j) {
    double coefficient = 0;
    for (std::size_t w = 0; w < windows; ++w) {
      if (std::isnan(at(w))) continue;  // a lost window counts as the run's mean
      coefficient += (at(w) - sum / static_cast<double>(present)) *
                     std::cos(std::numbers::pi * static_cast<double>(j) * (static_cast<double>(w) + 0.5) /
                              static_cast<double>(windows));
    }
    shape[j - 1](row, channel) = 2 * coefficient / static_cast<double>(windows) * scale;
  }
}

/// Where every run has windows enough, what happened within it.
void add_courses(const CampaignSource& source, Observations& result) {
  for (Index row = 0; row < source.rows(); ++row) {
    const RunStatistics* statistics = source.statistics(row);
    if (statistics == nullptr ||
        statistics->window_means_V.size() < 2 * kShapes * statistics->channels.size())
      return;
  }
  result.shape.assign(kShapes, MatrixXd::Zero(source.rows(), result.channels()));
  for (Index row = 0; row < source.rows(); ++row) {
    for (Index c = 0; c < result.channels(); ++c) {
      const double per_volt = result.response == "thrust" ? result.newtons_per_volt(c) : 1;
      const double scale = per_volt / (result.multiplicative ? result.value(row, c) : result.known(row, c));
      set_course(*source.statistics(row), row, c, scale, result.shape);
    }
  }
}

/// Not where the analysis makes a condition of that name itself.
bool is_read(std::string_view column) { return !is_made_of_times(column) && column != kTimeInRun; }

void add_sheet_covariates(const CampaignSource& source, Observations& result) {
  static const std::set<std::string, std::less<>> kNotConditions = {
      "repeat", "thrust_1_N", "thrust_2_N", "thrust_3_N", "thrust_4_N", "y_norm", "z_norm", kDuration};
  std::set<std::string> names = {std::string(kGroundDistance), std::string(kCeilingDistance)};
  for (Index row = 0; row < source.rows(); ++row)
    for (const auto& [name, value] : source.run(row).numbers)
      if (!kNotConditions.contains(name) && is_read(name)) names.insert(name);
  for (const std::string& name : names) {
    Covariate covariate{name, MatrixXd::Constant(source.rows(), 1, kNaN)};
    Index missing = 0;
    for (Index row = 0; row < source.rows(); ++row) {
      const auto value = condition(source.run(row), name);
      value ? covariate.value(row, 0) = *value : static_cast<double>(++missing);
    }
    if (may_be_absent(name) && missing == source.rows()) continue;
    if (missing > 0 && !may_be_absent(name))
      result.not_usable[name] = fmt::format("missing in {} of {} runs", missing, source.rows());
    result.covariates.push_back(std::move(covariate));
  }
}

/// Columns of texts: which battery, which blades.
void add_texts(const CampaignSource& source, Observations& result) {
  std::set<std::string> names;
  for (Index row = 0; row < source.rows(); ++row)
    for (const auto& [name, text] : source.run(row).labels)
      if (is_read(name)) names.insert(name);
  for (const std::string& name : names) {
    std::vector<std::string> texts;
    for (Index row = 0; row < source.rows(); ++row) {
      const auto& labels = source.run(row).labels;
      const auto found = labels.find(name);
      texts.push_back(found == labels.end() ? "" : found->second);
    }
    result.covariates.push_back(covariate_of_texts(name, texts));
  }
}

/// Hours since the session's first run, hour of the day, the run's number, and the trend of the air's
/// temperature.
void add_derived_covariates(const CampaignSource& source, Observations& result) {
  const Index n = source.rows();
  std::vector<double> first(result.block_name.size(), std::numeric_limits<double>::infinity());
  for (const Run& run : source.data.runs) {  // a tare may have begun the session
    const auto block = std::find(result.block_name.begin(), result.block_name.end(), run.session);
    if (block != result.block_name.end() && run.kind == RunKind::kThrust)
      first[static_cast<std::size_t>(block - result.block_name.begin())] =
          std::min(first[static_cast<std::size_t>(block - result.block_name.begin())], run.start_s);
  }
  Covariate hours{"hours_in_session", MatrixXd(n, 1), true, "h of the session"},
      day{"hour_of_day", MatrixXd(n, 1), true, "h of the day"}, order{"run_order", MatrixXd(n, 1), true};
  for (Index row = 0; row < n; ++row) {
    hours.value(row, 0) = (source.run(row).start_s -
                           first[static_cast<std::size_t>(result.block[static_cast<std::size_t>(row)])]) /
                          3600;
    day.value(row, 0) = std::fmod(source.run(row).start_s, 86400) / 3600;
    order.value(row, 0) = static_cast<double>(row);
  }
  result.covariates.insert(result.covariates.end(), {hours, day, order});
  const Covariate* air = result.find("air_temperature_C");
  if (air == nullptr) return;
  Covariate trend{"air_temperature_rate_K_s", MatrixXd::Zero(n, 1), true, "K/s"};
  for (Index row = 0; row < n; ++row) {
    Index low = row, high = row;
    if (row > 0 &&
        result.block[static_cast<std::size_t>(row - 1)] == result.block[static_cast<std::size_t>(row)])
      low = row - 1;
    if (row + 1 < n &&
        result.block[static_cast<std::size_t>(row + 1)] == result.block[static_cast<std::size_t>(row)])
      high = row + 1;
    const double seconds = source.run(high).start_s - source.run(low).start_s;
    if (seconds > 0) trend.value(row, 0) = (air->value(high, 0) - air->value(low, 0)) / seconds;
  }
  result.covariates.push_back(std::move(trend));
}

/// Open space has one coefficient for all heights where the baseline says so.
std::string group_of(const Run& run, const std::string& baseline) {
  return baseline == "open_space" && in_open_space(run) ? kOpenSpace : canonical_location(run.location);
}

int index_in(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  names.push_back(name);
  return static_cast<int>(names.size()) - 1;
}

/// Start times of each session's thrust runs, used or not.
std::map<std::string, std::set<double>> starts_s(const CampaignData& data) {
  std::map<std::string, std::set<double>> result;
  for (const Run& run : data.runs)
    if (run.kind == RunKind::kThrust) result[run.session].insert(run.start_s);
  return result;
}

void set_belonging(const CampaignSource& source, Observations& result) {
  std::map<std::string, int> last;
  const std::map<std::string, std::set<double>> all_starts_s = starts_s(source.data);
  for (Index row = 0; row < source.rows(); ++row) {
    const Run& run = source.run(row);
    result.name.push_back(run.run);
    result.group.push_back(index_in(result.group_name, group_of(run, result.baseline)));
    result.block.push_back(index_in(result.block_name, run.session));
    result.in_tunnel.push_back(run.in_tunnel());
    const auto before = last.find(run.session);
    const std::set<double>& starts = all_starts_s.at(run.session);
    // A run that is left out loaded the cell as well, and nobody predicts it.
    const bool next = before != last.end() &&
                      starts.upper_bound(source.run(before->second).start_s) == starts.find(run.start_s);
    result.previous.push_back(next ? before->second : -1);
    last[run.session] = static_cast<int>(row);
  }
}

void add_places(const CampaignSource& source, Observations& result) {
  Eigen::VectorXd tunnel = Eigen::VectorXd::Zero(source.rows()), y = tunnel, z = tunnel;
  for (Index row = 0; row < source.rows(); ++row) {
    const Run& run = source.run(row);
    if (!run.in_tunnel()) continue;
    tunnel(row) = 1;
    y(row) = *run.y_norm;
    z(row) = *run.z_norm;
  }
  const std::array<Eigen::VectorXd, kPlaces.size()> weights = {tunnel, y, z, y.cwiseAbs()};
  for (std::size_t i = 0; i < kPlaces.size(); ++i)
    result.places.push_back({std::string(kPlaces[i]), weights[i]});
}

/// One sentence for each reason, however many runs it is of.
void say_left_out(const Reduction& reduction, Observations& result) {
  constexpr std::size_t kNamed = 3;
  std::vector<std::pair<std::string, std::vector<std::string>>> by_reason;
  for (const LeftOutRun& run : reduction.left_out) {
    const auto same = std::ranges::find(by_reason, run.reason, [](const auto& each) { return each.first; });
    if (same == by_reason.end())
      by_reason.push_back({run.reason, {run.run}});
    else
      same->second.push_back(run.run);
  }
  for (const auto& [reason, runs] : by_reason)
    result.left_out.push_back(runs.size() == 1 ? fmt::format("{}: {}", runs[0], reason)
                                               : fmt::format("{} runs are left out ({}): {}", runs.size(),
                                                             first_few(runs, kNamed), reason));
}

/// Of the conditions that a run cannot do without; of the others no run is left out.
void say_what_lacks_temperature(const CampaignData& data, Observations& result) {
  const auto lack = [](const Run& run) {
    return run.kind == RunKind::kThrust && run.excluded.empty() && !run.number("air_temperature_C");
  };
  const auto missing = std::ranges::count_if(data.runs, lack);
  if (missing == 0) return;
  const auto runs = std::ranges::count(data.runs, RunKind::kThrust, &Run::kind);
  result.left_out_for["air_temperature_C"] = fmt::format(
      "missing in {} of {} runs, which are left out: without it there is no density", missing, runs);
}

/// Columns with a name that means something else here.
void warn_of_names(const CampaignData& data, Observations& result) {
  const auto has = [&](std::string_view name) {
    return std::ranges::any_of(
        data.runs, [&](const Run& run) { return run.numbers.contains(name) || run.labels.contains(name); });
  };
  for (const char* name : {"thrust", "cell", "c_t"})
    if (has(name))
      result.left_out.push_back(fmt::format(
          "the column {0} is read as a condition: --response {0} is what the cells say; rename the column to "
          "explain it",
          name));
  if (has(kTimeInRun))
    result.left_out.push_back(fmt::format(
        "the column {} is not read: that is what explain calls the time since a run began; rename it",
        kTimeInRun));
}

Observations observe(const CampaignData& data, const ObservationChoice& choice, bool all_runs) {
  const Reduction reduction = reduce_runs(data, {});
  CampaignSource source{data, reduction, std::vector<std::size_t>(reduction.runs.size())};
  std::iota(source.order.begin(), source.order.end(), 0U);
  std::stable_sort(source.order.begin(), source.order.end(), [&](std::size_t a, std::size_t b) {
    return data.runs[reduction.runs[a].run].start_s < data.runs[reduction.runs[b].run].start_s;
  });
  Observations result;
  result.campaign = data.info.name;
  result.response = choice.response.empty() ? "thrust" : choice.response;
  result.baseline = choice.baseline.empty() ? "thesis" : choice.baseline;
  if (result.baseline != "thesis" && result.baseline != "open_space")
    throw InputError(fmt::format("--baseline {}: a campaign has thesis and open_space", result.baseline));
  result.rig = data.info.rig;
  say_left_out(reduction, result);
  say_what_lacks_temperature(data, result);
  warn_of_names(data, result);
  result.newtons_per_volt = Eigen::VectorXd::Ones(data.info.rig.rotors);
  if (!data.certificate && result.response == "thrust")
    result.left_out.emplace_back(
        "the cells are not calibrated: what a cell adds, and its bounds, count 1 N for 1 V (tunnelrig "
        "calibrate, "
        "where there are calibration data)");
  if (data.certificate)
    for (int c = 0; c < data.info.rig.rotors; ++c)
      result.newtons_per_volt(c) = 1 / (data.certificate->cells[static_cast<std::size_t>(c)].gain_V_per_N *
                                        data.certificate->propellers.factor(c));
  const CampaignResponse response = response_of(source, result.response, result.newtons_per_volt);
  if (result.response != "thrust")
    result.newtons_per_volt.setOnes();  // volts, and whatever else, as they are
  if (!all_runs) leave_out_against_sign(source, response, result);
  set_response(source, response, result);
  set_belonging(source, result);
  add_places(source, result);
  result.slopes.resize(source.rows(), 0);
  result.duration_s = Eigen::VectorXd::Zero(source.rows());
  for (Index row = 0; row < source.rows(); ++row) {
    const RunStatistics* statistics = source.statistics(row);
    result.duration_s(row) = statistics != nullptr ? statistics->elapsed_s(data.info.daq.sample_rate_hz)
                                                   : source.run(row).number(kDuration).value_or(0);
  }
  add_sheet_covariates(source, result);
  add_texts(source, result);
  add_derived_covariates(source, result);
  std::vector<const RunStatistics*> statistics;
  for (Index row = 0; row < source.rows(); ++row) statistics.push_back(source.statistics(row));
  add_raw_conditions(statistics, data.info.daq, result);
  // A column explains itself, and what is made of it.
  std::erase_if(result.covariates, [&](const Covariate& covariate) {
    return covariate.name == result.response ||
           (covariate.name == "air_temperature_rate_K_s" && result.response == "air_temperature_C");
  });
  set_conditions_at_zero(data, reduction, source.order, result);
  if (result.response == "thrust" || result.response == "cell") add_courses(source, result);
  return result;
}

}  // namespace

Observations observe_runs(const CampaignData& data, const ObservationChoice& choice) {
  return observe(data, choice, true);
}

Observations observe_campaign(const CampaignData& data, const ObservationChoice& choice) {
  Observations result = observe(data, choice, false);
  if (result.baseline == "open_space" && std::ranges::count(result.group_name, kOpenSpace) == 0)
    throw InputError(
        "--baseline open_space: no run stands at OS, GND… or CEIL…, or has a distance to ground or ceiling");
  if (!(result.value.maxCoeff() > result.value.minCoeff()))
    throw InputError(fmt::format("the response {} is the same in every run: there is nothing to explain",
                                 result.response));
  warn_of_unmeasured_rotors(result);
  for (std::string& misread : in_words(misread_runs(data))) result.left_out.push_back(std::move(misread));
  return result;
}

}  // namespace tunnelrig
