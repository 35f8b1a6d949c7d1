// How much runs scatter, visits, and sessions: what the error of a location's mean is made of.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// One measured value per run, with the location and the session that it belongs to (indices from 0).
struct GroupedRuns {
  std::vector<std::size_t> location, session;
  std::vector<double> value;
};

/// What visit and session may vary by together, from few of them: values with their probabilities, and the
/// value in the middle as its two parts. Empty where nothing is to be drawn: the components stand as they
/// are.
struct ScatterDraws {
  Eigen::ArrayXd total, probability;
  double visit = 0, session = 0;
};

/// Variances of y = location + session + visit + run, where a visit is what one location saw of one session.
///
/// Runs within a visit give the run variance of each location, moderated: a location of few runs leans on the
/// others as far as the locations resemble each other (Smyth 2004, Stat. Appl. Genet. Mol. Biol. 3:3), one
/// that scatters unlike them leans less. Where Bartlett's test finds them alike they are pooled. The visit
/// and session variances maximise the restricted likelihood (REML; Patterson & Thompson 1971) of the visits'
/// means with locations fixed. A component that the design cannot show is absent, not zero: `…_known` says
/// so.
struct VarianceComponents {
  bool run_known = false, visit_known = false, session_known = false;
  std::vector<double> run_by_location;  // σ² of one run there
  std::vector<double> run_dof;          // degrees of freedom of each
  double run = 0;                       // pooled
  double visit = 0;
  double session = 0;
  ScatterDraws scatter;
};

VarianceComponents fit_variance_components(const GroupedRuns& runs);

/// Means of locations (plain, over their runs) with the covariance that the components give them, visit and
/// session by the middle of their draws: a maximum at 0 is no evidence that there is none.
struct LocationMeans {
  std::vector<double> mean;
  std::vector<double> std;  // over the runs of the location; NaN for a single run
  std::vector<int> runs, sessions;
  Eigen::MatrixXd
      covariance;  // n × n: runs of one session are not independent, nor are locations that share one
  std::vector<double> dof;  // of the variance of each mean: t(0.975, dof) is that of the draws
  std::vector<double> run_part, visit_part, session_part;  // variances of the mean, its budget
};

LocationMeans location_means(const GroupedRuns& runs, const VarianceComponents& components);

}  // namespace tunnelrig
