// The zero of a run: its session's tares, interpolated in time.
#pragma once

#include "datasets/campaign.h"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

/// A run with motors stopped.
struct TareReading {
  std::string session;
  double time_s = 0;  // its middle
  std::array<double, kMaxRotors> mean_V{};
  std::array<double, kMaxRotors> standard_error_V{};
  std::string run = {};  // for messages
};

/// The zero of one moment: the sum of weight · mean_V over tares of its session.
struct TareZero {
  struct Weight {
    std::size_t tare = 0;  // index in Tares::readings()
    double weight = 1;
  };
  std::array<double, kMaxRotors> zero_V{};
  std::array<double, kMaxRotors> standard_uncertainty_V{};
  std::vector<Weight> weights;  // one or two
  bool outside = false;         // before the session's first tare or after its last
};

/// Linear in time between two tares, constant before a session's first and after its last.
///
/// What a zero does between tares is taken for a random walk whose variance grows by wander_V2_per_s per
/// second. That makes linear interpolation the right one, with the uncertainty of a Brownian bridge: at t
/// between tares at a and b, wander · (t − a)(b − t)/(b − a); outside, wander · (distance to the tare). The
/// wander is estimated from how far tares are from the interpolation between their neighbours, which takes
/// three or more in a session, pooled over sessions; without such a session it is left out, and wander_dof()
/// is 0.
class Tares {
 public:
  /// Throws InputError naming session and runs for a value that is not finite, a negative standard error, or
  /// two tares at one time.
  explicit Tares(std::vector<TareReading> readings);

  /// Nothing where the session has no tare: the calibration's zero takes its place (Certificate::force).
  std::optional<TareZero> zero_at(std::string_view session, double time_s) const;

  /// Covariance, V², of the errors of the zeros of two moments of one session, channel 0 to 3; at one moment
  /// it is standard_uncertainty_V². 0 where the session has no tare.
  double covariance(std::string_view session, double time1_s, double time2_s, int channel) const;

  const std::vector<TareReading>& readings() const { return readings_; }
  double wander_V2_per_s(int channel) const { return wander_[static_cast<std::size_t>(channel)]; }
  int wander_dof() const { return wander_dof_; }

 private:
  using Session = std::vector<std::size_t>;  // indices of its tares, in time

  const Session* find(std::string_view session) const;
  std::vector<TareZero::Weight> weights(const Session& session, double time_s) const;
  double wander_factor_s(const Session& session, double time1_s, double time2_s) const;
  void estimate_wander();

  std::vector<TareReading> readings_;
  std::map<std::string, Session, std::less<>> sessions_;
  std::array<double, kMaxRotors> wander_{};
  int wander_dof_ = 0;
};

}  // namespace tunnelrig
