// The explanation's page: what its scripts draw (analysis/report/page/explanation*.js), as one document.
#include "analysis/report/explanation_page.h"

#include "analysis/report/render.h"
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/search/null_maxima.h"
#include "analysis/upper_median.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Json = nlohmann::ordered_json;

constexpr int kCoursePoints = 41;
constexpr double kLeastShown = 0.5;  // weight of a place

std::vector<double> sizes_of(const VectorXd& values) {
  const VectorXd sizes = values.cwiseAbs();
  return {sizes.begin(), sizes.end()};
}

/// As many digits as a picture shows; what is not known is null.
Json drawn(double value) {
  return std::isfinite(value) ? Json(std::strtod(fmt::format("{:.6g}", value).c_str(), nullptr))
                              : Json(nullptr);
}

Json drawn(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(drawn(value));
  return list;
}

Json rotor_number(int rotor) { return rotor < 0 ? Json(nullptr) : Json(rotor + 1); }

class Page {
 public:
  Page(const Explanation& explanation, const Observations& observations)
      : explanation_(explanation),
        observations_(without_set_aside(observations, explanation)),
        rows_(observations_.all_rows()),
        before_(-explanation.residual_before),
        after_(-explanation.residual_after) {
    forces_ = predict_forces(observations_, explanation.model, rows_);
  }

  Json runs() const {
    Json json{{"name", observations_.name}, {"before", Json::array()}, {"after", Json::array()}};
    for (const int row : rows_) {
      const auto r = static_cast<std::size_t>(row);
      json["location"].push_back(observations_.group_name[static_cast<std::size_t>(observations_.group[r])]);
      json["block"].push_back(observations_.block[r]);
    }
    json["block_name"] = observations_.block_name;
    for (Index c = 0; c < observations_.channels(); ++c) {
      json["before"].push_back(column(before_, c));
      json["after"].push_back(column(after_, c));
    }
    return json;
  }

  /// Each covariate of each effect and each structure without a name.
  Json panels() const {
    Json list = Json::array();
    for (std::size_t t = 0; t < explanation_.adopted.size(); ++t) add_effect(t, list);
    for (const UnknownStructure& unknown : explanation_.unknown) add_unknown(unknown, list);
    return list;
  }

  /// What happened within the runs, for effects that change with time.
  Json courses() const {
    Json list = Json::array();
    if (observations_.shape.empty() || !observations_.multiplicative) return list;
    std::set<int> done;
    for (const AdoptedEffect& adopted : explanation_.adopted)
      if (adopted.term.effect->within_time() && done.insert(adopted.term.rotor).second)
        list.push_back(course(adopted.term.label(), adopted.term.rotor));
    for (const UnknownStructure& unknown : explanation_.unknown)
      if (unknown.covariate == "time_in_run" && done.insert(unknown.rotor).second)
        list.push_back(course("time_in_run", unknown.rotor));
    return list;
  }

  Json rounds(const std::vector<Round>& rounds, double alpha) const {
    Json list = Json::array();
    for (const Round& round : rounds) {
      Json json{{"outcome", round.outcome},
                {"observed", drawn(round.observed)},
                {"critical", drawn(round.critical > 0 ? round.critical : critical(round, alpha))},
                {"null_maxima", drawn(round.null_maxima)},
                {"ranking", Json::array()}};
      for (const Ranked& ranked : round.ranking) {
        const EffectParameter& amplitude = ranked.term.effect->parameters[0];
        json["ranking"].push_back({{"label", ranked.term.label()},
                                   {"evidence", drawn(ranked.evidence)},
                                   {"p", drawn(ranked.p)},
                                   {"parameter", amplitude.name},
                                   {"unit", unit_of(observations_, *ranked.term.effect, 0)},
                                   {"amplitude", drawn(ranked.amplitude)},
                                   {"standard_error", drawn(ranked.standard_error)}});
      }
      list.push_back(std::move(json));
    }
    return list;
  }

 private:
  static double critical(const Round& round, double alpha) {
    return round.null_maxima.empty() ? 0 : critical_of(round.null_maxima, alpha);
  }

  static Json column(const MatrixXd& values, Index c) {
    Json list = Json::array();
    for (Index row = 0; row < values.rows(); ++row) list.push_back(drawn(values(row, c)));
    return list;
  }

  /// The part of what a term adds to y that a residual shows: without what the baseline can absorb.
  MatrixXd visible(const MatrixXd& added) const {
    const MixedModel mixed = MixedModel::baseline_alone(observations_, rows_);
    Components components(1 + observations_.shape.size(), MatrixXd::Zero(added.rows(), added.cols()));
    components[0] = added;
    MatrixXd by_mode = MatrixXd::Zero(added.rows(), added.cols());
    for (std::size_t s = 0; s < mixed.strata().size(); ++s) {
      const MixedModel::Stratum& stratum = mixed.strata()[s];
      if (!stratum.means()) continue;
      Stacked stacked = mixed.stack(s, {&components});
      mixed.project(s, 0, stacked);
      by_mode.middleCols(stratum.first_mode, stratum.modes) =
          Eigen::Map<const MatrixXd>(stacked.data(), added.rows(), stratum.modes);
    }
    return by_mode * mixed.rotors_of_modes();
  }

