#include "analysis/scatter_draws.h"

#include "analysis/restricted_likelihood.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

namespace tunnelrig {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

/// An interval of a grid's axis.
struct Range {
  double from = 0, to = 0;

  double at(int node, int nodes) const { return nodes == 1 ? from : from + (to - from) * node / (nodes - 1); }
};

/// What visits vary by without the component, a mean over the visits that tell: of locations with others.
double mean_own_variance(const VisitDesign& design, const VarianceComponents& components) {
  std::vector<int> visits(design.locations);
  for (const LocationVisit& visit : design.visits) ++visits[visit.location];
  double sum = 0, number = 0;
  for (const LocationVisit& visit : design.visits) {
    if (visits[visit.location] < 2) continue;
    sum += own_variance(visit, components);
    number += 1;
  }
  return number > 0 ? sum / number : 0;
}

/// The variance with which a session would seem to vary if it did not: the mean square of visits over their
/// number in a session, where all have as many; else by traces of Zᵀ P₀ Z, P₀ being the visits' weights less
/// what their locations' means take, and Z the sessions of the visits.
double seeming_session(const VisitDesign& design, const VarianceComponents& components) {
  const auto sessions = static_cast<Index>(design.sessions), locations = static_cast<Index>(design.locations);
  Eigen::MatrixXd w = Eigen::MatrixXd::Zero(sessions, locations);
  for (const LocationVisit& visit : design.visits)
    w(static_cast<Index>(visit.session), static_cast<Index>(visit.location)) =
        1 / (components.visit + own_variance(visit, components));
  const Eigen::VectorXd share =
      w.colwise().sum().transpose().unaryExpr([](double sum) { return sum > 0 ? 1 / sum : 0; });
  Eigen::MatrixXd once = -(w * share.asDiagonal()) * w.transpose();
  once.diagonal() += w.rowwise().sum();
  return once.trace() / once.squaredNorm();
}

/// The posterior where the prior is flat: over a with visit = own · sinh² a, or exp 2a where runs tell
/// nothing of their own, and over b with session = seeming one · sinh² b.
class Posterior {
 public:
  Posterior(const VisitDesign& design, const VarianceComponents& components)
      : likelihood_(design, components),
        components_(components),
        own_(mean_own_variance(design, components)),
        seeming_(components.session_known ? seeming_session(design, components) / (own_ + components.visit)
                                          : 0) {}

  double visit(double a) const {
    if (!components_.visit_known) return 0;
    return own_ > 0 ? own_ * std::pow(std::sinh(a), 2) : std::exp(2 * a);
  }
  double session(double a, double b) const {
    return components_.session_known ? seeming_ * (own_ + visit(a)) * std::pow(std::sinh(b), 2) : 0;
  }
  double log_density(double a, double b) const { return likelihood_(visit(a), session(a, b)); }

  /// Where the likelihood's maximum is, and as far from there as anything can lie.
  double best_a() const {
    if (!components_.visit_known) return 0;
    return own_ > 0 ? std::asinh(std::sqrt(components_.visit / own_)) : 0.5 * std::log(components_.visit);
  }
  double best_b() const {
    if (!components_.session_known) return 0;
    return std::asinh(std::sqrt(components_.session / (seeming_ * (own_ + components_.visit))));
  }
  Range widest_a() const {
    if (!components_.visit_known) return {};
    return {own_ > 0 ? 0 : best_a() - kWide, best_a() + kWide};
  }
  Range widest_b() const { return components_.session_known ? Range{0, best_b() + kWide} : Range{}; }

 private:
  static constexpr double kWide = 8;  // e¹⁶ of variance: of one degree of freedom e⁻⁸ is left out

  RestrictedLikelihood likelihood_;
  const VarianceComponents& components_;
  double own_, seeming_;
};

struct GridDraw {
  double visit = 0, session = 0, weight = 0;
};

/// Nodes of a grid with their weights, by the trapezoidal rule.
struct Grid {
  static constexpr int kNodes = 13, kNodesAlone = 41;
  Range a, b;
  int nodes_a = 1, nodes_b = 1;
  std::vector<GridDraw> draws;
  Range a_held, b_held;  // what holds all but e⁻⁸ of the density at its maximum, a step more on each side

