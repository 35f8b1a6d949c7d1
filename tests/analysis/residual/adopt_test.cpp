// What an explanation stores as a model: its parameters, and how far they and their products are known.
#include "analysis/model/adopt.h"

#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using Eigen::MatrixXd;

/// Four rotors nearer to a wall the less they pull: so slowly that the effect's length comes to its bound.
Observations beside_a_far_wall() {
  std::mt19937_64 random(test::seed());
  Observations o = test::four_rotors(3, 0.002, random);
  test::add_covariate(o, "wall_distance_R", 1, 6, random);
  const Eigen::VectorXd distance = o.find("wall_distance_R")->value.col(0);
  test::set_y(o, o.y + (0.01 * distance).replicate(1, o.channels()));
  test::add_effect(o, "supply_voltage", {0.5});
  return o;
}

Explanation with(const Observations& o, const std::vector<Term>& terms) {
  const JointFit fit = fit_jointly(o, {terms, {}}, o.all_rows());
  const auto estimates = estimate_parameters(o, fit, o.all_rows());
  Explanation explanation;
  explanation.model = fit.model;
  for (std::size_t t = 0; t < terms.size(); ++t)
    explanation.adopted.push_back(
        {.term = fit.model.terms[t], .parameters = estimates[t], .separating_run = {}});
  return explanation;
}

/// A shape at its bound is no column of the fit: what comes behind it is where it is all the same.
TEST(Adopt, AShapeAtItsBoundMovesNoOtherParameter) {
  const Observations o = beside_a_far_wall();
  const Term wall{.effect = &test::effect_named("wall_effect"), .parameters = {-0.1, 10}},
      supply{.effect = &test::effect_named("supply_voltage"), .parameters = {0.5}};
  const Explanation first = with(o, {wall, supply}), last = with(o, {supply, wall});
  ASSERT_TRUE(is_at_bound(first.model.terms[0], 1));
  const MatrixXd bound_first = adopt(o, first, false).model->covariance,
                 bound_last = adopt(o, last, false).model->covariance;
  ASSERT_EQ(bound_first.rows(), 3);
  const std::vector<Eigen::Index> turned = {1, 2, 0};
  const MatrixXd same = bound_last(turned, turned);
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      EXPECT_NEAR(bound_first(i, j), same(i, j), 1e-3 * std::sqrt(same(i, i) * same(j, j))) << i << ' ' << j;
  EXPECT_NEAR(bound_first(2, 2), std::pow(first.adopted[1].parameters[0].standard_error, 2), 1e-15);
  EXPECT_NE(bound_first(0, 2), 0);
}

}  // namespace
}  // namespace tunnelrig
