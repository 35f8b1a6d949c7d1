// All parameters at once, on data whose truth is known.
#include "analysis/residual/likelihood/joint_fit.h"

#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::MatrixXd;

struct JointFitTest : testing::Test {
  std::mt19937_64 random{test::seed()};

  Observations observations(int channels, int shapes, double sigma) {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(14, 8), .channels = channels, .shapes = shapes, .sigma = sigma},
        random);
    test::add_covariate(o, "air_pressure_Pa", 98000, 104000, random);
    test::add_covariate(o, "time_since_motor_start_s", 5, 400, random);
    return o;
  }
  static Term term(const std::string& name, std::vector<double> parameters) {
    return {.effect = &test::effect_named(name), .parameters = std::move(parameters)};
  }
};

TEST_F(JointFitTest, RecoversCreepAndPressure) {
  for (const int channels : {1, 4}) {
    Observations o = observations(channels, 0, 2e-4);
    test::add_effect(o, "creep", {0.04, 90});
    test::add_effect(o, "air_pressure", {1.2});
    const auto rows = o.all_rows();
    const JointFit fit = fit_jointly(o, {{term("creep", {0.02, 50}), term("air_pressure", {0.5})}, {}}, rows);
    EXPECT_TRUE(fit.converged);
    EXPECT_TRUE(fit.at_bound.empty());
    // standard errors from the linearised model that the fit ends with
    const AmplitudeFit errors = fit_amplitudes(o, difference(response_components(o), fit.linear.offset),
                                               fit.linear.columns, fit.variances, rows);
    ASSERT_EQ(errors.covariance.rows(), 3);
    const std::vector<double> truth = {0.04, 90, 1.2};
    const std::vector<double> found = {fit.model.terms[0].parameters[0], fit.model.terms[0].parameters[1],
                                       fit.model.terms[1].parameters[0]};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      const double standard_error = std::sqrt(errors.covariance(i, i));
      EXPECT_LT(standard_error, 0.15 * truth[k]);
      EXPECT_NEAR(found[k], truth[k], 4 * standard_error);
    }
    EXPECT_NEAR(fit.variances.sigma[0], 2e-4, 5e-5);
  }
}

TEST_F(JointFitTest, TheCourseWithinRunsSharpensTheTimeConstant) {
  Observations o = observations(1, kShapes, 5e-4);
  test::add_effect(o, "creep", {0.04, 40});
  Observations means = o;
  means.shape.clear();
  const auto rows = o.all_rows();
  const MeanModel start{{term("creep", {0.02, 80})}, {}};
  const auto error_of = [&](const Observations& data) {
    const JointFit fit = fit_jointly(data, start, rows);
    const AmplitudeFit amplitudes =
        fit_amplitudes(data, difference(response_components(data), fit.linear.offset), fit.linear.columns,
                       fit.variances, rows);
    const double standard_error = std::sqrt(amplitudes.covariance(1, 1));
    EXPECT_NEAR(fit.model.terms[0].parameters[1], 40, 4 * standard_error);
    return standard_error;
  };
  EXPECT_LT(error_of(o), error_of(means));
}

TEST_F(JointFitTest, IntervalsOfTimeConstantsKeepTheirBounds) {
  int beyond = 0;  // data sets whose standard error alone would lead out of the bounds
  for (int i = 0; i < 8; ++i) {
    Observations o = observations(1, 0, 2e-3);
    test::add_effect(o, "creep", {0.001, 60});  // too small for its time constant to be known
    const auto rows = o.all_rows();
    const JointFit fit = fit_jointly(o, {{term("creep", {0.01, 60})}, {}}, rows);
    const auto estimates = estimate_parameters(o, fit, rows);
    ASSERT_EQ(estimates.size(), 1u);
    ASSERT_EQ(estimates[0].size(), 2u);
    const ParameterEstimate& tau = estimates[0][1];
    const EffectParameter& bounds = fit.model.terms[0].effect->parameters[1];
    EXPECT_GE(tau.low, bounds.lower);
    EXPECT_LE(tau.high, bounds.upper);
    EXPECT_LE(tau.low, tau.value);
    EXPECT_GE(tau.high, tau.value);
    const double half = 2.16 * tau.standard_error;
    beyond += tau.value - half < bounds.lower || tau.value + half > bounds.upper ? 1 : 0;
  }
  EXPECT_GT(beyond, 0);
}

