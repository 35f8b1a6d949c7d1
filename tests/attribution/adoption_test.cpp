// What was found is put to use: `explain --adopt`, then `reduce` by the new version of the model, on
// campaigns with a known truth.
#include "attribution/generator/campaign.h"
#include "cli/program.h"
#include "datasets/campaign_file.h"
#include "datasets/csv.h"
#include "support/temporary_folder.h"

#include <cmath>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::attribution {
namespace {

using nlohmann::json;
using test::ProgramResult;
using testing::HasSubstr;

struct Adopted : testing::Test {
  test::TemporaryFolder folder;
  Campaign campaign;

  ProgramResult run(const std::string& arguments) const {
    return test::run_program(folder.path(), arguments);
  }
  void expect(int code, const std::string& arguments) const {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.code, code) << arguments << "\n" << result.error << result.out;
  }

  void import(const std::string& effect) {
    campaign = generate(
        {.track = Track::kOne, .blocks = 16, .runs = 160, .size = 4, .effects = {effect}, .seed = 11});
    write_folder(campaign, folder / "source");
    expect(0, "import source --db c.db");
  }

  /// Relative error of the runs' total thrust against what the baseline truly gave: mean and scatter.
  struct Error {
    double mean = 0, scatter = 0;
  };
  Error error_of(const std::string& runs_csv) const {
    const Sheet sheet = read_csv(folder / runs_csv);
    EXPECT_EQ(sheet.rows.size(), campaign.world.runs.size());
    std::vector<double> errors;
    for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
      double read_N = 0, true_N = 0;
      for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
        read_N += sheet.require_number(row, "thrust_" + std::to_string(rotor + 1) + "_N");
        true_N += campaign.world.baseline_N[row][rotor];
      }
      errors.push_back(read_N / true_N - 1);
    }
    Error result;
    for (const double e : errors) result.mean += e / static_cast<double>(errors.size());
    for (const double e : errors) result.scatter += std::pow(e - result.mean, 2);
    result.scatter = std::sqrt(result.scatter / static_cast<double>(errors.size() - 1));
    return result;
  }
  /// Of four rotors' mean, were the model exact.
  double scatter_of_truth() const {
    double square = 0;
    for (const Rotors& run : campaign.scatter) square += std::pow((run[0] + run[1] + run[2] + run[3]) / 4, 2);
    return std::sqrt(square / static_cast<double>(campaign.scatter.size()));
  }

  json output(const std::string& arguments) const {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.code, 0) << arguments << "\n" << result.error;
    return json::parse(result.out, nullptr, false);
  }
};

TEST_F(Adopted, RunsScatterLessAndAgreeWithTheTruthAndThesisComesBack) {
  import("creep");
  expect(0, "reduce --db c.db --csv before.csv --runs-csv runs_before.csv");
  expect(0, "explain --db c.db --simulations 199 --adopt --json explanation.json");
  expect(0, "reduce --db c.db --csv after.csv --runs-csv runs_after.csv");
  const Error before = error_of("runs_before.csv"), after = error_of("runs_after.csv");
  EXPECT_GT(before.scatter, 1.5 * after.scatter);
  EXPECT_NEAR(after.scatter / scatter_of_truth(), 1, 0.1);
  // what `after` is off by is the amplitude's own uncertainty, and the budget says so
  const Sheet locations = read_csv(folder / "after.csv");
  const double c_t = locations.require_number(0, "c_t"), model = locations.require_number(0, "c_t_u_model");
  EXPECT_GT(model, 0);
  EXPECT_LT(std::abs(after.mean), std::abs(before.mean));
  EXPECT_LT(std::abs(after.mean), 4 * model / c_t + 4 * scatter_of_truth() / std::sqrt(160.0));
  EXPECT_EQ(locations.text(0, "model"), "1");

  expect(0, "reduce --db c.db --model thesis --csv back.csv --runs-csv runs_back.csv");
  EXPECT_EQ(read_text(folder / "back.csv"), read_text(folder / "before.csv"));
  EXPECT_EQ(read_text(folder / "runs_back.csv"), read_text(folder / "runs_before.csv"));
  expect(0, "reduce --db c.db --model 1 --csv one.csv");
  EXPECT_EQ(read_text(folder / "one.csv"), read_text(folder / "after.csv"));

  const json models = output("models --db c.db --json");
  ASSERT_EQ(models["versions"].size(), 2u);
  EXPECT_FALSE(models["versions"][0]["in_force"].get<bool>());
  EXPECT_TRUE(models["versions"][1]["in_force"].get<bool>());
  EXPECT_THAT(models["versions"][1]["effects"].dump(), HasSubstr("creep"));
  const json explanation = json::parse(read_text(folder / "explanation.json"));
  EXPECT_EQ(models["versions"][1]["error_before"], explanation["before"]["held_out_rmse"]);
  EXPECT_EQ(models["versions"][1]["error_after"], explanation["after"]["held_out_rmse"]);
  EXPECT_EQ(output("reduce --db c.db --json")["model_version"], 1);
  EXPECT_THAT(run("reduce --db c.db").out, HasSubstr("model version 1 (creep"));
  EXPECT_THAT(run("models --db c.db").out, HasSubstr("creep"));

  // versions are derived: the folder that leaves is the folder that came
  expect(0, "export --db c.db out");
  EXPECT_EQ(read_text(folder / "out/runs.csv"), read_text(folder / "source/runs.csv"));
  EXPECT_EQ(read_text(folder / "out/campaign.toml"), read_text(folder / "source/campaign.toml"));
  expect(0, "import out --db again.db");
  EXPECT_EQ(output("models --db again.db --json")["versions"].size(), 1u);
  EXPECT_EQ(run("import out --db again.db --replace").error, "");
  EXPECT_THAT(run("import out --db c.db --replace").error, HasSubstr("1 version of the model"));
}

