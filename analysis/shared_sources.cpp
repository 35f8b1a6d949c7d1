#include "analysis/shared_sources.h"

#include "analysis/autocorrelation.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

/// Where each run of a reduction was measured.
struct Places {
  const std::vector<std::size_t>& location_of;
  Eigen::Index count;
};

/// Averages, over the runs of each location, of how C_T and U depend on `parameters` values; `slopes` gives
/// them run by run.
template <typename Slopes>
SharedSource shared_source(double Budget::*share, const Places& places, const Reduction& reduction,
                           const Rig& rig, const Eigen::MatrixXd& covariance, double dof,
                           const Slopes& slopes) {
  SharedSource source{share, covariance, dof, Eigen::MatrixXd::Zero(places.count, covariance.rows()),
                      Eigen::MatrixXd::Zero(places.count, covariance.rows())};
  std::vector<double> count(static_cast<std::size_t>(places.count));
  for (std::size_t i = 0; i < reduction.runs.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(places.location_of[i]);
    const auto c_t = c_t_per_thrust(reduction.runs[i], rig);
    const auto u = u_per_thrust(reduction.runs[i]);
    // thrust slopes: rotors × parameters
    const Eigen::MatrixXd thrust = slopes(reduction.runs[i]);
    for (Eigen::Index rotor = 0; rotor < thrust.rows(); ++rotor) {
      source.c_t.row(row) += c_t[static_cast<std::size_t>(rotor)] * thrust.row(rotor);
      source.u.row(row) += u[static_cast<std::size_t>(rotor)] * thrust.row(rotor);
    }
    count[places.location_of[i]] += 1;
  }
  for (Eigen::Index l = 0; l < places.count; ++l) {
    source.c_t.row(l) /= count[static_cast<std::size_t>(l)];
    source.u.row(l) /= count[static_cast<std::size_t>(l)];
  }
  return source;
}

/// One source per cell: their calibrations are independent, each with its own degrees of freedom.
void add_calibration(const CampaignData& data, const Places& places, const Reduction& reduction,
                     std::vector<SharedSource>& sources) {
  for (int rotor = 0; data.certificate && rotor < data.info.rig.rotors; ++rotor) {
    const CellFit& cell = data.certificate->cells[static_cast<std::size_t>(rotor)];
    sources.push_back(shared_source(&Budget::calibration, places, reduction, data.info.rig, cell.covariance,
                                    cell.dof, [&](const RunCoefficients& run) {
                                      Eigen::MatrixXd slope = Eigen::MatrixXd::Zero(data.info.rig.rotors, 2);
                                      slope(rotor, 0) = run.d_zero_N_per_V[static_cast<std::size_t>(rotor)];
                                      slope(rotor, 1) = run.d_gain_N2_per_V[static_cast<std::size_t>(rotor)];
                                      return slope;
                                    }));
  }
}

void add_propellers(const CampaignData& data, const Places& places, const Reduction& reduction,
                    std::vector<SharedSource>& sources) {
  if (!data.certificate || !data.certificate->propellers.tested || data.certificate->propellers.dof == 0)
    return;
  const PropellerFactors& propellers = data.certificate->propellers;
  sources.push_back(shared_source(&Budget::propellers, places, reduction, data.info.rig,
                                  propellers.covariance, propellers.dof, [&](const RunCoefficients& run) {
                                    Eigen::MatrixXd slope =
                                        Eigen::MatrixXd::Zero(data.info.rig.rotors, data.info.rig.rotors);
                                    for (Eigen::Index i = 0; run.from_volts && i < slope.rows(); ++i) {
                                      slope(i, i) =
                                          -run.thrust_N[static_cast<std::size_t>(i)] / propellers.factor(i);
                                    }
                                    return slope;
                                  }));
}

/// How well a channel's mean of a tare is known, from the windows that are stored of it; the standard error's
/// variance is that of the whole run's blocks, and as much larger as slow noise makes it.
MeanKnowledge knowledge_of_tare(const CampaignData& data, const TareReading& tare, std::size_t channel) {
  constexpr double kUnknownDof = 50;  // of statistics without windows
  const RunStatistics& statistics = data.statistics.at(tare.run);
  const std::size_t channels = statistics.channels.size();
  std::vector<double> windows;
  for (std::size_t i = channel; i < statistics.window_means_V.size(); i += channels)
    if (std::isfinite(statistics.window_means_V[i])) windows.push_back(statistics.window_means_V[i]);
  const double square = tare.standard_error_V[channel] * tare.standard_error_V[channel];
  constexpr std::size_t kFewWindows = 8;
  const double plain = variance_of_mean(windows);
  if (windows.size() < kFewWindows || !(plain > 0)) return {square, kUnknownDof};
  const MeanKnowledge known = knowledge_of_mean(windows);
  return {square * known.variance / plain, known.dof};
}

