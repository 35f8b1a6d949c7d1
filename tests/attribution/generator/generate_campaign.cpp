// generate_campaign: writes a campaign folder and, beside it, the sealed key.
#include "attribution/effects/catalogue.h"
#include "attribution/generator/campaign.h"
#include "datasets/csv.h"
#include "datasets/error.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace {

using namespace tunnelrig;
using namespace tunnelrig::attribution;

struct Options {
  Settings settings;
  std::string out, key, separate;
  bool list = false;
};

/// What `explain` proposed: one separating_run or a list of them. Values that are no number are passed over,
/// since "order" or a text cannot be brought to a setting.
std::vector<SeparatingRun> read_separating(const std::string& path) {
  const nlohmann::json document = nlohmann::json::parse(read_text(path), nullptr, false);
  if (document.is_discarded()) throw InputError::in(path, "is no JSON");
  std::vector<SeparatingRun> runs;
  for (const nlohmann::json& one : document.is_array() ? document : nlohmann::json::array({document})) {
    if (!one.is_object())
      throw InputError::in(path, "a separating run is an object with setting and location");
    SeparatingRun run;
    if (one.contains("location") && one["location"].is_string()) run.location = one["location"];
    if (one.contains("setting") && one["setting"].is_object()) {
      for (const auto& [column, value] : one["setting"].items()) {
        if (value.is_number()) run.setting[column] = value.get<double>();
        if (column == "location" && value.is_string()) run.location = value;
      }
    }
    runs.push_back(run);
  }
  return runs;
}

template <typename Enum, std::size_t size>
void add_choice(CLI::App& app, const char* name, Enum& value, const std::array<const char*, size>& names,
                const char* help) {
  std::map<std::string, Enum> choices;
  for (std::size_t i = 0; i < size; ++i) choices[names[i]] = static_cast<Enum>(i);
  app.add_option(name, value, help)->transform(CLI::CheckedTransformer(choices));
}

int run(Options& options) {
  if (options.list) {
    for (const std::string& name : effect_names()) fmt::print("{}\n", name);
    return 0;
  }
  if (options.out.empty() || options.key.empty()) throw InputError("--out DIR and --key FILE are required");
  const std::filesystem::path folder = std::filesystem::absolute(options.out).lexically_normal();
  const std::filesystem::path key = std::filesystem::absolute(options.key).lexically_normal();
  const auto [end, rest] = std::mismatch(folder.begin(), folder.end(), key.begin(), key.end());
  if (end == folder.end())
    throw InputError::in(options.key, "the key must not lie inside the campaign's folder");
  if (!options.separate.empty()) options.settings.separating = read_separating(options.separate);
  const Campaign campaign = generate(options.settings);
  write_folder(campaign, folder);
  write_text(key, key_json(campaign));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Generates a campaign with a known truth: its folder, and a sealed key beside it. Simulated data.");
  app.footer(
      "Example: generate_campaign --track one --noise session --effect creep --size 1 --seed 7 --out c7 "
      "--key c7.key.json");
  Options options;
  Settings& settings = options.settings;
  add_choice(app, "--track", settings.track, kTrackNames, "What kind of truth");
  add_choice(app, "--noise", settings.noise, kNoiseNames, "What kind of scatter");
  add_choice(app, "--order", settings.order, kOrderNames, "Locations randomised, or swept through");
  app.add_option("--blocks", settings.blocks, "Sessions")->capture_default_str();
  app.add_option("--runs", settings.runs, "Runs in all")->capture_default_str();
  app.add_option("--effect", settings.effects,
                 "True effect; twice for a pair. Without it the track draws one");
  app.add_option("--size", settings.size, "Rms of an effect over the scatter at its level")
      ->capture_default_str();
  app.add_flag("--size-over-run-scatter", settings.size_over_run_scatter,
               "Sizes are over the run scatter, also of effects that vary by session");
  app.add_option("--run-scatter", settings.run_scatter, "Relative, of one rotor")->capture_default_str();
  app.add_option("--seed", settings.seed, "Of everything that is drawn")->capture_default_str();
  app.add_flag("--unequal-repeats", settings.unequal_repeats, "Locations are repeated unevenly");
  app.add_flag("--missing-cells", settings.missing_cells, "One covariate lacks a value here and there");
  app.add_flag("--switches", settings.switches,
               "A switch and a column of texts are written down; what is true outside the library is theirs");
  app.add_flag("--raw", settings.raw, "Arrays of counts instead of thrusts");
  app.add_option("--raw-duration", settings.raw_duration_s, "Seconds of each raw run")->capture_default_str();
  app.add_option("--separate", options.separate,
                 "JSON of proposed separating runs, added in sessions of their own")
      ->check(CLI::ExistingFile);
  app.add_option("--out", options.out, "The campaign's folder; must not exist");
  app.add_option("--key", options.key, "The key's file, outside that folder");
  app.add_flag("--list", options.list, "Print the true effects' names");
  try {
    app.parse(argc, argv);
    return run(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "generate_campaign: {}\n", error.what());
    return 2;
  }
}
