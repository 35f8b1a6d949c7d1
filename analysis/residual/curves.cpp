#include "analysis/residual/curves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Few bends see a weak trend, many a wave: each covariate is tried with all of these.
constexpr std::array<int, 3> kBends = {2, 4, 6};

/// A value of few is told apart if as many blocks have it as a step needs on either side.
constexpr std::size_t kBlocksPerLevel = 3, kMostLevels = 12;

/// That a condition does different things in different places, or under another condition, is less likely
/// beforehand than that it does one.
constexpr double kPlaceWeight = 0.2;

Components nothing(const Observations& observations) {
  return Components(1 + observations.shape.size(),
                    MatrixXd::Zero(observations.rows(), observations.channels()));
}

/// `count` columns on the curve's rotors; column_at(k, x), k from 1.
template <class ColumnAt>
std::vector<Components> columns_over(const Observations& observations, const Covariate& covariate, int rotor,
                                     int count, const ColumnAt& column_at) {
  std::vector<Components> columns;
  for (int k = 1; k <= count; ++k) {
    columns.push_back(nothing(observations));
    for (Index row = 0; row < observations.rows(); ++row)
      for (Index channel = 0; channel < observations.channels(); ++channel)
        if (rotor < 0 || channel == rotor)
          columns.back()[0](row, channel) = column_at(k, covariate.at(row, channel));
  }
  return columns;
}

std::vector<Components> course(const Observations& observations, int rotor) {
  std::vector<Components> columns;
  for (std::size_t j = 1; j <= observations.shape.size(); ++j) {
    columns.push_back(nothing(observations));
    for (Index channel = 0; channel < observations.channels(); ++channel)
      if (rotor < 0 || channel == rotor) columns.back()[j].col(channel).setConstant(1);
  }
  return columns;
}

/// Whether a power law is what is straight.
bool is_ratio(const Observations& observations, const Covariate& covariate) {
  return observations.multiplicative && !covariate.derived && !covariate.name.ends_with("_C") &&
         covariate.value.minCoeff() > 0;
}

std::vector<CurveShape> bends_over(const Observations& observations, const Covariate& covariate) {
  if (is_ratio(observations, covariate)) return {CurveShape::kLogParabola, CurveShape::kLevelling};
  return {CurveShape::kParabola};
}

/// The widest part of the covariate's range without a row in it, over that range.
double widest_gap(const Covariate& covariate, const std::vector<int>& rows) {
  std::set<double> values;
  for (const int row : rows)
    for (Index c = 0; c < covariate.value.cols(); ++c) values.insert(covariate.value(row, c));
  double gap = 0;
  for (auto next = std::next(values.begin()); next != values.end(); ++next)
    gap = std::max(gap, *next - *std::prev(next));
  return gap / (*values.rbegin() - *values.begin());
}

/// What is straight, on the curve's rotors.
MatrixXd straight_over(const Curve& curve) {
  const MatrixXd& column = curve.columns[0][0];
  MatrixXd straight = MatrixXd::Zero(column.rows(), column.cols());
  for (Index row = 0; row < straight.rows(); ++row)
    for (Index c = 0; c < straight.cols(); ++c)
      if (straight.cols() == 1 || curve.rotor < 0 || c == curve.rotor)
        straight(row, c) =
            curve_straight(curve.shape, curve.x(row, curve.x.cols() > 1 ? c : 0), curve.low, curve.high);
  return straight;
}

/// Where a curve may be seen: beyond it, in runs that are sealed, it could be anything.
std::pair<double, double> range_of(const Covariate& covariate, const std::vector<int>& rows) {
  const MatrixXd values = covariate.value(rows, Eigen::all);
  return {values.minCoeff(), values.maxCoeff()};
}

/// Those that differ between `rows`, and not as one before does.
std::vector<Place> places_to_try(const Observations& observations, const std::vector<int>& rows) {
  std::vector<Place> result;
  for (const Place& place : observations.places) {
    const Eigen::VectorXd weight = place.weight(rows);
    if (weight.maxCoeff() > weight.minCoeff() &&
        std::none_of(result.begin(), result.end(),
                     [&](const Place& before) { return before.weight(rows).isApprox(weight); }))
      result.push_back(place);
  }
  return result;
}

