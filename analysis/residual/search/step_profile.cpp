#include "analysis/residual/search/step_profile.h"

#include "analysis/residual/likelihood/candidates.h"
#include "analysis/residual/search/group_amplitudes.h"

#include <algorithm>
#include <iterator>
#include <optional>

namespace tunnelrig {
namespace {

using Eigen::Index;

/// Of a step that begins at these rows, beside the rest of the model.
class StepLikelihoods {
 public:
  StepLikelihoods(const Observations& given, const MeanModel& model, std::size_t t,
                  const std::vector<int>& rows)
      : rows_(rows),
        step_(model.terms[t]),
        own_column_(step_.per_group ? given.first_own_slope() + place_among_own(model, t) : -1),
        fewer_(step_.per_group ? std::optional(without_own(given, model, t)) : std::nullopt),
        without_(fewer_ ? *fewer_ : given) {
    const MeanModel rest = model.without_term(t);
    const Forces forces = predict_forces(without_, rest, rows);
    linear_ = linearise(without_, rest, forces);
    predicted_ = forces.predicted;
    y_ = difference(response_components(without_), linear_.offset);
    if (step_.per_group)
      wide_ = given;
    else
      mixed_.emplace(without_, rows);
  }

  std::vector<double> operator()(std::vector<int>::const_iterator first,
                                 std::vector<int>::const_iterator last) {
    return step_.per_group ? in_groups(first, last) : alike(first, last);
  }

 private:
  Components column_from(int row) {
    step_.parameters[step_.effect->change_point().value()] = row;
    return respond(step_, without_, predicted_).derivative[0];
  }

  std::vector<double> alike(std::vector<int>::const_iterator first, std::vector<int>::const_iterator last) {
    std::vector<Candidate> candidates;
    for (auto row = first; row != last; ++row) candidates.push_back({.columns = {column_from(*row)}});
    std::vector<double> result;
    for (const CandidateFit& fit : CandidateScan(*mixed_, linear_.columns, candidates).fit(y_))
      result.push_back(fit.likelihood_ratio);
    return result;
  }

  /// There may be more groups than a candidate has columns: the step stands in the baseline.
  std::vector<double> in_groups(std::vector<int>::const_iterator first,
                                std::vector<int>::const_iterator last) {
    std::vector<double> result;
    for (auto row = first; row != last; ++row) {
      wide_->slopes.col(own_column_) = column_from(*row)[0];
      const NullFit fit = CandidateScan(MixedModel(*wide_, rows_), linear_.columns, {}).null_fit(y_);
      result.push_back(likelihood_beside_own(*wide_, fit, rows_));
    }
    return result;
  }

  const std::vector<int>& rows_;
  Term step_;
  Index own_column_;
  const std::optional<Observations> fewer_;
  const Observations& without_;       // the step's own columns
  std::optional<Observations> wide_;  // with them
  std::optional<MixedModel> mixed_;   // of `without_`
  LinearModel linear_;
  Eigen::MatrixXd predicted_;
  Components y_;
};

}  // namespace

int first_row_of(const Term& step) {
  return static_cast<int>(step.parameters[step.effect->change_point().value()]);
}

int StepProfile::likeliest() const {
  const auto highest = std::max_element(log_likelihood.begin(), log_likelihood.end());
  return first_row[static_cast<std::size_t>(highest - log_likelihood.begin())];
}

int StepProfile::end_of_interval(bool highest) const {
  const double least = *std::max_element(log_likelihood.begin(), log_likelihood.end()) - kStepInterval;
  int result = likeliest();
  for (std::size_t i = 0; i < first_row.size(); ++i)
    if (log_likelihood[i] > least)
      result = highest ? std::max(result, first_row[i]) : std::min(result, first_row[i]);
  return result;
}

StepProfile step_profile(const Observations& given, const MeanModel& model, std::size_t t,
                         const std::vector<int>& rows, const std::vector<int>& possible) {
  constexpr std::ptrdiff_t kAtOnce = 32;
  constexpr double kClearlyNot = 3 * kStepInterval;  // beyond it a profile hardly comes back
  StepProfile profile;
  if (possible.empty()) return profile;
  StepLikelihoods evaluate(given, model, t, rows);
  auto from = std::lower_bound(possible.begin(), possible.end(), first_row_of(model.terms[t]));
  auto to = from;
  const auto goes_on = [&](bool up) {
    if (up ? to == possible.end() : from == possible.begin()) return false;
    const auto& all = profile.log_likelihood;
    if (all.empty()) return true;
    const auto near = std::min(kAtOnce, std::ssize(all));
    const double at_end = up ? *std::max_element(all.end() - near, all.end())
                             : *std::max_element(all.begin(), all.begin() + near);
    return at_end > *std::max_element(all.begin(), all.end()) - kClearlyNot;
  };
  bool up = true;
  while (goes_on(true) || goes_on(false)) {
    up = goes_on(up) ? up : !up;
    const auto first = up ? to : from - std::min(kAtOnce, std::distance(possible.begin(), from));
    const auto last = up ? to + std::min(kAtOnce, std::distance(to, possible.end())) : from;
    const std::vector<double> values = evaluate(first, last);
    auto& all = profile.log_likelihood;
    all.insert(up ? all.end() : all.begin(), values.begin(), values.end());
    (up ? to : from) = up ? last : first;
    up = !up;
  }
  profile.first_row.assign(from, to);
  return profile;
}

}  // namespace tunnelrig
