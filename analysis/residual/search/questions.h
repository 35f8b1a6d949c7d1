// Whether what was found is beyond chance: each question is answered by data sets of its own.
#pragma once

#include "analysis/residual/search/null_maxima.h"
#include "analysis/residual/search/scan.h"

#include <cstdint>

namespace tunnelrig {

/// Counts the questions, so that no two are answered by the same data sets; the order in which they are asked
/// is a part of the result.
class Questions {
 public:
  /// `asked`: so many streams of random numbers are passed over.
  explicit Questions(std::uint64_t asked = 0) : asked_(asked) {}

  /// What chance makes of a scan on top of a fit, whose best candidate counts as no scatter. Refers to the
  /// scan, which has a candidate, and to the settings.
  NullMaxima maxima_of(const SearchData& data, const JointFit& fit, const Scan& scan, Draws what) {
    return maxima_of(data, fit, scan, what, data.settings());
  }
  NullMaxima maxima_of(const SearchData& data, const JointFit& fit, const Scan& scan, Draws what,
                       const SearchSettings& settings);

 private:
  std::uint64_t asked_;
};

}  // namespace tunnelrig