/// What two conditions do together and neither does alone: the product of both, each from its mean.
void add_products(const Observations& observations, const std::vector<int>& rows,
                  std::vector<Curve>& curves) {
  constexpr double kLeast = 0.5;  // of its variance that is neither's own
  std::vector<const Covariate*> conditions;
  for (const Covariate& covariate : observations.covariates)
    if (!covariate.derived && !covariate.per_channel() && covariate.labels.empty() &&
        can_be_followed(observations, covariate))
      conditions.push_back(&covariate);
  for (std::size_t a = 0; a < conditions.size(); ++a)
    for (std::size_t b = a + 1; b < conditions.size(); ++b) {
      const Covariate &first = *conditions[a], &second = *conditions[b];
      const auto [low, high] = range_of(first, rows);
      if (!(high > low)) continue;
      const double mean = first.value.mean();
      const Eigen::ArrayXd from_mean = second.value.col(0).array() - second.value.mean();
      const Strength strength{.centre = second.value.mean(), .scale = from_mean.abs().maxCoeff()};
      const auto column_at = [&, low = low, high = high](int k, double x) {
        return curve_column(CurveShape::kStraight, k, x, low, high) -
               curve_straight(CurveShape::kStraight, mean, low, high);
      };
      Curve curve{.covariate = first.name,
                  .shape = CurveShape::kStraight,
                  .columns = columns_over(observations, first, -1, 1, column_at),
                  .x = first.value,
                  .low = low,
                  .high = high,
                  .place = {second.name, from_mean / strength.scale},
                  .strength = strength};
      curve.columns[0][0] = curve.place.weight.asDiagonal() * curve.columns[0][0];
      const double own = share_beside_cubics(
          observations, rows, {first.value(rows, 0), second.value(rows, 0)}, curve.columns[0][0](rows, 0));
      if (own > kLeast) curves.push_back(std::move(curve));
    }
}

/// Whether another condition of the runs goes with it: sessions that all begin at one hour.
bool repeats_another(const Observations& observations, const Covariate& covariate) {
  constexpr double kSame = 0.99;  // correlation
  return std::any_of(observations.covariates.begin(), observations.covariates.end(),
                     [&](const Covariate& other) {
                       return other.name != covariate.name && !other.per_channel() &&
                              other.value.allFinite() && std::abs(correlation(covariate, other)) > kSame;
                     });
}

}  // namespace

std::string Curve::label() const {
  return covariate + (everywhere() ? "" : " × " + place.name) +
         (rotor < 0 ? "" : fmt::format(" of rotor {}", rotor + 1));
}

bool Curve::is_like(const Curve& other) const {
  return covariate == other.covariate && rotor == other.rotor && place.name == other.place.name;
}

double correlation(const Covariate& first, const Covariate& second) {
  const Eigen::VectorXd u = first.value.col(0).array() - first.value.col(0).mean(),
                        v = second.value.col(0).array() - second.value.col(0).mean();
  const double norms = u.norm() * v.norm();
  return norms > 0 ? u.dot(v) / norms : 0;
}

const Covariate* number_of_texts(const Observations& observations, const Covariate& texts) {
  if (texts.labels.empty()) return nullptr;
  for (const Covariate& number : observations.covariates) {
    if (!number.labels.empty() || number.derived || number.per_channel() ||
        !can_be_followed(observations, number))
      continue;
    std::map<double, double> of_text, of_number;
    bool one_to_one = true;
    for (Index row = 0; row < observations.rows() && one_to_one; ++row) {
      const double text = texts.value(row, 0), value = number.value(row, 0);
      one_to_one = of_text.emplace(text, value).first->second == value &&
                   of_number.emplace(value, text).first->second == text;
    }
    if (one_to_one) return &number;
  }
  return nullptr;
}

bool can_be_followed(const Observations& observations, const Covariate& covariate) {
  return !observations.not_usable.contains(covariate.name) && covariate.value.allFinite() &&
         !is_constant(covariate);
}

bool is_constant(const Covariate& covariate) {
  constexpr double kRounding = 1e-9;  // of the values: a range that is no more is none
  const double range = covariate.value.maxCoeff() - covariate.value.minCoeff();
  return range <= kRounding * covariate.value.cwiseAbs().maxCoeff();
}

