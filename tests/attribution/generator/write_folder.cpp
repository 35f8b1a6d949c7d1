#include "attribution/generator/campaign.h"
#include "attribution/generator/raw_runs.h"
#include "datasets/campaign.h"
#include "datasets/error.h"

#include <functional>

#include <fmt/format.h>

namespace tunnelrig::attribution {
namespace {

namespace fs = std::filesystem;

struct Column {
  std::string name;
  std::function<std::string(const Conditions&)> cell;
};

/// A quantity of runs.csv, with `digits` behind the point.
Column column(const char* name, double Conditions::*value, int digits) {
  return {name,
          [value, digits](const Conditions& run) { return fmt::format("{:.{}f}", run.*value, digits); }};
}

Column distance(const char* name, double Conditions::*value) {
  return {name, [value](const Conditions& run) {
            return run.*value < kFar_R ? fmt::format("{:g}", run.*value) : std::string();
          }};
}

std::vector<Column> covariates(const Campaign& campaign) {
  std::vector<Column> all = {column("speed_rpm", &Conditions::speed_rpm, 2),
                             column("air_temperature_C", &Conditions::air_temperature_C, 2),
                             column("air_pressure_Pa", &Conditions::air_pressure_Pa, 1),
                             column("relative_humidity", &Conditions::relative_humidity, 4),
                             column("supply_voltage_V", &Conditions::supply_voltage_V, 4),
                             column("tunnel_airspeed_m_s", &Conditions::tunnel_airspeed_m_s, 4),
                             column("cell_temperature_C", &Conditions::cell_temperature_C, 2),
                             column("time_since_motor_start_s", &Conditions::time_since_motor_start_s, 0),
                             column("time_of_day_h", &Conditions::time_of_day_h, 4),
                             column("cable_slack_mm", &Conditions::cable_slack_mm, 1)};
  if (campaign.open_space) {
    all.push_back(distance("ground_distance_R", &Conditions::ground_distance_R));
    all.push_back(distance("ceiling_distance_R", &Conditions::ceiling_distance_R));
  }
  if (campaign.settings.switches) {
    all.push_back(column("fan_on", &Conditions::fan_on, 0));
    all.push_back({"blade_set", [](const Conditions& run) { return std::string(1, "ABC"[run.blade_set]); }});
  }
  std::erase_if(all, [&](const Column& one) {
    const auto& hidden = campaign.truth.unrecorded;
    return std::find(hidden.begin(), hidden.end(), one.name) != hidden.end();
  });
  return all;
}

std::string runs_csv(const Campaign& campaign) {
  const std::vector<Column> columns = covariates(campaign);
  std::string text = "run,location,repeat,session,start_utc,raw";
  for (const Column& one : columns) text += "," + one.name;
  const bool raw = campaign.settings.raw;
  if (!raw) text += ",thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N";
  text += "\n";
  Random random(campaign.settings.seed, "missing cells");
  // what is forgotten is one instrument's reading for some runs; temperature is needed for every run
  const std::size_t forgotten = 2 + random.below(columns.size() - 2);
  for (std::size_t i = 0; i < campaign.world.runs.size(); ++i) {
    const Conditions& run = campaign.world.runs[i];
    const std::string name = fmt::format("R{:04}", i + 1);
    text += fmt::format("{},{},{},S{:02},{},{}", name, run.location, run.repeat, run.session + 1,
                        format_utc(run.start_s), raw ? fmt::format("raw/{}.npy", name) : "");
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const bool missing = campaign.settings.missing_cells && c == forgotten && random.chance(0.08);
      text += "," + (missing ? std::string() : columns[c].cell(run));
    }
    if (!raw) {
      for (const double thrust_N : campaign.measured_N[i]) text += fmt::format(",{:.6f}", thrust_N);
    }
    text += "\n";
  }
  return text;
}

/// Cells of one gain with a gauge's scatter; reduced thrusts do not need them, `calibrate` does.
std::string calibration_csv(const Campaign& campaign) {
  Random random(campaign.settings.seed, "calibration");
  std::string text = "cell,sequence,applied_force_N,voltage_V\n";
  for (int cell = 1; cell <= static_cast<int>(kRotors); ++cell) {
    for (int point = 1; point <= 12; ++point) {
      const double force_N = 2 + 8.0 / 11 * ((point * 5) % 12);
      text += fmt::format("{},{},{:.4f},{:.6f}\n", cell, point, force_N,
                          kZero_V + kGain_V_N * force_N + random.normal(0.0008));
    }
  }
  return text;
}

std::string campaign_toml(const Campaign& campaign) {
  std::string text = reference_campaign_toml();
  const std::string name = "static thrust in the 1.5 m tunnel";
  text.replace(text.find(name), name.size(), fmt::format("generated campaign {}", campaign.settings.seed));
  if (campaign.open_space) {
    const auto tunnel = text.find("[tunnel]");
    text.erase(tunnel, text.find("[daq]") - tunnel);
  }
  return text;
}

}  // namespace

void write_folder(const Campaign& campaign, const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error))
    throw InputError::in(folder.string(), "is there already; name another folder");
  fs::create_directories(folder, error);
  if (error) throw InputError::in(folder.string(), "cannot be made: {}", error.message());
  write_text(folder / "campaign.toml", campaign_toml(campaign));
  write_text(folder / "calibration.csv", calibration_csv(campaign));
  write_text(folder / "runs.csv", runs_csv(campaign));
  if (campaign.settings.raw) write_raw_runs(campaign, folder);
}

}  // namespace tunnelrig::attribution
