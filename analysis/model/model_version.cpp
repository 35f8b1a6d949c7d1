#include "analysis/model/model_version.h"

#include "analysis/residual/observations/observations.h"
#include "datasets/error.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Json = nlohmann::ordered_json;
using Eigen::Index;

constexpr const char* kFormat = "tunnelrig-model/1";

Json rotor_json(int rotor) { return rotor < 0 ? Json(nullptr) : Json(rotor + 1); }

Json term_json(const ModelTerm& term) {
  Json json{{"effect", term.effect->name},     {"form", term.effect->form}, {"rotor", rotor_json(term.rotor)},
            {"other", rotor_json(term.other)}, {"theory", term.at_theory},  {"parameters", Json::object()},
            {"reference", Json::object()}};
  for (std::size_t k = 0; k < term.parameters.size(); ++k) {
    Json parameter{{"value", term.parameters[k]}, {"unit", term.units[k]}};
    if (term.effect->parameters[k].role == ParameterRole::kChangePoint) parameter["run"] = term.first_run;
    json["parameters"][term.effect->parameters[k].name] = parameter;
  }
  for (std::size_t k = 0; k < term.reference.size(); ++k)
    json["reference"][term.effect->covariates[k]] = term.reference[k];
  return json;
}

/// Reads one object of the document; every message says where in it.
class Reader {
 public:
  Reader(const Json& json, std::string where) : json_(json), where_(std::move(where)) {
    if (!json_.is_object()) fail("is no object");
  }

  [[noreturn]] void fail(const std::string& rule) const { throw InputError(where_ + " " + rule); }

  const Json& at(const std::string& key) const {
    const auto found = json_.find(key);
    if (found == json_.end()) fail("has no " + key);
    return *found;
  }
  bool has(const std::string& key) const { return json_.contains(key); }
  Reader object(const std::string& key) const { return {at(key), where_ + "." + key}; }
  const Json& list(const std::string& key) const {
    if (!at(key).is_array()) fail("has a " + key + " that is no list");
    return at(key);
  }
  std::string text(const std::string& key) const {
    if (!at(key).is_string()) fail("has a " + key + " that is no text");
    return at(key).get<std::string>();
  }
  double number(const std::string& key) const { return number_of(at(key), key); }
  bool flag(const std::string& key) const {
    if (!at(key).is_boolean()) fail("has a " + key + " that is neither true nor false");
    return at(key).get<bool>();
  }
  int whole(const std::string& key) const {
    const double value = number(key);
    if (value != std::floor(value) || std::abs(value) > 1e6)
      fail(fmt::format("has {} {}, which is no such number", key, value));
    return static_cast<int>(value);
  }
  /// From 0; −1 for null.
  int rotor(const std::string& key) const {
    if (at(key).is_null()) return -1;
    const int rotor = whole(key);
    if (rotor < 1 || rotor > kMaxRotors)
      fail(fmt::format("has {} {}; rotors are 1 to {}", key, rotor, kMaxRotors));
    return rotor - 1;
  }
  std::vector<double> numbers(const std::string& key) const {
    std::vector<double> values;
    for (const Json& value : list(key)) values.push_back(number_of(value, key));
    return values;
  }
  std::vector<std::string> texts(const std::string& key) const {
    std::vector<std::string> values;
    for (const Json& value : list(key)) {
      if (!value.is_string()) fail("has a " + key + " that is no text");
      values.push_back(value.get<std::string>());
    }
    return values;
  }
  const std::string& where() const { return where_; }

 private:
  double number_of(const Json& value, const std::string& key) const {
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      fail("has a " + key + " that is no finite number");
    return value.get<double>();
  }

  const Json& json_;
  std::string where_;
};

const Effect& effect_of(const Reader& reader) {
  const std::string name = reader.text("effect"), form = reader.text("form");
  for (const Effect& effect : all_effects())
    if (effect.name == name && effect.form == form) return effect;
  reader.fail(fmt::format("names the effect {}{}, which this program does not have", name,
                          form.empty() ? "" : " (" + form + ")"));
}

ModelTerm term_of(const Reader& reader) {
  ModelTerm term{.effect = &effect_of(reader),
                 .rotor = reader.rotor("rotor"),
                 .other = reader.rotor("other"),
                 .at_theory = reader.flag("theory")};
  if (term.effect->scope == EffectScope::kPair && (term.rotor < 0 || term.other < 0))
    reader.fail("needs a rotor and another that leaks into it");
  const Reader parameters = reader.object("parameters");
  for (const EffectParameter& parameter : term.effect->parameters) {
    const Reader one = parameters.object(parameter.name);
    term.parameters.push_back(one.number("value"));
    term.units.push_back(one.text("unit"));
    if (parameter.role == ParameterRole::kChangePoint) term.first_run = one.text("run");
  }
  const Reader reference = reader.object("reference");
  for (const std::string& covariate : term.effect->covariates)
    term.reference.push_back(reference.number(covariate));
  return term;
}

