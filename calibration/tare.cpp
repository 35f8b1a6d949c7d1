#include "calibration/tare.h"

#include "datasets/error.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

void check(const TareReading& reading) {
  bool good = std::isfinite(reading.time_s);
  for (std::size_t channel = 0; channel < kMaxRotors; ++channel) {
    good = good && std::isfinite(reading.mean_V[channel]) &&
           std::isfinite(reading.standard_error_V[channel]) && reading.standard_error_V[channel] >= 0;
  }
  if (good) return;
  throw InputError(fmt::format("a tare of session {} at {:.0f} s ({}) has no finite mean and standard error",
                               reading.session, reading.time_s, reading.run));
}

}  // namespace

Tares::Tares(std::vector<TareReading> readings) : readings_(std::move(readings)) {
  for (std::size_t i = 0; i < readings_.size(); ++i) {
    check(readings_[i]);
    sessions_[readings_[i].session].push_back(i);
  }
  for (auto& [name, session] : sessions_) {
    std::sort(session.begin(), session.end(),
              [&](std::size_t a, std::size_t b) { return readings_[a].time_s < readings_[b].time_s; });
    for (std::size_t i = 1; i < session.size(); ++i) {
      const TareReading &before = readings_[session[i - 1]], &here = readings_[session[i]];
      if (here.time_s > before.time_s) continue;
      throw InputError(fmt::format(
          "session {} has two tares at one time, {} and {}: correct start_utc of one, or exclude it", name,
          before.run, here.run));
    }
  }
  estimate_wander();
}

/// A tare is off the line between its neighbours by its own and their errors, and by the wander over
/// (t − a)(b − t)/(b − a) seconds.
void Tares::estimate_wander() {
  std::array<double, kMaxRotors> excess{};
  double seconds = 0;
  for (const auto& [name, session] : sessions_) {
    for (std::size_t i = 1; i + 1 < session.size(); ++i) {
      const TareReading &before = readings_[session[i - 1]], &here = readings_[session[i]],
                        &after = readings_[session[i + 1]];
      const double w = (here.time_s - before.time_s) / (after.time_s - before.time_s);
      for (std::size_t c = 0; c < kMaxRotors; ++c) {
        const double off = here.mean_V[c] - (1 - w) * before.mean_V[c] - w * after.mean_V[c];
        const double noise = std::pow(here.standard_error_V[c], 2) +
                             std::pow((1 - w) * before.standard_error_V[c], 2) +
                             std::pow(w * after.standard_error_V[c], 2);
        excess[c] += off * off - noise;
      }
      seconds += w * (after.time_s - here.time_s);
      ++wander_dof_;
    }
  }
  for (std::size_t c = 0; c < kMaxRotors && wander_dof_ > 0; ++c)
    wander_[c] = std::max(0.0, excess[c] / seconds);
}

const Tares::Session* Tares::find(std::string_view session) const {
  const auto found = sessions_.find(session);
  return found == sessions_.end() ? nullptr : &found->second;
}

std::vector<TareZero::Weight> Tares::weights(const Session& session, double time_s) const {
  const auto after = std::find_if(session.begin(), session.end(),
                                  [&](std::size_t tare) { return readings_[tare].time_s > time_s; });
  if (after == session.begin()) return {{session.front(), 1}};
  if (after == session.end()) return {{session.back(), 1}};
  const double begin = readings_[*(after - 1)].time_s, end = readings_[*after].time_s;
  const double w = (time_s - begin) / (end - begin);
  return {{*(after - 1), 1 - w}, {*after, w}};
}

/// Covariance of the random walk's parts that no tare sees, over its variance per second.
double Tares::wander_factor_s(const Session& session, double time1_s, double time2_s) const {
  const auto [early, late] = std::minmax(time1_s, time2_s);
  const double first = readings_[session.front()].time_s, last = readings_[session.back()].time_s;
  if (late <= first) return first - late;
  if (early >= last) return early - last;
  for (std::size_t i = 1; i < session.size(); ++i) {
    const double begin = readings_[session[i - 1]].time_s, end = readings_[session[i]].time_s;
    if (early >= begin && late <= end) return (early - begin) * (end - late) / (end - begin);
  }
  return 0;
}

std::optional<TareZero> Tares::zero_at(std::string_view session, double time_s) const {
  const Session* tares = find(session);
  if (tares == nullptr) return {};
  TareZero zero{.weights = weights(*tares, time_s)};
  zero.outside = time_s < readings_[tares->front()].time_s || time_s > readings_[tares->back()].time_s;
  for (std::size_t channel = 0; channel < kMaxRotors; ++channel) {
    for (const auto& [tare, weight] : zero.weights)
      zero.zero_V[channel] += weight * readings_[tare].mean_V[channel];
    zero.standard_uncertainty_V[channel] =
        std::sqrt(covariance(session, time_s, time_s, static_cast<int>(channel)));
  }
  return zero;
}

double Tares::covariance(std::string_view session, double time1_s, double time2_s, int channel) const {
  const Session* tares = find(session);
  if (tares == nullptr) return 0;
  const auto c = static_cast<std::size_t>(channel);
  double sum = wander_[c] * wander_factor_s(*tares, time1_s, time2_s);
  for (const auto& one : weights(*tares, time1_s)) {
    for (const auto& other : weights(*tares, time2_s)) {
      if (one.tare != other.tare) continue;
      sum += one.weight * other.weight * std::pow(readings_[one.tare].standard_error_V[c], 2);
    }
  }
  return sum;
}

}  // namespace tunnelrig
