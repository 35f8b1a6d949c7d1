// The runs that are searched, as far as they are understood, and what may explain them.
#pragma once

#include "analysis/residual/likelihood/curves.h"
#include "analysis/residual/search/attribution.h"

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace tunnelrig {

/// Only two things change while a search goes on: what the runs scatter like, with which it begins again, and
/// the columns of effects with an amplitude of each group's own, which are slopes of the baseline. Whoever
/// changes the observations gets the mixed models that belong to them.
class SearchData {
 public:
  /// Keeps references to `rows`, `effects` and `settings`. Nothing is searched, or judged, by a response
  /// outside of `rows`.
  SearchData(const Observations& observations, const std::vector<int>& rows,
             const std::vector<const Effect*>& effects, const SearchSettings& settings);
  SearchData(const SearchData&) = delete;  // the models refer to its observations
  SearchData& operator=(const SearchData&) = delete;

  // the same all along
  const std::vector<int>& rows() const { return rows_; }
  const SearchSettings& settings() const { return settings_; }
  const Components& y() const { return y_; }
  const std::vector<Curve>& curves_to_try() const { return curves_to_try_; }

  const Observations& observations() const { return observations_; }
  const MixedModel& mixed() const { return *mixed_; }
  /// Of runs that are independent: what the baseline can absorb.
  const MixedModel& baseline() const { return *baseline_; }

  /// The effects in all their ways, but for those taken back and those that the runs cannot show; as it was
  /// when the search began.
  const std::vector<Term>& ways() const { return ways_; }
  /// How many of them are of an effect and a rotor: of a step, the change-points that are tried.
  std::size_t ways_like(const Term& way) const;

  /// The runs as they were given, but for what they scatter like.
  void begin_with(RunScatter scatter);
  void set_observations(Observations observations);

 private:
  void make_models();
  void list_ways();

  const std::vector<int>& rows_;
  const std::vector<const Effect*>& effects_;
  const SearchSettings& settings_;
  const Observations given_;
  Observations observations_;
  const std::vector<Curve> curves_to_try_;
  const Components y_;
  std::unique_ptr<MixedModel> mixed_, baseline_;
  std::vector<Term> ways_;
  std::map<std::string, std::size_t> ways_of_;  // an effect and a rotor
};

/// Of what a column (n × c, in y) leaves beside the baseline; 0 where that is rounding.
double rms_beside_baseline(const SearchData& data, const Eigen::MatrixXd& column);

}  // namespace tunnelrig
