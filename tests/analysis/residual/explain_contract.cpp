#include "analysis/residual/explain_contract.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::test {

using nlohmann::json;

namespace {

/// JSON has no NaN: one is written as null, which only what need not be there may be.
void expect_no_unknown_null(const json& value, const std::string& path) {
  constexpr std::array<std::string_view, 5> kMayBeNull = {"rotor", "from_rotor", "separating_run", "place",
                                                          "times"};
  for (const auto& [key, inner] : value.items()) {
    const std::string place = fmt::format("{}/{}", path, key);
    EXPECT_TRUE(!inner.is_null() || std::ranges::count(kMayBeNull, key) > 0) << place;
    if (inner.is_structured()) expect_no_unknown_null(inner, place);
  }
}

/// What is written is 0 where a number is not finite: the numbers themselves are looked at.
void expect_finite(const Explanation& e) {
  const auto is_finite = [](std::initializer_list<double> numbers) {
    return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
  };
  EXPECT_TRUE(is_finite({e.noise_floor, e.detectable}));
  for (const ErrorEstimate& error : {e.before, e.after})
    EXPECT_TRUE(is_finite({error.rmse, error.held_out_rmse, error.held_out_low, error.held_out_high}));
  for (const auto& [name, size] : e.detectable_by_effect) EXPECT_TRUE(std::isfinite(size)) << name;
  for (const AdoptedEffect& adopted : e.adopted) {
    EXPECT_TRUE(is_finite({adopted.p_value, adopted.held_out_gain})) << adopted.term.label();
    for (const ParameterEstimate& parameter : adopted.parameters)
      EXPECT_TRUE(is_finite({parameter.value, parameter.low, parameter.high})) << parameter.name;
  }
  for (const UnknownStructure& unknown : e.unknown) {
    EXPECT_TRUE(is_finite({unknown.p_value, unknown.amplitude})) << unknown.covariate;
    for (const ShapePoint& point : unknown.shape)
      EXPECT_TRUE(is_finite({point.x, point.y, point.low, point.high})) << unknown.covariate;
  }
  for (const SuspectRow& row : e.suspect_rows) EXPECT_TRUE(std::isfinite(row.studentised)) << row.row;
}

}  // namespace

void expect_contract(const Explanation& explanation) {
  const json written = json::parse(explanation_json(explanation));
  for (const char* key : {"format",
                          "campaign",
                          "response",
                          "unit",
                          "seal_chose",
                          "baseline",
                          "verdict",
                          "noise_floor",
                          "blocks",
                          "runs",
                          "model_in_force",
                          "before",
                          "after",
                          "adopted",
                          "unknown",
                          "untestable",
                          "suspect_rows",
                          "detectable_at_80_percent_power",
                          "detectable_by_effect",
                          "empirical",
                          "warnings"})
    EXPECT_TRUE(written.contains(key)) << key;
  EXPECT_EQ(written["format"], "tunnelrig-explain/1");
  for (const char* when : {"before", "after"}) {
    EXPECT_TRUE(written[when]["rmse"].is_number());
    EXPECT_TRUE(written[when]["held_out_rmse"].is_number());
    ASSERT_EQ(written[when]["held_out_ci95"].size(), 2u);
    EXPECT_LE(written[when]["held_out_ci95"][0], written[when]["held_out_ci95"][1]);
  }
  for (const json& adopted : written["adopted"]) {
    for (const char* key : {"effect", "form", "rotor", "parameters", "p_value", "held_out_gain",
                            "confounded_with", "separating_run"})
      EXPECT_TRUE(adopted.contains(key)) << key;
    for (const json& parameter : adopted["parameters"]) {
      EXPECT_TRUE(parameter["value"].is_number());
      EXPECT_EQ(parameter["ci95"].size(), 2u);
      EXPECT_TRUE(parameter["unit"].is_string());
    }
  }
  for (const json& unknown : written["unknown"]) {
    for (const char* key :
         {"covariate", "covariate_unit", "place", "times", "rotor", "p_value", "amplitude", "beside_baseline",
          "shape", "labels", "instead_of", "collinear_with", "by_sealed_too", "could_be"})
      EXPECT_TRUE(unknown.contains(key)) << key;
    for (const json& point : unknown["shape"]) EXPECT_EQ(point.size(), 4u);
    EXPECT_GT(unknown["beside_baseline"], 0);
    EXPECT_LE(unknown["beside_baseline"], unknown["amplitude"]);
  }
  for (const json& untestable : written["untestable"]) {
    EXPECT_TRUE(untestable.contains("effect"));
    EXPECT_TRUE(!untestable["missing"].empty() || !untestable["reason"].get<std::string>().empty())
        << untestable;
  }
  for (const json& row : written["suspect_rows"]) {
    EXPECT_TRUE(row.contains("row"));
    EXPECT_TRUE(row.contains("studentised"));
    EXPECT_TRUE(row.contains("set_aside"));
  }
  EXPECT_GT(written["noise_floor"], 0);
  expect_no_unknown_null(written, "");
  expect_finite(explanation);
}

}  // namespace tunnelrig::test
