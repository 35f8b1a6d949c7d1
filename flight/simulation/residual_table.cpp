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
constexpr std::array<Response, 4> kResponses = {{{"vertical", "vertical_N", "N"},
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

const Response& response_of(std::string_view name) {
  const auto* const found =
      std::find_if(kResponses.begin(), kResponses.end(), [&](const Response& r) { return r.name == name; });
  if (found == kResponses.end())
    throw InputError(fmt::format("no residual {}; there are vertical, lateral, roll and pitch", name));
  return *found;
}

}  // namespace

std::string format_residuals(std::span<const FlightLog> flights, const Airframe& believed) {
  std::string text =
      "flight,time_s,y_norm,z_norm,vertical_N,lateral_N,roll_N_m,pitch_N_m,predicted_N,map_N,map_roll_"
      "N_m,"
      "airspeed_m_s,rotor1_N,rotor2_N,rotor3_N,rotor4_N\n";
  const double mass = believed.mass_kg;
  const auto& inertia = believed.inertia_kg_m2;
  for (std::size_t flight = 0; flight < flights.size(); ++flight) {
    for (const ResidualRow& r : flights[flight].residuals) {
      fmt::format_to(std::back_inserter(text),
                     "{},{:.4f},{:.5f},{:.5f},{:.5f},{:.5f},{:.6f},{:.6f},{:.5f},{:.5f},{:.6f},{:.4f},{:.5f},"
                     "{:.5f},{:.5f},{:.5f}\n",
                     flight + 1, r.time_s, r.y_norm, r.z_norm, mass * r.residual_m_s2[1],
                     mass * r.residual_m_s2[0], inertia[0] * r.roll_residual_rad_s2,
                     inertia[1] * r.pitch_residual_rad_s2, mass * (r.thrust_m_s2 + r.map_thrust_m_s2),
                     mass * r.map_thrust_m_s2, inertia[0] * r.map_roll_rad_s2, r.airspeed_m_s,
                     r.rotor_thrust_N[0], r.rotor_thrust_N[1], r.rotor_thrust_N[2], r.rotor_thrust_N[3]);
    }
  }
  return text;
}

std::string residual_schema(std::string_view response) {
  const Response& found = response_of(response);
  std::string text = fmt::format(
      "format = \"tunnelrig-table/1\"\nname = \"flight residual, {}\"\nblocks = \"flight\"\n\n"
      "[response]\ncolumn = \"{}\"\nunit = \"{}\"\n",
      found.name, found.column, found.unit);
  for (const Covariate& covariate : kCovariates) {
    text +=
        fmt::format("\n[[covariates]]\ncolumn = \"{}\"\nunit = \"{}\"\n", covariate.column, covariate.unit);
    if (*covariate.meaning != '\0') text += fmt::format("meaning = \"{}\"\n", covariate.meaning);
  }
  return text;
}

namespace {

std::string candidate(std::string_view name, std::string_view formula, std::string_view physics,
                      std::string_view parameter, double largest, std::string_view covariates) {
  return fmt::format(
      "[[effects]]\nname = \"{}\"\nformula = \"{}\"\nphysics = \"{}\"\nadditive = true\n"
      "covariates = [{}]\nparameters = [{{ name = \"{}\", lower = {}, upper = {} }}]\n\n",
      name, formula, physics, covariates, parameter, -largest, largest);
}

}  // namespace

std::string residual_effects(std::string_view response, const Airframe& believed) {
  response_of(response);
  std::string text;
  if (response == "vertical") {
    text += candidate("payload", "F - share * predicted_N",
                      "more mass than believed: the same thrust accelerates it less; share of the whole mass",
                      "share", 0.5, "\"predicted_N\"");
    text += candidate("field_scale", "F + excess * map_N", "the walls do more than the map says", "excess", 3,
                      "\"map_N\"");
    text += candidate("gust_along", "F + gain * predicted_N * tunnel_airspeed_m_s * tunnel_airspeed_m_s",
                      "edgewise flow adds thrust to second order (Glauert)", "gain", 0.05,
                      "\"predicted_N\", \"tunnel_airspeed_m_s\"");
    for (std::size_t i = 0; i < kRotors; ++i)
      text += candidate(fmt::format("weak_rotor_{}", i + 1), fmt::format("F - loss * rotor{}_N", i + 1),
                        "a rotor that lost so much of its thrust", "loss", 0.1,
                        fmt::format("\"rotor{}_N\"", i + 1));
  } else if (response == "roll") {
    text += candidate("field_scale", "F + excess * map_roll_N_m", "the walls do more than the map says",
                      "excess", 3, "\"map_roll_N_m\"");
  } else if (response == "pitch") {
    // The lever is the same for all rotors in size; in pitch, unlike in roll, it tells 1 from 4.
    for (std::size_t i = 0; i < kRotors; ++i)
      text += candidate(fmt::format("weak_rotor_{}", i + 1),
                        fmt::format("F {} loss * {:.5f} * rotor{}_N", kRotorX[i] > 0 ? '+' : '-',
                                    believed.rotor_offset_m(), i + 1),
                        "a rotor that lost so much of its thrust", "loss", 0.1,
                        fmt::format("\"rotor{}_N\"", i + 1));
  } else {
    text +=
        candidate("tilted_attitude", "F + angle * predicted_N",
                  "the attitude is off by an angle, which turns the thrust", "angle", 0.2, "\"predicted_N\"");
  }
  return text;
}

}  // namespace tunnelrig
