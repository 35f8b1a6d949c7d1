// A Kalman filter whose corrections may come late: it goes back to when they were measured and repeats what
// followed.
#pragma once

#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>
#include <Eigen/LU>

namespace tunnelrig {

struct GateSettings {
  double sigma = 5;  // innovations beyond it are turned away
  /// After so many in a row the filter, not the matcher, is taken to be wrong: its position is made as
  /// uncertain as the innovation is large, its velocity as uncertain as one that led there since the last
  /// accepted correction, and the correction accepted. 0 never does.
  int most_rejections = 10;
};

struct Correction {
  bool accepted = false;
  Eigen::Vector2d innovation_m{0, 0};
  Eigen::Matrix2d innovation_covariance_m2 = Eigen::Matrix2d::Zero();
  double nis = 0;  // normalised innovation squared; two degrees of freedom
};

template <int kStates>
struct Belief {
  Eigen::Matrix<double, kStates, 1> state = Eigen::Matrix<double, kStates, 1>::Zero();
  Eigen::Matrix<double, kStates, kStates> covariance = Eigen::Matrix<double, kStates, kStates>::Zero();
};

/// What a filter corrects itself by.
struct MeasuredPosition {
  Eigen::Vector2d position_m{0, 0};
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  double age_s = 0;  // time since it was measured
  /// By how much it moves for each radian of the attitude's error; for models with that error as a state.
  Eigen::Vector2d per_roll_m{0, 0};
};

/// A model one of whose states, number kRollError, is the error of the attitude's roll.
template <typename Model>
concept WithRollError = requires {
  Model::kRollError;
};

/// The Model is a struct with kStates, a type Input with finite(), and step(belief, input, dt_s, last),
/// `last` where the step is not only the first part of one that a correction divides. The position is its
/// first two states.
template <typename Model>
class DelayedFilter {
 public:
  static constexpr double kLongest_step_s = 0.1;
  static constexpr std::size_t kRemembered = 128;  // steps

  using State = Eigen::Matrix<double, Model::kStates, 1>;
  using Covariance = Eigen::Matrix<double, Model::kStates, Model::kStates>;

  DelayedFilter(const Model& model, const Belief<Model::kStates>& start, const GateSettings& gate)
      : model_(model), gate_(gate), now_(start) {}

  /// Throws InputError where an input is not finite, dt not positive (time going backwards) or above 0.1 s.
  void predict(const typename Model::Input& input, double dt_s) {
    if (!(dt_s > 0 && dt_s <= kLongest_step_s))
      throw InputError::in("estimator", "a step of {} s: time runs forwards, by at most {} s", dt_s,
                           kLongest_step_s);
    if (!input.finite()) throw InputError::in("estimator", "an acceleration is not finite");
    Past& past = past_[next_ % kRemembered];
    past = {now_, input, dt_s};
    ++next_;
    if (next_ - first_ > kRemembered) first_ = next_ - kRemembered;
    model_.step(now_, input, dt_s, true);
    since_accepted_s_ += dt_s;
  }

  /// A position with its covariance, measured `age_s` ago. Throws InputError where a value is not finite, the
  /// covariance not positive definite, the age negative, beyond what is remembered, or before the last
  /// accepted correction.
  Correction correct(const Eigen::Vector2d& position_m, const Eigen::Matrix2d& covariance_m2,
                     double age_s = 0) {
    return correct({position_m, covariance_m2, age_s});
  }

  Correction correct(const MeasuredPosition& measured) {
    check(measured);
    const double age_s = measured.age_s;
    if (age_s <= kInstant_s) return update(now_, measured);

    std::size_t at = next_;  // the step in which the measurement was taken, and how far before its end
    double before_end_s = age_s;
    while (at > first_ && before_end_s > kInstant_s) before_end_s -= past_[--at % kRemembered].dt_s;
    if (before_end_s > kInstant_s)
      throw InputError::in(
          "estimator", "a position of {} s ago: older than what is remembered or than the last one", age_s);
    Past& divided = past_[at % kRemembered];
    Belief<Model::kStates> then = divided.before;
    const double into_step_s = -before_end_s;
    if (into_step_s > kInstant_s) model_.step(then, divided.input, into_step_s, false);
    Correction result = update(then, measured);
    if (!result.accepted) return result;

    divided.before = then;
    if (into_step_s > kInstant_s) divided.dt_s -= into_step_s;
    first_ = at;
    for (; at < next_; ++at) {
      Past& past = past_[at % kRemembered];
      past.before = then;
      model_.step(then, past.input, past.dt_s, true);
    }
    now_ = then;
    return result;
  }