TEST_F(Adopted, BadInputIsNamed) {
  import("air_pressure");
  EXPECT_THAT(run("reduce --db c.db --model 1").error, HasSubstr("--model 1: c.db has thesis"));
  EXPECT_THAT(run("reduce --db c.db --model newest").error, HasSubstr("write thesis, latest or the number"));
  expect(2, "reduce --db c.db --model 1");
  expect(0, "reduce --db c.db --model latest");
  expect(2, "explain --db c.db --response c_t --adopt");
  expect(0, "explain --db c.db --simulations 199 --adopt");
  ASSERT_EQ(output("models --db c.db --json")["versions"].size(), 2u);
  EXPECT_THAT(run("reduce --db c.db --model 1 --with air_pressure").error, HasSubstr("--model thesis"));
  expect(0, "reduce --db c.db --with rotor_speed");
  EXPECT_EQ(output("reduce --db c.db --with rotor_speed --json")["model"], "rotor_speed");

  CampaignFile(folder / "c.db", CampaignFile::Access::kWrite)
      .add_document("model", {"", "", "{}"}, "{\"format\":1}");
  for (const char* verb : {"models --db c.db", "reduce --db c.db", "map --db c.db --out maps"}) {
    const ProgramResult result = run(verb);
    EXPECT_EQ(result.code, 2) << verb;
    EXPECT_THAT(result.error, HasSubstr("the stored model (document"));
    EXPECT_THAT(result.error, HasSubstr("format that is no text"));
  }
  expect(0, "reduce --db c.db --model thesis");
}

TEST_F(Adopted, ARunWithoutTheCovariateIsLeftOut) {
  import("air_pressure");
  expect(0, "explain --db c.db --simulations 199 --adopt");
  const json models = output("models --db c.db --json");
  ASSERT_THAT(models["versions"][1]["effects"].dump(), HasSubstr("air_pressure"));
  {
    CampaignFile file(folder / "c.db", CampaignFile::Access::kWrite);
    Sheet sheet = file.sheet("runs").value();
    const auto column = std::find(sheet.columns.begin(), sheet.columns.end(), "air_pressure_Pa");
    ASSERT_NE(column, sheet.columns.end());
    sheet.rows[3].cells[static_cast<std::size_t>(column - sheet.columns.begin())] = "";
    file.set_sheet("runs", sheet);
  }
  const ProgramResult result = run("reduce --db c.db");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.error, HasSubstr("is left out: it has no air_pressure_Pa, which the adopted effect"));
  EXPECT_EQ(run("reduce --db c.db --model thesis").code, 0);
}

TEST_F(Adopted, NothingIsStoredWhereNothingIsThere) {
  campaign = generate({.track = Track::kNone, .blocks = 16, .runs = 120, .seed = 11});
  write_folder(campaign, folder / "source");
  expect(0, "import source --db c.db");
  const ProgramResult result = run("explain --db c.db --simulations 99 --adopt");
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.error, HasSubstr("nothing was adopted"));
  EXPECT_EQ(output("models --db c.db --json")["versions"].size(), 1u);
}

}  // namespace
}  // namespace tunnelrig::attribution
