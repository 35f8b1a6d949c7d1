#include "flight/simulation/monte_carlo.h"

#include "calibration/distributions.h"
#include "datasets/error.h"
#include "datasets/in_threads.h"
#include "flight/simulation/run_exchange.h"

#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>

namespace tunnelrig {
namespace {

constexpr double kLostError_m = std::numeric_limits<double>::infinity();

/// One worker's vehicle, field, estimator and controller; run() may be called for any runs in any order.
class Worker {
 public:
  Worker(const FlightTask& task, const DisturbanceField* map, std::string_view controller,
         const GainTable& gains)
      : task_(task), map_(map) {
    setup_.believed = task.believed;
    setup_.map = map;
    setup_.walls = &task.space->walls;
    setup_.scale = task.space->scale(task.believed);
    setup_.trajectory = &task.scenario->trajectory;
    setup_.score_from_s = task.scenario->score_from_s;
    setup_.seed = task.seed;
    controller_.emplace(controller, gains, controller_context(setup_));
    if (task.localisation) localisation_.emplace(*task.space, *task.localisation);
  }

  FlightScore run(int number, FlightLog* log) {
    draw(static_cast<std::uint64_t>(number));
    if (localisation_) {
      localisation_->prepare(setup_.seed, setup_.stream);
      return fly(setup_, *localisation_, *controller_, log);
    }
    GivenPosition given;
    return fly(setup_, given, *controller_, log);
  }

 private:
  void draw(std::uint64_t number) {
    Random random(task_.seed, 4 * number + 2);
    const Spread& spread = task_.spread;
    const HiddenTruth& hidden = task_.hidden;
    setup_.stream = number;
    setup_.vehicle = task_.believed;
    setup_.vehicle.mass_kg *= 1 + spread.mass * random.normal();
    setup_.vehicle.mass_kg += hidden.payload_kg;
    for (double& scale : setup_.rotor_scale) scale = 1 + spread.rotor_thrust * random.normal();
    setup_.rotor_scale[static_cast<std::size_t>(hidden.weak_rotor - 1)] *= 1 - hidden.motor_loss;
    setup_.inertial.roll_error_rad = spread.roll_error_rad * random.normal();
    for (double& bias : setup_.inertial.accelerometer_bias_m_s2)
      bias = spread.accelerometer_bias_m_s2 * random.normal();
    setup_.air = task_.air;
    setup_.air.wind_m_s += hidden.wind_m_s;
    setup_.air.gust_m_s = std::hypot(setup_.air.gust_m_s, hidden.gust_m_s);
    if (task_.map == nullptr) return;
    const MapError thrust_error(spread.map_errors, random), uneven_error(spread.map_errors, random);
    if (spread.map_errors == 0 && hidden.map_scale == 1) {
      setup_.field = map_;
      return;
    }
    field_ = DisturbanceField(*task_.map, hidden.map_scale, thrust_error, uneven_error);
    setup_.field = &field_;
  }

