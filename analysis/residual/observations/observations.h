// What the model is held against: one response per run and rotor, what is known of each run, and how runs
// belong together.
#pragma once

#include "analysis/campaign_data.h"
#include "datasets/observations.h"

#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// A condition of every run: a column of the runs sheet, or one derived from it. NaN where it was not
/// recorded.
struct Covariate {
  std::string name;
  Eigen::MatrixXd value;                 // runs × 1, or runs × channels where each channel has its own
  bool derived = false;                  // made here, not a column of the sheet
  std::string unit = {};                 // empty: the name says it, or it is not known
  std::vector<std::string> labels = {};  // of a column of texts: value i + 1 stands for labels[i]
  Eigen::MatrixXd at_zero = {};          // as `value`, when the run's zero was taken: NaN where not by tares;
                                         // empty: by no tares, or it is no condition of a zero

  bool per_channel() const { return value.cols() > 1; }
  double at(Eigen::Index run, Eigen::Index channel) const { return value(run, per_channel() ? channel : 0); }
  double zero(Eigen::Index run, Eigen::Index channel) const {
    return at_zero(run, per_channel() ? channel : 0);
  }
};

/// Conditions of a run when its zero was taken, in the order of these; empty where not by tares, or where one
/// is no condition of a zero.
std::vector<double> at_zero(const std::vector<const Covariate*>& covariates, Eigen::Index run,
                            Eigen::Index channel);

inline constexpr std::string_view kGroundDistance = "ground_distance_R",
                                  kCeilingDistance = "ceiling_distance_R",
                                  kDiameter = "propeller_diameter_m";  // of a table's propellers
inline constexpr double kLargestResponse = 1e100;  // squares of larger ones, summed, are no numbers
inline constexpr std::size_t kRunsPerGross = 25,
                             kRowsPerGross = 10;              // what touches more is no slip of the hand
inline constexpr const char* kConstantBaseline = "constant";  // a table's, where nothing else is said

/// A place without ground or ceiling has no distance to it, and what depends on the distance is absent there.
inline bool may_be_absent(std::string_view covariate) {
  return covariate == kGroundDistance || covariate == kCeilingDistance;
}

/// The places in `rows` of each group or block, by its number; `number` is of all rows.
std::map<int, std::vector<Eigen::Index>> places_of_each(const std::vector<int>& number,
                                                        const std::vector<int>& rows);

/// Of all rows.
std::map<int, std::vector<Eigen::Index>> places_of_each(const std::vector<int>& number);

/// The rows themselves.
std::map<int, std::vector<int>> rows_of_each(const std::vector<int>& number, const std::vector<int>& rows);

/// Places in the order of their numbers.
std::vector<std::vector<Eigen::Index>> without_numbers(
    const std::map<int, std::vector<Eigen::Index>>& places);

/// A column of texts; an empty cell is a text as well.
Covariate covariate_of_texts(const std::string& name, const std::vector<std::string>& texts);

/// Of the places below: 1 in the tunnel; how far to the side, how high, and how near to either wall.
inline constexpr std::array<std::string_view, 4> kPlaces = {"tunnel", "y_norm", "z_norm", "|y_norm|"};

/// What an effect may go with from one location to another: it is so many times as strong.
struct Place {
  std::string name = {};        // one of kPlaces; empty: alike everywhere
  Eigen::VectorXd weight = {};  // n, −1 to 1; 0 in open space
};

/// Where sessions differ more in some rotors than in others (rotor_sessions.h).
struct RotorSessions {
  Eigen::MatrixXd modes = {};  // c × c: by which rows of rotors are multiplied; empty: they differ alike
  int alone = 1;               // so many modes, from the first, have variances of their own each
  std::vector<int> rotors = {};
};

