// Curves over everything that is known of the runs, as candidates.
#include "analysis/residual/likelihood/curves.h"
#include "analysis/residual/observations/condition_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Few bends see a weak trend, many a wave: each covariate is tried with all of these.
constexpr std::array<int, 3> kBends = {2, 4, 6};

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

/// Whether its values are told by their ratios: a positive column, and no temperature.
bool has_ratios(const Covariate& covariate) {
  return !covariate.derived && !covariate.name.ends_with("_C") && covariate.value.minCoeff() > 0;
}

/// Whether a power law is what is straight.
bool is_ratio(const Observations& observations, const Covariate& covariate) {
  return observations.multiplicative && has_ratios(covariate);
}

/// Whether low/x is 1 in one row of many and little in all others: a wind that was nearly still once.
bool lowest_stands_alone(const Covariate& covariate, const std::vector<int>& rows) {
  constexpr std::size_t kMany = 40;  // in a ladder of a few settings every row is one of its own
  constexpr double kAlone = 2.5;     // times the lowest
  if (rows.size() < kMany) return false;
  const MatrixXd values = covariate.value(rows, Eigen::all);
  std::vector<double> lowest(values.reshaped().begin(), values.reshaped().end());
  std::partial_sort(lowest.begin(), lowest.begin() + 2, lowest.end());
  return lowest[1] > kAlone * lowest[0];
}

std::vector<CurveShape> bends_over(const Observations& observations, const Covariate& covariate,
                                   const std::vector<int>& rows) {
  if (!is_ratio(observations, covariate)) return {CurveShape::kParabola};
  if (lowest_stands_alone(covariate, rows)) return {CurveShape::kLogParabola};
  return {CurveShape::kLogParabola, CurveShape::kLevelling};
}

/// Whether what happens at the low end is one short piece of a range: an exponential, or a threshold, in 6 to
/// 500 s.
bool is_wide(const Covariate& covariate, const Curve& over, const std::vector<int>& rows) {
  constexpr double kWide = 10;
  return has_ratios(covariate) && over.high > kWide * over.low && !lowest_stands_alone(covariate, rows);
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

/// Whether another condition of the runs goes with it: sessions that all begin at one hour.
bool repeats_another(const Observations& observations, const Covariate& covariate) {
  constexpr double kSame = 0.99;  // correlation
  return std::any_of(observations.covariates.begin(), observations.covariates.end(),
                     [&](const Covariate& other) {
                       return other.name != covariate.name && !other.per_channel() &&
                              other.value.allFinite() && std::abs(correlation(covariate, other)) > kSame;
                     });
}

/// The candidates of one set of observations, in the order in which they are tried.
class CurvesToTry {
 public:
  CurvesToTry(const Observations& observations, const std::vector<int>& rows)
      : observations_(observations), rows_(rows), places_(places_to_try(observations, rows)) {
    for (int rotor = 0; rotor < static_cast<int>(observations.channels()) && observations.channels() > 1;
         ++rotor)
      rotors_.push_back(rotor);
  }

  std::vector<Curve> take() {
    for (const Covariate& covariate : observations_.covariates)
      if (can_be_followed(observations_, covariate) && number_of_texts(observations_, covariate) == nullptr)
        add_over(covariate);
    add_products();
    add_courses();
    return std::move(curves_);
  }

 private:
  void add_over(const Covariate& covariate) {
    const auto [low, high] = range_of(covariate, rows_);
    if (!(high > low)) return;
    const Curve over{
        .covariate = covariate.name, .columns = {}, .x = covariate.value, .low = low, .high = high};
    add_levels(covariate, over);
    if (!covariate.labels.empty()) return;
    if (covariate.derived && covariate.name == "hour_of_day" && repeats_another(observations_, covariate))
      return;
    for (const Place& place : places_)
      add(covariate, over,
          is_ratio(observations_, covariate) ? CurveShape::kLogStraight : CurveShape::kStraight, 1, rotors_,
          place);
    const std::vector<Room> rooms = rooms_of(covariate);
    for (const CurveShape bend : bends_over(observations_, covariate, rows_))
      add(covariate, over, bend, 1, with_room(rooms, 1));
    for (const int count : kBends) add(covariate, over, CurveShape::kWaves, count, with_room(rooms, count));
    if (!is_wide(covariate, over, rows_)) return;
    const std::vector<Room> of_logarithm = rooms_of(as_measured_along(covariate, CurveShape::kLogWaves));
    for (const int count : kBends)
      add(covariate, over, CurveShape::kLogWaves, count, with_room(of_logarithm, count));
  }

  /// How close a rotor's own values lie.
  struct Room {
    int rotor, places;
    double gap;
  };

  std::vector<Room> rooms_of(const Covariate& covariate) const {
    std::vector<Room> rooms;
    for (const int rotor : rotors_) {
      if (!rooms.empty() && !covariate.per_channel()) {
        rooms.push_back({rotor, rooms[0].places, rooms[0].gap});
        continue;
      }
      const int places = places_on_range(covariate, rows_, rotor);
      const bool varies = places >= 3 * kBends[1];  // or no gap is asked for
      rooms.push_back({rotor, places, varies ? widest_gap(covariate, rows_, rotor) : 0});
    }
    return rooms;
  }

  /// The rotors with room for so many waves. Where a whole one finds no row its height is anything.
  static std::vector<int> with_room(const std::vector<Room>& rooms, int waves) {
    constexpr int kSettings = 5;  // show a straight course and a bend: without these only the bend is tried
    const int fewest = waves == kBends[0] ? kSettings : 3 * waves;
    std::vector<int> result;
    for (const auto& [rotor, places, gap] : rooms)
      if (fewest <= places && (waves < kBends[1] || gap * waves <= 2)) result.push_back(rotor);
    return result;
  }

  /// For all rotors alike and for each alone.
  void add(const Covariate& covariate, const Curve& over, CurveShape shape, int count,
           const std::vector<int>& rotors, const Place& place = {}) {
    const auto column_at = [&](int k, double x) { return curve_column(shape, k, x, over.low, over.high); };
    for (const int rotor : rotors) {
      Curve curve = over;
      curve.rotor = rotor;
      curve.shape = shape;
      curve.place = place;
      curve.columns = columns_over(observations_, covariate, rotor, count, column_at);
      if (!curve.everywhere())
        for (Components& column : curve.columns) column[0] = place.weight.asDiagonal() * column[0];
      curves_.push_back(std::move(curve));
    }
  }

  void add_levels(const Covariate& covariate, const Curve& over) {
    const std::vector<double> levels = levels_of(observations_, covariate, rows_);
    if (levels.empty()) return;
    const auto column_at = [&](int k, double x) { return level_column(levels, k, x); };
    for (const int rotor : rotors_) {
      Curve curve = over;
      curve.rotor = rotor;
      curve.shape = CurveShape::kLevels;
      curve.columns =
          columns_over(observations_, covariate, rotor, static_cast<int>(levels.size()) - 1, column_at);
      curve.levels = levels;
      curve.labels = covariate.labels;
      curves_.push_back(std::move(curve));
    }
  }

  void add_products() {
    std::vector<const Covariate*> conditions;
    for (const Covariate& covariate : observations_.covariates)
      if (!covariate.derived && !covariate.per_channel() && covariate.labels.empty() &&
          can_be_followed(observations_, covariate))
        conditions.push_back(&covariate);
    // And what one does may be another from some run on: a cable that came loose, a part that was changed.
    if (const Covariate* order = observations_.find("run_order");
        order != nullptr && order->derived && can_be_followed(observations_, *order))
      conditions.push_back(order);
    for (std::size_t a = 0; a < conditions.size(); ++a)
      for (std::size_t b = a + 1; b < conditions.size(); ++b) add_product(*conditions[a], *conditions[b]);
  }

  /// What two conditions do together and neither does alone: the product of both, each from its mean.
  void add_product(const Covariate& first, const Covariate& second) {
    constexpr double kLeast = 0.5;  // of its variance that is neither's own
    const auto [low, high] = range_of(first, rows_);
    if (!(high > low)) return;
    const double mean = first.value.mean();
    const Eigen::ArrayXd from_mean = second.value.col(0).array() - second.value.mean();
    const Strength strength{.centre = second.value.mean(), .scale = from_mean.abs().maxCoeff()};
    const auto column_at = [&, low = low, high = high](int k, double x) {
      return curve_column(CurveShape::kStraight, k, x, low, high) -
             curve_straight(CurveShape::kStraight, mean, low, high);
    };
    Curve curve{.covariate = first.name,
                .shape = CurveShape::kStraight,
                .columns = columns_over(observations_, first, -1, 1, column_at),
                .x = first.value,
                .low = low,
                .high = high,
                .place = {second.name, from_mean / strength.scale},
                .strength = strength};
    curve.columns[0][0] = curve.place.weight.asDiagonal() * curve.columns[0][0];
    const double own = share_beside_cubics(
        observations_, rows_, {first.value(rows_, 0), second.value(rows_, 0)}, curve.columns[0][0](rows_, 0));
    if (own > kLeast) curves_.push_back(std::move(curve));
  }

  void add_courses() {
    if (observations_.shape.empty()) return;
    for (const int rotor : rotors_)
      curves_.push_back(
          {.covariate = "time_in_run", .rotor = rotor, .columns = course(observations_, rotor), .x = {}});
  }

  const Observations& observations_;
  const std::vector<int>& rows_;
  std::vector<int> rotors_ = {-1};
  const std::vector<Place> places_;
  std::vector<Curve> curves_;
};

}  // namespace