  /// Points of one covariate: the residual with everything else in, and what this term makes of it, with half
  /// of its band's height where it has one. Of a
  /// place: runs where it counts by half or more, turned round where it is below zero; of another condition
  /// that half of the runs where it counts more.
  Json panel(const std::string& label, const std::string& covariate, const MatrixXd& x, int rotor,
             const MatrixXd& fitted, const Curve& curve = {}, const MatrixXd& half = {}) const {
    const VectorXd& weight_of_run = curve.place.weight;
    const double least_shown = curve.strength ? upper_median(sizes_of(weight_of_run)) : kLeastShown;
    const Covariate* known = observations_.find(covariate);
    Json json{{"label", label},
              {"covariate", covariate},
              {"covariate_unit", known == nullptr ? "" : known->unit},
              {"labels", known == nullptr ? std::vector<std::string>{} : known->labels},
              {"place", curve.in_place()},
              {"times", curve.times()},
              {"rotor", rotor_number(rotor)}};
    for (Index c = 0; c < observations_.channels(); ++c) {
      if (rotor >= 0 && c != rotor) continue;
      for (const int row : rows_) {
        const double at = x(row, x.cols() > 1 ? c : 0);
        if (!std::isfinite(at) || !std::isfinite(after_(row, c))) continue;
        const double weight = curve.everywhere() ? 1 : weight_of_run(row);
        if (std::abs(weight) < least_shown) continue;
        const double side = weight < 0 ? -1 : 1;
        json["run"].push_back(row);
        json["channel"].push_back(c + 1);
        json["x"].push_back(drawn(at));
        json["before"].push_back(drawn(side * (after_(row, c) + fitted(row, c))));
        json["after"].push_back(drawn(side * after_(row, c)));
        json["fitted"].push_back(drawn(side * fitted(row, c)));
        if (half.size() > 0) json["half"].push_back(drawn(std::abs(weight) * half(row, c)));
      }
    }
    return json;
  }

  /// What the t-th effect does, n × c on the scale of y; where each group has its own amplitude, by that
  /// group's.
  MatrixXd added_by(std::size_t t) const {
    const AdoptedEffect& adopted = explanation_.adopted[t];
    if (!adopted.term.per_group) return respond(adopted.term, observations_, forces_.acted_on[t]).value[0];
    const VectorXd amplitude = values_by_group(observations_, adopted.parameters[0].groups);
    return respond_in_groups(adopted.term, amplitude, observations_, forces_.acted_on[t]).value;
  }

  void add_effect(std::size_t t, Json& list) const {
    const AdoptedEffect& adopted = explanation_.adopted[t];
    const MatrixXd added = visible(added_by(t));
    const MatrixXd fitted =
        added.cwiseProduct(observations_.multiplicative ? forces_.predicted : observations_.known);
    std::vector<std::string> names = adopted.term.effect->covariates;
    if (names.empty() && adopted.term.effect->needs_previous) names = {"run_order"};
    if (names.empty()) {  // it goes with the force itself
      list.push_back(panel(adopted.term.label(), "predicted " + explanation_.response, forces_.predicted,
                           adopted.term.rotor, fitted));
      list.back()["covariate_unit"] = explanation_.unit;
    }
    for (const std::string& name : names) {
      const Covariate* covariate = observations_.find(name);
      if (covariate == nullptr || !(covariate->value.maxCoeff() > covariate->value.minCoeff())) continue;
      list.push_back(panel(adopted.term.label(), name, covariate->value, adopted.term.rotor, fitted));
    }
  }

  void add_unknown(const UnknownStructure& unknown, Json& list) const {
    std::vector<Curve> curves = explanation_.model.curves;
    curves.insert(curves.end(), explanation_.by_sealed_too.begin(), explanation_.by_sealed_too.end());
    for (const Curve& curve : curves) {
      if (curve.covariate != unknown.condition || curve.rotor != unknown.rotor ||
          curve.in_place() != unknown.place || curve.times() != unknown.times || curve.x.size() == 0)
        continue;
      MatrixXd shape = MatrixXd::Zero(observations_.rows(), observations_.channels()), half = shape;
      for (Index row = 0; row < shape.rows(); ++row)
        for (Index c = 0; c < shape.cols(); ++c) {
          if (curve.rotor >= 0 && c != curve.rotor) continue;
          const ShapePoint point =
              unknown.levels ? at_level(unknown.shape, curve.x(row, 0), curve.levels[0])
                             : interpolated(unknown.shape, curve.x(row, curve.x.cols() > 1 ? c : 0));
          shape(row, c) = point.y;
          half(row, c) = (point.high - point.low) / 2;
        }
      if (!curve.everywhere()) shape = curve.place.weight.asDiagonal() * shape;
      list.push_back(panel("unknown: " + curve.label(), curve.covariate, curve.x, curve.rotor, visible(shape),
                           curve, half));
      return;
    }
    if (unknown.covariate == "session") {
      MatrixXd block(observations_.rows(), 1);
      for (const int row : rows_) block(row, 0) = observations_.block[static_cast<std::size_t>(row)] + 1;
      const std::string rotor = unknown.rotor < 0 ? "" : fmt::format(" of rotor {}", unknown.rotor + 1);
      list.push_back(panel("unknown: session" + rotor, "session", block, unknown.rotor,
                           MatrixXd::Zero(after_.rows(), after_.cols())));
    }
  }