/// One source per channel, whose parameters are the tares. How the zero wanders between them is the runs' own
/// and in their scatter.
void add_tares(const CampaignData& data, const Places& places, const Reduction& reduction,
               std::vector<SharedSource>& sources) {
  const auto& tares = reduction.tares.readings();
  if (tares.empty()) return;
  for (int rotor = 0; rotor < data.info.rig.rotors; ++rotor) {
    const auto channel = static_cast<std::size_t>(rotor);
    Eigen::VectorXd variance(static_cast<Eigen::Index>(tares.size()));
    double over_dof = 0;  // mean of 1/ν
    for (std::size_t t = 0; t < tares.size(); ++t) {
      const MeanKnowledge known = knowledge_of_tare(data, tares[t], channel);
      variance(static_cast<Eigen::Index>(t)) = known.variance;
      over_dof += 1 / known.dof / static_cast<double>(tares.size());
    }
    sources.push_back(shared_source(&Budget::tare, places, reduction, data.info.rig, variance.asDiagonal(),
                                    1 / over_dof, [&](const RunCoefficients& run) {
                                      Eigen::MatrixXd slope =
                                          Eigen::MatrixXd::Zero(data.info.rig.rotors, variance.size());
                                      if (!run.tare) return slope;
                                      for (const TareZero::Weight& weight : run.tare->weights) {
                                        slope(rotor, static_cast<Eigen::Index>(weight.tare)) =
                                            run.d_tare_N_per_V[channel] * weight.weight;
                                      }
                                      return slope;
                                    }));
  }
}

/// The adopted effects' parameters, to first order.
void add_model(const CampaignData& data, const Places& places, const Reduction& reduction,
               std::vector<SharedSource>& sources) {
  const AppliedModel& model = reduction.model;
  if (model.covariance.size() == 0) return;
  sources.push_back(shared_source(
      &Budget::model, places, reduction, data.info.rig, model.covariance, model.dof,
      [&](const RunCoefficients& run) {
        Eigen::MatrixXd slope = Eigen::MatrixXd::Zero(data.info.rig.rotors, model.covariance.rows());
        for (Eigen::Index rotor = 0; rotor < slope.rows(); ++rotor)
          for (Eigen::Index k = 0; k < slope.cols(); ++k)
            slope(rotor, k) = run.d_parameter_N[static_cast<std::size_t>(k)][static_cast<std::size_t>(rotor)];
        return slope;
      }));
}

/// An instrument's own error is the same in every run, so that repeats do not show it: C_T changes by
/// `relative` of itself, U not.
void add_instrument(double Budget::*share, double relative, const Places& places,
                    const std::vector<double>& c_t, std::vector<SharedSource>& sources) {
  SharedSource source{share, Eigen::MatrixXd::Identity(1, 1), std::numeric_limits<double>::infinity(),
                      Eigen::MatrixXd::Zero(places.count, 1), Eigen::MatrixXd::Zero(places.count, 1)};
  for (Eigen::Index l = 0; l < places.count; ++l)
    source.c_t(l, 0) = relative * c_t[static_cast<std::size_t>(l)];
  sources.push_back(std::move(source));
}

void add_instruments(const CampaignData& data, const Places& places, const Reduction& reduction,
                     const std::vector<double>& c_t, std::vector<SharedSource>& sources,
                     std::vector<std::string>& notes) {
  const InstrumentUncertainty& declared = data.info.uncertainty;
  double mean_temperature_K = 0;
  for (const RunCoefficients& run : reduction.runs)
    mean_temperature_K += run.temperature_K / static_cast<double>(reduction.runs.size());
  const auto left_out = [&notes](const char* quantity, const char* key) {
    notes.push_back(
        fmt::format("{}: the instrument's own error is left out (campaign.toml declares no uncertainty.{}); "
                    "what changes from run to run is in the scatter",
                    quantity, key));
  };
  if (declared.speed_rpm)
    add_instrument(&Budget::speed, 2 * *declared.speed_rpm / data.info.rig.nominal_speed_rpm, places, c_t,
                   sources);
  else
    left_out("speed", "speed_rpm");
  if (declared.air_temperature_K)
    add_instrument(&Budget::temperature, *declared.air_temperature_K / mean_temperature_K, places, c_t,
                   sources);
  else
    left_out("temperature", "air_temperature_K");
  const double exponent = reduction.terms.air_pressure ? 1 : reduction.model.pressure_exponent;
  if (exponent == 0) return;
  if (declared.air_pressure_Pa)
    add_instrument(&Budget::pressure, exponent * *declared.air_pressure_Pa / 101325, places, c_t, sources);
  else
    left_out("pressure", "air_pressure_Pa");
}

/// Thrusts of the sheet were made elsewhere, with errors that nothing here knows.
void note_given_thrusts(const Reduction& reduction, std::vector<std::string>& notes) {
  const auto given = std::count_if(reduction.runs.begin(), reduction.runs.end(),
                                   [](const RunCoefficients& run) { return !run.from_volts; });
  if (given == 0) return;
  notes.push_back(fmt::format(
      "thrusts: those of {} of {} runs stand in runs.csv (thrust_i_N), and what their calibration, "
      "propellers and tares are uncertain by is not in U95",
      given, reduction.runs.size()));
}

}  // namespace

std::vector<SharedSource> shared_sources(const CampaignData& data, const Reduction& reduction,
                                         const std::vector<std::size_t>& location_of,
                                         const std::vector<double>& c_t, std::vector<std::string>& notes) {
  const Places places{location_of, static_cast<Eigen::Index>(c_t.size())};
  std::vector<SharedSource> sources;
  add_calibration(data, places, reduction, sources);
  add_propellers(data, places, reduction, sources);
  add_tares(data, places, reduction, sources);
  note_given_thrusts(reduction, notes);
  add_model(data, places, reduction, sources);
  add_instruments(data, places, reduction, c_t, sources, notes);
  return sources;
}

}  // namespace tunnelrig