  Grid(const Posterior& posterior, const Range& over_a, const Range& over_b) : a(over_a), b(over_b) {
    const int along = a.to > a.from && b.to > b.from ? kNodes : kNodesAlone;
    nodes_a = a.to > a.from ? along : 1;
    nodes_b = b.to > b.from ? along : 1;
    std::vector<double> logs;
    for (int i = 0; i < nodes_a; ++i)
      for (int j = 0; j < nodes_b; ++j)
        logs.push_back(posterior.log_density(a.at(i, nodes_a), b.at(j, nodes_b)));
    const double highest = std::max(*std::ranges::max_element(logs),
                                    posterior.log_density(posterior.best_a(), posterior.best_b()));
    a_held = {posterior.best_a(), posterior.best_a()};
    b_held = {posterior.best_b(), posterior.best_b()};
    for (int i = 0; i < nodes_a; ++i) {
      for (int j = 0; j < nodes_b; ++j) {
        const double at_a = a.at(i, nodes_a), at_b = b.at(j, nodes_b);
        const double above = logs[static_cast<std::size_t>(i * nodes_b + j)] - highest;
        const auto at_end = [](int node, int nodes) { return node == 0 || node == nodes - 1 ? 0.5 : 1.0; };
        draws.push_back({posterior.visit(at_a), posterior.session(at_a, at_b),
                         std::exp(above) * at_end(i, nodes_a) * at_end(j, nodes_b)});
        if (above < -kHeld) continue;
        hold(a_held, at_a);
        hold(b_held, at_b);
      }
    }
    widen(a_held, a, nodes_a);
    widen(b_held, b, nodes_b);
  }

 private:
  static constexpr double kHeld = 8;

