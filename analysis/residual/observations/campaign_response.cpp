#include "analysis/residual/observations/campaign_response.h"

#include "analysis/air.h"
#include "analysis/conventions.h"
#include "datasets/error.h"
#include "datasets/run_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr double kStandard_C = 15;  // at which an additive y is the response itself

/// Whose thrust a column is, from 0; nothing of others.
std::optional<int> rotor_of_thrust(const std::string& column, int rotors) {
  for (int rotor = 0; rotor < rotors; ++rotor)
    if (column == fmt::format("thrust_{}_N", rotor + 1)) return rotor;
  return {};
}

}  // namespace

CampaignResponse response_of(const CampaignSource& source, const std::string& name,
                             const Eigen::VectorXd& newtons_per_volt) {
  const Rig& rig = source.data.info.rig;
  const auto reference_N = [&rig](double density_kg_m3) {
    return thesis_reference_thrust_N(density_kg_m3, rig.nominal_speed_rpm, rig);
  };
  const auto nothing = [](double, Index) { return 1.0; };
  const auto thrust_N = [&source](Index row, Index channel) {
    return source.coefficients(row).thrust_N[static_cast<std::size_t>(channel)];
  };
  if (name == "thrust")
    return {rig.rotors, "N", thrust_N, [=](double density, Index) { return reference_N(density); }};
  if (name == "cell") {
    return {rig.rotors, "V",
            [=](Index row, Index channel) { return thrust_N(row, channel) / newtons_per_volt(channel); },
            [=](double density, Index channel) { return reference_N(density) / newtons_per_volt(channel); }};
  }
  if (name == "c_t")
    return {1, "1", [&source](Index row, Index) { return source.coefficients(row).c_t; }, nothing};
  const auto rotor = rotor_of_thrust(name, rig.rotors);
  return {
      1, rotor ? "N" : "",
      [&source, name](Index row, Index) {
        const Run& run = source.run(row);
        if (const auto value = run.number(name)) return *value;
        if (run.labels.contains(name) || is_text_column(name))
          throw InputError::at("runs.csv", run.line,
                               "the response {} is read as text; a response is a column of numbers", name);
        throw InputError::at("runs.csv", run.line, "run {} has no {}, which is the response", run.run, name);
      },
      rotor ? [=](double density, Index) { return reference_N(density); }
            : std::function<double(double, Index)>(nothing)};
}

void set_response(const CampaignSource& source, const CampaignResponse& response, Observations& result) {
  result.unit = response.unit;
  result.value.resize(source.rows(), response.channels);
  result.known.resize(source.rows(), response.channels);
  for (Index row = 0; row < source.rows(); ++row)
    for (Index c = 0; c < response.channels; ++c) {
      result.value(row, c) = response.value(row, c);
      if (std::abs(result.value(row, c)) > kLargestResponse)
        throw InputError::at("runs.csv", source.run(row).line, "the response {} is {:g}, beyond ±{:g}",
                             result.response, result.value(row, c), kLargestResponse);
      result.known(row, c) = response.known(source.coefficients(row).density_kg_m3, c);
    }
  result.multiplicative = result.value.minCoeff() > 0;
  if (result.multiplicative) {
    result.y = (result.value.array() / result.known.array()).log();
    return;
  }
  // A rotor that stands still has no logarithm, and the others' air is in the baseline all the same.
  const double standard_kg_m3 = dry_air_density_kg_m3(thesis::kPressure_Pa, kStandard_C + kZeroCelsius_K);
  for (Index c = 0; c < response.channels; ++c) result.known.col(c) /= response.known(standard_kg_m3, c);
  result.y = result.value.cwiseQuotient(result.known);
}

namespace {

/// Runs in which a rotor gives next to nothing, and not in others of their location.
Index runs_without(const Observations& observations, Index rotor) {
  constexpr double kNothing = 0.05;  // of the strongest rotor of the run
  const Eigen::Array<bool, Eigen::Dynamic, 1> none =
      observations.value.col(rotor).array().abs() <
      kNothing * observations.value.array().rowwise().maxCoeff();
  Index result = 0;
  for (const auto& [location, runs] : places_of_each(observations.group))
    if (const Index count = none(runs).count(); count < std::ssize(runs)) result += count;
  return result;
}

}  // namespace

void warn_of_unmeasured_rotors(Observations& observations) {
  if (observations.channels() < 2) return;
  for (Index c = 0; c < observations.channels(); ++c) {
    const bool stuck = observations.value.col(c).maxCoeff() == observations.value.col(c).minCoeff();
    const auto without = static_cast<std::size_t>(runs_without(observations, c));
    if (!stuck && kRunsPerGross * without <= observations.name.size()) continue;  // fewer are set aside
    const std::string why =
        stuck ? fmt::format(
                    "the response {} of rotor {} is the same in every run, {:.4g} {}: it was not "
                    "measured, and what is said of that rotor is worth nothing",
                    observations.response, c + 1, observations.value(0, c), observations.unit)
              : fmt::format(
                    "rotor {} gives next to nothing in {} runs, and not in others of their locations: "
                    "it stood, or was not measured, and what is said of it is worth nothing",
                    c + 1, without);
    observations.unmeasured.push_back(why);
    observations.left_out.push_back(why);
  }
  constexpr double kRounding = 1e-9;
  const Eigen::ArrayXXd share =
      observations.value.array().colwise() / observations.value.rowwise().sum().array();
  const Eigen::Array<double, 1, Eigen::Dynamic> spread =
      share.colwise().maxCoeff() - share.colwise().minCoeff();
  if (observations.rows() > 1 && (spread < kRounding).all())
    observations.left_out.push_back(fmt::format(
        "each rotor has the same share of the {} in every run: these are parts of a total, and of one rotor "
        "by itself they say nothing",
        observations.response));
}

void leave_out_against_sign(CampaignSource& source, const CampaignResponse& response, Observations& result) {
  constexpr std::size_t kOneOf = 20;
  std::vector<std::size_t> kept;
  std::vector<std::string> reasons;
  for (Index row = 0; row < source.rows(); ++row) {
    double lowest = std::numeric_limits<double>::infinity();
    for (Index c = 0; c < response.channels; ++c) lowest = std::min(lowest, response.value(row, c));
    if (lowest > 0)
      kept.push_back(source.order[static_cast<std::size_t>(row)]);
    else
      reasons.push_back(fmt::format("{}: {} is {:.4g} {}, not above 0 as in all other runs",
                                    source.run(row).run, result.response, lowest, response.unit));
  }
  if (reasons.size() * kOneOf > source.order.size()) return;
  source.order = std::move(kept);
  result.left_out.insert(result.left_out.end(), reasons.begin(), reasons.end());
}

}  // namespace tunnelrig
