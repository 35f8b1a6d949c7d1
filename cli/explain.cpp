// tunnelrig explain: find the residual, trace it to the effect that the model lacks, add it, report before
// and after.
#include "analysis/effects/expression_effect.h"
#include "analysis/model/adopt.h"
#include "analysis/model/model_store.h"
#include "analysis/report/explanation_page.h"
#include "analysis/residual/explanation/explanation_output.h"
#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/error.h"
#include "datasets/observations.h"
#include "datasets/output_place.h"

#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::cli {
namespace {

struct ExplainOptions {
  std::string db, response, baseline, json, html, effects;
  SearchSettings search;
  bool list = false, adopt = false, adopt_empirical = false;
};

/// The program's effects, and the user's own.
struct Candidates {
  std::vector<Effect> own;
  std::vector<const Effect*> all;

  explicit Candidates(const std::string& file) {
    if (!file.empty()) own = read_effects_toml(file);
    for (const Effect& effect : all_effects()) all.push_back(&effect);
    for (const Effect& effect : own) all.push_back(&effect);
  }
};

Observations observations_of_file(const ExplainOptions& options) {
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  if (file.text("table.toml"))
    return observe_table(observations_of(file), {options.response, options.baseline});
  CampaignData data = read_campaign_data(file);
  read_run_windows(file, data);
  return observe_campaign(data, {options.response, options.baseline});
}

/// To a file, or for "-" to standard output.
void put_json(const std::string& file, const std::string& json) {
  if (file == "-")
    fmt::print("{}\n", json);
  else
    write_text(file, json + "\n");
}

int list(const ExplainOptions& options) {
  const Candidates candidates(options.effects);
  const auto say = [&](const std::vector<const Effect*>& effects, const CanBeFound* can_be_found) {
    if (options.json.empty())
      fmt::print("{}", candidates_text(effects, can_be_found));
    else
      put_json(options.json, candidates_json(effects, can_be_found));
  };
  if (options.db.empty()) {
    say(candidates.all, nullptr);
    return kWell;
  }
  const Observations observations = observations_of_file(options);
  const TableEffects effects(observations, candidates.all);
  const CanBeFound can_be_found(observations);
  say(effects.all, &can_be_found);
  return kWell;
}

/// 0: the thesis's.
int version_in_force(const std::string& db) {
  return static_cast<int>(stored_models(CampaignFile(db, CampaignFile::Access::kRead)).size());
}

/// Stores what was accepted as the next version of the model, and says so.
void adopt_and_store(const ExplainOptions& options, const Observations& observations,
                     const Explanation& explanation) {
  Adoption adoption = adopt(observations, explanation, options.adopt_empirical);
  for (const std::string& note : adoption.notes) warn(note);
  if (!adoption.model) {
    tell("nothing was adopted: the model stays as it is\n");
    return;
  }
  CampaignFile file(options.db, CampaignFile::Access::kWrite);
  if (const auto stored = stored_models(file);
      !stored.empty() && corrects_alike(*adoption.model, stored.back().model)) {
    tell(fmt::format("the same as model {}: nothing is stored\n", stored.back().model.name()));
    return;
  }
  const auto certificate = file.newest_document("calibration");
  const nlohmann::json inputs{{"calibration", certificate ? certificate->id : 0}};
  adoption.model->version =
      store_model(file, *adoption.model, {program_version(), arguments(), inputs.dump()});
  tell(fmt::format("stored as model {}; reduce, map and report go by it from now on\n",
                   adoption.model->name()));
}

/// Before a search that may take minutes.
void check_outputs(const ExplainOptions& options) {
  check_distinct({{"--json", options.json}, {"--html", options.html}});
  if (!options.json.empty() && options.json != "-") check_can_be_written(options.json);
  if (!options.html.empty()) check_can_be_written(options.html);
}

/// What would be left out in silence.
void refuse_unused(const ExplainOptions& options, const CLI::App& verb) {
  if (options.html == "-") throw InputError("--html -: the page goes to a file; - is of --json");
  if (!options.list) return;
  refuse_given(verb,
               {"--html", "--adopt", "--adopt-empirical", "--max-effects", "--alpha", "--simulations",
                "--seed", "--session-ratio"},
               "--list prints the candidates, and explains nothing");
  if (options.db.empty())
    refuse_given(verb, {"--response", "--baseline"}, "is of a campaign; with --list it goes with --db");
}

int run_explain(ExplainOptions options, const CLI::App& verb) {
  refuse_unused(options, verb);
  check_outputs(options);
  if (options.list) return list(options);
  if (options.db.empty()) throw InputError("--db is required (all but --list need a campaign)");
  if ((options.adopt || options.adopt_empirical) && !options.effects.empty())
    throw InputError(
        "--adopt stores effects that the program has: add your own as a file first (docs/effects.md)");
  const Candidates candidates(options.effects);
  const Observations observations = observations_of_file(options);
  const TableEffects effects(observations, candidates.all);
  if (options.adopt) require_adoptable(observations);
  options.search.empirical = options.adopt_empirical;
  if (const double most = static_cast<double>(options.search.simulations);
      1 / (most + 1) > options.search.alpha)
    throw InputError(fmt::format(
        "--alpha {} needs --simulations {:.0f} at least: of {:.0f} none can be rarer than 1 in {:.0f}",
        options.search.alpha, std::ceil(1 / options.search.alpha) - 1, most, most + 1));
  ProgressBar progress("explaining");
  options.search.progress = [&](const std::string& what) { progress.show(what); };
  Explanation explanation = explain(observations, effects.all, options.search);
  explanation.model_in_force = version_in_force(options.db);
  for (const std::string& warning : explanation.warnings) warn(warning);
  const std::string json = explanation_json(explanation);
  if (options.json != "-") fmt::print("{}", explanation_text(explanation));
  if (!options.json.empty()) put_json(options.json, json);
  if (!options.html.empty())
    write_text(options.html, explanation_html(explanation, observations, options.search,
                                              {options.db, program_version(), arguments(), now_utc()}));
  if (options.adopt_empirical && !adoptable(observations))
    warn(
        "the curves are in the errors above; no model is stored, since one corrects the thrusts of a "
        "campaign");
  else if (options.adopt || options.adopt_empirical)
    adopt_and_store(options, without_set_aside(observations, explanation), explanation);
  return kWell;
}

}  // namespace

