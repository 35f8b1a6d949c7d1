#include "calibration/propellers.h"

#include "datasets/error.h"

#include <cmath>
#include <map>

namespace tunnelrig {
namespace {

constexpr const char* kFile = "propellers.csv";

void check_tests(const std::vector<PropellerTest>& tests, int rotors) {
  std::map<int, const PropellerTest*> on_rotor;
  std::map<std::string, const PropellerTest*> of_propeller;
  for (const PropellerTest& test : tests) {
    if (test.rotor < 1 || test.rotor > rotors) {
      throw InputError::at(kFile, test.line, "rotor {} is none of 1 to {}", test.rotor, rotors);
    }
    if (!(test.thrust_N > 0) || !std::isfinite(test.thrust_N)) {
      throw InputError::at(kFile, test.line, "a thrust of {:g} N is not above 0", test.thrust_N);
    }
    const PropellerTest& mounted = *on_rotor.emplace(test.rotor, &test).first->second;
    if (mounted.propeller != test.propeller) {
      throw InputError::at(kFile, test.line,
                           "propeller {} is on rotor {}, where line {} has propeller {}; only tests of the "
                           "mounted propellers belong here",
                           test.propeller, test.rotor, mounted.line, mounted.propeller);
    }
    const PropellerTest& first = *of_propeller.emplace(test.propeller, &test).first->second;
    if (first.rotor != test.rotor) {
      throw InputError::at(kFile, test.line, "propeller {} is on rotor {}, and on rotor {} in line {}",
                           test.propeller, test.rotor, first.rotor, first.line);
    }
    if (first.direction != test.direction) {
      throw InputError::at(kFile, test.line, "propeller {} turns {}, and {} in line {}", test.propeller,
                           test.direction, first.direction, first.line);
    }
  }
  for (int rotor = 1; rotor <= rotors; ++rotor) {
    if (on_rotor.contains(rotor)) continue;
    throw InputError::in(
        kFile, "the propeller on rotor {} has no test; a factor is a thrust over the mean of all {}", rotor,
        rotors);
  }
}

}  // namespace

PropellerFactors propeller_factors(const std::vector<PropellerTest>& tests, int rotors) {
  PropellerFactors factors{.tested = !tests.empty(),
                           .factor = Eigen::VectorXd::Ones(rotors),
                           .covariance = Eigen::MatrixXd::Zero(rotors, rotors),
                           .propellers = std::vector<std::string>(static_cast<std::size_t>(rotors)),
                           .repeats = std::vector<int>(static_cast<std::size_t>(rotors))};
  if (tests.empty()) return factors;
  check_tests(tests, rotors);

  Eigen::VectorXd mean = Eigen::VectorXd::Zero(rotors), repeats = Eigen::VectorXd::Zero(rotors);
  for (const PropellerTest& test : tests) {
    mean[test.rotor - 1] += test.thrust_N;
    repeats[test.rotor - 1] += 1;
    factors.propellers[static_cast<std::size_t>(test.rotor - 1)] = test.propeller;
    ++factors.repeats[static_cast<std::size_t>(test.rotor - 1)];
  }
  mean = mean.cwiseQuotient(repeats);
  factors.factor = mean / mean.mean();

  double squares = 0;
  for (const PropellerTest& test : tests) squares += std::pow(test.thrust_N - mean[test.rotor - 1], 2);
  factors.dof = static_cast<int>(tests.size()) - rotors;
  if (factors.dof == 0) return factors;
  const double variance = squares / factors.dof;
  factors.scatter_N = std::sqrt(variance);
  const Eigen::MatrixXd share = factors.factor * Eigen::RowVectorXd::Constant(rotors, 1.0 / rotors);
  const Eigen::MatrixXd sensitivity = (Eigen::MatrixXd::Identity(rotors, rotors) - share) / mean.mean();
  factors.covariance = variance * sensitivity * repeats.cwiseInverse().asDiagonal() * sensitivity.transpose();
  return factors;
}

}  // namespace tunnelrig