  const FlightTask& task_;
  const DisturbanceField* map_;
  FlightSetup setup_;
  DisturbanceField field_;
  std::optional<AnyController> controller_;
  std::optional<Localisation> localisation_;
};

/// A flight that was lost has no error: what was flown up to there would flatter it.
RunResult result_of(const FlightScore& score) {
  RunResult run{
      .rms_y_m = score.tracking[0].rms_m(),
      .rms_z_m = score.tracking[1].rms_m(),
      .largest_y_m = score.tracking[0].largest_m(),
      .largest_z_m = score.tracking[1].largest_m(),
      .estimator_rms_m = std::hypot(score.estimator[0].rms_m(), score.estimator[1].rms_m()) / std::sqrt(2.0),
      .nees = score.nees,
      .effort_N = score.effort_N,
      .saturated_s = score.saturated_s,
      .clamped_s = score.clamped_s,
      .contacts = score.contact_count,
      .matches = score.matches,
      .rejected_matches = score.rejected_matches,
      .lost = score.lost,
      .touched = score.contacts};
  if (score.lost) run.rms_y_m = run.rms_z_m = run.largest_y_m = run.largest_z_m = kLostError_m;
  return run;
}

void summarise(Comparison& all) {
  const auto n = static_cast<double>(all.runs.size());
  double y2 = 0, z2 = 0, e2 = 0, mean = 0, squares = 0, matches = 0, rejected = 0;
  for (const RunResult& run : all.runs) {
    y2 += run.rms_y_m * run.rms_y_m / n;
    z2 += run.rms_z_m * run.rms_z_m / n;
    e2 += run.estimator_rms_m * run.estimator_rms_m / n;
    mean += run.rms_m() / n;
    all.largest_y_m = std::max(all.largest_y_m, run.largest_y_m);
    all.largest_z_m = std::max(all.largest_z_m, run.largest_z_m);
    all.contacts += run.contacts;
    all.runs_with_contact += run.contacts > 0 ? 1 : 0;
    all.lost += run.lost ? 1 : 0;
    all.nees += run.nees / n;
    all.effort_N += run.effort_N / n;
    all.saturated_s += run.saturated_s / n;
    all.clamped_s += run.clamped_s / n;
    matches += run.matches;
    rejected += run.rejected_matches;
    if (!run.touched.empty() && (!all.first_contact_s || run.touched[0].time_s < *all.first_contact_s))
      all.first_contact_s = run.touched[0].time_s;
  }
  for (const RunResult& run : all.runs) squares += (run.rms_m() - mean) * (run.rms_m() - mean);
  double half = 0;
  if (all.runs.size() < 2)
    half = std::numeric_limits<double>::infinity();  // one run says nothing of how runs differ
  else if (all.lost == 0)
    half = half_width_95(std::sqrt(squares / (n - 1) / n), n - 1);
  all.rms_y_m = std::sqrt(y2);
  all.rms_z_m = std::sqrt(z2);
  all.estimator_rms_m = std::sqrt(e2);
  all.ci95_low_m = std::max(mean - half, 0.0);
  all.ci95_high_m = mean + half;
  all.rejected_share = matches > 0 ? rejected / matches : 0;
}

DisturbanceField field_of(const FlightTask& task) {
  return task.map == nullptr ? DisturbanceField() : DisturbanceField(*task.map);
}

}  // namespace

std::optional<MeanInterval> paired_difference(const Comparison& one, const Comparison& other) {
  if (!one.has_interval() || !other.has_interval() || one.runs.size() != other.runs.size()) return {};
  const auto n = static_cast<double>(one.runs.size());
  const auto difference_m = [&](std::size_t i) { return one.runs[i].rms_m() - other.runs[i].rms_m(); };
  double mean = 0, squares = 0;
  for (std::size_t i = 0; i < one.runs.size(); ++i) mean += difference_m(i) / n;
  for (std::size_t i = 0; i < one.runs.size(); ++i) squares += std::pow(difference_m(i) - mean, 2);
  const double half = half_width_95(std::sqrt(squares / (n - 1) / n), n - 1);
  return MeanInterval{mean - half, mean + half};
}

double RunResult::rms_m() const { return std::hypot(rms_y_m, rms_z_m); }

void HiddenTruth::validate() const {
  const auto require = [](bool holds, const char* name, double value, const char* rule) {
    if (!holds) throw InputError::in("hidden truth", "{} = {:g}: {}", name, value, rule);
  };
  require(payload_kg >= 0 && payload_kg <= 2, "payload_kg", payload_kg, "must be from 0 to 2");
  require(map_scale >= -5 && map_scale <= 5, "map_scale", map_scale, "must be from -5 to 5");
  require(std::abs(wind_m_s) <= 15, "wind_m_s", wind_m_s, "must be from -15 to 15");
  require(gust_m_s >= 0 && gust_m_s <= 10, "gust_m_s", gust_m_s, "must be from 0 to 10");
  require(motor_loss >= 0 && motor_loss <= 0.3, "motor_loss", motor_loss, "must be from 0 to 0.3");
  require(weak_rotor >= 1 && weak_rotor <= 4, "weak_rotor", weak_rotor, "must be from 1 to 4");
}

Comparison fly_runs(const FlightTask& task, std::string_view controller, const GainTable& gains,
                    const std::function<void(int)>& progress) {
  const DisturbanceField map = field_of(task);
  Comparison all{.controller = std::string(controller)};
  all.runs.resize(static_cast<std::size_t>(task.runs));
  std::array<AxisErrors, 2> pooled;
  const int processes = task.processes != nullptr ? task.processes->count() : 1;
  std::atomic<int> next = task.processes != nullptr ? task.processes->rank() : 0;
  std::mutex mutex;
  std::exception_ptr failed;
  int done = 0;
  const auto work = [&] {
    try {
      Worker worker(task, &map, controller, gains);
      for (int run = next.fetch_add(processes); run < task.runs; run = next.fetch_add(processes)) {
        const FlightScore score = worker.run(run, nullptr);
        const std::scoped_lock lock(mutex);
        all.runs[static_cast<std::size_t>(run)] = result_of(score);
        // Counts do not care in which order they are added; everything else is added up in the order of the
        // runs.
        for (std::size_t i = 0; i < 2; ++i) pooled[i].add(score.tracking[i]);
        done = std::min(done + processes, task.runs);
        if (progress) progress(done);
      }
    } catch (...) {
      const std::scoped_lock lock(mutex);
      failed = std::current_exception();
      next = task.runs;
    }
  };
  const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const int workers = std::min(task.workers > 0 ? task.workers : cores, task.runs);
  in_threads(workers, work);
  if (failed) std::rethrow_exception(failed);
  if (task.processes != nullptr) exchange_runs(*task.processes, all.runs, pooled);
  summarise(all);
  all.p95_y_m = all.lost > 0 ? kLostError_m : pooled[0].quantile_m(0.95);
  all.p95_z_m = all.lost > 0 ? kLostError_m : pooled[1].quantile_m(0.95);
  return all;
}

FlightLog fly_logged(const FlightTask& task, std::string_view controller, const GainTable& gains, int run,
                     FlightScore* score) {
  const DisturbanceField map = field_of(task);
  FlightLog log;
  const FlightScore result = Worker(task, &map, controller, gains).run(run, &log);
  if (score != nullptr) *score = result;
  return log;
}

}  // namespace tunnelrig