TEST_F(JointFitTest, KeepsBoundsAndSaysSo) {
  Observations o = observations(1, 0, 2e-4);
  test::add_effect(o, "air_pressure", {4});  // physics allows 3
  const JointFit fit = fit_jointly(o, {{term("air_pressure", {1})}, {}}, o.all_rows());
  EXPECT_EQ(fit.model.terms[0].parameters[0], 3);
  EXPECT_THAT(fit.at_bound, testing::ElementsAre(ParameterPlace{0, 0}));
}

/// What has come to a bound is not fitted there: its amplitude is known as well as with a given shape.
TEST_F(JointFitTest, AShapeAtItsBoundHasNoColumn) {
  Observations o = observations(1, 0, 2e-4);
  test::add_effect(o, "creep", {0.05, 60});
  MeanModel model{{term("creep", {0.05, 60})}, {}};
  const auto columns = [&](Shapes shapes) {
    return linearise(o, model, predict_forces(o, model, o.all_rows()), shapes).columns.size();
  };
  EXPECT_EQ(columns(Shapes::kWithinBounds), 2u);
  model.terms[0].parameters[1] = test::effect_named("creep").parameters[1].upper;
  EXPECT_EQ(columns(Shapes::kWithinBounds), 1u);
  EXPECT_EQ(columns(Shapes::kAll), 2u);
}

TEST_F(JointFitTest, TheorysCoefficientStays) {
  Observations o = observations(1, 0, 2e-4);
  test::add_effect(o, "air_pressure", {1.4});
  MeanModel start{{term("air_pressure", {1})}, {}};
  start.terms[0].at_theory = true;
  const JointFit fit = fit_jointly(o, start, o.all_rows());
  EXPECT_EQ(fit.model.terms[0].parameters[0], 1);
  EXPECT_TRUE(fit.linear.columns.empty());
}

TEST_F(JointFitTest, ACurveTakesWhatTheTermsLeave) {
  Observations o = observations(1, 0, 2e-4);
  test::add_effect(o, "creep", {0.05, 60});
  test::add_covariate(o, "humidity_of_paper", 0, 1, random);
  const MatrixXd wave = (6 * o.find("humidity_of_paper")->value.array()).sin();
  test::set_y(o, o.y + 0.01 * wave);
  const auto rows = o.all_rows();
  MeanModel start{{term("creep", {0.02, 100})}, {}};
  const auto sigma = [&] { return fit_jointly(o, start, rows).variances.sigma[0]; };
  const double without = sigma();
  for (const Curve& curve : curves_to_try(o, rows))
    if (curve.covariate == "humidity_of_paper" && curve.columns.size() == 6) start.curves = {curve};
  ASSERT_EQ(start.curves.size(), 1u);
  const JointFit fit = fit_jointly(o, start, rows);
  EXPECT_GT(without, 10 * fit.variances.sigma[0]);
  EXPECT_NEAR(fit.model.terms[0].parameters[0], 0.05, 0.003);
}

/// What an effect acts on is without its own doing, however large that is.
TEST_F(JointFitTest, LargeEffectsAreOfTheirSize) {
  Observations o = observations(1, 0, 2e-4);
  o.covariates.push_back({"run_order", Eigen::VectorXd::LinSpaced(o.rows(), 0, 111), true});
  test::add_effect(o, "mounting_step", {1.5, 56});  // on forces of 7 N
  const JointFit fit = fit_jointly(o, {{term("mounting_step", {0.5, 56})}, {}}, o.all_rows());
  const auto estimates = estimate_parameters(o, fit, o.all_rows());
  EXPECT_NEAR(fit.model.terms[0].parameters[0], 1.5, 4 * estimates[0][0].standard_error);
  EXPECT_LT(estimates[0][0].standard_error, 0.005);
  EXPECT_NEAR(fit.variances.sigma[0], 2e-4, 5e-5);
}

