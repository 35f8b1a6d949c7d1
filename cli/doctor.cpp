#include "analysis/health.h"
#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/observations.h"
#include "datasets/snapshot.h"

#include <algorithm>
#include <array>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace tunnelrig::cli {
namespace {

struct DoctorOptions {
  std::string db;
  bool json = false;
};

constexpr std::array<const char*, 3> kNames = {"ok", "note", "problem"};
constexpr std::array<const char*, 3> kColours = {"\x1b[32m", "\x1b[33m", "\x1b[31m"};

std::vector<Finding> look_at(const CampaignFile& file) {
  const Snapshot snapshot(file);  // a run that grows while it is looked at would seem damaged
  if (file.text("table.toml")) {
    const ObservationTable table = observations_of(file);
    const std::string problems = file.integrity_problems();
    return {
        {problems.empty() ? Severity::kGood : Severity::kProblem, "data base",
         problems.empty() ? "SQLite finds nothing wrong" : problems,
         problems.empty() ? "" : "restore the file from a copy"},
        {Severity::kGood, "table", fmt::format("{} observations fit their schema", table.rows.size()), ""}};
  }
  ProgressBar bar("doctor");
  return examine(file, read_campaign_data(file), show_on(bar));
}

void print(const std::vector<Finding>& findings) {
  const bool colour = output_is_coloured();
  for (const Finding& finding : findings) {
    const auto severity = static_cast<std::size_t>(finding.severity);
    fmt::print("{}{:<8}{} {:<12} {}\n", colour ? kColours[severity] : "", kNames[severity],
               colour ? "\x1b[0m" : "", finding.check, finding.found);
    if (!finding.advice.empty()) fmt::print("{:21} → {}\n", "", finding.advice);
  }
}

int run_doctor(const DoctorOptions& options) {
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  const std::vector<Finding> findings = look_at(file);
  const auto problems = std::count_if(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.severity == Severity::kProblem;
  });
  if (options.json) {
    nlohmann::ordered_json json{{"format", "tunnelrig-doctor/1"},
                                {"well", problems == 0},
                                {"findings", nlohmann::ordered_json::array()}};
    for (const Finding& finding : findings) {
      json["findings"].push_back({{"severity", kNames[static_cast<std::size_t>(finding.severity)]},
                                  {"check", finding.check},
                                  {"found", finding.found},
                                  {"advice", finding.advice}});
    }
    fmt::print("{}\n", json.dump(1));
  } else {
    print(findings);
    fmt::print("\n{}\n", problems == 0 ? "all is well"
                                       : fmt::format("{} problem{}", problems, problems == 1 ? "" : "s"));
  }
  return problems == 0 ? kWell : kProblemFound;
}

}  // namespace

void add_doctor(CLI::App& app, Work& work) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* verb =
      app.add_subcommand("doctor", "Check a campaign file and say what to do about what is wrong");
  verb->footer("Exit code 0: all is well; 1: problems were found.\n\nExample: tunnelrig doctor --db my.db");
  verb->add_option("--db", options->db, "Campaign file")->required();
  verb->add_flag("--json", options->json, "Print as JSON");
  verb->callback([options, &work] { work = [options] { return run_doctor(*options); }; });
}

}  // namespace tunnelrig::cli
