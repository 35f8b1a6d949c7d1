// Coefficients of runs and locations with their uncertainty, and the maps.
#include "analysis/exports/table_builder.h"
#include "analysis/exports/tables.h"

#include <limits>

namespace tunnelrig::exports {
namespace {

struct BudgetColumn {
  const char* name;
  const char* meaning;
  double Budget::*value;
};
constexpr BudgetColumn kBudgetColumns[] = {
    {"c_t_u_run", "repeatability", &Budget::run},
    {"c_t_u_visit", "coming back to the location", &Budget::visit},
    {"c_t_u_session", "from one set-up of the rig to the next", &Budget::session},
    {"c_t_u_calibration", "calibration of the cells", &Budget::calibration},
    {"c_t_u_propellers", "factors of the propellers", &Budget::propellers},
    {"c_t_u_tare", "tares", &Budget::tare},
    {"c_t_u_speed", "tachometer", &Budget::speed},
    {"c_t_u_temperature", "thermometer", &Budget::temperature},
    {"c_t_u_pressure", "barometer", &Budget::pressure},
    {"c_t_u_model", "parameters of adopted effects", &Budget::model}};

Table run_coefficients(const CampaignData& data, const Reduction& reduction) {
  using Reduced = const RunCoefficients&;
  const auto of_run = [&data](auto member) {
    return [&data, member](Reduced r) { return data.runs[r.run].*member; };
  };
  // The noise of thrusts that stand in the row is not known.
  const auto of_noise = [](double RunCoefficients::*error) {
    return [error](Reduced r) { return r.from_volts ? r.*error : std::numeric_limits<double>::quiet_NaN(); };
  };
  TableBuilder<RunCoefficients> table(
      "run_coefficients", "One row per thrust run that was reduced; docs/reduction.md", reduction.runs);
  table.column("run", "", "Name of the run", of_run(&Run::run))
      .column("location", "", "Where it was flown", of_run(&Run::location))
      .column("repeat", "1", "Number of the repeat", of_run(&Run::repeat))
      .column("session", "", "One set-up of the rig on one day", of_run(&Run::session))
      .column("c_t", "1", "Thrust coefficient, the thesis's (4.18)", &RunCoefficients::c_t)
      .column("c_t_standard_error", "1", "From the run's noise alone",
              of_noise(&RunCoefficients::c_t_standard_error))
      .column("u_percent", "Uneven thrust (5.1); not known for fewer than four rotors",
              &RunCoefficients::u_percent)
      .column("u_standard_error_percent", "From the run's noise alone",
              of_noise(&RunCoefficients::u_standard_error))
      .column("total_N", "Sum of the thrusts", &RunCoefficients::total_N);
  for (std::size_t i = 0; i < static_cast<std::size_t>(data.info.rig.rotors); ++i) {
    table.column(fmt::format("thrust_{}_N", i + 1),
                 fmt::format("Mean thrust of rotor {}, corrected by the model", i + 1),
                 [i](Reduced r) { return r.thrust_N[i]; });
    table.column(
        fmt::format("thrust_{}_standard_error_N", i + 1), "From the run's noise alone", [i](Reduced r) {
          return r.from_volts ? r.thrust_standard_error_N[i] : std::numeric_limits<double>::quiet_NaN();
        });
  }
  return table.column("density_kg_m3", "Of the air", &RunCoefficients::density_kg_m3)
      .column("speed_rpm", "Of the rotors, as the model takes it", &RunCoefficients::speed_rpm)
      .column("temperature_K", "Of the air", &RunCoefficients::temperature_K)
      .column("stationary", "1", "1: no drift beyond what noise explains", &RunCoefficients::stationary)
      .column("clipped", "1", "Samples at an end of the converter's range", &RunCoefficients::clipped)
      .column("zero_from_calibration", "1", "1: no tare; the zero is the calibration's",
              &RunCoefficients::zero_from_calibration)
      .column("extrapolated", "1", "1: beyond the forces of the calibration", &RunCoefficients::extrapolated)
      .take();
}

Table left_out(const Reduction& reduction) {
  return TableBuilder("left_out", "Thrust runs without coefficients, and tares that are no zeros",
                      reduction.left_out)
      .column("run", "", "Name of the run", &LeftOutRun::run)
      .column("reason", "", "Why it was not reduced", &LeftOutRun::reason)
      .column("problem", "1", "1: it needs mending", &LeftOutRun::problem)
      .take();
}

void add_value(TableBuilder<LocationSummary>& table, const std::string& name, const std::string& ending,
               const std::string& unit, LocationValue LocationSummary::*value) {
  const auto of = [value](double LocationValue::*member) {
    return [value, member](const LocationSummary& l) { return (l.*value).*member; };
  };
  table.column(name + ending, unit, "Mean over the runs", of(&LocationValue::mean))
      .column(name + "_std" + ending, unit, "Standard deviation over the runs", of(&LocationValue::std))
      .column(name + "_standard_uncertainty" + ending, unit, "Of the mean, all sources (k = 1)",
              of(&LocationValue::standard_uncertainty))
      .column(name + "_dof", "1", "Its effective degrees of freedom", of(&LocationValue::dof))
      .column(name + "_u95" + ending, unit, "Half of the 95 % interval", of(&LocationValue::u95));
}

Table locations(const CampaignData& data, const Summary& summary) {
  TableBuilder<LocationSummary> table("locations", "One row per location; docs/reduction.md",
                                      summary.locations);
  table.column("location", "", "Label", &LocationSummary::label)
      .column("y_norm", "Normalised tunnel coordinate, right is positive", &LocationSummary::y_norm)
      .column("z_norm", "Normalised tunnel coordinate, up is positive", &LocationSummary::z_norm)
      .column("runs", "1", "Runs that were reduced", &LocationSummary::runs)
      .column("sessions", "1", "Sessions that they come from", &LocationSummary::sessions)
      .column("thrust_N", "Mean total thrust", &LocationSummary::thrust_N);
  add_value(table, "c_t", "", "1", &LocationSummary::c_t);
  if (data.info.rig.rotors == kMaxRotors) add_value(table, "u", "_percent", "%", &LocationSummary::u_percent);
  for (std::size_t i = 0; i < static_cast<std::size_t>(data.info.rig.rotors); ++i) {
    table.column(fmt::format("c_rotor_{}", i + 1), "1", fmt::format("C_T of rotor {} alone", i + 1),
                 [i](const LocationSummary& l) { return l.c_rotor[i]; });
  }
  for (const BudgetColumn& part : kBudgetColumns) {
    table.column(part.name, "1", fmt::format("Standard uncertainty of C_T from: {}", part.meaning),
                 [&part](const LocationSummary& l) { return l.budget.*part.value; });
  }
  return table.take();
}

Array matrix_array(std::string name, std::string unit, std::string meaning, const Eigen::MatrixXd& matrix) {
  Array array{std::move(name),
              std::move(unit),
              std::move(meaning),
              {static_cast<std::size_t>(matrix.rows()), static_cast<std::size_t>(matrix.cols())},
              {}};
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) array.values.push_back(matrix(i, j));
  return array;
}

Array axis_array(std::string name, std::string meaning, const std::vector<double>& values) {
  return {std::move(name), "1", std::move(meaning), {values.size()}, values};
}

}  // namespace