  Eigen::Vector2d position_m() const { return now_.state.template head<2>(); }
  Eigen::Vector2d velocity_m_s() const { return now_.state.template segment<2>(2); }
  const State& state() const { return now_.state; }
  const Covariance& covariance() const { return now_.covariance; }
  const Model& model() const { return model_; }

 private:
  static constexpr double kInstant_s = 1e-9;
  using Gain = Eigen::Matrix<double, Model::kStates, 2>;

  struct Past {
    Belief<Model::kStates> before;
    typename Model::Input input;
    double dt_s = 0;
  };

  static void check(const MeasuredPosition& measured) {
    if (!measured.position_m.allFinite() || !measured.per_roll_m.allFinite())
      throw InputError::in("estimator", "a measured position is not finite");
    const Eigen::Matrix2d& covariance = measured.covariance_m2;
    if (!(covariance(0, 0) > 0 && covariance.determinant() > 0 && covariance.allFinite()))
      throw InputError::in("estimator", "the covariance of a measured position is not positive definite");
    if (!(measured.age_s >= 0))
      throw InputError::in("estimator", "a position of {} s ago: ages are not negative", measured.age_s);
  }

  /// M Hᵀ, where H = [I 0], with `per_roll_m` in the column of the attitude's error.
  static Gain seen(const Covariance& m, const MeasuredPosition& by) {
    Gain result = m.template leftCols<2>();
    if constexpr (WithRollError<Model>) result += m.col(Model::kRollError) * by.per_roll_m.transpose();
    return result;
  }

  /// The gain's equation, (6.14), and (6.15) in Joseph's form, which stays positive definite whatever
  /// rounding does to the gain.
  Correction update(Belief<Model::kStates>& belief, const MeasuredPosition& measured) {
    Covariance& p = belief.covariance;
    Correction result;
    result.innovation_m = measured.position_m - belief.state.template head<2>();
    if constexpr (WithRollError<Model>)
      result.innovation_m -= measured.per_roll_m * belief.state(Model::kRollError);
    const auto innovation_covariance = [&](const Gain& with_position) -> Eigen::Matrix2d {
      Eigen::Matrix2d s = with_position.template topRows<2>() + measured.covariance_m2;
      if constexpr (WithRollError<Model>) s += measured.per_roll_m * with_position.row(Model::kRollError);
      return s;
    };
    Gain with_position = seen(p, measured);  // P Hᵀ
    result.innovation_covariance_m2 = innovation_covariance(with_position);
    result.nis = result.innovation_m.dot(result.innovation_covariance_m2.inverse() * result.innovation_m);
    if (result.nis > gate_.sigma * gate_.sigma) {
      if (gate_.most_rejections == 0 || ++rejections_ <= gate_.most_rejections) return result;
      // A position alone would drift off again: what led it astray (a bias, a blow) went through the
      // velocity.
      const double square_m2 = result.innovation_m.squaredNorm();
      const double astray_s = std::max(since_accepted_s_, kLongest_step_s);
      p.template topLeftCorner<2, 2>() += square_m2 * Eigen::Matrix2d::Identity();
      p.template block<2, 2>(2, 2) += square_m2 / (astray_s * astray_s) * Eigen::Matrix2d::Identity();
      with_position = seen(p, measured);
      result.innovation_covariance_m2 = innovation_covariance(with_position);
      result.nis = result.innovation_m.dot(result.innovation_covariance_m2.inverse() * result.innovation_m);
    }
    rejections_ = 0;
    since_accepted_s_ = 0;
    result.accepted = true;

    const Gain gain = with_position * result.innovation_covariance_m2.inverse();
    belief.state += gain * result.innovation_m;
    // (I − KH) P (I − KH)ᵀ + K R Kᵀ
    const Covariance left = p - gain * with_position.transpose();
    const Covariance both =
        left - seen(left, measured) * gain.transpose() + gain * measured.covariance_m2 * gain.transpose();
    p = 0.5 * (both + both.transpose());
    return result;
  }

  Model model_;
  GateSettings gate_;
  Belief<Model::kStates> now_;
  std::array<Past, kRemembered> past_;
  std::size_t first_ =
      0;  // past_ holds the steps from first_ to before next_, each at its number modulo kRemembered
  std::size_t next_ = 0;
  int rejections_ = 0;
  double since_accepted_s_ = 0;
};

}  // namespace tunnelrig
