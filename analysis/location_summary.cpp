#include "analysis/location_summary.h"

#include "analysis/shared_sources.h"
#include "analysis/unused_conditions.h"
#include "analysis/upper_median.h"
#include "analysis/variance_components.h"
#include "calibration/distributions.h"
#include "datasets/error.h"
#include "datasets/locations.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace tunnelrig {
namespace {

/// Runs sorted into locations and sessions.
struct Grouping {
  std::vector<LocationSummary> locations;
  std::vector<std::size_t> location_of, session_of;  // by index in Reduction::runs
};

/// The place of a location in the order of the tables: columns from the centre, top to bottom, then open
/// space.
std::tuple<int, double, double, std::string> order_of(const LocationSummary& location) {
  if (location.y_norm) return {0, *location.y_norm, -*location.z_norm, location.label};
  for (const auto& [prefix, rank] : {std::pair<const char*, int>{"OS", 1}, {"GND", 2}, {"CEIL", 3}}) {
    if (const auto distance = distance_of(location.label, prefix))
      return {rank, *distance, 0, location.label};
    if (location.label == prefix) return {rank, 0, 0, location.label};
  }
  return {4, 0, 0, location.label};
}

Grouping group(const CampaignData& data, const Reduction& reduction) {
  Grouping grouping;
  std::map<std::string, std::size_t> locations, sessions;
  std::vector<std::string> first_run;
  for (const RunCoefficients& reduced : reduction.runs) {
    const Run& run = data.runs[reduced.run];
    const std::string label = canonical_location(run.location);
    const auto [found, fresh] = locations.emplace(label, grouping.locations.size());
    if (fresh) {
      LocationSummary location;
      location.label = label;
      location.y_norm = run.y_norm;
      location.z_norm = run.z_norm;
      grouping.locations.push_back(location);
      first_run.push_back(run.run);
    }
    const LocationSummary& location = grouping.locations[found->second];
    if (location.y_norm != run.y_norm || location.z_norm != run.z_norm) {
      throw InputError::at("runs.csv", run.line, "run {}: location {} stands elsewhere than in run {}",
                           run.run, label, first_run[found->second]);
    }
    grouping.location_of.push_back(found->second);
    grouping.session_of.push_back(sessions.emplace(run.session, sessions.size()).first->second);
  }
  std::vector<std::size_t> order(grouping.locations.size()), rank(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return order_of(grouping.locations[a]) < order_of(grouping.locations[b]);
  });
  std::vector<LocationSummary> sorted;
  for (std::size_t i = 0; i < order.size(); ++i) {
    rank[order[i]] = i;
    sorted.push_back(grouping.locations[order[i]]);
  }
  grouping.locations = std::move(sorted);
  for (std::size_t& location : grouping.location_of) location = rank[location];
  return grouping;
}

/// Scatter of one quantity: relative for C_T, because what scatters is a factor; absolute for U.
struct Scatter {
  LocationMeans means;
  VarianceComponents components;
};

Scatter scatter_of(const Grouping& grouping, std::vector<double> values, bool relative) {
  GroupedRuns runs{
      .location = grouping.location_of, .session = grouping.session_of, .value = std::move(values)};
  std::vector<double> scale(grouping.locations.size(), 1.0), count(scale.size());
  if (relative) {
    std::fill(scale.begin(), scale.end(), 0);
    for (std::size_t i = 0; i < runs.value.size(); ++i) {
      scale[runs.location[i]] += runs.value[i];
      count[runs.location[i]] += 1;
    }
    for (std::size_t l = 0; l < scale.size(); ++l) scale[l] /= count[l];
  }
  for (std::size_t i = 0; i < runs.value.size(); ++i) runs.value[i] /= scale[runs.location[i]];
  Scatter scatter;
  scatter.components = fit_variance_components(runs);
  scatter.means = location_means(runs, scatter.components);
  for (std::size_t l = 0; l < scale.size(); ++l) {
    const auto row = static_cast<Eigen::Index>(l);
    const double square = scale[l] * scale[l];
    scatter.means.mean[l] *= scale[l];
    scatter.means.std[l] *= scale[l];
    scatter.means.run_part[l] *= square;
    scatter.means.visit_part[l] *= square;
    scatter.means.session_part[l] *= square;
    scatter.means.covariance.row(row) *= scale[l];
    scatter.means.covariance.col(row) *= scale[l];
  }
  return scatter;
}