void add_explain(CLI::App& app, Work& work) {
  auto options = std::make_shared<ExplainOptions>();
  CLI::App* verb = app.add_subcommand("explain", "Trace the residual to the effect that the model lacks");
  verb->footer(
      "Seals a quarter of the sessions, searches on the rest, opens the seal at the end; "
      "docs/closed-loop.md.\n\n"
      "Examples: tunnelrig explain --db my.db\n"
      "          tunnelrig explain --db my.db --json explanation.json --html explanation.html\n"
      "          tunnelrig explain --list --db my.db");
  verb->add_option("--db", options->db, "Campaign file");
  verb->add_option("--response", options->response, "thrust, c_t, cell, or a column")->option_text("NAME");
  verb->add_option("--baseline", options->baseline,
                   "thesis, open_space; tables: constant, linear:COLUMN, power:COLUMN");
  verb->add_option("--max-effects", options->search.most_effects, "At most so many effects")
      ->check(CLI::Range(0, 12))
      ->capture_default_str();
  verb->add_option("--alpha", options->search.alpha, "Chance of a name where there is no effect")
      ->check(CLI::Range(0.001, 0.5))
      ->capture_default_str();
  verb->add_option("--simulations", options->search.simulations, "Data sets without effect to compare with")
      ->check(CLI::Range(99, 99999))
      ->capture_default_str();
  verb->add_option("--seed", options->search.seed, "Of seal and simulations")
      ->check(CLI::Range(0., 1e18))
      ->capture_default_str();
  verb->add_option("--session-ratio", options->search.session_ratio,
                   "Session scatter over run scatter above which it is an unknown")
      ->check(CLI::Range(0.1, 7.0))
      ->capture_default_str();
  verb->add_option("--json", options->json,
                   "Write the explanation as JSON to this file (- for standard output)");
  verb->add_option("--html", options->html, "Write a page with the pictures");
  verb->add_option("--effects", options->effects,
                   "Candidates of your own as expressions (.toml; docs/effects.md)")
      ->option_text("FILE");
  verb->add_flag("--list", options->list,
                 "Print the candidates, and with --db whether this data can test them");
  verb->add_flag("--adopt", options->adopt, "Store the accepted effects as the next version of the model");
  verb->add_flag("--adopt-empirical", options->adopt_empirical,
                 "Count the curves that have no name in the error after, and store them with the effects");
  verb->callback([options, verb, &work] { work = [options, verb] { return run_explain(*options, *verb); }; });
}

}  // namespace tunnelrig::cli
