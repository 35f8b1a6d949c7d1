#include "analysis/residual/simulated.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

namespace tunnelrig::test {

using Eigen::Index;
using Eigen::MatrixXd;

Observations simulate(const Design& design, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Observations o;
  o.campaign = "simulated";
  o.response = "thrust";
  o.unit = "N";
  o.baseline = "thesis";
  o.multiplicative = design.multiplicative;
  const Index n = std::accumulate(design.runs_of_block.begin(), design.runs_of_block.end(), 0);
  o.known = MatrixXd::Constant(n, design.channels, design.multiplicative ? 7.0 : 1.0);
  MatrixXd y(n, design.channels);
  o.shape.assign(static_cast<std::size_t>(design.shapes), MatrixXd(n, design.channels));
  std::uniform_int_distribution<int> group(0, design.groups - 1);
  const double session = design.sigma * std::sqrt(design.session_ratio);
  const double level = design.multiplicative ? 0.0 : 7.0;
  Index row = 0;
  for (std::size_t block = 0; block < design.runs_of_block.size(); ++block) {
    o.block_name.push_back(fmt::format("S{:02}", block + 1));
    // one offset of the session for each rotor and component
    MatrixXd offset(1 + design.shapes, design.channels);
    for (double& value : offset.reshaped()) value = session * normal(random);
    Eigen::RowVectorXd scatter = Eigen::RowVectorXd::Zero(design.channels);
    for (int run = 0; run < design.runs_of_block[block]; ++run, ++row) {
      o.name.push_back(fmt::format("R{:04}", row + 1));
      o.block.push_back(static_cast<int>(block));
      o.group.push_back(row < design.groups ? static_cast<int>(row) : group(random));
      o.previous.push_back(run == 0 ? -1 : static_cast<int>(row) - 1);
      const double before = run == 0 ? 0 : design.run_correlation;
      for (Index c = 0; c < design.channels; ++c) {
        scatter(c) = before * scatter(c) + std::sqrt(1 - before * before) * design.sigma * normal(random);
        y(row, c) = level + 0.01 * o.group.back() + offset(0, c) + scatter(c);
        for (int j = 0; j < design.shapes; ++j)
          o.shape[static_cast<std::size_t>(j)](row, c) = offset(j + 1, c) + design.sigma * normal(random);
      }
    }
  }
  for (int g = 0; g < design.groups; ++g) o.group_name.push_back(fmt::format("H{}V0", g));
  o.in_tunnel.assign(static_cast<std::size_t>(n), true);
  o.slopes.resize(n, 0);
  o.duration_s = Eigen::VectorXd::Constant(n, design.shapes > 0 ? 60.0 : 0.0);
  o.newtons_per_volt = Eigen::VectorXd::Constant(design.channels, 4.0);
  o.rig.rotors = design.channels;
  o.rig.propeller_radius_m = 0.1524;
  o.rig.nominal_speed_rpm = 5000;
  set_y(o, y);
  return o;
}

void set_y(Observations& observations, const MatrixXd& y) {
  observations.y = y;
  observations.value =
      observations.multiplicative ? MatrixXd(observations.known.array() * y.array().exp()) : y;
}

void add_covariate(Observations& observations, const std::string& name, double low, double high,
                   std::mt19937_64& random) {
  std::uniform_real_distribution<double> draw(low, high);
  Covariate covariate{name, MatrixXd(observations.rows(), 1)};
  for (double& value : covariate.value.reshaped()) value = draw(random);
  observations.covariates.push_back(std::move(covariate));
}

Observations four_rotors(int groups, double sigma, std::mt19937_64& random) {
  Observations o = simulate({.runs_of_block = std::vector<int>(16, 8),
                             .groups = groups,
                             .channels = 4,
                             .sigma = sigma,
                             .session_ratio = 0.4},
                            random);
  add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
  add_covariate(o, "tunnel_airspeed_m_s", 0, 0.4, random);
  return o;
}

void add_effect(Observations& observations, const std::string& name, const std::vector<double>& parameters) {
  const Term term{.effect = &effect_named(name), .parameters = parameters};
  const TermResponse response = respond(term, observations, observations.value);
  for (std::size_t j = 0; j < observations.shape.size(); ++j) observations.shape[j] += response.value[j + 1];
  set_y(observations, observations.y + response.value[0]);
}

const Effect& effect_named(const std::string& name) {
  const auto& all = all_effects();
  return *std::find_if(all.begin(), all.end(), [&](const Effect& effect) { return effect.name == name; });
}

std::vector<const Effect*> every_effect() {
  std::vector<const Effect*> result;
  for (const Effect& effect : all_effects()) result.push_back(&effect);
  return result;
}

SearchSettings quick() {
  SearchSettings settings;
  settings.simulations = 199;
  return settings;
}

Explanation explained(const Observations& observations) {
  return explain(observations, every_effect(), quick());
}

MatrixXd dense_covariance(const Observations& observations, const std::vector<int>& rows, double ratio,
                          double run_correlation) {
  const auto n = static_cast<Index>(rows.size());
  const auto block = [&](Index r) {
    return observations.block[static_cast<std::size_t>(rows[static_cast<std::size_t>(r)])];
  };
  return MatrixXd::NullaryExpr(n, n, [&](Index a, Index b) {
    if (block(a) != block(b)) return 0.0;
    // without rows of others in between, since simulated blocks follow each other
    return std::pow(run_correlation, static_cast<double>(std::abs(a - b))) + ratio;
  });
}

MatrixXd dense_baseline(const Observations& observations, const std::vector<int>& rows,
                        const std::vector<int>& wanted) {
  std::set<int> groups;
  for (const int row : rows) groups.insert(observations.group[static_cast<std::size_t>(row)]);
  const Index each = 1 + observations.slopes.cols();
  MatrixXd baseline =
      MatrixXd::Zero(static_cast<Index>(wanted.size()), static_cast<Index>(groups.size()) * each);
  for (std::size_t r = 0; r < wanted.size(); ++r) {
    const auto found = groups.find(observations.group[static_cast<std::size_t>(wanted[r])]);
    const Index first = std::distance(groups.begin(), found) * each;
    baseline(static_cast<Index>(r), first) = 1;
    baseline.row(static_cast<Index>(r)).segment(first + 1, each - 1) = observations.slopes.row(wanted[r]);
  }
  return baseline;
}

}  // namespace tunnelrig::test
