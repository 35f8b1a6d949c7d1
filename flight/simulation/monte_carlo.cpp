#include "flight/simulation/monte_carlo.h"

#include <array>
#include <cmath>
#include <mutex>
#include <thread>

namespace tunnelrig {
namespace {

/// The truth of one run. The setup points into it, so it stays where it is.
struct RunTruth {
  DisturbanceField field, map;
  FlightSetup setup;

  RunTruth(const Programme& p, int run);
  RunTruth(const RunTruth&) = delete;
  RunTruth& operator=(const RunTruth&) = delete;
};

RunTruth::RunTruth(const Programme& p, int run) : map(p.map) {
  Random random(p.seed, 4 * static_cast<std::uint64_t>(run) + 3);
  const auto draw = [&](double deviation) { return run == 0 ? 0 : deviation * random.normal(); };
  setup.believed = p.believed;
  setup.vehicle = p.believed;
  setup.vehicle.mass_kg *= 1 + draw(p.spread.mass);
  setup.vehicle.motor_lag_s *= std::max(0.5, 1 + draw(p.spread.motor_lag));
  for (double& scale : setup.rotor_scale) scale = 1 + draw(p.spread.rotor_thrust);
  const double map_scale = 1 + draw(p.spread.map_scale);
  const double thrust_error = draw(p.spread.map_uncertainties),
               uneven_error = draw(p.spread.map_uncertainties);
  setup.inertial.roll_error_rad = draw(p.spread.roll_error_rad);
  for (double& bias : setup.inertial.accelerometer_bias_m_s2) bias = draw(p.spread.accelerometer_m_s2);

  setup.vehicle.mass_kg += p.undeclared.payload_kg;
  if (p.undeclared.weak_motor > 0)
    setup.rotor_scale[static_cast<std::size_t>(p.undeclared.weak_motor - 1)] *=
        1 - p.undeclared.weak_motor_loss;
  field = DisturbanceField(p.map, map_scale * p.undeclared.map_scale, thrust_error, uneven_error);
  setup.field = &field;
  setup.map = &map;
  setup.walls = &p.space->walls;
  setup.scale = p.space->scale(p.believed);
  setup.trajectory = &p.scenario.trajectory;
  setup.score_from_s = p.scenario.score_from_s;
  setup.air = p.air;
  setup.air.wind_m_s += p.undeclared.wind_m_s;
  setup.seed = p.seed;
  setup.stream = static_cast<std::uint64_t>(run);
}

RunResult condense(const FlightScore& score) {
  RunResult r;
  for (std::size_t i = 0; i < 2; ++i) {
    r.squares_m2[i] = std::pow(score.tracking[i].rms_m(), 2);
    r.largest_m[i] = score.tracking[i].largest_m();
    r.estimator_squares_m2[i] = std::pow(score.estimator[i].rms_m(), 2);
  }
  r.contacts = score.contact_count;
  if (!score.contacts.empty()) r.first_contact = score.contacts.front();
  r.effort_N = score.effort_N;
  r.saturated_s = score.saturated_s;
  r.clamped_s = score.clamped_s;
  r.nees = score.nees;
  r.matches = score.matches;
  r.rejected_matches = score.rejected_matches;
  r.lost = score.lost;
  return r;
}

/// One flight, into its place of the result.
void fly_one(const Programme& p, int run, ControllerResult& result, std::mutex& pooling) {
  const RunTruth truth(p, run);
  AnyController controller(result.name, p.gains, controller_context(truth.setup, p.map_share));
  FlightLog* log = p.keep_logs && run == 0 ? &result.log : nullptr;
  FlightScore score;
  if (p.position_given) {
    GivenPosition given;
    score = fly(truth.setup, given, controller, log);
  } else {
    Localisation localisation(*p.space, p.localisation, truth.setup);
    score = fly(truth.setup, localisation, controller, log);
  }
  result.runs[static_cast<std::size_t>(run)] = condense(score);
  if (run == 0) result.contacts = score.contacts;
  // Of what is pooled here only counts are used, which do not depend on the order.
  const std::scoped_lock lock(pooling);
  for (std::size_t i = 0; i < 2; ++i) result.pooled[i].add(score.tracking[i]);
}

}  // namespace

std::vector<ControllerResult> fly_programme(const Programme& p, const Progress& progress) {
  std::vector<ControllerResult> results(p.controllers.size());
  for (std::size_t c = 0; c < results.size(); ++c) {
    results[c].name = p.controllers[c];
    results[c].runs.resize(static_cast<std::size_t>(p.runs));
    AnyController(results[c].name, p.gains, {});  // an unknown name is refused before anything flies
  }
  const int total = p.runs * static_cast<int>(results.size());
  std::atomic<int> next{0}, done{0};
  std::mutex pooling, failing;
  std::exception_ptr failure;
  const auto work = [&](bool reports) {
    for (int task = next++; task < total; task = next++) {
      try {
        ControllerResult& result = results[static_cast<std::size_t>(task) % results.size()];
        fly_one(p, task / static_cast<int>(results.size()), result, pooling);
      } catch (...) {
        const std::scoped_lock lock(failing);
        failure = std::current_exception();
        next = total;
      }
      ++done;
      if (reports && progress) progress(done, total);
    }
  };
  std::vector<std::jthread> others;
  for (int i = 1; i < p.threads; ++i) others.emplace_back(work, false);
  work(true);
  others.clear();  // joins
  if (failure) std::rethrow_exception(failure);
  return results;
}

double RunResult::rms_m() const { return std::sqrt(squares_m2[0] + squares_m2[1]); }

Plane ControllerResult::rms_m() const {
  Plane mean{};
  for (const RunResult& run : runs) {
    for (std::size_t i = 0; i < 2; ++i) mean[i] += run.squares_m2[i] / static_cast<double>(runs.size());
  }
  return {std::sqrt(mean[0]), std::sqrt(mean[1])};
}

Plane ControllerResult::largest_m() const {
  Plane largest{};
  for (const RunResult& run : runs) {
    for (std::size_t i = 0; i < 2; ++i) largest[i] = std::max(largest[i], run.largest_m[i]);
  }
  return largest;
}

int ControllerResult::contacts_of_all() const {
  int sum = 0;
  for (const RunResult& run : runs) sum += run.contacts;
  return sum;
}

std::optional<ContactEvent> ControllerResult::first_contact() const {
  std::optional<ContactEvent> first;
  for (const RunResult& run : runs) {
    if (run.first_contact && (!first || run.first_contact->time_s < first->time_s)) first = run.first_contact;
  }
  return first;
}

double ControllerResult::estimator_rms_m() const {
  double mean = 0;
  for (const RunResult& run : runs) mean += run.estimator_squares_m2[0] + run.estimator_squares_m2[1];
  return std::sqrt(mean / static_cast<double>(runs.size()));
}

double ControllerResult::mean_of(double RunResult::*value) const {
  double sum = 0;
  for (const RunResult& run : runs) sum += run.*value;
  return sum / static_cast<double>(runs.size());
}

int ControllerResult::lost_runs() const {
  int lost = 0;
  for (const RunResult& run : runs) lost += run.lost ? 1 : 0;
  return lost;
}

std::pair<double, double> ControllerResult::rms_with_interval_m() const {
  const auto n = static_cast<double>(runs.size());
  double mean = 0, square = 0;
  for (const RunResult& run : runs) mean += run.rms_m() / n;
  for (const RunResult& run : runs) square += std::pow(run.rms_m() - mean, 2);
  if (runs.size() < 2) return {mean, 0};
  return {mean, student_t_975(static_cast<int>(n) - 1) * std::sqrt(square / (n - 1) / n)};
}

double student_t_975(int degrees) {
  constexpr std::array<double, 10> kTable = {12.706, 4.303, 3.182, 2.776, 2.571,
                                             2.447,  2.365, 2.306, 2.262, 2.228};
  if (degrees < 1) return 0;
  if (degrees <= 10) return kTable[static_cast<std::size_t>(degrees - 1)];
  // Cornish-Fisher (Abramowitz and Stegun 26.7.5), within 0.001 from 11 degrees on.
  const double z = 1.959964, n = degrees, z3 = z * z * z, z5 = z3 * z * z;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n);
}

}  // namespace tunnelrig
