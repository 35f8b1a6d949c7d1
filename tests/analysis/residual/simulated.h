// Simulated observations of a design that the test chooses, without any effect, and dense algebra to hold the
// model against.
#pragma once

#include "analysis/residual/explanation/explanation.h"
#include "analysis/residual/likelihood/mixed_model.h"

#include <random>
#include <string>
#include <vector>

namespace tunnelrig::test {

struct Design {
  std::vector<int> runs_of_block = std::vector<int>(12, 6);
  int groups = 3;
  int channels = 1;
  int shapes = 0;
  double sigma = 0.002;        // of a run, in y
  double session_ratio = 1;    // session variance over run variance
  double run_correlation = 0;  // with the run before in the session
  bool multiplicative = true;
};

/// Runs in order of time; each group has one run at least, otherwise groups are drawn. Forces of about 7 N.
Observations simulate(const Design& design, std::mt19937_64& random);

/// Sets y, and the measured value with it.
void set_y(Observations& observations, const Eigen::MatrixXd& y);

/// A condition of every run, drawn evenly between two values.
void add_covariate(Observations& observations, const std::string& name, double low, double high,
                   std::mt19937_64& random);

/// Four rotors in sixteen sessions of eight runs, with a supply voltage and a wind that do nothing.
Observations four_rotors(int groups, double sigma, std::mt19937_64& random);

/// Adds an effect with these parameters to y, on the forces that are there.
void add_effect(Observations& observations, const std::string& name, const std::vector<double>& parameters);

const Effect& effect_named(const std::string& name);
std::vector<const Effect*> every_effect();

/// 199 simulated data sets: enough to tell what is found from what is not.
SearchSettings quick();

/// By every effect, quickly.
Explanation explained(const Observations& observations);

/// Φ + a 11ᵀ in each block of `rows`, Φ_ij = φ^|i − j|.
Eigen::MatrixXd dense_covariance(const Observations& observations, const std::vector<int>& rows, double ratio,
                                 double run_correlation = 0);

/// An indicator and the slopes of each group of `rows`, in the order of their numbers; for `wanted` rows.
Eigen::MatrixXd dense_baseline(const Observations& observations, const std::vector<int>& rows,
                               const std::vector<int>& wanted);

}  // namespace tunnelrig::test
