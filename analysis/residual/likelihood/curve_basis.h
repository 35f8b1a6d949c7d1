// Columns of curves without a name, over a covariate from `low` to `high`.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace tunnelrig {

enum class CurveShape {
  kWaves,     // cos(π k u), u = (x − low)/(high − low), k = 1 …: bends of ever shorter length
  kLogWaves,  // the same over ln x: what happens near the low end of a wide range
  kSmooth,  // s, s², cos(π k u), k = 1 … (Eubank & Speckman 1990): what waves have found, as it is drawn
  kLogSmooth,    // the same over ln x
  kParabola,     // s², s = 2u − 1: what a straight line lacks; s where it stands alone
  kLogParabola,  // the same over ln x: what a power law lacks
  kLevelling,    // low/x, with s of ln x: the same, but less and less where x grows
  kStraight,     // s
  kLogStraight,  // the same over ln x
  kLevels,       // 1 at one of few values: what differs from the most common of them
};

/// Whether s is that of ln x: then x is above 0.
bool is_of_logarithm(CurveShape shape);

/// Whether it is waves, or smooth: it ends with the range.
bool has_waves(CurveShape shape);

/// How strong a slope is that goes with another condition x: 0 at the mean of the runs, ±1 at the farthest of
/// them, and no stronger beyond.
struct Strength {
  double centre = 0, scale = 1;
  double at(double x) const;
};

/// s: −1 at `low`, 1 at `high`. Beyond them a bend goes on for half of the range and waves do not; from there
/// on it stays as it is: what a curve does far from where it was seen is not known.
double curve_straight(CurveShape shape, double x, double low, double high);

/// The k-th column (from 1) at x; not of levels.
double curve_column(CurveShape shape, int k, double x, double low, double high);

/// The same of the i-th coefficient (from 0), less what was taken out of it of s; `tilt` empty: nothing was.
double tilted_column(CurveShape shape, const std::vector<double>& tilt, std::size_t i, double x, double low,
                     double high);

/// The k-th column (from 1) of levels: whether x is levels[k].
double level_column(const std::vector<double>& levels, int k, double x);

/// "waves", "log_waves", "smooth", "log_smooth", "parabola", "log_parabola", "levelling", "straight",
/// "log_straight", "levels".
std::string_view name_of(CurveShape shape);
std::optional<CurveShape> curve_shape(std::string_view name);

}  // namespace tunnelrig