/// What stands beside a coefficient at theory is found with it there, though the data alone, in which the two
/// go together, would have both elsewhere.
TEST_F(JointFitTest, ParametersAreThoseBesideTheory) {
  Observations o = observations(1, 0, 2e-3);
  test::add_covariate(o, "air_pressure_Pa", 98000, 103000, random);
  test::add_covariate(o, "supply_voltage_V", 14, 16, random);
  MatrixXd& supply = o.covariates.back().value;
  supply = 15 + (o.find("air_pressure_Pa")->value.array() - 100500) / 2500 + 0.3 * (supply.array() - 15);
  test::add_effect(o, "air_pressure", {1});
  test::add_effect(o, "supply_voltage", {0.2});
  MeanModel both{{term("air_pressure", {1}), term("supply_voltage", {0.2})}, {}};
  both.terms[0].at_theory = true;
  const JointFit fit = fit_jointly(o, both, o.all_rows());
  const auto beside = estimate_parameters(o, fit, o.all_rows());
  EXPECT_NEAR(beside[1][0].value, fit.model.terms[1].parameters[0], 1e-5);
  EXPECT_EQ(beside[0][0].value, 1);
  EXPECT_LT(beside[0][0].low, beside[0][0].high);
  both.terms[0].at_theory = false;
  const auto free = estimate_parameters(o, fit_jointly(o, both, o.all_rows()), o.all_rows());
  EXPECT_GT(free[1][0].standard_error, 1.5 * beside[1][0].standard_error);
}

/// Nor is the line that it bends.
TEST_F(JointFitTest, ALineAndWhatBendsItAreFoundTogether) {
  Observations o = test::simulate({.runs_of_block = std::vector<int>(14, 8),
                                   .groups = 1,
                                   .sigma = 0.02,
                                   .session_ratio = 0,
                                   .multiplicative = false},
                                  random);
  test::add_covariate(o, "throttle", -1, 1, random);
  o.slopes = o.find("throttle")->value;
  const MatrixXd line = 8 * o.slopes;
  const MatrixXd noise = o.y.array() - o.y.mean();
  test::set_y(o, line);
  test::add_effect(o, "bidirectional", {-0.25});
  test::set_y(o, o.y + noise);
  const JointFit fit = fit_jointly(o, {{term("bidirectional", {-0.1})}, {}}, o.all_rows());
  const auto estimates = estimate_parameters(o, fit, o.all_rows());
  EXPECT_NEAR(fit.model.terms[0].parameters[0], -0.25, 4 * estimates[0][0].standard_error);
  EXPECT_LT(estimates[0][0].standard_error, 0.01);
}

/// Each turn would make the force, and with it the effect, larger.
TEST_F(JointFitTest, AnEffectLargerThanTheForceDoesNotChaseIt) {
  Observations o =
      test::simulate({.runs_of_block = std::vector<int>(14, 8), .multiplicative = false}, random);
  test::add_covariate(o, "tunnel_airspeed_m_s", 0, 30, random);
  const auto rows = o.all_rows();
  const MatrixXd without = predict_response(o, {}, rows);
  for (const double per_speed2 : {-0.02, 0.02}) {
    const MatrixXd with = predict_response(o, {{term("axial_wind", {per_speed2})}, {}}, rows);
    EXPECT_LT(with.cwiseAbs().maxCoeff(), 20 * without.cwiseAbs().maxCoeff()) << per_speed2;
  }
}

TEST_F(JointFitTest, RefitFollowsTheRuns) {
  Observations o = observations(1, 0, 2e-4);
  test::add_effect(o, "creep", {0.04, 90});
  const auto rows = o.all_rows();
  const JointFit whole = fit_jointly(o, {{term("creep", {0.04, 90})}, {}}, rows);
  const MeanModel again = refit(o, whole.model, whole.variances, rows).value();
  EXPECT_NEAR(again.terms[0].parameters[0], whole.model.terms[0].parameters[0], 1e-4);
  const MeanModel half = refit(o, whole.model, whole.variances, {rows.begin(), rows.begin() + 56}).value();
  EXPECT_NE(half.terms[0].parameters[0], again.terms[0].parameters[0]);
  EXPECT_NEAR(half.terms[0].parameters[0], 0.04, 0.01);
}

}  // namespace
}  // namespace tunnelrig
