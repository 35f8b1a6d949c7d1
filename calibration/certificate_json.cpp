#include "calibration/certificate.h"
#include "calibration/json_eigen.h"

namespace tunnelrig {

using nlohmann::json;

namespace {
constexpr const char* kFormat = "tunnelrig-calibration/1";
}

NLOHMANN_JSON_SERIALIZE_ENUM(RobustLoss, {{RobustLoss::kOrdinary, "ordinary"},
                                          {RobustLoss::kHuber, "huber"},
                                          {RobustLoss::kCauchy, "cauchy"},
                                          {RobustLoss::kTukey, "tukey"}})

// Non-finite numbers have no JSON; the fields below are finite for whatever the fits accept.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LackOfFit, f, dof_lack, dof_pure, p)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Linearity, curvature_V_per_N2, p, bow_N, max_deviation_N,
                                   max_deviation_percent_of_span)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Hysteresis, down_minus_up_N, standard_uncertainty_N, p, percent_of_span,
                                   largest_N)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Repeatability, std_N, dof)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ZeroReturn, change_N, percent_of_span)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Creep, largest_N, stretches, longest)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CellChecks, lack_of_fit, linearity, hysteresis, repeatability, zero_return,
                                   creep)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FitConvergence, converged, iterations, message)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CellPoint, line, force_N, voltage_V, residual_N, leverage, studentised, p,
                                   weight, suspicious, gross)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CellFit, cell, zero_V, gain_V_per_N, covariance, dof, convergence, loss,
                                   gauge_force_N, confidence, residual_std_V, reading_std_V, correlation,
                                   lowest_force_N, highest_force_N, checks, points)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PropellerFactors, tested, factor, covariance, dof, scatter_N, propellers,
                                   repeats)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CalibrationGate, cell, name, passed, finding)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CalibrationConditions, points, propeller_tests, lowest_air_temperature_C,
                                   highest_air_temperature_C)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Certificate, conditions, cells, propellers, gates, warnings, points_hash)

std::string to_json(const Certificate& certificate, int indent) {
  json document = certificate;
  document["format"] = kFormat;
  return document.dump(indent);
}

Certificate certificate_from_json(std::string_view text) {
  try {
    const json document = json::parse(text);
    if (const auto& format = document.at("format"); format != kFormat) {
      throw InputError(fmt::format("a calibration certificate of format {} stands where {} is expected",
                                   format.dump(), kFormat));
    }
    Certificate certificate;
    from_json(document, certificate);
    return certificate;
  } catch (const json::exception& error) {
    throw InputError(fmt::format("this is no calibration certificate: {}", error.what()));
  }
}

}  // namespace tunnelrig