void note_components(const VarianceComponents& components, const Reduction& reduction, Summary& summary) {
  std::vector<std::string>& notes = summary.notes;
  if (!components.run_known && !components.visit_known) {
    summary.u95_without.emplace_back("repeats");
    const bool noise = std::any_of(reduction.runs.begin(), reduction.runs.end(),
                                   [](const RunCoefficients& run) { return run.c_t_standard_error > 0; });
    notes.emplace_back(noise
                           ? "repeatability: no location was repeated; the noise within runs stands in for it"
                           : "repeatability: no location was repeated and there are no raw data, so how far "
                             "C_T and U scatter is not known");
  }
  if (!components.session_known && !components.run_known && components.visit_known) {
    notes.emplace_back(
        "sessions: what runs and sessions scatter cannot be told apart, and is taken as one, of each visit's "
        "own");
  } else if (!components.session_known) {
    summary.u95_without.emplace_back("sessions");
    notes.emplace_back(
        "sessions: no location was measured in two sessions, so their scatter is left out, and what "
        "stands as U95 holds the truth in less than 95 %; measure one location, such as OT, in every "
        "session");
  }
}

/// What the locations' own scatter is; the noise within runs where repeats tell nothing of it.
double own_variance(double of_means, double noise_variance) {
  return of_means > 0 ? of_means : noise_variance;
}

Eigen::MatrixXd with_noise(Eigen::MatrixXd covariance, const std::vector<double>& noise_variance) {
  for (Eigen::Index l = 0; l < covariance.rows(); ++l)
    covariance(l, l) = own_variance(covariance(l, l), noise_variance[static_cast<std::size_t>(l)]);
  return covariance;
}

/// One quantity at one location from all its parts.
LocationValue combine(const LocationMeans& means, std::size_t l, double noise_variance,
                      const std::vector<SharedSource>& sources, Eigen::MatrixXd SharedSource::*slopes) {
  const auto row = static_cast<Eigen::Index>(l);
  LocationValue value{.mean = means.mean[l], .std = means.std[l]};
  double variance = means.covariance(row, row);
  double over_dof = variance > 0 && std::isfinite(means.dof[l]) ? variance * variance / means.dof[l] : 0;
  variance = own_variance(variance, noise_variance);
  const bool known = variance > 0;  // without repeats and raw data instruments alone would look exact
  for (const SharedSource& source : sources) {
    const Eigen::RowVectorXd slope = (source.*slopes).row(row);
    const double part = slope * source.covariance * slope.transpose();
    variance += part;
    if (source.has_dof()) over_dof += part * part / source.dof;
  }
  value.standard_uncertainty = std::sqrt(variance);
  value.dof = over_dof > 0 ? variance * variance / over_dof
                           : std::numeric_limits<double>::infinity();  // Welch–Satterthwaite
  value.u95 = half_width_95(value.standard_uncertainty, value.dof);
  if (!known) value.standard_uncertainty = value.u95 = std::numeric_limits<double>::quiet_NaN();
  return value;
}

/// Each source's covariance over the root of its degrees of freedom. The locations' own scatter has those of
/// each location.
std::vector<Eigen::MatrixXd> over_root_dof(const LocationMeans& means,
                                           const std::vector<SharedSource>& sources,
                                           Eigen::MatrixXd SharedSource::*slopes) {
  Eigen::VectorXd scale(means.covariance.rows());
  for (Eigen::Index l = 0; l < scale.size(); ++l)
    scale(l) = std::pow(means.dof[static_cast<std::size_t>(l)], -0.25);  // 0 where they are infinite
  std::vector<Eigen::MatrixXd> scaled{scale.asDiagonal() * means.covariance * scale.asDiagonal()};
  for (const SharedSource& source : sources) {
    if (!source.has_dof()) continue;
    scaled.emplace_back(source.*slopes * source.covariance * (source.*slopes).transpose() /
                        std::sqrt(source.dof));
  }
  return scaled;
}

