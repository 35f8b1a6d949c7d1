#include "analysis/residual/search/found.h"

#include <algorithm>
#include <utility>

namespace tunnelrig {

void Found::set_fit(JointFit other) {
  fit = std::move(other);
  for (std::size_t t = 0; t < accepted.size(); ++t) accepted[t].term = fit.model.terms[t];
}

void Found::accept(JointFit with, double p) {
  const std::vector<Term>& terms = with.model.terms;
  const bool together = terms.size() > accepted.size() + 1;
  for (std::size_t t = accepted.size(); t < terms.size(); ++t)
    accepted.push_back({.term = terms[t], .p = p, .together = together, .confounded = {}});
  set_fit(std::move(with));
}

void Found::drop(std::size_t t, JointFit without) {
  accepted.erase(accepted.begin() + static_cast<std::ptrdiff_t>(t));
  set_fit(std::move(without));
}

void Found::make_newest(std::size_t t, JointFit other) {
  const auto place = accepted.begin() + static_cast<std::ptrdiff_t>(t);
  std::rotate(place, place + 1, accepted.end());
  set_fit(std::move(other));
}

void Found::add_curve(FoundCurve curve, JointFit with) {
  curves.push_back(std::move(curve));
  set_fit(std::move(with));
}

void Found::set_curve(std::size_t c, const Curve& form, JointFit with) {
  curves[c].curve = form;
  set_fit(std::move(with));
}

}  // namespace tunnelrig
