#include "analysis/residual/explain_contract.h"

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::test {

using nlohmann::json;

namespace {

void expect_finite(const json& value, const std::string& path) {
  if (value.is_number()) {
    EXPECT_TRUE(std::isfinite(value.get<double>())) << path;
  }
  if (value.is_object() || value.is_array())
    for (const auto& [key, inner] : value.items()) expect_finite(inner, fmt::format("{}/{}", path, key));
}

}  // namespace

void expect_contract(const Explanation& explanation) {
  const json written = json::parse(explanation_json(explanation));
  for (const char* key :
       {"format", "campaign", "response", "unit", "baseline", "verdict", "noise_floor", "blocks", "runs",
        "before", "after", "adopted", "unknown", "untestable", "suspect_rows",
        "detectable_at_80_percent_power", "detectable_by_effect", "empirical", "warnings"})
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
    for (const char* key : {"covariate", "covariate_unit", "place", "times", "rotor", "p_value", "amplitude",
                            "shape", "labels", "instead_of", "by_sealed_too", "could_be"})
      EXPECT_TRUE(unknown.contains(key)) << key;
    for (const json& point : unknown["shape"]) EXPECT_EQ(point.size(), 4u);
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
  expect_finite(written, "");
}

}  // namespace tunnelrig::test
