#include "analysis/residual/search/shape_profile.h"

#include "analysis/residual/search/group_amplitudes.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace tunnelrig {
namespace {

/// The likelihood at values of one parameter, on a logarithmic scale; each is worked out once.
class Likelihoods {
 public:
  Likelihoods(const Observations& observations, const JointFit& fit, std::size_t t, std::size_t k,
              const std::vector<int>& rows)
      : own_(observations),
        fit_(fit),
        rows_(rows),
        term_(fit.model.terms[t]),
        parameter_(k),
        place_(place_among_own(fit.model, t)),
        forces_(predict_forces(observations, fit.model, rows)),
        before_(group_term(observations, fit, forces_, t, rows)) {}

  double operator()(double log_value) {
    const auto [place, fresh] = known_.try_emplace(log_value, 0);
    if (!fresh) return place->second;
    term_.parameters[parameter_] = std::exp(log_value);
    const OwnResponse own = respond_in_groups(term_, before_.by_group, own_, before_.acted_on);
    own_.slopes.col(own_.first_own_slope() + place_) = own.derivative;
    own_.beyond.col(place_) = own.beyond(before_.amplitude);
    const LinearModel linear = linearise(own_, fit_.model, forces_);
    const NullFit found = CandidateScan(MixedModel(own_, rows_), linear.columns, {})
                              .null_fit(difference(response_components(own_), linear.offset));
    return place->second = likelihood_beside_own(own_, found, rows_);
  }

  /// Of the values so far.
  double likeliest() const {
    return std::ranges::max_element(known_, {}, [](const auto& known) { return known.second; })->first;
  }

 private:
  Observations own_;
  const JointFit& fit_;
  const std::vector<int>& rows_;
  Term term_;
  std::size_t parameter_;
  Eigen::Index place_;
  Forces forces_;
  GroupTerm before_;
  std::map<double, double> known_;
};

/// Where the likelihood falls below `least` between a value that is likely and an end of the range; the end
/// itself, where it is likely.
double crossing(Likelihoods& likelihood, double likely, double end, double least) {
  constexpr int kHalvings = 13;  // of the range, to a part in 10,000
  if (likelihood(end) >= least) return end;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (likely + end) / 2;
    (likelihood(middle) >= least ? likely : end) = middle;
  }
  return likely;
}

}  // namespace

std::vector<std::size_t> shapes_in_groups(const Term& term) {
  std::vector<std::size_t> result;
  for (std::size_t k = 1; k < term.parameters.size() && term.per_group; ++k) {
    const EffectParameter& parameter = term.effect->parameters[k];
    if (parameter.role == ParameterRole::kShape && parameter.lower > 0) result.push_back(k);
  }
  return result;
}

ShapeProfile shape_profile(const Observations& observations, const JointFit& fit, std::size_t t,
                           std::size_t k, const std::vector<int>& rows) {
  constexpr int kAtFirst = 16, kRounds = 4;
  const Term& term = fit.model.terms[t];
  const EffectParameter& parameter = term.effect->parameters[k];
  const double low = std::log(parameter.lower), high = std::log(parameter.upper);
  Likelihoods likelihood(observations, fit, t, k, rows);
  likelihood(std::clamp(std::log(term.parameters[k]), low, high));
  for (int i = 0; i <= kAtFirst; ++i) likelihood(low + (high - low) * i / kAtFirst);
  double step = (high - low) / kAtFirst;
  for (int round = 0; round < kRounds; ++round) {
    step /= 3;
    const double middle = likelihood.likeliest();
    for (const double side : {-2, -1, 1, 2}) likelihood(std::clamp(middle + side * step, low, high));
  }
  const double likeliest = likelihood.likeliest();
  const auto blocks = static_cast<double>(places_of_each(observations.block, rows).size());
  const double width = half_width_95(1, std::max(blocks - 1, 1.0));
  const double least = likelihood(likeliest) - width * width / 2;
  return {std::exp(likeliest), std::exp(crossing(likelihood, likeliest, low, least)),
          std::exp(crossing(likelihood, likeliest, high, least))};
}

}  // namespace tunnelrig
