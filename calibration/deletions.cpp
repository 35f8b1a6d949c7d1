#include "calibration/deletions.h"

#include <iterator>
#include <optional>
#include <utility>

namespace tunnelrig {
namespace {

// A downdate loses digits as the rest says less of the coefficients or scatters less than the rows that were
// fitted last, and with the number of steps: beyond these the rest is fitted anew.
constexpr double kLeastInformation = 0.1, kLeastScatter = 0.01;
constexpr int kMostSteps = 64;

/// The fit of the rows that are left, kept up to date in closed form (Cook and Weisberg 1982, 2.2).
class ShrinkingFit {
 public:
  ShrinkingFit(const Eigen::MatrixXd& X, const Eigen::VectorXd& y)
      : X_(X), y_(y), kept_(Eigen::Array<bool, Eigen::Dynamic, 1>::Constant(X.rows(), true)) {
    refit();
  }

  /// Nothing where the rows that are left do not determine the coefficients.
  const std::optional<RestFit>& rest() const { return rest_; }

  void remove(Eigen::Index row) {
    kept_[row] = false;
    const Eigen::VectorXd toward = rest_->inverse_normal * X_.row(row).transpose();
    const double spread = 1 - X_.row(row).dot(toward);
    const double residual = y_[row] - X_.row(row).dot(rest_->coefficients);
    const double sum = rest_->residual_sum - residual * residual / spread;
    information_ *= spread;  // the determinant of XᵀX, as a share
    if (++steps_ > kMostSteps || !(information_ > kLeastInformation) ||
        !(sum > kLeastScatter * fitted_sum_)) {
      refit();
      return;
    }
    rest_->inverse_normal += toward * toward.transpose() / spread;
    rest_->coefficients -= toward * (residual / spread);
    rest_->residual_sum = sum;
    --rest_->dof;
  }

  /// The row whose deletion residual is largest among those that are left: Student's t of a row rises with
  /// the scatter that it takes along, e²/(1 − h).
  Eigen::Index most_extreme() const {
    Eigen::Index extreme = 0;
    double largest = -1;
    for (Eigen::Index row = 0; row < X_.rows(); ++row) {
      if (!kept_[row]) continue;
      if (const double scatter = scatter_taken_by(row); scatter > largest) {
        largest = scatter;
        extreme = row;
      }
    }
    return extreme;
  }

 private:
  /// In plain loops: this is asked of every row at every step, and products of a row or two are slow in
  /// Eigen.
  double scatter_taken_by(Eigen::Index row) const {
    double residual = y_[row], spread = 1;
    for (Eigen::Index a = 0; a < X_.cols(); ++a) {
      double toward = 0;
      for (Eigen::Index b = 0; b < X_.cols(); ++b) toward += rest_->inverse_normal(a, b) * X_(row, b);
      spread -= X_(row, a) * toward;
      residual -= X_(row, a) * rest_->coefficients[a];
    }
    // a row that alone determines a coefficient has no deletion residual
    return spread < 1e-10 ? 0 : residual * residual / spread;
  }

  void refit() {
    const auto fit = regress(rows_where(X_, kept_), rows_where(y_, kept_));
    rest_.reset();
    if (fit) rest_.emplace(*fit);
    fitted_sum_ = fit ? fit->residual_sum : 0;
    information_ = 1;
    steps_ = 0;
  }

  const Eigen::MatrixXd& X_;
  const Eigen::VectorXd& y_;
  Eigen::Array<bool, Eigen::Dynamic, 1> kept_;
  std::optional<RestFit> rest_;
  double fitted_sum_ = 0, information_ = 1;  // where it was fitted last, and since then
  int steps_ = 0;
};

/// `next` names the row to take out of what is left.
template <typename Next>
Removal remove_rows(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, Eigen::Index count,
                    const Next& next) {
  Removal removal;
  ShrinkingFit fit(X, y);
  while (fit.rest()) {
    removal.rests.push_back(*fit.rest());
    if (std::ssize(removal.order) == count) break;
    removal.order.push_back(next(fit, removal.order.size()));
    fit.remove(removal.order.back());
  }
  return removal;
}

}  // namespace

Removal remove_in_order(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, std::vector<Eigen::Index> order,
                        Eigen::Index count) {
  return remove_rows(X, y, count, [&](const ShrinkingFit&, std::size_t step) { return order[step]; });
}

Removal remove_stepwise(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, Eigen::Index count) {
  return remove_rows(X, y, count, [](const ShrinkingFit& fit, std::size_t) { return fit.most_extreme(); });
}

}  // namespace tunnelrig
