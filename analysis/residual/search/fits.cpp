#include "analysis/residual/search/fits.h"

#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

using Eigen::Index;

constexpr double kTheoryRefused = 0.05;  // p at which the data speak against theory's coefficient

}  // namespace

JointFit fit_with(const SearchData& data, const JointFit& base, Term term, double amplitude) {
  const EffectParameter& parameter = term.effect->parameters[0];
  term.parameters[0] = std::clamp(amplitude, parameter.lower, parameter.upper);
  MeanModel model = base.model;
  model.terms.push_back(term);
  JointFit free = fit_jointly(data.observations(), model, data.rows());
  if (!parameter.theory) return free;
  model = free.model;
  model.terms.back().at_theory = true;
  model.terms.back().parameters[0] = *parameter.theory;
  JointFit fixed = fit_jointly(data.observations(), model, data.rows());
  const double ratio = std::max(0.0, free.variances.log_likelihood - fixed.variances.log_likelihood);
  const bool allowed = ratio_p(data, ratio, free) > kTheoryRefused;
  return allowed || term.effect->theory_only ? fixed : free;
}

JointFit fit_with_all(const SearchData& data, const JointFit& base, const std::vector<Term>& terms) {
  MeanModel model = base.model;
  model.terms.insert(model.terms.end(), terms.begin(), terms.end());
  return fit_jointly(data.observations(), model, data.rows());
}

JointFit fit_without(const SearchData& data, const JointFit& base, std::size_t t) {
  return fit_jointly(data.observations(), base.model.without_term(t), data.rows());
}

JointFit fit_with_curve(const SearchData& data, const JointFit& base, const Curve& curve) {
  MeanModel model = base.model;
  model.curves.push_back(curve);
  return fit_jointly(data.observations(), model, data.rows());
}

JointFit fit_without_curve(const SearchData& data, const JointFit& base, std::size_t c) {
  MeanModel model = base.model;
  model.curves.erase(model.curves.begin() + static_cast<std::ptrdiff_t>(c));
  return fit_jointly(data.observations(), model, data.rows());
}

double ratio_p(const SearchData& data, double ratio, const JointFit& fit) {
  Index dof = -static_cast<Index>(fit.linear.columns.size());
  for (std::size_t s = 0; s < data.mixed().strata().size(); ++s) dof += data.mixed().dof(s);
  const double n = static_cast<double>(std::max<Index>(dof, 1));
  return f_upper_p(std::expm1(2 * ratio / (n + 1)) * n, 1, n);
}

}  // namespace tunnelrig
