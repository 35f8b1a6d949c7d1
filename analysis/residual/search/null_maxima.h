// What the largest evidence of all candidates is where there is no effect.
#pragma once

#include "analysis/residual/search/attribution.h"
#include "analysis/residual/search/draws.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace tunnelrig {

/// What only α of the data sets exceed, of which these are the maxima; one at least.
inline double critical_of(std::vector<double> maxima, double alpha) {
  std::sort(maxima.begin(), maxima.end());
  const auto rank =
      static_cast<std::size_t>(std::ceil((1 - alpha) * static_cast<double>(maxima.size() + 1))) - 1;
  return maxima[std::min(rank, maxima.size() - 1)];
}

/// Of data sets that are drawn from one null model, as they are asked for: early enough that a campaign
/// without effect costs little, and never before the p that was asked for is settled (Besag & Clifford 1991).
class DrawnMaxima {
 public:
  DrawnMaxima(const CandidateScan& scan, NullFit null, const SearchSettings& settings, std::uint64_t stream)
      : scan_(scan),
        null_(std::move(null)),
        settings_(settings),
        random_(random_numbers(settings.seed, stream)) {}

  double p(double evidence) {
    constexpr std::size_t kBatch = 111, kEnough = 30;
    std::size_t above = count(evidence);
    while (maxima_.size() < settings_.simulations && above < kEnough) {
      const auto batch =
          scan_.simulated_maxima(null_, std::min(kBatch, settings_.simulations - maxima_.size()), random_);
      maxima_.insert(maxima_.end(), batch.begin(), batch.end());
      above = count(evidence);
    }
    return (1.0 + static_cast<double>(above)) / (1.0 + static_cast<double>(maxima_.size()));
  }

  /// The evidence that only α of the null campaigns exceed.
  double critical() {
    p(1e9);  // all of them
    return critical_of(maxima_, settings_.alpha);
  }
  const std::vector<double>& values() const { return maxima_; }

 private:
  std::size_t count(double evidence) const {
    return static_cast<std::size_t>(
        std::count_if(maxima_.begin(), maxima_.end(), [&](double m) { return m >= evidence; }));
  }

  const CandidateScan& scan_;
  const NullFit null_;
  const SearchSettings& settings_;
  std::mt19937_64 random_;
  std::vector<double> maxima_;
};

/// With normal scatter, and once more with runs as far off as what is left of them, the sign drawn: scatter
/// may go with anything (Wu 1986: the wild bootstrap). Of the two what is less beyond chance counts.
class NullMaxima {
 public:
  /// `sizes`: see NullFit; empty: normal scatter alone.
  NullMaxima(const CandidateScan& scan, NullFit null, std::vector<Eigen::MatrixXd> sizes,
             const SearchSettings& settings, std::uint64_t stream)
      : normal_(scan, null, settings, stream), alpha_(settings.alpha) {
    if (sizes.empty()) return;
    null.sizes = std::move(sizes);
    by_size_.emplace(scan, std::move(null), settings, stream + kDrawsWithoutNormality);
  }

  double p(double evidence) {
    const double p = normal_.p(evidence);
    return by_size_ && p <= alpha_ ? std::max(p, by_size_->p(evidence)) : p;
  }
  /// The evidence that only α of the null campaigns exceed.
  double critical() {
    by_size_decides_ = by_size_ && by_size_->critical() > normal_.critical();
    return by_size_decides_ ? by_size_->critical() : normal_.critical();
  }
  /// Those that the critical evidence is of.
  const std::vector<double>& values() const {
    return by_size_decides_ ? by_size_->values() : normal_.values();
  }

 private:
  DrawnMaxima normal_;
  std::optional<DrawnMaxima> by_size_;
  bool by_size_decides_ = false;
  double alpha_;
};

}  // namespace tunnelrig
