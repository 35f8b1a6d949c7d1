#include "attribution/generator/noise.h"

#include "attribution/generator/random.h"

#include <cmath>
#include <cstdlib>
#include <map>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace tunnelrig::attribution {
namespace {

constexpr int kHeavyFreedom = 4;

double draw(const NoiseModel& model, Random& random) {
  return model.kind == Noise::kHeavyTailed ? random.heavy(kHeavyFreedom) : random.normal();
}

/// All rotors' draw: a common part and each one's own.
Rotors draw_rotors(double sigma, double common_share, Random& random, const NoiseModel* heavy) {
  const auto one = [&] { return heavy != nullptr ? draw(*heavy, random) : random.normal(); };
  const double common = std::sqrt(common_share) * one();
  Rotors values{};
  for (double& value : values) value = sigma * (common + std::sqrt(1 - common_share) * one());
  return values;
}

/// Of n runs of one session in order: neighbours persist, and all share the session's offset.
Eigen::MatrixXd session_covariance(const NoiseModel& model, Eigen::Index n) {
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      covariance(i, j) = model.run * model.run * std::pow(model.persistence, std::abs(i - j)) +
                         model.session * model.session;
  return covariance;
}

/// Mean variance, over the runs of every fourth session, of the coefficient that generalised least squares
/// finds from the other sessions. A location that is not among those counts for nothing.
double coefficient_variance(const NoiseModel& model, const World& world, int first_sealed) {
  std::map<std::string, Eigen::Index> index;
  const auto sealed = [&](const Conditions& run) { return run.session % 4 == first_sealed; };
  std::map<int, std::vector<Eigen::Index>> sessions;
  for (const Conditions& run : world.runs) {
    if (sealed(run) || run.added) continue;
    const auto place = index.emplace(run.location, static_cast<Eigen::Index>(index.size())).first;
    sessions[run.session].push_back(place->second);
  }
  const auto size = static_cast<Eigen::Index>(index.size());
  if (size == 0) return 0;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  for (const auto& [id, places] : sessions) {
    const auto runs = static_cast<Eigen::Index>(places.size());
    Eigen::MatrixXd of_place = Eigen::MatrixXd::Zero(runs, size);
    for (Eigen::Index i = 0; i < runs; ++i) of_place(i, places[static_cast<std::size_t>(i)]) = 1;
    information += of_place.transpose() * session_covariance(model, runs).ldlt().solve(of_place);
  }
  const Eigen::MatrixXd covariance = information.ldlt().solve(Eigen::MatrixXd::Identity(size, size));
  double sum = 0;
  int count = 0;
  for (const Conditions& held_out : world.runs) {
    const auto place = index.find(held_out.location);
    if (!sealed(held_out) || held_out.added || place == index.end()) continue;
    sum += covariance(place->second, place->second);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

double NoiseModel::of_session_mean(double runs) const {
  const double inflation = (1 + persistence) / (1 - persistence);
  return std::sqrt(session * session + run * run * inflation / runs);
}

NoiseModel draw_noise_model(const Settings& settings) {
  Random random(settings.seed, "noise model");
  NoiseModel model{.kind = settings.noise, .run = settings.run_scatter};
  if (settings.noise == Noise::kWhite) return model;
  const double relative = settings.run_scatter / 0.0024;
  model.session = relative * (settings.noise == Noise::kSession ? random.log_uniform(0.0008, 0.003) : 0.0008);
  if (settings.noise == Noise::kAutocorrelated) model.persistence = random.uniform(0.3, 0.6);
  return model;
}

std::vector<Rotors> draw_noise(const NoiseModel& model, const World& world, std::uint64_t seed) {
  Random runs(seed, "run scatter"), sessions(seed, "session scatter");
  std::vector<Rotors> noise;
  Rotors offset{}, state{};
  for (std::size_t i = 0; i < world.runs.size(); ++i) {
    const bool fresh = i == 0 || world.runs[i].session != world.runs[i - 1].session;
    if (fresh) offset = draw_rotors(model.session, model.session_common, sessions, nullptr);
    const Rotors draw = draw_rotors(model.run, model.run_common, runs, &model);
    const double keep = fresh ? 0 : model.persistence;
    Rotors total{};
    for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
      state[rotor] = keep * state[rotor] + std::sqrt(1 - keep * keep) * draw[rotor];
      total[rotor] = offset[rotor] + state[rotor];
    }
    noise.push_back(total);
  }
  return noise;
}

NoiseFloor noise_floor(const NoiseModel& model, const World& world) {
  double square = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < world.runs.size(); ++i) {
    if (world.runs[i].added) continue;
    for (const double thrust_N : world.baseline_N[i]) square += thrust_N * thrust_N;
    count += kRotors;
  }
  const double thrust_N = std::sqrt(square / static_cast<double>(count));
  double coefficients = 0;
  for (int first = 0; first < 4; ++first) coefficients += coefficient_variance(model, world, first) / 4;
  const double variance = model.run * model.run + model.session * model.session;
  return {.run_N = model.run * thrust_N,
          .session_N = model.session * thrust_N,
          .root_N = std::sqrt(variance) * thrust_N,
          .with_coefficients_N = std::sqrt(variance + coefficients) * thrust_N};
}

}  // namespace tunnelrig::attribution