Json curve_json(const ModelCurve& curve) {
  Json json{{"covariate", curve.covariate},
            {"rotor", rotor_json(curve.rotor)},
            {"shape", name_of(curve.shape)},
            {"low", curve.low},
            {"high", curve.high},
            {"coefficients", curve.coefficients},
            {"centre", curve.centre},
            {"tilt", curve.tilt}};
  if (!curve.levels.empty()) json["levels"] = curve.levels;
  if (!curve.labels.empty()) json["labels"] = curve.labels;
  if (!curve.place.empty()) json["place"] = curve.place;
  if (curve.times)
    json["times"] = {{"covariate", curve.times->covariate},
                     {"centre", curve.times->strength.centre},
                     {"scale", curve.times->strength.scale},
                     {"mean", curve.times->mean}};
  return json;
}

/// Versions that were stored before there were other shapes do not say it.
CurveShape shape_of(const Reader& reader) {
  if (!reader.has("shape")) return CurveShape::kWaves;
  if (const auto shape = curve_shape(reader.text("shape"))) return *shape;
  reader.fail("has a shape which this program does not know");
}

OtherCondition condition_of(const Reader& reader) {
  OtherCondition condition{.covariate = reader.text("covariate"),
                           .strength = {.centre = reader.number("centre"), .scale = reader.number("scale")},
                           .mean = reader.number("mean")};
  if (!(condition.strength.scale > 0)) reader.fail("has a scale that is not above 0");
  return condition;
}

ModelCurve curve_of(const Reader& reader) {
  ModelCurve curve{.covariate = reader.text("covariate"),
                   .rotor = reader.rotor("rotor"),
                   .shape = shape_of(reader),
                   .low = reader.number("low"),
                   .high = reader.number("high"),
                   .coefficients = reader.numbers("coefficients"),
                   .centre = reader.numbers("centre"),
                   .tilt = reader.has("tilt") ? reader.numbers("tilt") : std::vector<double>(),
                   .levels = reader.has("levels") ? reader.numbers("levels") : std::vector<double>(),
                   .labels = reader.has("labels") ? reader.texts("labels") : std::vector<std::string>(),
                   .place = reader.has("place") ? reader.text("place") : std::string()};
  if (reader.has("times")) curve.times = condition_of(reader.object("times"));
  if (curve.covariate == "start_utc") curve.covariate = "hours_in_session";  // as it was called at first
  if (!(curve.high > curve.low)) reader.fail("has no range: high is not above low");
  if (is_of_logarithm(curve.shape) && !(curve.low > 0))
    reader.fail("has a shape over the logarithm, and a low that is not above 0");
  if (curve.coefficients.size() != curve.centre.size())
    reader.fail("has not as many coefficients as values of centre");
  if ((curve.shape == CurveShape::kLevels ? curve.coefficients.size() + 1 : 0) != curve.levels.size())
    reader.fail("needs one level more than coefficients, and no levels where its shape is another");
  if (!curve.place.empty() && std::find(kPlaces.begin(), kPlaces.end(), curve.place) == kPlaces.end())
    reader.fail(fmt::format("goes with the place {}, which this program does not know", curve.place));
  if (!curve.tilt.empty() && curve.tilt.size() != curve.coefficients.size())
    reader.fail("has not as many coefficients as values of tilt");
  return curve;
}

Eigen::MatrixXd covariance_of(const Reader& reader, Index size) {
  const Json& rows = reader.list("covariance");
  if (static_cast<Index>(rows.size()) != size)
    reader.fail(fmt::format("has a covariance of {} rows for {} parameters", rows.size(), size));
  Eigen::MatrixXd covariance(size, size);
  for (Index i = 0; i < size; ++i) {
    const Json& row = rows[static_cast<std::size_t>(i)];
    if (!row.is_array() || static_cast<Index>(row.size()) != size)
      reader.fail("has a covariance that is not square");
    for (Index j = 0; j < size; ++j) {
      const Json& value = row[static_cast<std::size_t>(j)];
      if (!value.is_number()) reader.fail("has a covariance with an entry that is no number");
      covariance(i, j) = value.get<double>();
    }
    if (covariance(i, i) < 0) reader.fail("has a covariance with a variance below 0");
  }
  return covariance;
}

}  // namespace

