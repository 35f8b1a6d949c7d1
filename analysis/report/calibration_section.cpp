#include "analysis/report/sections.h"

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

const char* state_of(const CellPoint& point) {
  if (point.weight == 0) return "left out";
  if (point.suspicious) return "suspicious";
  return "used";
}

Json cell_json(const CellFit& cell) {
  Json json{{"cell", cell.cell},
            {"zero_V", cell.zero_V},
            {"zero_u95_V", cell.zero_u95_V()},
            {"gain_V_per_N", cell.gain_V_per_N},
            {"gain_u95_V_per_N", cell.gain_u95_V_per_N()},
            {"correlation", cell.correlation},
            {"residual_std_N", cell.residual_std_N()},
            {"points_used", cell.points_used()}};
  for (const CellPoint& point : cell.points) {
    json["force_N"].push_back(point.force_N);
    json["residual_N"].push_back(point.residual_N);
    json["line"].push_back(point.line);
    json["state"].push_back(state_of(point));
  }
  return json;
}

Json propellers_json(const PropellerFactors& propellers) {
  Json json = Json::array();
  for (Eigen::Index rotor = 0; propellers.tested && rotor < propellers.factor.size(); ++rotor) {
    json.push_back({{"rotor", rotor + 1},
                    {"propeller", propellers.propellers[static_cast<std::size_t>(rotor)]},
                    {"tests", propellers.repeats[static_cast<std::size_t>(rotor)]},
                    {"factor", propellers.factor(rotor)},
                    {"standard_uncertainty", propellers.uncertainty_known()
                                                 ? maybe(std::sqrt(propellers.covariance(rotor, rotor)))
                                                 : Json(nullptr)}});
  }
  return json;
}

}  // namespace

Json calibration_section(const Material& material) {
  if (!material.data.certificate) {
    return absent(material.data.raw.empty()
                      ? "The runs give thrusts, not voltages, so there are no load cells to calibrate."
                      : "There is no calibration yet: `tunnelrig calibrate` makes the certificate.");
  }
  const Certificate& certificate = *material.data.certificate;
  Json json{{"id", material.data.certificate_id},
            {"passed", certificate.passed()},
            {"points_hash", certificate.points_hash},
            {"warnings", certificate.warnings},
            {"propellers", propellers_json(certificate.propellers)}};
  for (const CellFit& cell : certificate.cells) json["cells"].push_back(cell_json(cell));
  json["gates"] = Json::array();
  for (const CalibrationGate& gate : certificate.gates) {
    json["gates"].push_back(
        {{"cell", gate.cell}, {"name", gate.name}, {"passed", gate.passed}, {"finding", gate.finding}});
  }
  return json;
}

}  // namespace tunnelrig::report
