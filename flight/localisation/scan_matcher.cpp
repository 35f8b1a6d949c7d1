#include "flight/localisation/scan_matcher.h"

#include "datasets/error.h"
#include "flight/localisation/start_search.h"
#include "flight/localisation/swept_beams.h"
#include "flight/localisation/visible_walls.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace tunnelrig {
namespace {

constexpr double kMost_tilt_cosine = 0.2588190451025207;  // 75°
constexpr int kMost_steps = 8;
constexpr double kConverged_m = 2e-4;
constexpr double kSame_place_m = 0.1;
constexpr double kChance_sigma = 3;  // of what neighbours share by chance
constexpr double kPrior_sigma = 4;

Projection narrowed(const Eigen::Matrix2d& m) {
  return {static_cast<float>(m(0, 0)), static_cast<float>(m(0, 1)), static_cast<float>(m(1, 0)),
          static_cast<float>(m(1, 1))};
}

Eigen::Matrix2d turn(double angle_rad) {
  return (Eigen::Matrix2d() << std::cos(angle_rad), -std::sin(angle_rad), std::sin(angle_rad),
          std::cos(angle_rad))
      .finished();
}

/// Of a symmetric matrix: the larger eigenvalue.
double largest(const Eigen::Matrix2d& m) {
  return 0.5 * m.trace() + std::hypot(0.5 * (m(0, 0) - m(1, 1)), m(0, 1));
}

/// Where a match stands: position, rotation in the scan plane, and the logarithm of the stretch of y.
struct Pose {
  SectionPoint position{0, 0};
  double rotation_rad = 0;
  double stretch = 0;
};

struct Fit {
  Pose pose;
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  double inliers = 0;  // beams
  double beyond = 0;
  double residual_m = 0;
  double misfit_m = 0;  // along the axis where it is more
  double facing = 0;    // beams, along the axis where it is fewer
  bool solved = false;
};

using Search = std::variant<TwoColumnSearch, AllDirectionSearch, CircleSearch>;

Search search_for(const CrossSection& section, const MatcherSettings& settings) {
  const std::vector<SectionPoint> points = reference_points(section, settings);
  if (settings.form == HoughForm::two_columns) return TwoColumnSearch(section, points, settings);
  if (settings.form == HoughForm::all_directions) return AllDirectionSearch(section, points, settings);
  return CircleSearch(section, points, settings);
}

}  // namespace

struct ScanMatcher::Work {
  MatcherSettings settings;
  CrossSection section;
  Search search;
  VisibleWalls walls;
  const BeamKernels& kernels = beam_kernels();
  SweptBeams swept;
  const Beams& beams = swept.beams();
  Eigen::Matrix2d attitude = Eigen::Matrix2d::Identity();  // the projection that the IMU gives
  int returned = 0;                                        // beams with a return
  std::vector<float> sizes_m;                              // of residuals, where their median is needed
  // Of the last match, for moved_per_roll_m
  Eigen::Matrix2d matched_projection = Eigen::Matrix2d::Identity();
  SectionPoint matched{0, 0};
  double matched_gate_m = 0;  // 0: nothing matched

  Work(const CrossSection& the_section, const MatcherSettings& the_settings)
      : settings(the_settings),
        section(the_section),
        search(search_for(section, settings)),
        walls(section, settings.layout),
        swept(settings.layout) {}

  int unknowns() const {
    if (settings.unknowns == Unknowns::position) return 2;
    return settings.unknowns == Unknowns::rotation ? 3 : 4;
  }

  Eigen::Matrix2d projection(const Pose& pose) const {
    if (pose.rotation_rad == 0 && pose.stretch == 0) return attitude;
    Eigen::Matrix2d result = attitude * turn(pose.rotation_rad);
    result.row(0) *= std::exp(pose.stretch);
    return result;
  }

  void project(const Pose& pose) { kernels.project(beams, narrowed(projection(pose))); }

  SectionBox box(const std::optional<SearchPrior>& prior) const {
    const SectionBox& all = section.box();
    if (!prior) return all;
    const Eigen::Vector2d gate = (kPrior_sigma * prior->sigma_m).cwiseMax(settings.prior_gate_m);
    return {all.lowest.cwiseMax(prior->position_m - gate), all.highest.cwiseMin(prior->position_m + gate)};
  }

  Found find(const SectionBox& where, double rotation_rad) {
    project({{0, 0}, rotation_rad, 0});
    return std::visit(
        [&](auto& form) {
          form.take(kernels, beams);
          return form.find(kernels, where);
        },
        search);
  }

