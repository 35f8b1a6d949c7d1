#include "campaigns.h"

#include "analysis/air.h"
#include "analysis/conventions.h"
#include "analysis/run_summary.h"
#include "calibration/certificate.h"
#include "datasets/campaign_folder.h"
#include "datasets/locations.h"
#include "datasets/observations.h"
#include "datasets/published_field.h"
#include "datasets/thesis.h"
#include "support/example_campaign.h"

#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include <fmt/format.h>

namespace tunnelrig::test {
namespace {

constexpr double kTemperature_C = 20;
constexpr std::uint64_t kFrames = 2500;
constexpr double kZero_V = 0.34, kGain_V_per_N = 0.242;  // of the example's calibration points

struct Place {
  std::string label;
  std::optional<TunnelPoint> point;
  double c_t = 0, uneven = 0;
};

std::vector<Place> places(const CampaignParts& parts) {
  std::vector<Place> all;
  for (int h = 0; h < parts.columns; ++h) {
    for (int v = 0; v < parts.rows; ++v) {
      const std::string label =
          h == 0 && v == 0 ? "OT" : fmt::format("H{}V{}", 2 * h, v % 2 == 0 ? v / 2 : -v / 2 - 1);
      const TunnelPoint at = *grid_point(label);
      const double c_t = thesis::kCtTunnelOrigin * (1 + published_thrust_change(at.y_norm, at.z_norm));
      all.push_back({label, parts.tunnel ? std::optional(at) : std::nullopt, c_t,
                     published_uneven_thrust(at.y_norm, at.z_norm)});
    }
  }
  if (parts.open_space) {
    all.push_back({"OS", {}, thesis::kCtOpenSpace, 0});
    for (const double d : {1.0, 2.0, 4.0}) {
      all.push_back({fmt::format("GND{:g}", d), {}, thesis::kCtOpenSpace * published_ground_ratio(d), 0});
      all.push_back({fmt::format("CEIL{:g}", d), {}, thesis::kCtOpenSpace * published_ceiling_ratio(d), 0});
    }
  }
  if (!parts.odd_label.empty()) all.push_back({parts.odd_label, {}, thesis::kCtOpenSpace, 0});
  for (Place& place : all) place.uneven += parts.uneven_offset_percent / 100;
  return all;
}

std::array<double, kMaxRotors> thrusts_N(const Place& place, const CampaignInfo& info, double factor) {
  const double density = dry_air_density_kg_m3(thesis::kPressure_Pa, kTemperature_C + kZeroCelsius_K);
  const double total_N = place.c_t * factor *
                         thesis_reference_thrust_N(density, info.rig.nominal_speed_rpm, info.rig) *
                         info.rig.rotors / kMaxRotors;
  std::array<double, kMaxRotors> thrusts = rotor_shares(place.uneven);
  for (double& thrust : thrusts) thrust *= info.rig.rotors == kMaxRotors ? total_N : total_N * 4 / kMaxRotors;
  return thrusts;
}

/// Counts of a run that lifts these thrusts, with the shaft's line at the nominal speed and some noise.
std::vector<std::byte> counts(const std::array<double, kMaxRotors>& thrusts, const CampaignInfo& info,
                              std::mt19937& engine, bool turning) {
  std::normal_distribution<double> noise_V(0, 0.02);
  std::vector<std::int16_t> samples;
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
    const double turns =
        info.rig.nominal_speed_rpm / 60 * static_cast<double>(frame) / info.daq.sample_rate_hz;
    const double shaft_V = turning ? 0.05 * std::sin(2 * std::numbers::pi * turns) : 0;
    for (const double thrust : thrusts) {
      const double voltage_V = kZero_V + kGain_V_per_N * thrust + shaft_V + noise_V(engine);
      samples.push_back(static_cast<std::int16_t>(std::lround(voltage_V / info.daq.volts_per_count())));
    }
  }
  std::vector<std::byte> data(samples.size() * sizeof(std::int16_t));
  std::memcpy(data.data(), samples.data(), data.size());
  return data;
}

/// The rows of runs.csv and, with them, the raw files.
class Writer {
 public:
  Writer(const std::filesystem::path& folder, const CampaignParts& parts, const CampaignInfo& info)
      : folder_(folder), parts_(parts), info_(info) {
    runs_csv = "run,location,kind,repeat,session,start_utc,raw,y_norm,z_norm,speed_rpm,air_temperature_C";
    if (!parts_.source.empty()) runs_csv += ",source";
    for (int rotor = 1; !parts_.raw_data && rotor <= info_.rig.rotors; ++rotor)
      runs_csv += fmt::format(",thrust_{}_N", rotor);
    runs_csv += "\n";
  }

  void run(const Place& place, bool tare, int repeat) {
    const std::string name = fmt::format("R{:03}", ++number_);
    const auto thrusts =
        tare ? std::array<double, kMaxRotors>{} : thrusts_N(place, info_, 1 + 0.002 * scatter_(engine_));
    const std::string raw = parts_.raw_data ? "raw/" + name + ".npy" : "";
    runs_csv +=
        fmt::format("{},\"{}\",{},{},S{},{},{},{},{},5000,{}", name, place.label, tare ? "tare" : "thrust",
                    repeat, repeat, format_utc(1.7724e9 + 86400 * repeat + 90 * number_), raw,
                    place.point ? fmt::format("{}", place.point->y_norm) : "",
                    place.point ? fmt::format("{}", place.point->z_norm) : "", kTemperature_C);
    if (!parts_.source.empty()) runs_csv += "," + parts_.source;
    for (std::size_t rotor = 0; !parts_.raw_data && rotor < static_cast<std::size_t>(info_.rig.rotors);
         ++rotor)
      runs_csv += fmt::format(",{:.5f}", thrusts[rotor]);
    runs_csv += "\n";
    if (!parts_.raw_data) return;
    write_npy(folder_ / raw, {}, kFrames, counts(thrusts, info_, engine_, !tare));
    if (number_ == 1 && parts_.frames_lost > 0) {
      write_text(folder_ / ("raw/" + name + ".gaps.csv"),
                 fmt::format("first_frame,frames_lost\n100,{}\n", parts_.frames_lost));
    }
  }