double share_beside_cubics(const Observations& observations, const std::vector<int>& rows,
                           const std::vector<Eigen::VectorXd>& conditions, const Eigen::VectorXd& column) {
  constexpr int kDegree = 3;
  MatrixXd columns(column.size(), kDegree * static_cast<Index>(conditions.size()) + 1);
  Index next = 0;
  for (const Eigen::VectorXd& condition : conditions) {
    const Eigen::ArrayXd x = condition.array() - condition.mean();
    for (int power = 1; power <= kDegree; ++power) columns.col(next++) = (x / x.abs().maxCoeff()).pow(power);
  }
  columns.col(next) = column;
  for (const auto& [group, members] : places_of_each(observations.group, rows)) {
    const MatrixXd own = columns(members, Eigen::all);
    columns(members, Eigen::all) = own.rowwise() - own.colwise().mean();
  }
  const MatrixXd cubics = columns.leftCols(next);
  const Eigen::VectorXd whole = columns.col(next);
  const Eigen::VectorXd left = whole - cubics * cubics.completeOrthogonalDecomposition().solve(whole);
  return whole.squaredNorm() > 0 ? left.squaredNorm() / whole.squaredNorm() : 0;
}

int places_on_range(const Covariate& covariate, const std::vector<int>& rows) {
  constexpr double kApart = 0.01;
  std::set<double> values;
  for (const int row : rows) values.insert(covariate.value(row, 0));
  const double range = *values.rbegin() - *values.begin();
  int count = 0;
  auto next = values.begin();
  while (next != values.end()) {
    ++count;
    const auto apart = values.lower_bound(*next + kApart * range);
    next = apart == next ? std::next(next) : apart;
  }
  return count;
}

int different_values(const Covariate& covariate, const std::vector<int>& rows) {
  std::set<double> values;
  for (const int row : rows) values.insert(covariate.value(row, 0));
  return static_cast<int>(values.size());
}

std::vector<double> levels_of(const Observations& observations, const Covariate& covariate,
                              const std::vector<int>& rows) {
  struct Level {
    std::size_t rows = 0;
    std::set<int> blocks;
  };
  if (covariate.derived || covariate.per_channel()) return {};
  std::map<double, Level> all;
  for (const int row : rows) {
    Level& level = all[covariate.value(row, 0)];
    ++level.rows;
    level.blocks.insert(observations.block[static_cast<std::size_t>(row)]);
  }
  std::vector<double> levels;
  std::size_t held = 0;
  for (const auto& [value, level] : all) {
    if (level.blocks.size() < kBlocksPerLevel) continue;
    levels.push_back(value);
    held += level.rows;
  }
  if (levels.size() < 2 || levels.size() > kMostLevels || 10 * held < 9 * rows.size()) return {};
  std::iter_swap(levels.begin(), std::max_element(levels.begin(), levels.end(), [&](double a, double b) {
                   return all[a].rows < all[b].rows;
                 }));
  return levels;
}

std::vector<Curve> curves_to_try(const Observations& observations, const std::vector<int>& rows) {
  std::vector<int> rotors = {-1};
  for (int rotor = 0; rotor < static_cast<int>(observations.channels()) && observations.channels() > 1;
       ++rotor)
    rotors.push_back(rotor);
  const std::vector<Place> places = places_to_try(observations, rows);
  std::vector<Curve> curves;
  for (const Covariate& covariate : observations.covariates) {
    if (!can_be_followed(observations, covariate) || number_of_texts(observations, covariate) != nullptr)
      continue;
    const auto [low, high] = range_of(covariate, rows);
    if (!(high > low)) continue;
    if (const std::vector<double> levels = levels_of(observations, covariate, rows); !levels.empty()) {
      const auto column_at = [&](int k, double x) { return level_column(levels, k, x); };
      for (const int rotor : rotors)
        curves.push_back({.covariate = covariate.name,
                          .rotor = rotor,
                          .shape = CurveShape::kLevels,
                          .columns = columns_over(observations, covariate, rotor,
                                                  static_cast<int>(levels.size()) - 1, column_at),
                          .x = covariate.value,
                          .low = low,
                          .high = high,
                          .levels = levels,
                          .labels = covariate.labels});
    }
    if (!covariate.labels.empty()) continue;
    if (covariate.derived && covariate.name == "hour_of_day" && repeats_another(observations, covariate))
      continue;
    const int most = places_on_range(covariate, rows) / 3;
    const auto add = [&, low = low, high = high](CurveShape shape, int count, const Place& place = {}) {
      const auto column_at = [&](int k, double x) { return curve_column(shape, k, x, low, high); };
      for (const int rotor : rotors) {
        curves.push_back({.covariate = covariate.name,
                          .rotor = rotor,
                          .shape = shape,
                          .columns = columns_over(observations, covariate, rotor, count, column_at),
                          .x = covariate.value,
                          .low = low,
                          .high = high,
                          .place = place});
        if (curves.back().everywhere()) continue;
        for (Components& column : curves.back().columns) column[0] = place.weight.asDiagonal() * column[0];
      }
    };
    for (const Place& place : places)
      add(is_ratio(observations, covariate) ? CurveShape::kLogStraight : CurveShape::kStraight, 1, place);
    if (most >= 1)
      for (const CurveShape bend : bends_over(observations, covariate)) add(bend, 1);
    // Where a whole wave finds no row its height is anything.
    const double gap = most >= kBends[1] ? widest_gap(covariate, rows) : 0;
    for (const int count : kBends)
      if (count <= most && gap * count <= 2) add(CurveShape::kWaves, count);
  }
  add_products(observations, rows, curves);
  if (!observations.shape.empty())
    for (const int rotor : rotors)
      curves.push_back(
          {.covariate = "time_in_run", .rotor = rotor, .columns = course(observations, rotor), .x = {}});
  return curves;
}

