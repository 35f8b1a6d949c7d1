#include "datasets/error.h"
#include "flight/simulation/flight_log.h"

#include <array>
#include <iterator>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

struct Response {
  const char* name;
  const char* column;
  const char* unit;
};
constexpr std::array<Response, 5> kResponses = {{{"lift", "lift_N", "N"},
                                                 {"vertical", "vertical_N", "N"},
                                                 {"lateral", "lateral_N", "N"},
                                                 {"roll", "roll_N_m", "N·m"},
                                                 {"pitch", "pitch_N_m", "N·m"}}};

struct Covariate {
  const char* column;
  const char* unit;
  const char* meaning;
};
constexpr std::array<Covariate, 11> kCovariates = {{{"time_s", "s", ""},
                                                    {"y_norm", "1", ""},
                                                    {"z_norm", "1", ""},
                                                    {"predicted_N", "N", ""},
                                                    {"map_N", "N", ""},
                                                    {"map_roll_N_m", "N·m", ""},
                                                    {"airspeed_m_s", "m/s", "tunnel_airspeed_m_s"},
                                                    {"rotor1_N", "N", ""},
                                                    {"rotor2_N", "N", ""},
                                                    {"rotor3_N", "N", ""},
                                                    {"rotor4_N", "N", ""}}};

}  // namespace

std::string format_residuals(const FlightLog& log, const Airframe& believed) {
  std::string text =
      "time_s,block,y_norm,z_norm,lift_N,vertical_N,lateral_N,roll_N_m,pitch_N_m,predicted_N,map_N,map_roll_"
      "N_m,"
      "airspeed_m_s,rotor1_N,rotor2_N,rotor3_N,rotor4_N\n";
  const double mass = believed.mass_kg;
  const auto& inertia = believed.inertia_kg_m2;
  for (const ResidualRow& r : log.residuals) {
    const double predicted_N = mass * (r.thrust_m_s2 + r.map_thrust_m_s2);
    fmt::format_to(std::back_inserter(text),
                   "{:.4f},{},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.6f},{:.6f},{:.5f},{:.5f},{:.6f},{:.4f},{:"
                   ".5f},{:.5f},"
                   "{:.5f},{:.5f}\n",
                   r.time_s, r.block, r.y_norm, r.z_norm, predicted_N + mass * r.residual_m_s2[1],
                   mass * r.residual_m_s2[1], mass * r.residual_m_s2[0], inertia[0] * r.roll_residual_rad_s2,
                   inertia[1] * r.pitch_residual_rad_s2, predicted_N, mass * r.map_thrust_m_s2,
                   inertia[0] * r.map_roll_rad_s2, r.airspeed_m_s, r.rotor_thrust_N[0], r.rotor_thrust_N[1],
                   r.rotor_thrust_N[2], r.rotor_thrust_N[3]);
  }
  return text;
}

std::string residual_schema(std::string_view response) {
  const auto* const found = std::find_if(kResponses.begin(), kResponses.end(),
                                         [&](const Response& r) { return r.name == response; });
  if (found == kResponses.end())
    throw InputError(
        fmt::format("no residual {}; there are lift, vertical, lateral, roll and pitch", response));
  std::string text = fmt::format(
      "format = \"tunnelrig-table/1\"\nname = \"flight residual, {}\"\nblocks = \"block\"\n\n"
      "[response]\ncolumn = \"{}\"\nunit = \"{}\"\n",
      found->name, found->column, found->unit);
  for (const Covariate& covariate : kCovariates) {
    text +=
        fmt::format("\n[[covariates]]\ncolumn = \"{}\"\nunit = \"{}\"\n", covariate.column, covariate.unit);
    if (*covariate.meaning != '\0') text += fmt::format("meaning = \"{}\"\n", covariate.meaning);
  }
  return text;
}

}  // namespace tunnelrig