  /// The rotation whose Hough columns have the sharpest peaks.
  double best_rotation(const SectionBox& where) {
    double best = 0;
    float most = -1;
    const auto steps = static_cast<int>(std::ceil(settings.rotation_search_rad / settings.rotation_step_rad));
    for (int i = -steps; i <= steps; ++i) {
      const double rotation = settings.rotation_search_rad * i / std::max(steps, 1);
      const float score = find(where, rotation).best.score;
      if (score <= most) continue;
      most = score;
      best = rotation;
    }
    return best;
  }

  /// Residuals of walls alone have a mean size of 0.80 of their RMS. Something else among them (an obstacle
  /// not far before its wall) lowers that, and would raise a gate made from the RMS until it is let in.
  static bool heavy_tailed(const FitSums& sums) {
    constexpr float kGaussian = 0.797885F;
    constexpr float kLeast_share = 0.95F;
    return sums.absolute < kLeast_share * kGaussian * std::sqrt(sums.square * sums.inliers);
  }

  /// A gate from the median of the residuals within a wider one, which up to half of them may spoil.
  double tight_gate_m(double gate_m) {
    sizes_m.clear();
    for (std::size_t i = 0; i < beams.count; ++i) {
      if (!(beams.range[i] > 0 && beams.inverse[i] > 0)) continue;
      const float size_m = std::abs(beams.range[i] - 1 / beams.inverse[i]);
      if (size_m < static_cast<float>(gate_m)) sizes_m.push_back(size_m);
    }
    const auto middle = sizes_m.begin() + static_cast<std::ptrdiff_t>(sizes_m.size() / 2);
    std::nth_element(sizes_m.begin(), middle, sizes_m.end());
    constexpr double kSigma_of_median = 1.4826;
    constexpr double kTight = 3;
    return std::min(
        gate_m, kTight * std::max(kSigma_of_median * static_cast<double>(*middle), settings.least_sigma_m));
  }

  /// One Gauss–Newton step on the ranges of the beams within the gate; its length in m.
  double step(Fit& fit, double& gate_m, bool turned) {
    const Eigen::Matrix2d now = projection(fit.pose);
    if (turned) kernels.project(beams, narrowed(now));
    walls.look(kernels, beams, now, fit.pose.position, swept.bent_beams());
    FitSums sums;
    const int size = unknowns();
    kernels.fit(beams, narrowed(now), static_cast<float>(gate_m), static_cast<float>(settings.most_slope),
                size, sums);
    if (heavy_tailed(sums)) {
      gate_m = tight_gate_m(gate_m);
      kernels.fit(beams, narrowed(now), static_cast<float>(gate_m), static_cast<float>(settings.most_slope),
                  size, sums);
    }
    fit.inliers = sums.inliers;
    fit.beyond = sums.beyond;
    fit.solved = false;
    if (fit.inliers <= size) return 0;

    Eigen::Matrix4d normal = Eigen::Matrix4d::Identity();
    Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
    for (int a = 0; a < size; ++a) {
      gradient(a) = sums.gradient[a];
      for (int b = 0; b <= a; ++b) normal(a, b) = normal(b, a) = sums.normal[a][b];
    }
    const double variance = std::max(static_cast<double>(sums.square) / (fit.inliers - size),
                                     settings.least_sigma_m * settings.least_sigma_m);
    fit.residual_m = std::sqrt(static_cast<double>(sums.square) / fit.inliers);
    Eigen::Vector4d change = Eigen::Vector4d::Zero();
    if (size == 2) {
      const Eigen::Matrix2d block = normal.topLeftCorner<2, 2>();
      if (!(block.determinant() > 1e-9 * block.trace() * block.trace())) return 0;
      const Eigen::Matrix2d inverse = block.inverse();
      fit.covariance.topLeftCorner<2, 2>() = variance * inverse;
      change.head<2>() = inverse * gradient.head<2>();
    } else {
      const Eigen::LDLT<Eigen::Matrix4d> factor(normal);
      if (!(factor.vectorD().minCoeff() > 1e-9 * factor.vectorD().maxCoeff())) return 0;
      const Eigen::Matrix4d inverse = factor.solve(Eigen::Matrix4d::Identity());
      fit.covariance.setZero();
      fit.covariance.topLeftCorner(size, size) = variance * inverse.topLeftCorner(size, size);
      change = inverse * gradient;
    }
    fit.solved = true;
    fit.pose.position += change.head<2>();
    if (size >= 3) fit.pose.rotation_rad += change(2);
    if (size >= 4) fit.pose.stretch += change(3);
    return change.norm();
  }

