#include "analysis/restricted_likelihood.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

namespace tunnelrig {
namespace {

/// By Henderson's mixed-model equations: locations and visits are eliminated by hand, which leaves a matrix
/// of sessions.
double likelihood_by_sessions(const VisitDesign& design, const VarianceComponents& components, double visit,
                              double session) {
  const auto sessions = static_cast<Eigen::Index>(design.sessions);
  std::vector<double> weight(design.locations), weighted(design.locations);
  Eigen::MatrixXd by_location = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(design.locations), sessions);
  Eigen::MatrixXd schur = Eigen::MatrixXd::Zero(sessions, sessions);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(sessions);
  double log_determinants = 0, squares = 0;
  for (const LocationVisit& v : design.visits) {
    const double w = 1 / (visit + own_variance(v, components));
    const auto s = static_cast<Eigen::Index>(v.session);
    log_determinants -= std::log(w);
    weight[v.location] += w;
    weighted[v.location] += w * v.mean;
    by_location(static_cast<Eigen::Index>(v.location), s) += w;
    schur(s, s) += w;
    right(s) += w * v.mean;
    squares += w * v.mean * v.mean;
  }
  for (std::size_t l = 0; l < design.locations; ++l) {
    if (weight[l] <= 0) continue;
    const auto row = by_location.row(static_cast<Eigen::Index>(l));
    log_determinants += std::log(weight[l]);
    squares -= weighted[l] * weighted[l] / weight[l];
    schur.noalias() -= row.transpose() * row / weight[l];
    right -= row.transpose() * (weighted[l] / weight[l]);
  }
  if (session > 0) {
    // log|G| + log|S + G⁻¹| = log|I + σ² S|, which stays finite as σ² goes to 0
    const Eigen::MatrixXd scaled = Eigen::MatrixXd::Identity(sessions, sessions) + session * schur;
    const Eigen::LLT<Eigen::MatrixXd> factor(scaled);
    for (Eigen::Index s = 0; s < sessions; ++s) log_determinants += 2 * std::log(factor.matrixL()(s, s));
    squares -= session * right.dot(factor.solve(right));
  }
  return -0.5 * (log_determinants + squares);
}

/// The same with sessions and visits eliminated, which leaves a matrix of locations: V is a block D + σ² 1 1ᵀ
/// per session, inverted by Sherman and Morrison's formula. `by_session` has the design's visits session by
/// session.
double likelihood_by_locations(const VisitDesign& design, const std::vector<LocationVisit>& by_session,
                               const VarianceComponents& components, double visit, double session) {
  const auto locations = static_cast<Eigen::Index>(design.locations);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(locations, locations);  // Xᵀ V⁻¹ X, its lower half
  Eigen::VectorXd right = Eigen::VectorXd::Zero(locations);              // Xᵀ V⁻¹ y
  std::vector<bool> visited(design.locations, false);
  double log_determinants = 0, squares = 0;
  std::vector<double> weight;
  for (std::size_t from = 0, to = 0; from < by_session.size(); from = to) {
    double total = 0, weighted = 0;
    weight.clear();
    for (; to < by_session.size() && by_session[to].session == by_session[from].session; ++to) {
      const LocationVisit& v = by_session[to];
      const double w = 1 / (visit + own_variance(v, components));
      weight.push_back(w);
      log_determinants -= std::log(w);
      total += w;
      weighted += w * v.mean;
      squares += w * v.mean * v.mean;
    }
    const double shared = session / (1 + session * total);
    log_determinants += std::log1p(session * total);
    squares -= shared * weighted * weighted;
    for (std::size_t i = from; i < to; ++i) {
      const auto row = static_cast<Eigen::Index>(by_session[i].location);
      const double w = weight[i - from];
      right(row) += w * (by_session[i].mean - shared * weighted);
      visited[by_session[i].location] = true;
      normal(row, row) += w;
      for (std::size_t j = from; j <= i; ++j)  // in order of location
        normal(row, static_cast<Eigen::Index>(by_session[j].location)) -= shared * w * weight[j - from];
    }
  }
  for (Eigen::Index l = 0; l < locations; ++l)
    if (!visited[static_cast<std::size_t>(l)]) normal(l, l) = 1;
  const Eigen::LLT<Eigen::MatrixXd> factor(normal);
  for (Eigen::Index l = 0; l < locations; ++l) log_determinants += 2 * std::log(factor.matrixL()(l, l));
  squares -= right.dot(factor.solve(right));
  return -0.5 * (log_determinants + squares);
}

}  // namespace

double own_variance(const LocationVisit& visit, const VarianceComponents& components) {
  return components.run_known ? components.run_by_location[visit.location] / visit.runs : 0;
}

/// Goes by whichever leaves the smaller matrix.
RestrictedLikelihood::RestrictedLikelihood(const VisitDesign& design, const VarianceComponents& components)
    : design_(design), components_(components) {
  if (design.locations >= design.sessions) return;
  by_session_ = design.visits;
  std::ranges::sort(by_session_, {}, [](const LocationVisit& v) { return std::pair(v.session, v.location); });
}

double RestrictedLikelihood::operator()(double visit, double session) const {
  return by_session_.empty() ? likelihood_by_sessions(design_, components_, visit, session)
                             : likelihood_by_locations(design_, by_session_, components_, visit, session);
}

}  // namespace tunnelrig