Budget budget_of(const LocationMeans& means, const VarianceComponents& components, std::size_t l,
                 double noise_variance, const std::vector<SharedSource>& sources) {
  Budget budget;
  // Without repeats within a visit, coming back and repeating are one.
  budget.run = std::sqrt(components.run_known     ? means.run_part[l]
                         : components.visit_known ? means.visit_part[l]
                         : noise_variance > 0     ? noise_variance
                                                  : std::numeric_limits<double>::quiet_NaN());
  budget.visit = components.run_known ? std::sqrt(means.visit_part[l]) : 0;
  budget.session = std::sqrt(means.session_part[l]);
  for (const SharedSource& source : sources) {
    const Eigen::RowVectorXd slope = source.c_t.row(static_cast<Eigen::Index>(l));
    const double part = slope * source.covariance * slope.transpose();
    budget.*source.share = std::hypot(budget.*source.share, std::sqrt(part));
  }
  return budget;
}

/// Those that the model holds constant, and how far that moves C_T beside what it is said to be known to.
void note_conditions(const CampaignData& data, const Reduction& reduction, Summary& summary) {
  std::vector<double> u95_percent;
  for (const LocationSummary& location : summary.locations)
    if (std::isfinite(location.c_t.u95)) u95_percent.push_back(100 * location.c_t.u95 / location.c_t.mean);
  for (std::string& note : notes_of_unused_conditions(data, reduction, upper_median(u95_percent)))
    summary.notes.push_back(std::move(note));
}

}  // namespace

Summary summarize_locations(const CampaignData& data, const Reduction& reduction) {
  Summary summary;
  const Grouping grouping = group(data, reduction);
  std::vector<double> c_t, u;
  for (const RunCoefficients& run : reduction.runs) {
    c_t.push_back(run.c_t);
    u.push_back(run.u_percent);
  }
  const Scatter c_t_scatter = scatter_of(grouping, c_t, true);
  const bool has_u = data.info.rig.rotors == kMaxRotors;
  const Scatter u_scatter = has_u ? scatter_of(grouping, u, false) : Scatter{};
  note_components(c_t_scatter.components, reduction, summary);

  const std::vector<SharedSource> sources =
      shared_sources(data, reduction, grouping.location_of, c_t_scatter.means.mean, summary.notes);

  summary.locations = grouping.locations;
  std::vector<double> noise_c_t(summary.locations.size()), noise_u(summary.locations.size());
  for (LocationSummary& location : summary.locations)
    location.c_rotor.assign(static_cast<std::size_t>(data.info.rig.rotors), 0);
  for (std::size_t i = 0; i < reduction.runs.size(); ++i) {
    const std::size_t l = grouping.location_of[i];
    const RunCoefficients& run = reduction.runs[i];
    const auto n = static_cast<double>(c_t_scatter.means.runs[l]);
    noise_c_t[l] += run.c_t_standard_error * run.c_t_standard_error / (n * n);
    noise_u[l] += run.u_standard_error * run.u_standard_error / (n * n);
    LocationSummary& location = summary.locations[l];
    location.thrust_N += run.total_N / n;
    for (std::size_t rotor = 0; rotor < location.c_rotor.size(); ++rotor) {
      location.c_rotor[rotor] += run.thrust_N[rotor] / run.total_N * run.c_t / n;
    }
  }
  for (std::size_t l = 0; l < summary.locations.size(); ++l) {
    LocationSummary& location = summary.locations[l];
    location.runs = c_t_scatter.means.runs[l];
    location.sessions = c_t_scatter.means.sessions[l];
    location.c_t = combine(c_t_scatter.means, l, noise_c_t[l], sources, &SharedSource::c_t);
    if (has_u) location.u_percent = combine(u_scatter.means, l, noise_u[l], sources, &SharedSource::u);
    location.budget = budget_of(c_t_scatter.means, c_t_scatter.components, l, noise_c_t[l], sources);
  }
  summary.c_t_covariance = with_noise(c_t_scatter.means.covariance, noise_c_t);
  summary.u_covariance = has_u ? with_noise(u_scatter.means.covariance, noise_u) : Eigen::MatrixXd(0, 0);
  summary.c_t_over_root_dof = over_root_dof(c_t_scatter.means, sources, &SharedSource::c_t);
  if (has_u) summary.u_over_root_dof = over_root_dof(u_scatter.means, sources, &SharedSource::u);
  for (const SharedSource& source : sources) {
    summary.c_t_covariance += source.c_t * source.covariance * source.c_t.transpose();
    if (has_u) summary.u_covariance += source.u * source.covariance * source.u.transpose();
  }
  note_conditions(data, reduction, summary);
  return summary;
}

}  // namespace tunnelrig