  /// Sub-cell position from the beams that fit the walls they should meet: each beam counts by how sharply it
  /// tells the wall's place, which is what the Cramér–Rao bound counts too.
  Fit refine(const Pose& start) {
    Fit fit{.pose = start};
    double gate = settings.first_gate_m;
    for (int i = 0; i < kMost_steps; ++i) {
      const double moved = step(fit, gate, settings.unknowns != Unknowns::position);
      if (!fit.solved || !section.contains(fit.pose.position)) break;
      const double tight = settings.gate_sigma * std::max(fit.residual_m, settings.least_sigma_m);
      const bool same_gate = tight > 0.8 * gate;
      gate = std::min(gate, tight);
      if (moved < kConverged_m || (moved < 5 * kConverged_m && same_gate && i > 0)) break;
    }
    if (fit.solved) weigh(fit, gate);
    return fit;
  }

  /// What the section is wrong by does not average out over beams as noise does: it is added to the
  /// covariance.
  void weigh(Fit& fit, double gate_m) const {
    Evidence e;
    kernels.weigh(beams, static_cast<float>(gate_m), static_cast<float>(settings.most_slope), e);
    constexpr double kPairs = Evidence::kNeighbours;
    const auto misfit_m2 = [](double shared, double square, double facing) {
      if (facing < 1) return 0.0;
      const double by_chance = kChance_sigma * square / std::sqrt(kPairs * facing);
      return std::max((shared / kPairs - by_chance) / facing, 0.0);
    };
    const double misfit = std::max(misfit_m2(e.shared_y, e.square_y, e.facing_yy),
                                   misfit_m2(e.shared_z, e.square_z, e.facing_zz));
    fit.misfit_m = std::sqrt(misfit);
    fit.covariance.topLeftCorner<2, 2>() += misfit * Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d facing =
        (Eigen::Matrix2d() << e.facing_yy, e.facing_yz, e.facing_yz, e.facing_zz).finished();
    fit.facing = facing.trace() - largest(facing);
  }

  Rejection judge(const Fit& fit) const {
    if (!section.contains(fit.pose.position)) return Rejection::outside;
    if (fit.inliers < settings.least_inliers * returned || fit.beyond > settings.most_beyond * returned)
      return Rejection::poor_fit;
    if (!fit.solved) return Rejection::unobservable;
    if (fit.residual_m > settings.most_residual_m) return Rejection::noisy;
    if (fit.misfit_m > settings.most_misfit_m) return Rejection::poor_fit;
    if (fit.facing < settings.least_facing * static_cast<double>(beams.count) ||
        largest(fit.covariance.topLeftCorner<2, 2>()) > settings.most_sigma_m * settings.most_sigma_m)
      return Rejection::unobservable;
    return Rejection::none;
  }

  /// Of y, that a match may begin with: yaws of 0, 18°, 30° and 42° more than the IMU's
  std::vector<double> stretches() const {
    if (settings.unknowns != Unknowns::rotation_and_heading) return {0};
    return {0, -0.05, -0.14, -0.30};
  }

  /// All maxima of the Hough domain, where the highest is not plainly the right one.
  Rejection choose(const SectionBox& where, double rotation_rad, Fit& fit) {
    std::vector<Fit> good;
    for (const double stretch : stretches()) {
      const Pose view{{0, 0}, rotation_rad, stretch};
      project(view);
      const std::vector<Start> starts = std::visit(
          [&](auto& form) {
            form.take(kernels, beams);
            return form.candidates(kernels, where);
          },
          search);
      for (const Start& start : starts) {
        project(view);
        const Fit other = refine({start.position, rotation_rad, stretch});
        if (judge(other) == Rejection::none) good.push_back(other);
      }
    }
    if (good.empty()) return judge(fit);
    fit = *std::max_element(good.begin(), good.end(),
                            [](const Fit& a, const Fit& b) { return a.inliers < b.inliers; });
    for (const Fit& other : good)
      if ((other.pose.position - fit.pose.position).norm() > kSame_place_m &&
          other.inliers >= settings.ambiguity * fit.inliers)
        return Rejection::ambiguous;
    return Rejection::none;
  }

