// What turns volts into newtons and newtons into forces: the certificate, adopted effects, and where all of
// it came from.
#include "analysis/exports/table_builder.h"
#include "analysis/exports/tables.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig::exports {
namespace {

constexpr const char* kKinds[] = {"calibration", "reduction", "map", "model"};

struct CellRow {
  const CellFit* cell;
  const PropellerFactors* propellers;

  std::size_t index() const { return static_cast<std::size_t>(cell->cell - 1); }
  double factor() const { return propellers->factor(cell->cell - 1); }
  std::optional<double> factor_uncertainty() const {
    if (!propellers->uncertainty_known()) return {};
    return propellers->tested ? std::sqrt(propellers->covariance(cell->cell - 1, cell->cell - 1)) : 0;
  }
  std::string propeller() const { return propellers->tested ? propellers->propellers[index()] : ""; }
};

Table cells(const Certificate& certificate) {
  std::vector<CellRow> rows;
  for (const CellFit& cell : certificate.cells) rows.push_back({&cell, &certificate.propellers});
  using Row = const CellRow&;
  return TableBuilder("calibration_cells", "voltage = zero + gain * force, one row per load cell", rows)
      .column("cell", "1", "Of rotor 1, 2, ...", [](Row r) { return r.cell->cell; })
      .column("zero_V", "Voltage without force", [](Row r) { return r.cell->zero_V; })
      .column("zero_u95_V", "Half of its 95 % interval", [](Row r) { return r.cell->zero_u95_V(); })
      .column("gain_V_per_N", "Voltage per force", [](Row r) { return r.cell->gain_V_per_N; })
      .column("gain_u95_V_per_N", "Half of its 95 % interval",
              [](Row r) { return r.cell->gain_u95_V_per_N(); })
      .column("zero_variance_V2", "V^2", "Of the fit", [](Row r) { return r.cell->covariance(0, 0); })
      .column("zero_gain_covariance_V2_per_N", "V^2/N", "Of the fit",
              [](Row r) { return r.cell->covariance(0, 1); })
      .column("gain_variance_V2_per_N2", "V^2/N^2", "Of the fit",
              [](Row r) { return r.cell->covariance(1, 1); })
      .column("dof", "1", "Degrees of freedom of these variances", [](Row r) { return r.cell->dof; })
      .column("residual_std_N", "Of the points about the line",
              [](Row r) { return r.cell->residual_std_N(); })
      .column("correlation", "1", "Of voltage and force", [](Row r) { return r.cell->correlation; })
      .column("lowest_force_N", "Of the points", [](Row r) { return r.cell->lowest_force_N; })
      .column("highest_force_N", "Of the points", [](Row r) { return r.cell->highest_force_N; })
      .column("propeller", "", "Mounted on this rotor", &CellRow::propeller)
      .column("propeller_factor", "1", "Thrusts are divided by it", &CellRow::factor)
      .column("propeller_factor_standard_uncertainty", "1", "Not known without repeats",
              &CellRow::factor_uncertainty)
      .take();
}

struct PointRow {
  int cell;
  const CellPoint* point;
};

Table points(const Certificate& certificate) {
  std::vector<PointRow> rows;
  for (const CellFit& cell : certificate.cells)
    for (const CellPoint& point : cell.points) rows.push_back({cell.cell, &point});
  const auto of = [](auto member) { return [member](const PointRow& r) { return r.point->*member; }; };
  return TableBuilder("calibration_points", "The points beside their lines; docs/calibration.md", rows)
      .column("cell", "1", "Of rotor 1, 2, ...", &PointRow::cell)
      .column("line", "1", "Of calibration.csv", of(&CellPoint::line))
      .column("force_N", "Applied", of(&CellPoint::force_N))
      .column("voltage_V", "Read", of(&CellPoint::voltage_V))
      .column("residual_N", "Force that the line gives for the voltage, minus the force",
              of(&CellPoint::residual_N))
      .column("leverage", "1", "0 to 1", of(&CellPoint::leverage))
      .column("studentised", "1", "Residual from the line without the point, over its deviation",
              of(&CellPoint::studentised))
      .column("p", "1", "Of that, Bonferroni", of(&CellPoint::p))
      .column("weight", "1", "That the fit gave it; 0: left out", of(&CellPoint::weight))
      .column("suspicious", "1", "1: does not fit the others", of(&CellPoint::suspicious))
      .column("gross", "1", "1: by far", of(&CellPoint::gross))
      .take();
}

Table gates(const Certificate& certificate) {
  return TableBuilder("calibration_gates", "What the certificate demands of each cell", certificate.gates)
      .column("cell", "1", "Of rotor 1, 2, ...", &CalibrationGate::cell)
      .column("gate", "", "What is asked", &CalibrationGate::name)
      .column("passed", "1", "1: it is so", &CalibrationGate::passed)
      .column("finding", "", "What was found, and the limit", &CalibrationGate::finding)
      .take();
}

/// One parameter of one version, in the order of its covariance.
struct ParameterRow {
  int version = 0;
  std::string effect, parameter, unit, first_run;
  int rotor = 0, other = 0;  // from 1; 0: all, none
  double value = 0, standard_uncertainty = 0;
  bool at_theory = false, empirical = false;
};

std::vector<ParameterRow> parameter_rows(const ModelVersion& model) {
  std::vector<ParameterRow> rows;
  for (const ModelTerm& term : model.terms) {
    for (std::size_t k = 0; k < term.parameters.size(); ++k) {
      rows.push_back({.version = model.version,
                      .effect = term.label(),
                      .parameter = term.effect->parameters[k].name,
                      .unit = term.units[k],
                      .first_run = term.first_run,
                      .rotor = term.rotor + 1,
                      .other = term.other + 1,
                      .value = term.parameters[k],
                      .at_theory = term.at_theory});
    }
  }
  for (const ModelCurve& curve : model.curves) {
    for (std::size_t k = 0; k < curve.coefficients.size(); ++k) {
      rows.push_back({.version = model.version,
                      .effect = curve.label(),
                      .parameter = fmt::format("coefficient_{}", k + 1),
                      .rotor = curve.rotor + 1,
                      .value = curve.coefficients[k],
                      .empirical = true});
    }
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    rows[k].standard_uncertainty = std::sqrt(model.covariance(i, i));
  }
  return rows;
}

}  // namespace