  static void hold(Range& range, double at) {
    range.from = std::min(range.from, at);
    range.to = std::max(range.to, at);
  }
  static void widen(Range& range, const Range& within, int nodes) {
    if (nodes == 1) {
      range = within;
      return;
    }
    const double step = (within.to - within.from) / (nodes - 1);
    range = {std::max(within.from, range.from - step), std::min(within.to, range.to + step)};
  }
};

/// The grid, narrowed as long as that makes it finer.
Grid narrowed(const Posterior& posterior) {
  constexpr int kRounds = 6;
  Grid grid(posterior, posterior.widest_a(), posterior.widest_b());
  for (int round = 0; round < kRounds; ++round) {
    const auto length = [](const Range& range) { return range.to - range.from; };
    const double shorter = std::min(length(grid.a) > 0 ? length(grid.a_held) / length(grid.a) : 1.0,
                                    length(grid.b) > 0 ? length(grid.b_held) / length(grid.b) : 1.0);
    if (shorter > 0.7) break;
    grid = Grid(posterior, grid.a_held, grid.b_held);
  }
  return grid;
}

/// Few draws in place of many: means of neighbours, finely at the upper end, which decides what 95 % are.
void collect(std::vector<GridDraw> grid, ScatterDraws& draws) {
  constexpr std::array kUpTo = {0.02, 0.1,  0.2,  0.3,  0.4,  0.5,   0.6,   0.7,   0.8,
                                0.87, 0.92, 0.95, 0.97, 0.98, 0.987, 0.992, 0.996, 1.0};
  std::ranges::sort(grid, {}, [](const GridDraw& draw) { return draw.visit + draw.session; });
  double all = 0;
  for (const GridDraw& draw : grid) all += draw.weight;
  draws.total = draws.probability = ArrayXd::Zero(static_cast<Index>(kUpTo.size()));
  double below = 0, session_share = 0, median = -1;
  double last_middle = 0, last_total = grid.front().visit + grid.front().session;
  std::size_t bin = 0;
  for (const GridDraw& draw : grid) {
    const double weight = draw.weight / all, total = draw.visit + draw.session;
    while (bin + 1 < kUpTo.size() && below + 0.5 * weight > kUpTo[bin]) ++bin;
    draws.total(static_cast<Index>(bin)) += weight * total;
    draws.probability(static_cast<Index>(bin)) += weight;
    session_share += total > 0 ? weight * draw.session / total : 0;
    const double middle = below + 0.5 * weight;
    if (median < 0 && middle >= 0.5)
      median = last_total + (total - last_total) * (0.5 - last_middle) / (middle - last_middle);
    last_middle = middle;
    last_total = total;
    below += weight;
  }
  for (Index i = 0; i < draws.total.size(); ++i)
    if (draws.probability(i) > 0) draws.total(i) /= draws.probability(i);
  if (median < 0) median = last_total;
  draws.session = session_share * median;
  draws.visit = median - draws.session;
}

/// What an estimate of a variance with these degrees of freedom may be off by: quantiles of ν/χ²(ν), alike
/// probable.
ArrayXd run_factors(double dof) {
  constexpr double kAsGoodAsKnown = 300;
  if (dof > kAsGoodAsKnown) return ArrayXd::Ones(1);
  constexpr int kFactors = 12;
  ArrayXd factors(kFactors);
  for (int i = 0; i < kFactors; ++i) factors(i) = dof / chi2_quantile((i + 0.5) / kFactors, dof);
  return factors;
}

/// The half width w for which normal errors of these variances, alike probable to `factors`, hold 95 %.
double half_width(const ScatterDraws& draws, double run_part, const ArrayXd& factors, double concentration) {
  constexpr double kHeld = 0.95;
  double width = 0;
  for (int i = 0; i < 60; ++i) {  // concave, so that Newton's steps approach from below
    double held = 0, slope = 0;
    for (Index k = 0; k < draws.total.size(); ++k) {
      for (Index f = 0; f < factors.size(); ++f) {
        const double deviation =
            std::sqrt(std::max(1e-300, run_part * factors(f) + concentration * draws.total(k)));
        const double u = width / (deviation * std::numbers::sqrt2);
        const double probability = draws.probability(k) / static_cast<double>(factors.size());
        held += probability * std::erf(u);
        slope += probability * std::exp(-u * u) / deviation;
      }
    }
    const double step = (kHeld - held) / (slope * std::sqrt(2 / std::numbers::pi));
    width += step;
    if (!(std::abs(step) > 1e-6 * width)) break;
  }
  return width;
}

/// ν with t(0.975, ν) = t, by a table of 1/ν, in which t is nearly a straight line.
double dof_of_t(double t) {
  constexpr int kSteps = 400;
  static const std::vector<double> table = [] {
    std::vector<double> quantiles;
    for (int i = 0; i <= kSteps; ++i)
      quantiles.push_back(i == 0 ? normal_quantile(0.975)
                                 : student_t_quantile(0.975, static_cast<double>(kSteps) / i));
    return quantiles;
  }();
  const auto above = std::ranges::lower_bound(table, t);
  if (above == table.begin()) return std::numeric_limits<double>::infinity();
  if (above == table.end()) return 1;
  const double lower = *(above - 1);
  const double steps = static_cast<double>(above - 1 - table.begin()) + (t - lower) / (*above - lower);
  return kSteps / steps;
}

}  // namespace

ScatterDraws draw_scatter(const VisitDesign& design, const VarianceComponents& components) {
  ScatterDraws draws{.visit = components.visit, .session = components.session};
  draws.total = ArrayXd::Constant(1, components.visit + components.session);
  draws.probability = ArrayXd::Ones(1);
  const Posterior posterior(design, components);
  if (!std::isfinite(posterior.best_a()) || !std::isfinite(posterior.best_b()))
    return draws;  // runs that repeat to the last digit
  collect(narrowed(posterior).draws, draws);
  return draws;
}

double dof_of(const ScatterDraws& draws, double run_part, double run_dof, double concentration,
              double variance) {
  const ArrayXd factors = run_part > 0 ? run_factors(run_dof) : ArrayXd::Ones(1);
  return dof_of_t(half_width(draws, run_part, factors, concentration) / std::sqrt(variance));
}

}  // namespace tunnelrig
