#include "analysis/variance_components.h"

#include "analysis/restricted_likelihood.h"
#include "analysis/scatter_draws.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <unsupported/Eigen/SpecialFunctions>

namespace tunnelrig {
namespace {

VisitDesign design_of(const GroupedRuns& runs) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> index;
  VisitDesign design;
  for (std::size_t i = 0; i < runs.value.size(); ++i) {
    const auto key = std::make_pair(runs.location[i], runs.session[i]);
    const auto [found, fresh] = index.emplace(key, design.visits.size());
    if (fresh) design.visits.push_back({key.first, key.second});
    LocationVisit& visit = design.visits[found->second];
    const double old_mean = visit.mean;  // Welford
    visit.runs += 1;
    visit.mean += (runs.value[i] - old_mean) / visit.runs;
    visit.squares += (runs.value[i] - old_mean) * (runs.value[i] - visit.mean);
    design.locations = std::max(design.locations, key.first + 1);
    design.sessions = std::max(design.sessions, key.second + 1);
  }
  return design;
}

double digamma(double x) { return Eigen::numext::digamma(x); }
double trigamma(double x) { return Eigen::numext::polygamma(1.0, x); }

/// The x with ψ'(x) = y, by Newton's method on 1/ψ' (Smyth 2004, appendix).
double inverse_trigamma(double y) {
  double x = 0.5 + 1 / y;
  for (int i = 0; i < 50; ++i) {
    const double value = trigamma(x);
    const double step = value * (1 - value / y) / Eigen::numext::polygamma(2.0, x);
    x += step;
    if (std::abs(step) < 1e-9 * x) break;
  }
  return x;
}

/// The prior that the locations' sample variances suggest for each other: its variance and its weight in
/// degrees of freedom.
struct Prior {
  double variance = 0;
  double dof = std::numeric_limits<double>::infinity();
};

constexpr double kAlike = 0.05;  // p above which locations are taken to scatter alike

/// The p of Bartlett's test that variances of so many degrees of freedom are one (Snedecor & Cochran 1989,
/// 13.10): it depends on the degrees of freedom and not on the variances seen, so that a location that
/// scatters much cannot hide itself by widening what counts as chance.
double homogeneity_p(const std::vector<double>& variance, const std::vector<double>& dof) {
  const std::size_t n = variance.size();
  if (n < 2) return 1;
  double all_squares = 0, all_dof = 0, logarithms = 0, reciprocals = 0;
  for (std::size_t l = 0; l < n; ++l) {
    all_squares += dof[l] * variance[l];
    all_dof += dof[l];
    logarithms += dof[l] * std::log(variance[l]);
    reciprocals += 1 / dof[l];
  }
  const auto others = static_cast<double>(n - 1);
  const double correction = 1 + (reciprocals - 1 / all_dof) / (3 * others);
  const double statistic = (all_dof * std::log(all_squares / all_dof) - logarithms) / correction;
  return chi2_upper_p(std::max(0.0, statistic), others);
}

Prior prior_of(const std::vector<double>& squares, const std::vector<double>& dof, double pooled) {
  Prior prior{.variance = pooled};
  std::vector<double> scores, variance, freedom;
  double trigammas = 0;
  for (std::size_t l = 0; l < dof.size(); ++l) {
    if (dof[l] < 1 || squares[l] <= 0) continue;
    variance.push_back(squares[l] / dof[l]);
    freedom.push_back(dof[l]);
    scores.push_back(std::log(squares[l] / dof[l]) - digamma(dof[l] / 2) + std::log(dof[l] / 2));
    trigammas += trigamma(dof[l] / 2);
  }
  if (homogeneity_p(variance, freedom) > kAlike) return prior;
  const auto count = static_cast<double>(scores.size());
  double mean = 0, spread = 0;
  for (const double score : scores) mean += score / count;
  for (const double score : scores) spread += (score - mean) * (score - mean) / (count - 1);
  const double excess = spread - trigammas / count;
  if (excess <= 0) return prior;
  prior.dof = 2 * inverse_trigamma(excess);
  prior.variance = std::exp(mean + digamma(prior.dof / 2) - std::log(prior.dof / 2));
  return prior;
}

/// The weight that the prior has at a location, in degrees of freedom: less where it makes the location's own
/// variance an improbably large one, and none where it rules it out, or else the noisiest would get the
/// smallest error bars for their scatter (Phipson et al. 2016, Ann. Appl. Stat. 10:946).
double weight_of(const Prior& prior, double squares, double dof) {
  if (dof < 1) return prior.dof;
  const double p = f_upper_p(squares / dof / prior.variance, dof, prior.dof);
  return prior.dof * std::min(1.0, 2 * p);
}

void fit_run_variances(const VisitDesign& design, VarianceComponents& components) {
  std::vector<double> squares(design.locations), dof(design.locations);
  double all_squares = 0, all_dof = 0;
  for (const LocationVisit& visit : design.visits) {
    squares[visit.location] += visit.squares;
    dof[visit.location] += visit.runs - 1;
    all_squares += visit.squares;
    all_dof += visit.runs - 1;
  }
  components.run_by_location.assign(design.locations, 0);
  components.run_dof.assign(design.locations, 0);
  components.run_known = all_dof >= 1;
  if (!components.run_known) return;
  components.run = all_squares / all_dof;
  const Prior prior = prior_of(squares, dof, components.run);
  for (std::size_t l = 0; l < design.locations; ++l) {
    const bool alike = std::isinf(prior.dof);
    const double weight = alike ? 0 : weight_of(prior, squares[l], dof[l]);
    components.run_by_location[l] =
        alike ? components.run : (weight * prior.variance + squares[l]) / (weight + dof[l]);
    components.run_dof[l] = alike ? all_dof : weight + dof[l];
  }
}

/// Maximises over both variances at once: a grid over decades, refined around its best point. The surface is
/// smooth with at most a ridge, and a grid cannot fail to converge.
void maximise(const VisitDesign& design, bool free_visit, bool free_session, double scale,
              VarianceComponents& components) {
  constexpr int kSteps = 4, kRounds = 9;
  double span = 3.0;  // decades on either side
  std::array<double, 2> centre = {std::log10(scale), std::log10(scale)};
  double best = -std::numeric_limits<double>::infinity();
  const RestrictedLikelihood restricted_likelihood(design, components);
  for (int round = 0; round < kRounds; ++round, span *= 0.5) {
    const auto around = centre;
    for (int i = -kSteps - 1; i <= kSteps; ++i) {
      for (int j = -kSteps - 1; j <= kSteps; ++j) {
        if ((!free_visit && i >= -kSteps) || (!free_session && j >= -kSteps)) continue;
        const double at_visit = around[0] + span * i / kSteps, at_session = around[1] + span * j / kSteps;
        const double visit = i < -kSteps ? 0 : std::pow(10, at_visit);  // the extra step is the boundary
        const double session = j < -kSteps ? 0 : std::pow(10, at_session);
        const double value = restricted_likelihood(visit, session);
        if (!(value > best)) continue;
        best = value;
        components.visit = visit;
        components.session = session;
        if (visit > 0) centre[0] = at_visit;
        if (session > 0) centre[1] = at_session;
      }
    }
  }
}

}  // namespace