std::vector<Curve> smooth_forms(const Observations& observations, const Curve& curve,
                                const std::vector<int>& rows) {
  const Covariate* covariate = observations.find(curve.covariate);
  const bool bend = curve.shape == CurveShape::kParabola || is_of_logarithm(curve.shape);
  const bool smooth = bend || curve.shape == CurveShape::kWaves || curve.shape == CurveShape::kSmooth;
  if (covariate == nullptr || !smooth || !curve.tilt.empty() || !curve.everywhere()) return {};
  const auto form_of = [&](CurveShape shape, int count) {
    Curve form = curve;
    form.shape = shape;
    form.columns = columns_over(observations, *covariate, curve.rotor, count, [&](int k, double x) {
      return curve_column(shape, k, x, curve.low, curve.high);
    });
    return form;
  };
  const int most = std::clamp(places_on_range(*covariate, rows) / 3, 2, kBends.back() + 2);
  std::vector<Curve> forms;
  for (int count = 1; count <= (is_of_logarithm(curve.shape) ? 2 : most); ++count) {
    if (widest_gap(*covariate, rows) * (count - 2) > 2) break;
    forms.push_back(form_of(bend && count <= 2 ? curve.shape : CurveShape::kSmooth, count));
  }
  return forms;
}

bool is_over(const Curve& curve, const std::vector<std::string>& covariates) {
  return std::find(covariates.begin(), covariates.end(), curve.covariate) != covariates.end();
}

Curve without_trend(const Curve& curve, const std::vector<int>& rows) {
  Curve result = curve;
  if (curve.x.size() == 0) return result;
  const MatrixXd straight = straight_over(curve);
  for (Components& column : result.columns) {
    const bool own = column[0].cols() > 1 && curve.rotor >= 0;
    const Index first = own ? curve.rotor : 0, channels = own ? 1 : straight.cols();
    const MatrixXd w = straight.middleCols(first, channels)(rows, Eigen::all),
                   y = column[0].middleCols(first, channels)(rows, Eigen::all);
    const auto centred = w.array() - w.mean();
    result.tilt.push_back((centred * y.array()).sum() / centred.square().sum());
    column[0] -= result.tilt.back() * straight;
  }
  return result;
}

Curve with_trend(const Curve& curve) {
  Curve result = curve;
  if (curve.tilt.empty()) return result;
  const MatrixXd straight = straight_over(curve);
  for (std::size_t k = 0; k < curve.tilt.size(); ++k) result.columns[k][0] += curve.tilt[k] * straight;
  result.tilt.clear();
  if (curve.shape == CurveShape::kWaves) return result;  // the longest of which is a trend
  Components column(curve.columns[0].size(), MatrixXd::Zero(straight.rows(), straight.cols()));
  column[0] = straight;
  result.columns.push_back(std::move(column));
  return result;
}

bool is_bend_over(const Curve& curve, const std::vector<std::string>& covariates, int rotor) {
  return curve.columns.size() == 1 && curve.shape != CurveShape::kLevels && curve.everywhere() &&
         curve.x.size() > 0 && curve.rotor == rotor && is_over(curve, covariates);
}

Candidate as_candidate(const Curve& curve) {
  // Rotors alone are as likely together as all of them alike, as with named effects.
  const auto channels = static_cast<double>(curve.columns[0][0].cols());
  return {.columns = curve.columns,
          .sign = 0,
          .weight = (curve.rotor < 0 ? 1 : 1 / channels) * (curve.everywhere() ? 1 : kPlaceWeight)};
}

}  // namespace tunnelrig
