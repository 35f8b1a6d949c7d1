#include "datasets/error.h"
#include "flight/localisation/scan_matcher.h"

#include <numbers>

namespace tunnelrig {
namespace {

void check_setting(std::string_view name, double value, double lowest, double highest) {
  if (!(value >= lowest && value <= highest))
    throw InputError::in("scan matcher", "{} is {}: it lies between {} and {}", name, value, lowest, highest);
}

}  // namespace

void MatcherSettings::validate() const {
  const MatcherSettings& s = *this;
  check_setting("layout.beams", static_cast<double>(s.layout.beams), 3, 20000);
  check_setting("layout.step_rad", s.layout.step_rad, 1e-4, 0.2);
  check_setting("layout.first_rad", s.layout.first_rad, -10, 10);
  check_setting("layout.beams × step_rad", static_cast<double>(s.layout.beams - 1) * s.layout.step_rad, 0,
                2 * std::numbers::pi);
  check_setting("cell_m", s.cell_m, 1e-4, 1);
  check_setting("smoothing_m", s.smoothing_m, 0, 100 * s.cell_m);
  check_setting("directions", static_cast<double>(s.directions), 2, 360);
  if (s.form == HoughForm::circle) check_setting("circle_diameter_m", s.circle_diameter_m, 0.1, 100);
  check_setting("rotation_search_rad", s.rotation_search_rad, 0, 0.8);
  check_setting("rotation_step_rad", s.rotation_step_rad, 1e-3, 1);
  check_setting("least_range_m", s.least_range_m, 0, 1e4);
  check_setting("most_range_m", s.most_range_m, s.least_range_m, 1e4);
  check_setting("first_gate_m", s.first_gate_m, 1e-3, 10);
  check_setting("gate_sigma", s.gate_sigma, 1, 100);
  check_setting("most_slope", s.most_slope, 1, 1e6);
  check_setting("least_sigma_m", s.least_sigma_m, 1e-6, 1);
  check_setting("prior_gate_m", s.prior_gate_m, 0, 1e4);
  check_setting("vantage_spread", s.vantage_spread, 0, 0.95);
  check_setting("least_beams", static_cast<double>(s.least_beams), 3, 20000);
  check_setting("least_inliers", s.least_inliers, 0, 1);
  check_setting("most_beyond", s.most_beyond, 0, 1);
  check_setting("most_sigma_m", s.most_sigma_m, 1e-6, 1e3);
  check_setting("most_residual_m", s.most_residual_m, 1e-6, 1e3);
  check_setting("least_facing", s.least_facing, 0, 1);
  check_setting("most_misfit_m", s.most_misfit_m, 1e-6, 1e3);
  check_setting("ambiguity", s.ambiguity, 0, 1);
}

std::string_view text(Rejection reason) {
  switch (reason) {
    case Rejection::none:
      return "accepted";
    case Rejection::few_beams:
      return "too few beams with a return";
    case Rejection::poor_fit:
      return "the scan does not fit the section";
    case Rejection::noisy:
      return "the residuals are too large";
    case Rejection::unobservable:
      return "the scan does not fix the position";
    case Rejection::ambiguous:
      return "the scan fits in several places";
    case Rejection::outside:
      return "the match lies outside the section";
  }
  return "unknown";
}

}  // namespace tunnelrig
