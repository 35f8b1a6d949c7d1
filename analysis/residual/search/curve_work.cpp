#include "analysis/residual/search/curve_work.h"

#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/observations/condition_values.h"

#include <algorithm>

namespace tunnelrig {
namespace {

/// A formula that leaves more than this of its own size, rms, as a curve over its own covariate is not what
/// the covariate does. One with a time constant or a length can bend towards the curve, and must do less than
/// it.
constexpr double kMostLeft = 0.3, kMostLeft_bending = 1;

/// A curve over another condition that leaves no more of an effect's variance than this can do all that the
/// effect does.
constexpr double kLittle_other = 0.02;

/// Whether it has a time constant or a length that is not at its bound, where a formula is what it is.
bool can_bend(const Term& term) {
  for (std::size_t k = 1; k < term.parameters.size(); ++k)
    if (!is_at_bound(term, k)) return true;
  return false;
}

/// Of what an effect makes of its conditions, the share that does not go with what the curve is over.
double share_beside(const SearchData& data, const Curve& curve, const Term& term, const Eigen::MatrixXd& made,
                    const Eigen::MatrixXd& predicted) {
  const Eigen::Index channel = std::max(term.rotor, 0), of_curve = curve.x.cols() > 1 ? channel : 0;
  const Eigen::VectorXd column = made(data.rows(), channel);
  const auto share = [&](const Eigen::VectorXd& of) {
    return share_beside_cubics(data.observations(), data.rows(), {curve.x(data.rows(), of_curve)}, of);
  };
  if (data.observations().multiplicative) return share(column);
  // What an effect adds goes with the force as well, or with the conditions alone.
  const Eigen::VectorXd of_force = column.cwiseQuotient(predicted(data.rows(), channel));
  return std::min(share(column), of_force.allFinite() ? share(of_force) : 1.0);
}

/// Whether a curve is of an effect's rotors, the same everywhere, and nothing was taken out of it.
bool is_whole_curve_of(const Curve& curve, const Term& term) {
  return curve.everywhere() && !curve.strength && curve.tilt.empty() && curve.rotor == term.rotor &&
         curve.x.size() > 0;
}

Eigen::MatrixXd made_by_newest_curve(const SearchData& data, const JointFit& fit) {
  const auto& columns = fit.model.curves.back().columns;  // the last of the fit
  const Eigen::VectorXd amplitude =
      fit_amplitudes(data.observations(), difference(data.y(), fit.linear.offset), fit.linear.columns,
                     fit.variances, data.rows())
          .amplitude.tail(std::ssize(columns));
  return combined(columns, amplitude)[0];
}

}  // namespace

bool is_work_of_a_curve(const SearchData& data, const std::vector<FoundCurve>& curves, const Term& term,
                        const Eigen::MatrixXd& made, const Eigen::MatrixXd& predicted) {
  constexpr double kLittle = 0.1;  // of its variance, over a condition of its own
  const auto names = own_conditions(*term.effect, data.observations());
  return !term.per_group && std::any_of(curves.begin(), curves.end(), [&](const FoundCurve& found) {
    return is_whole_curve_of(found.curve, term) &&
           share_beside(data, found.curve, term, made, predicted) <
               (is_over(found.curve, names) ? kLittle : kLittle_other);
  });
}

bool outshone_by_curve(const SearchData& data, const Found& found, const Term& term) {
  const Curve& curve = found.curves.back().curve;
  const bool over_its_own =
      !curve.tilt.empty() && is_over(curve, own_conditions(*term.effect, data.observations()));
  if (!over_its_own && !is_whole_curve_of(curve, term)) return false;
  const Eigen::MatrixXd predicted = predict_response(data.observations(), found.fit.model, data.rows());
  const Eigen::MatrixXd made = respond(term, data.observations(), predicted).value[0];
  // Over a condition that tells the effect's own, a curve may be large only because the two cancel.
  if (!over_its_own && share_beside(data, curve, term, made, predicted) >= kLittle_other) return false;
  const double most = can_bend(term) ? kMostLeft_bending : kMostLeft;
  return rms_beside_baseline(data, made_by_newest_curve(data, found.fit)) >
         most * rms_beside_baseline(data, made);
}

}  // namespace tunnelrig
