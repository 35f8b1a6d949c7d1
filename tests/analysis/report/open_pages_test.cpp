// The pages in a real browser: every plot drawn, no complaint of the console, nothing asked for.
#include "analysis/report/render.h"
#include "analysis/report/report_data.h"
#include "campaigns.h"
#include "datasets/csv.h"
#include "support/temporary_folder.h"

#include <array>
#include <cstdio>
#include <cstdlib>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

namespace tunnelrig {
namespace {

using test::CampaignParts;

/// Standard output and error of a command, and its exit code.
std::pair<std::string, int> output_of(const std::string& command) {
  std::string output;
  std::FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  std::array<char, 4096> piece{};
  while (const auto n = std::fread(piece.data(), 1, piece.size(), pipe)) output.append(piece.data(), n);
  const int status = ::pclose(pipe);
  return {output, WIFEXITED(status) ? WEXITSTATUS(status) : -1};
}

bool has(const char* program) { return output_of(fmt::format("command -v {}", program)).second == 0; }

/// Two points of a flight whose names are hostile.
constexpr const char* kFlights =
    R"({"format": "tunnelrig-flights/1", "command": "tunnelrig fly --out </script>",
  "flights": [{"tunnel": "1.5", "scenario": "<b>hover", "map": "m.json", "position": "lidar-thesis",
    "extrapolated": "the map is of a tunnel of 2.4 x 2.4 m, this one is 1.5 x 1.5 m",
    "walls": [[-0.75, 0], [0.75, 0], [0.75, 1.5], [-0.75, 1.5]],
    "reference": {"time_s": [0, 0.1], "y_m": [0, 0], "z_m": [0.75, 0.75]},
    "controllers": [{"name": "</script><b>%{x}", "runs": 2, "rms_y_mm": 3.1, "rms_z_mm": 2, "max_y_mm": 9,
      "max_z_mm": 8, "contacts": 0, "first_contact_s": null, "estimator_rms_mm": 1.5, "thrust_saturated_s": 0,
      "rms_of_runs_mm": [3.6, 3.8], "contacts_of_runs": [0, 0],
      "path": {"y_m": [0, 0.01], "z_m": [0.75, 0.76]}},
      {"name": "other", "runs": 2, "rms_y_mm": 4.1, "rms_z_mm": 2, "max_y_mm": 9,
      "max_z_mm": 8, "contacts": 0, "first_contact_s": null, "estimator_rms_mm": 1.5, "thrust_saturated_s": 0,
      "rms_of_runs_mm": [4.5, 4.6], "contacts_of_runs": [0, 0],
      "more_than_mm": {"</script><b>%{x}": [0.2, 1.5]},
      "path": {"y_m": [0, 0.01], "z_m": [0.75, 0.76]}}]}]})";

struct Pages {
  test::TemporaryFolder folder;
  std::string names;

  void add(const std::string& name) { add(name, name, "", {}); }
  void add(const std::string& name, const std::string& db, const std::string& flights,
           const ModelChoice& model) {
    const CampaignFile file(folder / (db + ".db"), CampaignFile::Access::kRead);
    const ReportData data = report_data(file, {.db = db + ".db",
                                               .program_version = "0",
                                               .arguments = "tunnelrig report",
                                               .model = model,
                                               .flights = flights});
    write_text(folder / (name + ".html"), render_report(data.json));
    names += fmt::format(" '{}'", (folder / (name + ".html")).string());
  }
  void campaign(const std::string& name, const CampaignParts& parts) {
    test::make_campaign(folder / (name + ".db"), parts);
    add(name);
  }
};

/// The whole campaign with coefficients that differ in their sixth decimal.
void add_near_alike(Pages& pages) {
  const CampaignFile file(pages.folder / "whole.db", CampaignFile::Access::kRead);
  auto data = nlohmann::json::parse(
      report_data(file, {.db = "whole.db", .program_version = "0", .arguments = "tunnelrig report"}).json);
  for (auto& location : data["sections"]["locations"]["locations"]) {
    auto& c_t = location["c_t"];
    c_t["mean"] = 0.1063 + 1e-3 * (c_t["mean"].get<double>() - 0.1063);
    c_t["u95"] = 1e-6;
  }
  write_text(pages.folder / "near_alike.html", render_report(data.dump()));
  pages.names += fmt::format(" '{}'", (pages.folder / "near_alike.html").string());
}

TEST(ReportPage, OpensInABrowser) {
  if (!has("chromium")) GTEST_SKIP() << "chromium is not installed, so no page was opened";
  if (!has("node")) GTEST_SKIP() << "node is not installed, which drives the browser, so no page was opened";
  Pages pages;
  pages.campaign("whole", {.frames_lost = 3});
  pages.campaign("hostile", {.columns = 1, .rows = 3, .source = "virtual", .odd_label = "</script><b>%{x}"});
  pages.campaign("uncalibrated", {.calibrated = false});
  pages.campaign("open_space_only", {.tunnel = false});
  {
    CampaignFile file(pages.folder / "whole.db", CampaignFile::Access::kWrite);
    file.add_document("model", {"0", "tunnelrig explain --adopt", "{}"},
                      nlohmann::json{{"explanation", test::explanation("confounded")}}.dump());
  }
  write_text(pages.folder / "flights.json", kFlights);
  pages.add("with_model_and_flights", "whole", (pages.folder / "flights.json").string(),
            {{}, test::adopted_model()});
  pages.campaign("one_rotor", {.raw_data = false, .rotors = 1});
  pages.campaign("one_run", {.raw_data = false, .open_space = false, .columns = 1, .rows = 1, .repeats = 1});
  add_near_alike(pages);
  test::make_table(pages.folder / "table.db");
  pages.add("table");
  test::make_table(pages.folder / "no_thrust.db", false);
  pages.add("no_thrust");
  const auto [output, code] = output_of(fmt::format("node '{}' chromium '{}'{}", TUNNELRIG_OPEN_PAGES,
                                                    (pages.folder / "profile").string(), pages.names));
  EXPECT_EQ(code, 0) << output;
}

}  // namespace
}  // namespace tunnelrig
