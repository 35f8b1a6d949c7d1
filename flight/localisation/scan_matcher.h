// Hough scan matcher: where in the cross-section a scan was taken.
#pragma once

#include "flight/lidar/scan.h"
#include "flight/tunnel/cross_section.h"

#include <memory>
#include <optional>
#include <string_view>

#include <Eigen/Core>

namespace tunnelrig {

/// Where the arg max of the Hough domain is taken.
enum class HoughForm {
  two_columns,  // the thesis's: β = 0° and 90°, for sections with upright and level walls (6.8)–(6.10)
  all_directions,  // columns over 180°, the shift by least squares over them (6.7): arches, slanted walls
  circle           // known radius, unknown centre (Yuen et al. 1990)
};

/// What the match finds beside the position.
enum class Unknowns { position, rotation, rotation_and_heading };

struct MatcherSettings {
  BeamLayout layout;
  HoughForm form = HoughForm::two_columns;
  Unknowns unknowns = Unknowns::position;

  double cell_m = 0.005;         // Δρ; the thesis's is 0.010
  double smoothing_m = 0.040;    // half width of the triangle that the columns are smoothed with
  std::size_t directions = 12;   // HoughForm::all_directions only
  double circle_diameter_m = 0;  // HoughForm::circle only
  double rotation_search_rad = 0.18;
  double rotation_step_rad = 0.035;

  double least_range_m = 0.06;  // UST-10LX
  double most_range_m = 30;
  double first_gate_m = 0.20;    // beams further from the wall they should meet do not count at first,
  double gate_sigma = 4;         // then beyond so many standard deviations of those that did
  double most_slope = 12;        // 1 / cos(incidence): beams that graze a wall more say little of where it is
  double least_sigma_m = 0.003;  // of a range, whatever the scan's own residuals say
  double prior_gate_m = 0.25;    // arg max at least so far around a prior, where one is given
  double vantage_spread = 0.6;   // part of the section that the reference is seen from; 0: its origin alone

  // What is rejected.
  std::size_t least_beams = 60;
  /// Of the beams with a return. Two walls of a wider tunnel, seen from their corner, can take up to
  /// 0.76 of a scan, and near the ceiling more (docs/localisation.md).
  double least_inliers = 0.78;
  double most_beyond = 0.1;  // of them: a beam cannot see through a wall, if it is the right tunnel
  /// Of all beams: so many must face the direction in which the position is known worst. A few beams beside a
  /// corner fit wherever that corner is put.
  double least_facing = 0.08;
  double most_sigma_m = 0.05;     // of the position along its worst axis
  double most_residual_m = 0.08;  // RMS of the beams that fit
  /// Noise differs from beam to beam, a wrong shape is wrong over many: RMS of what the distances from the
  /// walls that face one axis share with those of neighbouring beams, where it is more than noise alone may
  /// show.
  double most_misfit_m = 0.012;
  double ambiguity = 0.8;  // another place that fits with this share of the inliers

  /// Throws InputError for settings that make no sense, naming the value and the rule.
  void validate() const;
};

enum class Rejection { none, few_beams, poor_fit, noisy, unobservable, ambiguous, outside };

/// "too few beams" …, for logs and messages.
std::string_view text(Rejection reason);

/// How the LIDAR moves while it sweeps, in the middle of the sweep.
struct SweepMotion {
  double sweep_s = 0;                  // from the first beam to the last
  Eigen::Vector2d velocity_m_s{0, 0};  // in the cross-section
  double roll_rate_rad_s = 0;
  double roll_acceleration_rad_s2 = 0;
};

/// Where the LIDAR is believed to be, and how well that is known.
struct SearchPrior {
  Eigen::Vector2d position_m;
  Eigen::Vector2d sigma_m;

  SearchPrior(const Eigen::Vector2d& position, const Eigen::Vector2d& sigma = Eigen::Vector2d::Zero())
      : position_m(position), sigma_m(sigma) {}
};

struct Match {
  Eigen::Vector2d position_m{0, 0};  // (y, z) of the LIDAR in the cross-section
  double rotation_rad = 0;  // what is to be added to the attitude's roll; 0 where it is taken as known
  double heading_rad = 0;  // |yaw| that the scan shows (its sign leaves no trace); the attitude's where known
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();  // of the position
  double heading_sigma_rad = 0;                             // 0 where known
  double quality = 0;     // share of the beams with a return that fit, 0 … 1
  double residual_m = 0;  // RMS of those
  bool accepted = false;  // a position that is not accepted must not be used
  Rejection reason = Rejection::none;
};

/// Matches scans with one cross-section. Not safe to share among threads: it keeps its working memory.
class ScanMatcher {
 public:
  /// Throws InputError for settings that make no sense, naming the value and the rule.
  ScanMatcher(const CrossSection& section, const MatcherSettings& settings = {});
  ~ScanMatcher();
  ScanMatcher(ScanMatcher&&) noexcept;
  ScanMatcher& operator=(ScanMatcher&&) noexcept;

  /// The attitude is the IMU's in the middle of the sweep, and the position is that of the same moment. A
  /// prior narrows the search, to four of its standard deviations or prior_gate_m, and is not otherwise used;
  /// with a motion every beam counts from where it was measured. Throws InputError for an empty scan, one
  /// with another number of beams, NaN, an attitude or motion that is not finite, or an attitude that turns
  /// the scan plane edge-on (over 75°); everything else that is wrong with a scan is a rejection.
  Match match(const Scan& scan, const Attitude& attitude,
              const std::optional<SearchPrior>& prior = std::nullopt, const SweepMotion& motion = {});

  /// Whether a scan at this attitude can be matched at all: its plane is within 75° of the cross-section.
  static bool can_match(const Attitude& attitude);

  /// By how much the position of the last match moves for each radian that the attitude's roll was too large,
  /// m. The scan turns about the LIDAR, so that a match far from the middle of the walls in sight moves more.
  /// Zero where nothing matched.
  Eigen::Vector2d moved_per_roll_m() const;

  const MatcherSettings& settings() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace tunnelrig