bool ModelTerm::counts_from_reference(std::size_t k) const {
  const Rig rig;
  std::vector<double> elsewhere = reference;
  elsewhere[k] += 1 + 0.01 * std::abs(elsewhere[k]);
  std::vector<double> p = parameters;
  if (p[0] == 0) p[0] = 1;
  const auto force_N = [&](const std::vector<double>& from) {
    return effect->force_N({.x = reference, .reference = from, .at_zero = {}, .rig = &rig}, p.data(), 1);
  };
  return std::abs(force_N(elsewhere) - force_N(reference)) > 0;
}

std::string ModelTerm::label() const { return effect->label(rotor, other); }

double ModelCurve::column(std::size_t k, double x) const {
  if (shape == CurveShape::kLevels) return level_column(levels, static_cast<int>(k) + 1, x) - centre[k];
  return tilted_column(shape, tilt, k, x, low, high) - centre[k];
}

std::string ModelCurve::label() const {
  const std::string with = times ? times->covariate : place;
  return fmt::format("curve over {}{}{} (empirical)", covariate, with.empty() ? "" : " × " + with,
                     rotor < 0 ? "" : fmt::format(" of rotor {}", rotor + 1));
}

std::map<std::string, double> ModelVersion::reference() const {
  std::map<std::string, double> result;
  for (const ModelTerm& term : terms)
    for (std::size_t k = 0; k < term.reference.size(); ++k)
      if (term.counts_from_reference(k)) result[term.effect->covariates[k]] = term.reference[k];
  return result;
}

Eigen::VectorXd ModelVersion::parameters() const {
  std::vector<double> values;
  for (const ModelTerm& term : terms)
    values.insert(values.end(), term.parameters.begin(), term.parameters.end());
  for (const ModelCurve& curve : curves)
    values.insert(values.end(), curve.coefficients.begin(), curve.coefficients.end());
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
}

std::vector<std::string> ModelVersion::effects() const {
  std::vector<std::string> labels;
  for (const ModelTerm& term : terms) labels.push_back(term.label());
  for (const ModelCurve& curve : curves) labels.push_back(curve.label());
  return labels;
}

std::string ModelVersion::name() const {
  return fmt::format("version {} ({})", version, fmt::join(effects(), ", "));
}

std::string model_json(const ModelVersion& model) {
  Json json{{"format", kFormat},
            {"version", model.version},
            {"parent", model.parent},
            {"baseline", model.baseline},
            {"multiplicative", model.multiplicative},
            {"terms", Json::array()},
            {"curves", Json::array()},
            {"covariance", Json::array()},
            {"dof", std::isfinite(model.dof) ? Json(model.dof) : Json(nullptr)}};
  for (const ModelTerm& term : model.terms) json["terms"].push_back(term_json(term));
  for (const ModelCurve& curve : model.curves) json["curves"].push_back(curve_json(curve));
  for (Index i = 0; i < model.covariance.rows(); ++i) {
    Json row = Json::array();
    for (Index j = 0; j < model.covariance.cols(); ++j) row.push_back(model.covariance(i, j));
    json["covariance"].push_back(std::move(row));
  }
  json["explanation"] = Json::parse(model.explanation);
  return json.dump(1);
}

ModelVersion model_from_json(const std::string& text, const std::string& source) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) throw InputError(source + " is no JSON");
  const Reader reader(json, source);
  if (const std::string format = reader.text("format"); format != kFormat)
    reader.fail(fmt::format("has the format {}; this program reads {}", format, kFormat));
  ModelVersion model{.version = reader.whole("version"),
                     .parent = reader.whole("parent"),
                     .baseline = reader.text("baseline"),
                     .multiplicative = reader.flag("multiplicative")};
  if (model.version < 1) reader.fail("has a version below 1");
  if (model.parent != 0)
    reader.fail(fmt::format("builds on version {}; versions build on thesis (0)", model.parent));
  std::size_t number = 0;
  for (const Json& term : reader.list("terms"))
    model.terms.push_back(term_of({term, fmt::format("{}, term {}", source, ++number)}));
  number = 0;
  for (const Json& curve : reader.list("curves"))
    model.curves.push_back(curve_of({curve, fmt::format("{}, curve {}", source, ++number)}));
  model.covariance = covariance_of(reader, model.parameters().size());
  if (!reader.at("dof").is_null()) model.dof = reader.number("dof");
  if (!(model.dof > 0)) reader.fail("has dof that are not above 0");
  reader.object("explanation");
  model.explanation = reader.at("explanation").dump(1);
  return model;
}

}  // namespace tunnelrig