/// What the runs' scatter is like. Not known before the search has found it.
struct RunScatter {
  /// Of neighbouring runs of a block: what rotors have in common, what they differ by (run_correlation.h).
  std::array<double, 2> run_correlation = {0, 0};
  /// Each rotor's own over their geometric mean; empty: alike (rotor_scatter.h).
  Eigen::VectorXd rotors = {};
  /// Each contrast's of four rotors over their geometric mean, which is each a stratum of its own then;
  /// empty: alike (contrast_scatter.h).
  Eigen::VectorXd contrasts = {};
  RotorSessions sessions = {};
  /// n: each run's over that of most, by location and session; empty: alike (run_scatter.h).
  Eigen::VectorXd runs = {};
  /// n: each run's over the rms of all, by these conditions; empty: alike (condition_scatter.h).
  struct ByCondition {
    std::set<std::string> names = {};
    Eigen::VectorXd runs = {};
  } by_condition = {};

  /// Whether nothing was found.
  bool alike() const {
    return !rotors_differ() && runs.size() == 0 && by_condition.names.empty() &&
           run_correlation == std::array<double, 2>{0, 0};
  }
  bool rotors_differ() const { return rotors.size() > 0 || contrasts.size() > 0 || !sessions.rotors.empty(); }
  /// Of some runs, by all of these; 1 where all are alike.
  Eigen::VectorXd of_runs(const std::vector<int>& rows) const;
  RunScatter subset(const std::vector<int>& kept) const;
};

/// n runs (rows of a table) by c channels (rotors; 1 for a table).
///
/// Where a campaign's response is positive, and a table's of one sign (unless it scatters alike or the
/// baseline is `linear:`), the model is multiplicative: `y` is the logarithm of the response over what the
/// baseline takes as known (k_i ½ρΩ²R²A), and errors are relative. Otherwise it is additive: `y` is the
/// response over that factor's ratio to its value in standard air (of a table the response itself).
struct Observations {
  std::string campaign, response, unit, baseline;
  bool multiplicative = true;
  Eigen::MatrixXd value;  // n × c, in the unit
  Eigen::MatrixXd known;  // n × c: the baseline's known factor, or its ratio where additive; 1: there is none
  Eigen::MatrixXd y;      // n × c
  std::vector<Eigen::MatrixXd>
      shape;  // J matrices n × c: cosine coefficients of the run's course; empty without raw data
  Eigen::VectorXd duration_s;  // of the raw data, else the column of this name; 0: neither, or a table

  std::vector<std::string> name;  // of each run, or "file:line" of a row
  std::vector<int> group,
      block;  // baseline group (location) and block (session), from 0; blocks in order of time
  std::vector<std::string> group_name, block_name;
  Eigen::MatrixXd
      slopes;  // n × s: baseline columns beside the constants, with coefficients of each group's own
  Eigen::MatrixXd beyond = {};  // n × e: what effects with an amplitude of each group's own, whose columns
                                // are the last e of `slopes`, do beside amplitude · column; empty: none
  std::vector<bool> in_tunnel;
  std::vector<int> previous;   // the run before in the same session, −1 for the first
  Eigen::VectorXd position;    // n: what change-points are held against; empty: the row's place, from 0
  std::vector<bool> held_out;  // a table's hold_out expression; empty: seal blocks instead
  bool from_table = false, blocks_are_rows = false;
  bool coefficient = false;  // the response is a thrust coefficient, or is made one by its measured speed
  bool of_air = false;       // it is a thrust, a coefficient, power or torque, without the density of the air
  bool of_no_cell = false;   // nothing says that a cell read it: a number, a time, a length
  bool groups_within_blocks =
      false;  // the block is the group: its baseline is estimated anew where it is held out
  RunScatter scatter;
  std::vector<Place> places;  // none in tables

