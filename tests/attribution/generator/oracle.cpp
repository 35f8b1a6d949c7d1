#include "attribution/generator/oracle.h"

#include <map>

#include <Eigen/Core>
#include <Eigen/QR>

namespace tunnelrig::attribution {
namespace {

// Rows: the sum of the rotors, and three differences, orthonormal.
constexpr std::array<Rotors, kRotors> kModes = {
    {{0.5, 0.5, 0.5, 0.5}, {0.5, -0.5, 0.5, -0.5}, {0.5, 0.5, -0.5, -0.5}, {0.5, -0.5, -0.5, 0.5}}};

/// Columns whitened for one mode: V = run I + session 1 1' within each session.
void whiten(Eigen::MatrixXd& columns, const World& world, double run_variance, double session_variance) {
  std::map<int, std::vector<Eigen::Index>> sessions;
  for (Eigen::Index i = 0; i < columns.rows(); ++i) {
    sessions[world.runs[static_cast<std::size_t>(i)].session].push_back(i);
  }
  for (const auto& [id, rows] : sessions) {
    const auto count = static_cast<double>(rows.size());
    const double keep = std::sqrt(run_variance / (run_variance + count * session_variance));
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(columns.cols());
    for (const Eigen::Index row : rows) mean += columns.row(row) / count;
    for (const Eigen::Index row : rows) columns.row(row) -= (1 - keep) * mean;
  }
  columns /= std::sqrt(run_variance);
}

Eigen::MatrixXd locations(const World& world, Eigen::Index ordinary, bool one_coefficient) {
  std::map<std::string, Eigen::Index> index;
  const auto label = [&](Eigen::Index i) {
    return one_coefficient ? std::string() : world.runs[static_cast<std::size_t>(i)].location;
  };
  for (Eigen::Index i = 0; i < ordinary; ++i)
    index.emplace(label(i), static_cast<Eigen::Index>(index.size()));
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(ordinary, static_cast<Eigen::Index>(index.size()));
  for (Eigen::Index i = 0; i < ordinary; ++i) columns(i, index[label(i)]) = 1;
  return columns;
}

Eigen::VectorXd in_mode(const std::vector<Rotors>& change, std::size_t mode, Eigen::Index ordinary) {
  Eigen::VectorXd column = Eigen::VectorXd::Zero(ordinary);
  if (change.empty()) return column;
  for (Eigen::Index i = 0; i < ordinary; ++i) {
    for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
      column[i] += kModes[mode][rotor] * change[static_cast<std::size_t>(i)][rotor];
    }
  }
  return column;
}

}  // namespace

std::vector<Rotors> changes_of(const Effect& effect, double amplitude, const World& world) {
  std::vector<Rotors> changes(world.runs.size());
  for (std::size_t run = 0; run < changes.size(); ++run) {
    for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
      changes[run][rotor] = change_at(effect, {world, run, rotor}, amplitude);
    }
  }
  return changes;
}

double distance_sigma(const std::vector<Rotors>& signal, const std::vector<Rotors>& other, const World& world,
                      const NoiseModel& noise, bool one_coefficient) {
  Eigen::Index ordinary = 0;
  for (const Conditions& run : world.runs) ordinary += run.added ? 0 : 1;
  const Eigen::MatrixXd places = locations(world, ordinary, one_coefficient);
  double signal_signal = 0, signal_other = 0, other_other = 0;
  for (std::size_t mode = 0; mode < kRotors; ++mode) {
    const auto share = [&](double common) { return mode == 0 ? 1 + 3 * common : 1 - common; };
    const double run = noise.run * noise.run * share(noise.run_common);
    const double session = noise.session * noise.session * share(noise.session_common);
    Eigen::MatrixXd columns(ordinary, places.cols() + 2);
    columns << places, in_mode(signal, mode, ordinary), in_mode(other, mode, ordinary);
    whiten(columns, world, run, session);
    const Eigen::HouseholderQR<Eigen::MatrixXd> fitted(columns.leftCols(places.cols()));
    Eigen::MatrixXd rest = fitted.householderQ().transpose() * columns.rightCols(2);
    const auto free = rest.bottomRows(ordinary - places.cols());
    signal_signal += free.col(0).squaredNorm();
    signal_other += free.col(0).dot(free.col(1));
    other_other += free.col(1).squaredNorm();
  }
  const double explained = other_other > 0 ? signal_other * signal_other / other_other : 0;
  return std::sqrt(std::max(0.0, signal_signal - explained));
}

}  // namespace tunnelrig::attribution
