#include "analysis/residual/explanation/explanation_output.h"

#include <cmath>

#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Json = nlohmann::ordered_json;

Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(0.0); }

Json rotor_json(int rotor) { return rotor < 0 ? Json(nullptr) : Json(rotor + 1); }

Json error_json(const ErrorEstimate& error) {
  return {{"rmse", finite(error.rmse)},
          {"held_out_rmse", finite(error.held_out_rmse)},
          {"held_out_ci95", {finite(error.held_out_low), finite(error.held_out_high)}}};
}

Json adopted_json(const AdoptedEffect& adopted) {
  Json parameters = Json::object();
  for (const ParameterEstimate& parameter : adopted.parameters) {
    parameters[parameter.name] = {{"value", finite(parameter.value)},
                                  {"ci95", {finite(parameter.low), finite(parameter.high)}},
                                  {"unit", parameter.unit},
                                  {"theory", parameter.theory}};
    if (!parameter.run.empty()) parameters[parameter.name]["run"] = parameter.run;
    for (const GroupEstimate& group : parameter.groups)
      parameters[parameter.name]["groups"].push_back({{"group", group.group},
                                                      {"value", finite(group.value)},
                                                      {"ci95", {finite(group.low), finite(group.high)}}});
  }
  Json separating = nullptr;
  if (const auto& run = adopted.separating_run) {
    separating = {{"setting", Json::object()},
                  {"location", run->location},
                  {"expected_sigma", finite(run->expected_sigma)},
                  {"text", run->text}};
    for (const auto& [name, value] : run->setting) separating["setting"][name] = value;
  }
  Json json{{"effect", adopted.term.effect->name},        {"form", adopted.term.effect->form},
            {"rotor", rotor_json(adopted.term.rotor)},    {"parameters", parameters},
            {"p_value", finite(adopted.p_value)},         {"held_out_gain", finite(adopted.held_out_gain)},
            {"confounded_with", adopted.confounded_with}, {"separating_run", separating}};
  if (adopted.term.other >= 0) json["from_rotor"] = adopted.term.other + 1;
  return json;
}

Json unknown_json(const UnknownStructure& unknown) {
  Json shape = Json::array();
  for (const ShapePoint& point : unknown.shape)
    shape.push_back({finite(point.x), finite(point.y), finite(point.low), finite(point.high)});
  Json could_be = Json::array();
  for (const auto& [term, on_all_blocks] : unknown.could_be)
    could_be.push_back({{"effect", term.effect->name},
                        {"rotor", rotor_json(term.rotor)},
                        {"at_theory", term.at_theory},
                        {"on_all_blocks", on_all_blocks}});
  return {{"covariate", unknown.covariate},
          {"covariate_unit", unknown.covariate_unit},
          {"place", unknown.place.empty() ? Json(nullptr) : Json(unknown.place)},
          {"times", unknown.times.empty() ? Json(nullptr) : Json(unknown.times)},
          {"rotor", rotor_json(unknown.rotor)},
          {"p_value", finite(unknown.p_value)},
          {"amplitude", finite(unknown.amplitude)},
          {"beside_baseline", finite(unknown.beside_baseline)},
          {"shape", shape},
          {"labels", unknown.labels},
          {"instead_of", unknown.instead_of},
          {"collinear_with", unknown.collinear_with},
          {"by_sealed_too", unknown.by_sealed_too},
          {"could_be", could_be}};
}

}  // namespace

std::string explanation_json(const Explanation& e) {
  Json json{{"format", "tunnelrig-explain/1"},
            {"campaign", e.campaign},
            {"response", e.response},
            {"unit", e.unit},
            {"baseline", e.baseline},
            {"verdict", e.verdict},
            {"relative_to", finite(e.relative_to)},
            {"noise_floor", finite(e.noise_floor)},
            {"seal_chose", e.seal_chose},
            {"blocks", e.blocks},
            {"runs", e.runs},
            {"model_in_force", e.model_in_force},
            {"before", error_json(e.before)},
            {"after", error_json(e.after)},
            {"adopted", Json::array()},
            {"unknown", Json::array()},
            {"untestable", Json::array()},
            {"suspect_rows", Json::array()},
            {"detectable_at_80_percent_power", finite(e.detectable)},
            {"detectable_by_effect", e.detectable_by_effect},
            {"empirical", e.empirical},
            {"warnings", e.warnings}};
  for (const AdoptedEffect& adopted : e.adopted) json["adopted"].push_back(adopted_json(adopted));
  for (const UnknownStructure& unknown : e.unknown) json["unknown"].push_back(unknown_json(unknown));
  for (const Untestable& entry : e.untestable)
    json["untestable"].push_back(
        {{"effect", entry.effect}, {"missing", entry.missing}, {"reason", entry.reason}});
  for (const SuspectRow& row : e.suspect_rows)
    json["suspect_rows"].push_back(
        {{"row", row.row}, {"studentised", finite(row.studentised)}, {"set_aside", row.set_aside}});
  return json.dump(1);
}

}  // namespace tunnelrig
