// A version of the model: the thesis's, and the effects that were adopted on top of it.
#pragma once

#include "analysis/effects/effect.h"
#include "analysis/residual/likelihood/curve_basis.h"

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// An adopted effect with its parameters.
struct ModelTerm {
  const Effect* effect = nullptr;
  int rotor = -1;                  // from 0; −1: all alike
  int other = -1;                  // crosstalk: the rotor that leaks in
  bool at_theory = false;          // the amplitude is known physics
  std::vector<double> parameters;  // all of the effect's; of a change-point the run's name counts instead
  std::vector<std::string> units;  // of the parameters
  std::vector<double> reference;   // of the covariates, as they were when the effect was adopted
  std::string first_run;           // where the effect has a change-point

  std::string label() const;  // "creep of rotor 2"
  /// Whether the effect counts its k-th covariate from what it was typically.
  bool counts_from_reference(std::size_t k) const;
};

/// What a slope goes with; `mean` of the product over the runs that it was found in is the baseline's.
struct OtherCondition {
  std::string covariate;
  Strength strength;
  double mean = 0;
};

/// A curve without a name: y changes by Σ a_k (column_k(x) − tilt_k s(x) − centre_k) between `low` and
/// `high`, and is held there beyond (curve_basis.h); of levels it is known only at these.
struct ModelCurve {
  std::string covariate;
  int rotor = -1;
  CurveShape shape = CurveShape::kWaves;
  double low = 0, high = 1;
  std::vector<double> coefficients, centre;
  std::vector<double> tilt = {};             // empty: none
  std::vector<double> levels = {};           // of CurveShape::kLevels, one more than coefficients
  std::vector<std::string> labels = {};      // of a column of texts: x = i + 1 stands for labels[i]
  std::string place = {};                    // times the run's weight there (Place); empty: alike everywhere
  std::optional<OtherCondition> times = {};  // or times the strength of another condition

  double column(std::size_t k, double x) const;  // of the k-th coefficient, from 0, with tilt and centre
  std::string label() const;                     // "curve over relative_humidity (empirical)"
};

struct ModelVersion {
  int version = 0, parent = 0;  // 0 is the thesis's model
  std::string baseline = "thesis";
  bool multiplicative = true;  // effects multiply (y is a logarithm), or add
  std::vector<ModelTerm> terms;
  std::vector<ModelCurve> curves;
  Eigen::MatrixXd covariance;  // of parameters()
  double dof = std::numeric_limits<double>::infinity();
  std::string explanation;  // JSON of the explanation that it comes from

  /// All terms' parameters, then all curves' coefficients.
  Eigen::VectorXd parameters() const;
  std::vector<std::string> effects() const;  // labels
  /// The conditions that what is reduced by this model is for: where its effects do nothing.
  std::map<std::string, double> reference() const;
  std::string name() const;  // "version 2 (creep, supply_voltage)"
};

/// "tunnelrig-model/1".
std::string model_json(const ModelVersion& model);

/// Throws InputError, naming `source` and the key, for what is no such document and for an effect that this
/// program does not have.
ModelVersion model_from_json(const std::string& json, const std::string& source);

}  // namespace tunnelrig