std::vector<Table> calibration_tables(const Certificate& certificate) {
  return {cells(certificate), points(certificate), gates(certificate)};
}

std::vector<Table> model_tables(const std::vector<StoredModel>& models) {
  std::vector<ParameterRow> parameters;
  for (const StoredModel& stored : models) {
    for (ParameterRow& row : parameter_rows(stored.model)) parameters.push_back(std::move(row));
  }
  const auto of = [](auto member) { return [member](const StoredModel& s) { return s.model.*member; }; };
  Table versions =
      TableBuilder("models", "Versions of the model that were adopted, oldest first", models)
          .column("version", "1", "1 is the first after the thesis's", of(&ModelVersion::version))
          .column("parent", "1", "Version that it was found on; 0: the thesis's", of(&ModelVersion::parent))
          .column("created_utc", "", "When it was adopted, ISO 8601", &StoredModel::created_utc)
          .column("baseline", "", "Of the explanation", of(&ModelVersion::baseline))
          .column("multiplicative", "1", "1: effects multiply; 0: they add",
                  of(&ModelVersion::multiplicative))
          .column("effects", "", "What it holds, in words",
                  [](const StoredModel& s) { return fmt::format("{}", fmt::join(s.model.effects(), ", ")); })
          .column("dof", "1", "Degrees of freedom of its covariance", of(&ModelVersion::dof))
          .column("arguments", "", "Command that adopted it",
                  [](const StoredModel& s) { return s.provenance.arguments; })
          .take();
  Table rows = TableBuilder("model_parameters", "One row per parameter of each version", parameters)
                   .column("version", "1", "Of the model", &ParameterRow::version)
                   .column("effect", "", "In words; formulas are in docs/effects.md", &ParameterRow::effect)
                   .column("parameter", "", "Its name", &ParameterRow::parameter)
                   .column("value", "", "In the unit of column `unit`", &ParameterRow::value)
                   .column("standard_uncertainty", "", "k = 1; 0 where theory gives the value",
                           &ParameterRow::standard_uncertainty)
                   .column("unit", "", "Of value and uncertainty", &ParameterRow::unit)
                   .column("rotor", "1", "0: all alike", &ParameterRow::rotor)
                   .column("other", "1", "Crosstalk: the rotor that leaks in; 0: none", &ParameterRow::other)
                   .column("at_theory", "1", "1: known physics gives the value", &ParameterRow::at_theory)
                   .column("empirical", "1", "1: a curve without a name", &ParameterRow::empirical)
                   .column("first_run", "", "Where the effect begins at a run", &ParameterRow::first_run)
                   .take();
  return {std::move(versions), std::move(rows)};
}

Table documents_table(const CampaignFile& file) {
  std::vector<tunnelrig::Document> documents;
  std::vector<std::int64_t> newest;
  for (const char* kind : kKinds) {
    for (tunnelrig::Document& document : file.documents(kind)) {
      document.json.clear();
      documents.push_back(std::move(document));
    }
    if (!documents.empty()) newest.push_back(documents.back().id);
  }
  std::sort(documents.begin(), documents.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  using Row = const tunnelrig::Document&;
  return TableBuilder("documents", "Everything that was derived, and from what", documents)
      .column("id", "1", "In the campaign file", &tunnelrig::Document::id)
      .column("kind", "", "calibration, reduction, map, model", &tunnelrig::Document::kind)
      .column("in_force", "1", "1: the newest of its kind",
              [&](Row d) { return std::find(newest.begin(), newest.end(), d.id) != newest.end(); })
      .column("created_utc", "", "ISO 8601", &tunnelrig::Document::created_utc)
      .column("program_version", "", "That made it", [](Row d) { return d.provenance.program_version; })
      .column("arguments", "", "Command that made it", [](Row d) { return d.provenance.arguments; })
      .column("inputs", "", "JSON: ids and hashes of what it depends on",
              [](Row d) { return d.provenance.inputs; })
      .take();
}

std::vector<Attachment> documents_in_force(const CampaignFile& file) {
  std::vector<Attachment> documents{{"campaign", "toml", file.text("campaign.toml").value_or("")}};
  for (const char* kind : kKinds) {
    if (std::string_view(kind) == "model") {
      for (const tunnelrig::Document& document : file.documents(kind))
        documents.push_back({fmt::format("{}_{}", kind, document.id), "json", document.json});
    } else if (const auto document = file.newest_document(kind)) {
      documents.push_back({fmt::format("{}_{}", kind, document->id), "json", document->json});
    }
  }
  return documents;
}

}  // namespace tunnelrig::exports