  Eigen::VectorXd newtons_per_volt;  // c
  /// n: −1 where `value` is the magnitude of a response below zero, which effects are added to with its sign.
  Eigen::VectorXd sign;
  Rig rig;
  std::vector<Covariate> covariates;
  std::set<std::string> assumed;                    // covariates nobody recorded: the standard's
  std::map<std::string, std::string> not_usable;    // covariate: why (missing in some runs, constant, a text)
  std::map<std::string, std::string> left_out_for;  // covariate: why runs are left out for it
  std::vector<std::string> left_out;                // "run: reason", and what else is wrong with runs
  std::vector<std::string> unmeasured;              // of these, a rotor without a thrust in some runs

  /// v = b + g T of a cell, a linear baseline that is over what it is loaded with: what it reads without a
  /// load is no force. A thrust over a condition has none.
  bool line_of_cell = false;
  std::string baseline_over;            // covariate that a table's line or power law is over; or empty
  std::vector<std::string> other_axes;  // covariates of a linear baseline's quantity

  /// [1 slopes] of rows: what a group's constant and slopes are multiplied by.
  template <class Rows>
  Eigen::MatrixXd baseline_columns(const Rows& rows) const {
    Eigen::MatrixXd columns(static_cast<Eigen::Index>(rows.size()), 1 + slopes.cols());
    columns << Eigen::VectorXd::Ones(columns.rows()), slopes(rows, Eigen::all);
    return columns;
  }

  Eigen::Index first_own_slope() const { return slopes.cols() - beyond.cols(); }
  Eigen::Index rows() const { return y.rows(); }
  Eigen::Index channels() const { return y.cols(); }
  int groups() const { return static_cast<int>(group_name.size()); }
  int blocks() const { return static_cast<int>(block_name.size()); }
  std::vector<int> all_rows() const;
  const Covariate* find(std::string_view wanted) const {
    for (const Covariate& covariate : covariates)
      if (covariate.name == wanted) return &covariate;
    return nullptr;
  }

  const Place* find_place(std::string_view wanted) const {
    for (const Place& place : places)
      if (place.name == wanted) return &place;
    return nullptr;
  }

  /// The same of some rows only. Groups and blocks without a row are gone; the others keep their order.
  Observations subset(const std::vector<int>& kept) const;

  /// The same with the responses of these rows only, NaN in all others: what must not be seen of sealed rows.
  Observations without_responses_but(const std::vector<int>& rows) const;
  /// What a small change of y is of the response, on the whole.
  double response_per_y() const { return multiplicative ? value.cwiseAbs().mean() : known.mean(); }
  /// Of a channel, from its magnitude.
  double signed_force_N(double size_N, Eigen::Index row) const {
    return sign.size() > 0 ? size_N * sign(row) : size_N;
  }
  bool has_response(Eigen::Index row) const { return !std::isnan(y(row, 0)); }
};

struct ObservationChoice {
  std::string response;  // "thrust", "c_t", "cell", or a column; empty: the table's response, or thrust
  std::string baseline;  // "thesis", "open_space"; tables: "constant", "linear:COLUMN", "power:COLUMN";
                         // empty: default
};

/// Cosine coefficients kept of a run's course: cos(π j (t/duration)), j = 1 … kShapes.
inline constexpr int kShapes = 6;

/// All thrust runs that can be reduced, with the thesis's model. Windows of the runs are used where `data`
/// has them. Throws InputError for a response or baseline that the campaign does not have, or a response
/// without variation.
Observations observe_campaign(const CampaignData& data, const ObservationChoice& choice);

/// The same whether or not the response varies: what is known of the runs, which a model corrects them by.
Observations observe_runs(const CampaignData& data, const ObservationChoice& choice);

/// All rows. Throws InputError likewise.
Observations observe_table(const ObservationTable& table, const ObservationChoice& choice);

/// How a table's rows belong together, those of a standing motor left out.
struct TableParts {
  int groups = 0, blocks = 0;
};

/// Throws InputError naming the schema's file and line where its groups, blocks or hold_out cannot be had of
/// the table: at import, where they can still be mended.
TableParts check_table(const ObservationTable& table);

}  // namespace tunnelrig
