#include "calibration/cell_checks.h"

#include "calibration/distributions.h"
#include "calibration/regression.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace tunnelrig {
namespace {

using Points = std::vector<CalibrationPoint>;

/// Weighted mean voltage of the readings of one force in one direction, and their scatter.
struct Group {
  double force_N = 0;
  double weight = 0;
  double mean_V = 0;
  double scatter = 0;  // weighted sum of squares about the mean
  int count = 0;

  void add(double voltage_V, double w) {
    weight += w;
    const double step = voltage_V - mean_V;
    mean_V += step * w / weight;
    scatter += w * step * (voltage_V - mean_V);
    ++count;
  }
};
using Groups = std::map<std::pair<double, std::string>, Group>;  // by force and direction

Groups group(std::span<const CalibrationPoint> points, const Eigen::VectorXd& weights) {
  Groups groups;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Group& of = groups[{points[i].applied_force_N, points[i].direction}];
    of.force_N = points[i].applied_force_N;
    of.add(points[i].voltage_V, weights[static_cast<Eigen::Index>(i)]);
  }
  return groups;
}

/// The points that were taken in a known order, in that order; none unless all were.
Points in_sequence(std::span<const CalibrationPoint> points) {
  Points ordered(points.begin(), points.end());
  if (!std::all_of(ordered.begin(), ordered.end(), [](const auto& point) { return point.sequence; }))
    return {};
  std::stable_sort(ordered.begin(), ordered.end(),
                   [](const auto& a, const auto& b) { return *a.sequence < *b.sequence; });
  return ordered;
}