  /// A value that is too rare to be told apart counts as the most common one.
  static ShapePoint at_level(const std::vector<ShapePoint>& shape, double x, double most_common) {
    const auto of = [&](double value) {
      return std::find_if(shape.begin(), shape.end(), [&](const ShapePoint& p) { return p.x == value; });
    };
    return of(x) != shape.end() ? *of(x) : *of(most_common);
  }

  static ShapePoint interpolated(const std::vector<ShapePoint>& shape, double x) {
    if (x <= shape.front().x) return shape.front();
    for (std::size_t p = 1; p < shape.size(); ++p) {
      if (x > shape[p].x) continue;
      const ShapePoint &a = shape[p - 1], &b = shape[p];
      const double share = (x - a.x) / (b.x - a.x);
      return {x, std::lerp(a.y, b.y, share), std::lerp(a.low, b.low, share),
              std::lerp(a.high, b.high, share)};
    }
    return shape.back();
  }

  /// Mean course over the runs with its 95 % band, and with the model's terms taken out; % of the run's mean.
  Json course(const std::string& label, int rotor) const {
    Components modelled(1 + observations_.shape.size(),
                        MatrixXd::Zero(observations_.rows(), observations_.channels()));
    for (std::size_t t = 0; t < forces_.acted_on.size(); ++t) {
      const TermResponse response = respond(explanation_.model.terms[t], observations_, forces_.acted_on[t]);
      for (std::size_t k = 0; k < modelled.size(); ++k) modelled[k] += response.value[k];
    }
    Json json{{"label", label},
              {"rotor", rotor_number(rotor)},
              {"duration_s", drawn(observations_.duration_s.mean())}};
    for (int p = 0; p < kCoursePoints; ++p) {
      const double u = static_cast<double>(p) / (kCoursePoints - 1);
      VectorXd measured = VectorXd::Zero(observations_.rows()), model = measured;
      for (std::size_t j = 1; j < modelled.size(); ++j) {
        const double cosine = 100 * std::cos(std::numbers::pi * static_cast<double>(j) * u);
        measured += cosine * of_rotor(observations_.shape[j - 1], rotor);
        model += cosine * of_rotor(modelled[j], rotor);
      }
      json["u"].push_back(drawn(u));
      json["measured"].push_back(drawn(measured.mean()));
      json["half"].push_back(drawn(half_width(measured)));
      json["model"].push_back(drawn(model.mean()));
      json["after"].push_back(drawn((measured - model).mean()));
      json["after_half"].push_back(drawn(half_width(measured - model)));
    }
    return json;
  }

  static VectorXd of_rotor(const MatrixXd& values, int rotor) {
    return rotor < 0 ? VectorXd(values.rowwise().mean()) : VectorXd(values.col(rotor));
  }

  static double half_width(const VectorXd& values) {
    const double n = static_cast<double>(values.size()), dof = std::max(1.0, n - 1);
    return half_width_95(std::sqrt((values.array() - values.mean()).square().sum() / dof / n), dof);
  }

  const Explanation& explanation_;
  const Observations observations_;
  std::vector<int> rows_;
  MatrixXd before_, after_;  // measured less predicted
  Forces forces_;
};

Json effects_of(const Explanation& explanation) {
  Json list = Json::array();
  for (const AdoptedEffect& adopted : explanation.adopted)
    list.push_back({{"label", adopted.term.label()},
                    {"formula", adopted.term.effect->formula},
                    {"physics", adopted.term.effect->physics}});
  return list;
}

}  // namespace

std::string explanation_html(const Explanation& explanation, const Observations& observations,
                             const SearchSettings& settings, const PageOrigin& origin) {
  const Page page(explanation, observations);
  const Json document{{"format", "tunnelrig-explanation-page/1"},
                      {"made",
                       {{"db", origin.db},
                        {"program", "tunnelrig " + origin.program_version},
                        {"arguments", origin.arguments},
                        {"created_utc", origin.created_utc}}},
                      {"settings",
                       {{"alpha", settings.alpha},
                        {"seed", settings.seed},
                        {"simulations", settings.simulations},
                        {"most_effects", settings.most_effects}}},
                      {"explanation", Json::parse(explanation_json(explanation))},
                      {"verdict_in_words", verdict_in_words(explanation)},
                      {"effects", effects_of(explanation)},
                      {"runs", page.runs()},
                      {"panels", page.panels()},
                      {"courses", page.courses()},
                      {"rounds", page.rounds(explanation.rounds, settings.alpha)},
                      {"curve_rounds", page.rounds(explanation.curve_rounds, settings.alpha)}};
  // Paths need not be UTF-8.
  return render_explanation(document.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace tunnelrig