  std::string runs_csv;

 private:
  std::filesystem::path folder_;
  const CampaignParts& parts_;
  const CampaignInfo& info_;
  std::mt19937 engine_{20260302};
  std::normal_distribution<double> scatter_;
  int number_ = 0;
};

std::string campaign_toml(const CampaignParts& parts) {
  std::string toml = reference_campaign_toml();
  if (!parts.tunnel) {
    const auto from = toml.find("[tunnel]");
    toml.erase(from, toml.find("[daq]") - from);
  }
  return toml.insert(toml.find("[rig]") + 5, fmt::format("\nrotors = {}", parts.rotors));
}

void store_calibration(CampaignFile& file) {
  const Certificate certificate = calibrate(file.calibration_points(), file.propeller_tests());
  file.add_document("calibration", {"test", "tunnelrig calibrate", R"({"points":"these"})"},
                    to_json(certificate));
}

}  // namespace

void make_campaign(const std::filesystem::path& db, const CampaignParts& parts) {
  std::filesystem::path folder = db;
  folder += ".folder";
  ExampleCampaign texts;
  texts.campaign_toml = campaign_toml(parts);
  if (!parts.raw_data) {
    texts.propellers_csv.clear();
    texts.calibration_csv = "cell,applied_force_N,voltage_V\n";
  }
  texts.write(folder);
  const CampaignInfo info = parse_campaign_toml(texts.campaign_toml, "campaign.toml");
  Writer writer(folder, parts, info);
  for (int session = 1; session <= parts.repeats; ++session) {
    const std::vector<Place> all = places(parts);
    for (const Place& place : all) writer.run(place, false, session);
    if (parts.raw_data && parts.tares) {
      writer.run(all.front(), true, session);
      writer.run(all.back(), true, session);
    }
  }
  write_text(folder / "runs.csv", writer.runs_csv);
  ImportOptions options;
  options.summarizer = [](const CampaignInfo& campaign, const RawFormat& format) {
    return make_run_summarizer(campaign, format);
  };
  import_campaign_folder(folder, db, options);
  CampaignFile file(db, CampaignFile::Access::kWrite);
  if (parts.raw_data && parts.calibrated) store_calibration(file);
}

void make_table(const std::filesystem::path& db, bool with_thrust) {
  const std::string schema = fmt::format(
      "format = \"tunnelrig-table/1\"\nname = \"two propellers\"\ngroups = [\"propeller\"]\n\n[response]\n"
      "column = \"T\"\nunit = \"N\"\nmeaning = \"{}\"\n\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n\n"
      "[propeller]\ndiameter_m = 0.254\n",
      with_thrust ? "thrust_N" : "");
  std::string csv = "propeller,N,T\n";
  for (const auto& [name, c_t] : {std::pair{"<i>thin</i>", 0.09}, std::pair{"wide", 0.12}}) {
    for (const double speed_rpm : {3000.0, 4000.0, 5000.0, 6000.0}) {
      const double thrust_N = c_t * 1.225 * std::pow(speed_rpm / 60, 2) * std::pow(0.254, 4);
      csv += fmt::format("{},{},{:.6f}\n", name, speed_rpm, thrust_N);
    }
  }
  store_table(read_observations(parse_csv(csv, "table.csv"), parse_table_schema(schema, "table.toml")), db,
              false);
}

nlohmann::ordered_json explanation(const std::string& verdict) {
  return nlohmann::ordered_json::parse(
             R"({"format": "tunnelrig-explain/1", "campaign": "c", "response": "thrust",
    "unit": "N", "baseline": "thesis", "verdict": "?", "noise_floor": 0.021, "blocks": 18, "runs": 215,
    "before": {"rmse": 0.06, "held_out_rmse": 0.062, "held_out_ci95": [0.05, 0.08]},
    "after": {"rmse": 0.02, "held_out_rmse": 0.022, "held_out_ci95": [0.018, 0.026]},
    "adopted": [{"effect": "creep", "form": "", "rotor": 2, "p_value": 0.001, "held_out_gain": 0.04,
      "parameters": {"amplitude": {"value": 0.02, "ci95": [0.018, 0.022], "unit": "1", "theory": false}},
      "confounded_with": ["motor_warm_up"],
      "separating_run": {"setting": {}, "location": "OS", "expected_sigma": 4.2, "text": "a run at OS"}}],
    "unknown": [], "untestable": [], "suspect_rows": [], "detectable_at_80_percent_power": 0.01, "warnings": []})")
      .patch({{{"op", "replace"}, {"path", "/verdict"}, {"value", verdict}}});
}

ModelVersion adopted_model() {
  ModelVersion version{.version = 1, .explanation = explanation("explained").dump()};
  version.curves = {
      {.covariate = "air_temperature_C", .low = 10, .high = 30, .coefficients = {0.02}, .centre = {0.5}}};
  version.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-6);
  return version;
}

}  // namespace tunnelrig::test