VarianceComponents fit_variance_components(const GroupedRuns& runs) {
  VarianceComponents components;
  const VisitDesign design = design_of(runs);
  fit_run_variances(design, components);
  const std::size_t visits = design.visits.size();
  const std::size_t freedom =
      visits - std::min(visits, design.locations);  // visits beyond the first of each location
  const std::size_t for_sessions = design.sessions - 1;
  components.session_known = freedom >= 1 && for_sessions >= 1;
  components.visit_known = freedom > for_sessions;
  if (!components.run_known && !components.visit_known) {
    // As many visits beyond the first as sessions: all that is known is what the three make together.
    components.visit_known = freedom >= 1;
    components.session_known = false;
  }
  if (!components.session_known && !components.visit_known) return components;

  double squares = 0;
  std::vector<double> count(design.locations), mean(design.locations);
  for (const LocationVisit& visit : design.visits) {
    count[visit.location] += 1;
    mean[visit.location] += (visit.mean - mean[visit.location]) / count[visit.location];
  }
  for (const LocationVisit& visit : design.visits)
    squares += (visit.mean - mean[visit.location]) * (visit.mean - mean[visit.location]);
  const double scale = std::max(squares / static_cast<double>(std::max<std::size_t>(freedom, 1)), 1e-300);
  maximise(design, components.visit_known, components.session_known, scale, components);
  components.scatter = draw_scatter(design, components);
  return components;
}

LocationMeans location_means(const GroupedRuns& runs, const VarianceComponents& components) {
  const VisitDesign design = design_of(runs);
  const std::size_t n = design.locations;
  LocationMeans means{.mean = std::vector<double>(n),
                      .std = std::vector<double>(n),
                      .runs = std::vector<int>(n),
                      .sessions = std::vector<int>(n),
                      .covariance = {},
                      .dof = std::vector<double>(n),
                      .run_part = std::vector<double>(n),
                      .visit_part = std::vector<double>(n),
                      .session_part = std::vector<double>(n)};
  std::vector<double> total(n), squares(n);
  for (const LocationVisit& visit : design.visits) {
    total[visit.location] += visit.runs;
    means.mean[visit.location] += visit.runs * visit.mean;
    means.sessions[visit.location] += 1;
  }
  for (std::size_t l = 0; l < n; ++l) means.mean[l] /= total[l];
  for (std::size_t i = 0; i < runs.value.size(); ++i) {
    const double difference = runs.value[i] - means.mean[runs.location[i]];
    squares[runs.location[i]] += difference * difference;
  }
  // Shares of a location's runs in each session: w(l, s)
  Eigen::MatrixXd share =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(design.sessions));
  for (const LocationVisit& visit : design.visits) {
    share(static_cast<Eigen::Index>(visit.location), static_cast<Eigen::Index>(visit.session)) =
        visit.runs / total[visit.location];
  }
  ScatterDraws scatter = components.scatter;
  if (scatter.total.size() == 0) {
    scatter.visit = components.visit;
    scatter.session = components.session;
  }
  means.covariance = scatter.session * share * share.transpose();
  for (std::size_t l = 0; l < n; ++l) {
    const auto row = static_cast<Eigen::Index>(l);
    means.runs[l] = static_cast<int>(total[l]);
    means.std[l] =
        total[l] > 1 ? std::sqrt(squares[l] / (total[l] - 1)) : std::numeric_limits<double>::quiet_NaN();
    const double concentration = share.row(row).squaredNorm();
    means.run_part[l] = components.run_known ? components.run_by_location[l] / total[l] : 0;
    means.visit_part[l] = scatter.visit * concentration;
    means.session_part[l] = scatter.session * concentration;
    means.covariance(row, row) += means.run_part[l] + means.visit_part[l];
    const double variance = means.covariance(row, row);
    const double run_dof =
        components.run_known ? components.run_dof[l] : std::numeric_limits<double>::infinity();
    means.dof[l] = scatter.total.size() > 0 && variance > 0
                       ? dof_of(scatter, means.run_part[l], run_dof, concentration, variance)
                       : std::max(1.0, run_dof);
  }
  return means;
}

}  // namespace tunnelrig