class Checker {
 public:
  Checker(std::span<const CalibrationPoint> points, const Eigen::VectorXd& weights,
          const Eigen::Vector2d& line)
      : points_(points),
        weights_(weights),
        line_(line),
        gain_(std::abs(line[1])),
        groups_(group(points, weights)),
        ordered_(in_sequence(points)) {
    const auto n = static_cast<Eigen::Index>(points.size());
    force_.resize(n);
    voltage_.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      force_[i] = points[static_cast<std::size_t>(i)].applied_force_N;
      voltage_[i] = points[static_cast<std::size_t>(i)].voltage_V;
    }
    span_N_ = force_.maxCoeff() - force_.minCoeff();
    const Eigen::VectorXd root = weights.cwiseSqrt();
    X_.resize(n, 2);
    X_ << root, root.cwiseProduct(force_);
  }

  std::optional<Repeatability> repeatability() const {
    const auto [scatter, dof] = pure_error();
    if (dof == 0) return {};
    return Repeatability{std::sqrt(scatter / dof) / gain_, dof};
  }

  std::optional<LackOfFit> lack_of_fit() const {
    const auto [scatter, dof] = pure_error();
    const int groups = static_cast<int>(groups_.size());
    if (dof == 0 || groups < 3) return {};
    const auto fit = regress(X_, weights_.cwiseSqrt().cwiseProduct(voltage_));
    if (!fit) return {};
    const double floor = std::pow(rounding_floor(voltage_), 2);
    LackOfFit lack{.dof_lack = groups - 2, .dof_pure = dof};
    const double between = std::max(fit->residual_sum - scatter, 0.0) / lack.dof_lack;
    lack.f = between / std::max(scatter / dof, floor);
    lack.p = f_upper_p(lack.f, lack.dof_lack, lack.dof_pure);
    return lack;
  }

  std::optional<Linearity> linearity() const {
    const std::set<double> forces(force_.begin(), force_.end());
    if (forces.size() < 3) return {};
    // about the middle, so that the quadratic column is not a copy of the linear one
    const Eigen::ArrayXd from_middle = force_.array() - (force_.maxCoeff() + force_.minCoeff()) / 2;
    const auto curve = added(from_middle.square());
    if (!curve) return {};
    Linearity linearity{.curvature_V_per_N2 = curve->coefficient, .p = curve->p};
    linearity.bow_N = std::abs(curve->coefficient) * span_N_ * span_N_ / (8 * gain_);
    for (const auto& [key, of] : groups_) {
      const double deviation = std::abs(of.mean_V - line_[0] - line_[1] * of.force_N) / gain_;
      linearity.max_deviation_N = std::max(linearity.max_deviation_N, deviation);
    }
    linearity.max_deviation_percent_of_span = percent_of_span(linearity.max_deviation_N);
    return linearity;
  }

  std::optional<Hysteresis> hysteresis() const {
    Eigen::ArrayXd down = Eigen::ArrayXd::Zero(force_.size());
    int ups = 0, downs = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const bool up = points_[i].direction == "up", is_down = points_[i].direction == "down";
      if (!up && !is_down) return {};
      ups += up ? 1 : 0;
      downs += is_down ? 1 : 0;
      down[static_cast<Eigen::Index>(i)] = is_down ? 1 : 0;
    }
    if (ups < 2 || downs < 2) return {};
    const auto offset = added(down);
    if (!offset) return {};
    Hysteresis hysteresis{.down_minus_up_N = offset->coefficient / line_[1],
                          .standard_uncertainty_N = offset->standard_error / gain_,
                          .p = offset->p};
    for (const auto& [key, of] : groups_) {
      const auto other = groups_.find({key.first, key.second == "up" ? "down" : ""});
      if (key.second != "up" || other == groups_.end()) continue;
      const double difference = (other->second.mean_V - of.mean_V) / line_[1];
      if (std::abs(difference) >= std::abs(hysteresis.largest_N.value_or(0)))
        hysteresis.largest_N = difference;
    }
    hysteresis.percent_of_span =
        percent_of_span(std::abs(hysteresis.largest_N.value_or(hysteresis.down_minus_up_N)));
    return hysteresis;
  }

  std::optional<ZeroReturn> zero_return() const {
    const auto zero = [](const CalibrationPoint& point) { return point.applied_force_N == 0; };
    const auto first = std::find_if(ordered_.begin(), ordered_.end(), zero);
    const auto last = std::find_if(ordered_.rbegin(), ordered_.rend(), zero);
    if (first == ordered_.end() || std::all_of(first, last.base(), zero)) return {};
    ZeroReturn zero_return{.change_N = (last->voltage_V - first->voltage_V) / line_[1]};
    zero_return.percent_of_span = percent_of_span(std::abs(zero_return.change_N));
    return zero_return;
  }

  std::optional<Creep> creep() const {
    Creep creep;
    for (std::size_t start = 0; start < ordered_.size();) {
      std::size_t end = start + 1;
      while (end < ordered_.size() && ordered_[end].applied_force_N == ordered_[start].applied_force_N) ++end;
      if (end - start >= 2 && ordered_[start].applied_force_N != 0) {
        const double change = (ordered_[end - 1].voltage_V - ordered_[start].voltage_V) / line_[1];
        if (std::abs(change) >= std::abs(creep.largest_N)) creep.largest_N = change;
        creep.longest = std::max(creep.longest, static_cast<int>(end - start));
        ++creep.stretches;
      }
      start = end;
    }
    if (creep.stretches == 0) return {};
    return creep;
  }

 private:
  /// Sum of squares within groups, and its degrees of freedom.
  std::pair<double, int> pure_error() const {
    double scatter = 0;
    int dof = 0;
    for (const auto& [key, of] : groups_) {
      scatter += of.scatter;
      dof += of.count - 1;
    }
    return {scatter, dof};
  }

  std::optional<AddedTerm> added(const Eigen::ArrayXd& term) const {
    const Eigen::VectorXd root = weights_.cwiseSqrt();
    return test_added_term(X_, root.array() * term, root.cwiseProduct(voltage_));
  }

  double percent_of_span(double force_N) const { return 100 * force_N / span_N_; }

  std::span<const CalibrationPoint> points_;
  const Eigen::VectorXd& weights_;
  Eigen::Vector2d line_;
  double gain_;
  Groups groups_;
  Points ordered_;
  Eigen::VectorXd force_, voltage_;
  Eigen::MatrixXd X_;
  double span_N_ = 0;
};

}  // namespace

CellChecks check_cell(std::span<const CalibrationPoint> points, const Eigen::VectorXd& weights,
                      const Eigen::Vector2d& line) {
  const Checker checker(points, weights, line);
  return {.lack_of_fit = checker.lack_of_fit(),
          .linearity = checker.linearity(),
          .hysteresis = checker.hysteresis(),
          .repeatability = checker.repeatability(),
          .zero_return = checker.zero_return(),
          .creep = checker.creep()};
}

}  // namespace tunnelrig