std::vector<Table> coefficient_tables(const CampaignData& data, const Reduction& reduction,
                                      const Summary& summary) {
  return {run_coefficients(data, reduction), left_out(reduction), locations(data, summary)};
}

ArrayGroup covariance_group(const Summary& summary) {
  ArrayGroup group{"covariance", "Between the rows of `locations`, all sources of uncertainty", {}};
  group.arrays.push_back(matrix_array("c_t", "1", "Covariance of C_T", summary.c_t_covariance));
  if (summary.u_covariance.size() > 0)
    group.arrays.push_back(matrix_array("u_percent2", "%^2", "Covariance of U", summary.u_covariance));
  return group;
}

Table map_locations_table(const DisturbanceMap& map) {
  return TableBuilder("map_locations", "The measured locations beneath the maps", map.locations)
      .column("location", "", "Label", &MeasuredLocation::label)
      .column("y_norm", "Normalised tunnel coordinate, right is positive", &MeasuredLocation::y_norm)
      .column("z_norm", "Normalised tunnel coordinate, up is positive", &MeasuredLocation::z_norm)
      .column("delta_ct_percent", "Change of C_T against OT", &MeasuredLocation::delta_ct_percent)
      .column("delta_ct_u95_percent", "Half of its 95 % interval", &MeasuredLocation::delta_ct_u95_percent)
      .column("uneven_thrust_percent", "U (5.1); negative rolls to the right",
              &MeasuredLocation::uneven_thrust_percent)
      .column("uneven_thrust_u95_percent", "Half of its 95 % interval",
              &MeasuredLocation::uneven_thrust_u95_percent)
      .take();
}

ArrayGroup map_group(const DisturbanceMap& map) {
  const MapGrid& grid = map.grid;
  const auto layer = [&](const char* name, const char* meaning, const std::vector<double>& values) {
    return Array{name, "%", meaning, {grid.z_norm.size(), grid.y_norm.size()}, values};
  };
  return {"map",
          "Disturbance maps; row i is at z_norm i, column j at y_norm j; docs/maps.md",
          {axis_array("y_norm", "Of the columns; -1 left wall, 1 right wall", grid.y_norm),
           axis_array("z_norm", "Of the rows; -1 ground, 1 ceiling", grid.z_norm),
           layer("delta_ct_percent", "Change of C_T against OT", map.delta_ct.value_percent),
           layer("delta_ct_u95_percent", "Half of its 95 % interval", map.delta_ct.u95_percent),
           layer("uneven_thrust_percent", "U (5.1); negative rolls to the right",
                 map.uneven_thrust.value_percent),
           layer("uneven_thrust_u95_percent", "Half of its 95 % interval", map.uneven_thrust.u95_percent)}};
}

ArrayGroup model_covariance_group(const std::vector<StoredModel>& models) {
  ArrayGroup group{"model_covariance",
                   "Between the parameters of each version of the model, in the order of `model_parameters`",
                   {}};
  for (const StoredModel& stored : models) {
    group.arrays.push_back(matrix_array(fmt::format("version_{}", stored.model.version), "",
                                        "Covariance; units are the products of the parameters' units",
                                        stored.model.covariance));
  }
  return group;
}

}  // namespace tunnelrig::exports
