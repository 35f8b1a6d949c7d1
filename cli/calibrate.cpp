#include "calibration/certificate.h"
#include "calibration/crosstalk.h"
#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/calibration_doubts.h"
#include "datasets/campaign_file.h"
#include "datasets/error.h"

#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::cli {
namespace {

struct CalibrateOptions {
  std::string db, points, propellers, loss = "ordinary", matrix, force_unit = "N", zeros = "block";
  std::vector<std::string> forces, readings;
  bool diagonal = false, keep_gross = false, json = false;
};

RobustLoss loss_of(const std::string& name) {
  if (name == "huber") return RobustLoss::kHuber;
  if (name == "cauchy") return RobustLoss::kCauchy;
  if (name == "tukey") return RobustLoss::kTukey;
  return RobustLoss::kOrdinary;
}

/// A laboratory's own file of points or tests.
std::optional<Sheet> read_if_given(const std::string& path) {
  if (path.empty()) return {};
  return read_csv(path);
}

/// A message that names the file that was given where this is not the campaign's own sheet.
std::string as_named(const std::string& message, const CalibrateOptions& options) {
  for (const auto& [sheet, given] :
       {std::pair<std::string_view, std::string>{"calibration.csv", options.points},
        {"propellers.csv", options.propellers}})
    if (!given.empty() && message.starts_with(sheet)) return given + message.substr(sheet.size());
  return message;
}

Certificate calibrate_as_named(const std::vector<CalibrationPoint>& points,
                               const std::vector<PropellerTest>& tests, const CalibrationOptions& how,
                               const CalibrateOptions& options) {
  try {
    return calibrate(points, tests, how);
  } catch (const InputError& error) {
    throw InputError(as_named(error.what(), options));
  }
}

int calibrate_campaign(const CalibrateOptions& options) {
  CampaignFile file(options.db, CampaignFile::Access::kWrite);
  const CampaignInfo info = file.info();
  CalibrationOptions how{.rotors = info.rig.rotors};
  how.cell.loss = loss_of(options.loss);
  how.cell.gauge_force_N = info.uncertainty.force_N.value_or(0);
  how.cell.leave_out_gross = !options.keep_gross;
  const auto new_points = read_if_given(options.points), new_tests = read_if_given(options.propellers);
  const auto points =
      new_points ? parse_calibration(*new_points, info.rig.rotors) : file.calibration_points();
  const auto tests = new_tests ? parse_propellers(*new_tests, info.rig.rotors) : file.propeller_tests();
  if (points.empty() && new_points) throw InputError::in(options.points, "holds no calibration points");
  if (points.empty())
    throw InputError::in(options.db, "holds no calibration points; --points calibration.csv adds them");
  Certificate certificate = calibrate_as_named(points, tests, how, options);
  for (const std::string& doubt : calibration_doubts(file, points))
    certificate.warnings.push_back(as_named(doubt, options));
  const nlohmann::json inputs{{"points", certificate.points_hash}};
  std::int64_t id = 0;
  file.atomically([&] {  // only what is to be written: a recorder may be waiting
    if (new_points) file.set_sheet("calibration", *new_points);
    if (new_tests) file.set_sheet("propellers", *new_tests);
    id = file.add_document("calibration", {program_version(), arguments(), inputs.dump()},
                           to_json(certificate));
  });
  if (options.json) {
    fmt::print("{}\n", to_json(certificate, 1));
  } else {
    fmt::print("{}\nstored in {} as calibration {}\n", format_certificate(certificate), options.db, id);
  }
  return certificate.passed() ? kWell : kProblemFound;
}

int calibrate_matrix(const CalibrateOptions& options) {
  if (options.forces.empty() || options.forces.size() != options.readings.size()) {
    throw InputError("--matrix: --forces and --readings name the columns of as many axes as channels");
  }
  const CrosstalkSpec spec{
      .force_columns = options.forces, .reading_columns = options.readings, .force_unit = options.force_unit};
  const CrosstalkFit fit =
      fit_crosstalk(read_crosstalk(read_csv(options.matrix), spec),
                    {.zeros = options.zeros == "common" ? BlockZero::kCommon : BlockZero::kPerBlock,
                     .shape = options.diagonal ? MatrixShape::kDiagonal : MatrixShape::kFull,
                     .leave_out_gross = !options.keep_gross});
  if (options.json) {
    fmt::print("{}\n", to_json(fit, 1));
  } else {
    fmt::print("{}: {}", options.matrix, format_crosstalk(fit));
  }
  for (const CrosstalkRow& row : fit.suspicious) {
    warn(fmt::format("{}:{}: this row does not fit the others ({}, p = {:.1g}){}", options.matrix, row.line,
                     row.channel, row.p, row.left_out ? "; it is left out" : ""));
  }
  return fit.suspicious.empty() ? kWell : kProblemFound;
}

int run_calibrate(const CalibrateOptions& options) {
  if (!options.matrix.empty()) return calibrate_matrix(options);
  if (options.db.empty()) throw InputError("calibrate: --db FILE is required (or --matrix CSV)");
  return calibrate_campaign(options);
}

/// Refused beside --matrix, which has nothing to do with a campaign.
void add_campaign_options(CLI::App& verb, CalibrateOptions& options, CLI::Option& matrix) {
  verb.add_option("--db", options.db, "Campaign file")->excludes(&matrix);
  verb.add_option("--points", options.points, "CSV of calibration points, in place of those in the file")
      ->excludes(&matrix);
  verb.add_option("--propellers", options.propellers, "CSV of propeller tests, in place of those in the file")
      ->excludes(&matrix);
  verb.add_option("--loss", options.loss, "How much a point far from the line counts")
      ->check(CLI::IsMember({"ordinary", "huber", "cauchy", "tukey"}))
      ->capture_default_str()
      ->excludes(&matrix);
}

/// Refused without --matrix.
void add_matrix_options(CLI::App& verb, CalibrateOptions& options, CLI::Option& matrix) {
  verb.add_option("--forces", options.forces, "Its force columns")->delimiter(',')->needs(&matrix);
  verb.add_option("--readings", options.readings, "Its reading columns, in the same order")
      ->delimiter(',')
      ->needs(&matrix);
  verb.add_option("--force-unit", options.force_unit, "Unit of the forces")
      ->capture_default_str()
      ->needs(&matrix);
  verb.add_option("--zeros", options.zeros,
                  "block: a row without load starts a block with its own zero; common: one zero")
      ->check(CLI::IsMember({"block", "common"}))
      ->capture_default_str()
      ->needs(&matrix);
  verb.add_flag("--diagonal", options.diagonal, "One gain per axis, no crosstalk")->needs(&matrix);
}

}  // namespace

void add_calibrate(CLI::App& app, Work& work) {
  auto options = std::make_shared<CalibrateOptions>();
  CLI::App* verb =
      app.add_subcommand("calibrate", "Fit load cells and propellers; print and store the certificate");
  verb->footer(
      "Exit code 1: the certificate has gates that were not passed, or rows that do not fit the others.\n\n"
      "Examples: tunnelrig calibrate --db my.db\n"
      "          tunnelrig calibrate --db my.db --points calibration.csv --propellers propellers.csv\n"
      "          tunnelrig calibrate --matrix cell3.csv --forces force_x,force_y,force_z --readings "
      "sensor_x,sensor_y,sensor_z --force-unit gf");
  CLI::Option* matrix = verb->add_option(
      "--matrix", options->matrix, "CSV of loads on several axes: fit the crosstalk matrix, nothing else");
  add_campaign_options(*verb, *options, *matrix);
  verb->add_flag("--keep-gross", options->keep_gross, "Do not leave gross errors out of the fit");
  add_matrix_options(*verb, *options, *matrix);
  verb->add_flag("--json", options->json, "Print as JSON");
  verb->callback([options, &work] { work = [options] { return run_calibrate(*options); }; });
}

}  // namespace tunnelrig::cli