  void take(const Scan& scan, const Attitude& imu, const SweepMotion& motion) {
    if (!std::isfinite(imu.roll_rad) || !std::isfinite(imu.pitch_rad) || !std::isfinite(imu.yaw_rad))
      throw InputError::in("scan", "its attitude is not finite");
    if (!motion.velocity_m_s.allFinite() || !std::isfinite(motion.roll_rate_rad_s) ||
        !std::isfinite(motion.roll_acceleration_rad_s2) || !std::isfinite(motion.sweep_s))
      throw InputError::in("scan", "the motion during its sweep is not finite");
    attitude = section_projection(imu);
    if (!can_match(imu))
      throw InputError::in("scan",
                           "pitch {} and yaw {} rad turn the scan plane over 75° from the cross-section",
                           imu.pitch_rad, imu.yaw_rad);
    returned = swept.load(kernels, scan, settings.least_range_m, settings.most_range_m);
    swept.straighten(motion, attitude.inverse() * motion.velocity_m_s, settings.least_range_m,
                     settings.most_range_m);
  }

  void remember(const Fit& fit) {
    matched_projection = projection(fit.pose);
    matched = fit.pose.position;
    matched_gate_m = fit.solved ? settings.gate_sigma * std::max(fit.residual_m, settings.least_sigma_m) : 0;
  }

  /// Least squares for the position at a roll that is too large by a little: −(JₚᵀJₚ)⁻¹ Jₚᵀ Jᵣ, r the
  /// rotation.
  Eigen::Vector2d moved_per_roll_m() {
    if (matched_gate_m == 0) return {0, 0};
    walls.look(kernels, beams, matched_projection, matched, swept.bent_beams());
    FitSums sums;
    kernels.fit(beams, narrowed(matched_projection), static_cast<float>(matched_gate_m),
                static_cast<float>(settings.most_slope), 3, sums);
    Eigen::Matrix2d normal;
    normal << sums.normal[0][0], sums.normal[1][0], sums.normal[1][0], sums.normal[1][1];
    if (!(normal.determinant() > 0)) return {0, 0};
    return -(normal.inverse() * Eigen::Vector2d(sums.normal[2][0], sums.normal[2][1]));
  }

  Match result(const Fit& fit, const Attitude& imu) const {
    Match match;
    match.position_m = fit.pose.position;
    match.rotation_rad = fit.pose.rotation_rad;
    match.covariance_m2 = fit.covariance.topLeftCorner<2, 2>();
    match.heading_rad = imu.yaw_rad;
    if (settings.unknowns == Unknowns::rotation_and_heading) {
      // Yaw makes the section appear wider by 1 / cos(yaw); its own error there is that of the cosine
      match.heading_rad = std::acos(std::clamp(std::cos(imu.yaw_rad) * std::exp(fit.pose.stretch), 0.0, 1.0));
      const double sigma = std::sqrt(fit.covariance(3, 3));
      match.heading_sigma_rad = sigma / std::max(std::tan(match.heading_rad), std::sqrt(2 * sigma));
    }
    match.quality = returned > 0 ? fit.inliers / returned : 0;
    match.residual_m = fit.residual_m;
    return match;
  }
};

ScanMatcher::ScanMatcher(const CrossSection& section, const MatcherSettings& settings) {
  settings.validate();
  work_ = std::make_unique<Work>(section, settings);
}

ScanMatcher::~ScanMatcher() = default;
ScanMatcher::ScanMatcher(ScanMatcher&&) noexcept = default;
ScanMatcher& ScanMatcher::operator=(ScanMatcher&&) noexcept = default;

bool ScanMatcher::can_match(const Attitude& attitude) {
  return section_projection(attitude).determinant() >= kMost_tilt_cosine;
}

Eigen::Vector2d ScanMatcher::moved_per_roll_m() const { return work_->moved_per_roll_m(); }

const MatcherSettings& ScanMatcher::settings() const { return work_->settings; }

Match ScanMatcher::match(const Scan& scan, const Attitude& attitude, const std::optional<SearchPrior>& prior,
                         const SweepMotion& motion) {
  Work& work = *work_;
  work.take(scan, attitude, motion);
  if (prior && !(prior->position_m.allFinite() && prior->sigma_m.allFinite()))
    throw InputError::in("scan", "its prior is not finite");
  Fit fit;
  Rejection reason = Rejection::few_beams;
  if (work.returned >= static_cast<int>(work.settings.least_beams)) {
    const SectionBox where = work.box(prior);
    const double rotation = work.settings.unknowns == Unknowns::position ? 0 : work.best_rotation(where);
    const Found found = work.find(where, rotation);
    fit = work.refine({found.best.position, rotation, 0});
    reason = work.judge(fit);
    if (reason != Rejection::none || found.rivalry > work.settings.ambiguity)
      reason = work.choose(where, rotation, fit);
  }
  work.remember(fit);
  Match match = work.result(fit, attitude);
  match.reason = reason;
  match.accepted = reason == Rejection::none;
  return match;
}

}  // namespace tunnelrig
