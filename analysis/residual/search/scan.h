// Candidates that are scanned together, and the evidence of each.
#pragma once

#include "analysis/residual/search/search_data.h"

#include <cstddef>
#include <map>
#include <memory>
#include <vector>

namespace tunnelrig {

struct Scan {
  std::vector<Term> ways;
  std::vector<Candidate> candidates;
  std::vector<CandidateFit> fits;                        // of each of them
  std::unique_ptr<CandidateScan> scan;                   // refers to the models of the data
  std::vector<std::size_t> order;                        // by evidence, best first
  std::map<std::size_t, std::vector<Term>> others = {};  // of ways that are several effects: but the first
};

struct CurveScan {
  Scan scan;                 // without ways
  std::vector<Curve> tried;  // its candidates
};

/// With its derivative by the amplitude on top of the predicted forces (n × c, response's unit).
Candidate candidate_of(const SearchData& data, const Term& way, const Eigen::MatrixXd& predicted);

/// Fits all candidates on top of a model, and puts them in order.
void rank(const SearchData& data, const JointFit& base, Scan& scan);

/// The highest of an effect in this form and of this rotor, whatever its shape; 0 where it was not scanned.
double evidence_of(const Scan& scan, const Term& term);

}  // namespace tunnelrig
