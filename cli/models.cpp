// tunnelrig models: which versions of the model a campaign file holds, and what each brought.
#include "analysis/model/model_store.h"
#include "cli/console.h"
#include "cli/verb.h"

#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::cli {
namespace {

using Json = nlohmann::ordered_json;

struct ModelsOptions {
  std::string db;
  bool json = false;
};

/// A number of an explanation; null where it has none.
Json number_in(const Json& explanation, const char* first, const char* second = nullptr) {
  const Json* at = &explanation;
  for (const char* key : {first, second}) {
    if (key == nullptr) break;
    if (!at->is_object() || !at->contains(key)) return nullptr;
    at = &(*at)[key];
  }
  return at->is_number() ? *at : Json(nullptr);
}

/// "2026-03-02T08:00:00Z" of whatever fraction of a second it was.
std::string whole_seconds(const std::string& utc) {
  const std::size_t point = utc.find('.');
  return point == std::string::npos ? utc : utc.substr(0, point) + "Z";
}

Json version_json(const StoredModel& stored, bool in_force) {
  const Json explanation = Json::parse(stored.model.explanation);
  return {{"version", stored.model.version},
          {"parent", stored.model.parent},
          {"created_utc", whole_seconds(stored.created_utc)},
          {"program", stored.provenance.program_version},
          {"arguments", stored.provenance.arguments},
          {"baseline", stored.model.baseline},
          {"effects", stored.model.effects()},
          {"reference", stored.model.reference()},
          {"unit", "N"},
          {"error_before", number_in(explanation, "before", "held_out_rmse")},
          {"error_after", number_in(explanation, "after", "held_out_rmse")},
          {"noise_floor", number_in(explanation, "noise_floor")},
          {"in_force", in_force}};
}

Json thesis_json(bool in_force) {
  return {{"version", 0}, {"parent", nullptr}, {"effects", Json::array()}, {"in_force", in_force}};
}

std::string cell(const Json& version, const char* key) {
  return version.contains(key) && version[key].is_number() ? fmt::format("{:.4g}", version[key].get<double>())
                                                           : "-";
}

void print(const Json& versions) {
  Table table({"version", "created", "effects", "error before [N]", "after [N]", "floor [N]", "in force"});
  for (const Json& version : versions) {
    const bool thesis = version["version"] == 0;
    table.add({thesis ? "thesis" : fmt::format("{}", version["version"].get<int>()),
               thesis ? "-" : version["created_utc"].get<std::string>(),
               thesis
                   ? "-"
                   : fmt::format("{}", fmt::join(version["effects"].get<std::vector<std::string>>(), ", ")),
               cell(version, "error_before"), cell(version, "error_after"), cell(version, "noise_floor"),
               version["in_force"].get<bool>() ? "yes" : ""});
  }
  table.print();
  fmt::print("\n");
  for (const Json& version : versions) {
    std::vector<std::string> conditions;
    if (version.contains("reference"))
      for (const auto& [name, value] : version["reference"].items())
        conditions.push_back(fmt::format("{} {:.6g}", name, value.get<double>()));
    if (!conditions.empty())
      fmt::print("coefficients by version {} are for {}\n", version["version"].get<int>(),
                 fmt::join(conditions, ", "));
  }
  fmt::print("errors are of blocks held out; `reduce --model N` goes by another version\n");
}

int run_models(const ModelsOptions& options) {
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  const std::vector<StoredModel> stored = stored_models(file);
  Json versions = Json::array({thesis_json(stored.empty())});
  for (const StoredModel& one : stored) versions.push_back(version_json(one, &one == &stored.back()));
  if (options.json)
    fmt::print("{}\n", Json{{"format", "tunnelrig-models/1"}, {"versions", versions}}.dump(1));
  else
    print(versions);
  return kWell;
}

}  // namespace

void add_models(CLI::App& app, Work& work) {
  auto options = std::make_shared<ModelsOptions>();
  CLI::App* verb = app.add_subcommand("models", "List the versions of the model that a campaign file holds");
  verb->footer(
      "`explain --adopt` adds a version; the newest is in force in reduce, map and report; docs/reduction.md."
      "\n\nExample: tunnelrig models --db my.db");
  verb->add_option("--db", options->db, "Campaign file")->required();
  verb->add_flag("--json", options->json, "Print as JSON");
  verb->callback([options, &work] { work = [options] { return run_models(*options); }; });
}

void add_model_options(CLI::App& verb, std::string& model, std::string& terms) {
  verb.add_option("--model", model,
                  "Version of the model: thesis, a number of `models`, or latest (the default)")
      ->option_text("VERSION");
  verb.add_option(
          "--with", terms,
          "Measured conditions that enter the thesis's model: air_pressure, air_humidity, rotor_speed; "
          "thesis: none")
      ->option_text("TERMS");
}

}  // namespace tunnelrig::cli