Covariate as_measured_along(const Covariate& covariate, CurveShape shape) {
  Covariate result = covariate;
  if (is_of_logarithm(shape)) result.value = covariate.value.array().log();
  return result;
}

std::vector<Curve> curves_to_try(const Observations& observations, const std::vector<int>& rows) {
  return CurvesToTry(observations, rows).take();
}

std::vector<Curve> smooth_forms(const Observations& observations, const Curve& curve,
                                const std::vector<int>& rows) {
  const Covariate* covariate = observations.find(curve.covariate);
  const bool waves = has_waves(curve.shape);
  const bool bend = curve.shape == CurveShape::kParabola || (is_of_logarithm(curve.shape) && !waves);
  if (covariate == nullptr || !(bend || waves) || !curve.tilt.empty() || !curve.everywhere()) return {};
  const auto form_of = [&](CurveShape shape, int count) {
    Curve form = curve;
    form.shape = shape;
    form.columns = columns_over(observations, *covariate, curve.rotor, count, [&](int k, double x) {
      return curve_column(shape, k, x, curve.low, curve.high);
    });
    return form;
  };
  const Covariate measured = as_measured_along(*covariate, curve.shape);
  const CurveShape of_many = is_of_logarithm(curve.shape) ? CurveShape::kLogSmooth : CurveShape::kSmooth;
  const int most = std::clamp(places_on_range(measured, rows, curve.rotor) / 3, 2, kBends.back() + 2);
  std::vector<Curve> forms;
  for (int count = 1; count <= (bend && is_of_logarithm(curve.shape) ? 2 : most); ++count) {
    if (widest_gap(measured, rows, curve.rotor) * (count - 2) > 2) break;
    forms.push_back(form_of(bend && count <= 2 ? curve.shape : of_many, count));
  }
  return forms;
}

}  // namespace tunnelrig
