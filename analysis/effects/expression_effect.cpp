#include "analysis/effects/expression_effect.h"

#include "analysis/expression.h"
#include "datasets/csv.h"
#include "datasets/error.h"
#include "datasets/toml_keys.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <toml++/toml.h>

namespace tunnelrig {
namespace {

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

/// Reads keys of one table, with file and line in every message.
class Reader {
 public:
  Reader(const toml::table& table, std::string name, const std::string& file)
      : table_(table), name_(std::move(name)), file_(file) {}

  template <class T>
  std::optional<T> get(std::string_view key, const char* what) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return {};
    if (auto value = node->value<T>()) return value;
    throw InputError::at(file_, line_of(*node), "{}: {} must be {}", name_, key, what);
  }
  std::optional<std::string> text(std::string_view key) const {
    return get<std::string>(key, "text in quotes");
  }
  std::string required_text(std::string_view key) const {
    if (const auto value = text(key); value && !value->empty()) return *value;
    throw InputError::at(file_, line_of(table_), "{}: {} is required", name_, key);
  }
  std::optional<double> number(std::string_view key) const {
    const auto value = get<double>(key, "a number");
    if (value && !std::isfinite(*value)) fail(key, "must be finite");
    return value;
  }
  double required_number(std::string_view key) const {
    if (const auto value = number(key)) return *value;
    throw InputError::at(file_, line_of(table_), "{}: {} is required", name_, key);
  }
  bool flag(std::string_view key) const { return get<bool>(key, "true or false").value_or(false); }

  const toml::array& list(std::string_view key) const {
    static const toml::array none;
    const toml::node* node = table_.get(key);
    if (node == nullptr) return none;
    if (const toml::array* array = node->as_array()) return *array;
    throw InputError::at(file_, line_of(*node), "{}: {} must be a list", name_, key);
  }

  void only(std::initializer_list<std::string_view> keys) const {
    require_known_keys(table_, name_, file_, keys);
  }

  [[noreturn]] void fail(std::string_view key, const std::string& rule) const {
    const toml::node* node = table_.get(key);
    throw InputError::at(file_, line_of(node == nullptr ? table_ : *node), "{}: {} {}", name_, key, rule);
  }
  int line(std::string_view key) const {
    const toml::node* node = table_.get(key);
    return line_of(node == nullptr ? table_ : *node);
  }

 private:
  const toml::table& table_;
  std::string name_;
  const std::string& file_;
};

/// A formula as an expression, its names bound to the force, the parameters and the covariates.
class Formula {
 public:
  Formula(Expression expression, const Effect& effect) : expression_(std::move(expression)) {
    for (const std::string& name : expression_.names()) bindings_.push_back(binding_of(name, effect));
    for (const EffectParameter& parameter : effect.parameters)
      spans_.push_back(parameter.upper - parameter.lower);
  }

  static bool is_known(const std::string& name, const Effect& effect) {
    return name == "F" || index_in(name, effect.covariates) < effect.covariates.size() ||
           std::any_of(effect.parameters.begin(), effect.parameters.end(),
                       [&](const EffectParameter& parameter) { return parameter.name == name; });
  }

  double operator()(const Sample& s, const double* p, double force) const {
    std::vector<double> values;
    for (const Binding& b : bindings_) {
      if (b.what == What::kForce) values.push_back(force);
      if (b.what == What::kParameter) values.push_back(p[b.index]);
      if (b.what == What::kCovariate) values.push_back(s.x[b.index]);
      if (b.what == What::kRunningTime) values.push_back(s.x[b.index] + s.time_s);
    }
    return expression_(values);
  }

  /// An expression has no derivatives of its own: central differences, their step where rounding and
  /// curvature cost about the same.
  EffectJet operator()(const Sample& s, const EffectJet* p, const EffectJet& force) const {
    std::array<double, kMaxEffectParameters> at{};
    for (std::size_t k = 0; k < spans_.size(); ++k) at[k] = p[k].a;
    EffectJet result((*this)(s, at.data(), force.a));
    for (std::size_t k = 0; k < spans_.size(); ++k) {
      const double step = kStep * std::max(std::abs(at[k]), 0.01 * spans_[k]), centre = at[k];
      at[k] = centre + step;
      const double above = (*this)(s, at.data(), force.a);
      at[k] = centre - step;
      const double below = (*this)(s, at.data(), force.a);
      at[k] = centre;
      result.v += (above - below) / (2 * step) * p[k].v;
    }
    const double step = kStep * std::max(std::abs(force.a), 1e-3);
    result.v += ((*this)(s, at.data(), force.a + step) - (*this)(s, at.data(), force.a - step)) / (2 * step) *
                force.v;
    return result;
  }

 private:
  static constexpr double kStep = 6e-6;  // cube root of the rounding unit
  enum class What { kForce, kParameter, kCovariate, kRunningTime };
  struct Binding {
    What what = What::kForce;
    std::size_t index = 0;
  };

  static std::size_t index_in(const std::string& name, const std::vector<std::string>& names) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  }

  static Binding binding_of(const std::string& name, const Effect& effect) {
    if (name == "F") return {};
    for (std::size_t k = 0; k < effect.parameters.size(); ++k)
      if (effect.parameters[k].name == name) return {What::kParameter, k};
    return {name == kTimeSinceMotorStart ? What::kRunningTime : What::kCovariate,
            index_in(name, effect.covariates)};
  }

  Expression expression_;
  std::vector<Binding> bindings_;
  std::vector<double> spans_;
};

EffectParameter parameter_of(const toml::table& table, bool first, const std::string& owner,
                             const std::string& file) {
  EffectParameter parameter;
  parameter.name = Reader(table, owner + ": a parameter", file).required_text("name");
  const Reader reader(table, owner + ": parameter " + parameter.name, file);
  reader.only({"name", "unit", "lower", "upper", "theory", "grid"});
  parameter.unit = reader.text("unit").value_or("1");
  parameter.lower = reader.required_number("lower");
  parameter.upper = reader.required_number("upper");
  if (!(parameter.lower < parameter.upper)) reader.fail("upper", "must be above lower");
  const auto inside = [&](double value) { return value >= parameter.lower && value <= parameter.upper; };
  parameter.role = first ? ParameterRole::kAmplitude : ParameterRole::kShape;
  if (first && !inside(0))
    reader.fail("lower",
                "and upper must hold 0: the first parameter is the amplitude, 0 where the effect is absent");
  parameter.theory = reader.number("theory");
  if (parameter.theory && (!first || !inside(*parameter.theory)))
    reader.fail("theory", "must lie within lower and upper, of the first parameter");
  for (const toml::node& node : reader.list("grid")) {
    const auto value = node.value<double>();
    if (!value || !inside(*value)) reader.fail("grid", "must be numbers within lower and upper");
    parameter.grid.push_back(*value);
  }
  if (parameter.grid.empty() != first)
    reader.fail("grid", first ? "is not for the first parameter, which is the amplitude"
                              : "is required: where the search for this parameter begins");
  return parameter;
}

EffectScope scope_of(const Reader& reader) {
  const std::string scope = reader.text("scope").value_or("shared");
  if (scope != "shared" && scope != "rotor") reader.fail("scope", "must be \"shared\" or \"rotor\"");
  return scope == "rotor" ? EffectScope::kRotor : EffectScope::kShared;
}

void check_names(const Effect& effect, const Expression& expression, const Reader& reader) {
  std::vector<std::string> names = {"F"};
  for (const EffectParameter& parameter : effect.parameters) names.push_back(parameter.name);
  names.insert(names.end(), effect.covariates.begin(), effect.covariates.end());
  for (const std::string& name : names)
    if (std::count(names.begin(), names.end(), name) > 1)
      reader.fail("formula", fmt::format("has two meanings of {}", name));
  for (const std::string& name : expression.names())
    if (!Formula::is_known(name, effect))
      reader.fail("formula", fmt::format("has {}, which is neither F nor a parameter nor a covariate", name));
  const auto& used = expression.names();
  for (const std::string& name : names)
    if (std::find(used.begin(), used.end(), name) == used.end())
      reader.fail("formula", fmt::format("does not use {}", name));
}

/// The search compares with no effect, which is an amplitude of 0.
void check_absence(const Effect& effect, const Reader& reader) {
  for (const double value : {0.5, 1.0, 3.0, 300.0}) {
    const std::vector<double> x(effect.covariates.size(), value);
    std::vector<double> parameters = {0.0};
    for (std::size_t k = 1; k < effect.parameters.size(); ++k)
      parameters.push_back(effect.parameters[k].grid[0]);
    constexpr double kForce_N = 2;
    const double force_N = effect.force_N({.x = x, .reference = x}, parameters.data(), kForce_N);
    if (std::isfinite(force_N) && std::abs(force_N - kForce_N) > 1e-9)
      reader.fail("formula", fmt::format("must give F where {} is 0", effect.parameters[0].name));
  }
}

Effect effect_of(const toml::table& table, const std::string& file) {
  Effect effect;
  effect.name = Reader(table, "an effect", file).required_text("name");
  const Reader reader(table, effect.name, file);
  reader.only({"name", "form", "formula", "physics", "sign", "parameters", "covariates", "scope",
               "tunnel_only", "additive"});
  for (const Effect& known : all_effects())
    if (known.name == effect.name) reader.fail("name", "is that of a candidate which the program has");
  effect.form = reader.text("form").value_or("");
  effect.formula = reader.required_text("formula");
  effect.physics = reader.required_text("physics");
  effect.sign_rule = reader.text("sign").value_or("within the bounds");
  effect.scope = scope_of(reader);
  effect.tunnel_only = reader.flag("tunnel_only");
  effect.additive = reader.flag("additive");
  for (const toml::node& node : reader.list("parameters")) {
    if (!node.is_table()) reader.fail("parameters", "must be tables with name, lower, upper");
    effect.parameters.push_back(parameter_of(*node.as_table(), effect.parameters.empty(), effect.name, file));
  }
  if (effect.parameters.empty() || effect.parameters.size() > kMaxEffectParameters)
    reader.fail("parameters", fmt::format("must be 1 to {}", kMaxEffectParameters));
  for (const toml::node& node : reader.list("covariates")) {
    const auto name = node.value<std::string>();
    if (!name) reader.fail("covariates", "must be names in quotes");
    effect.covariates.push_back(*name);
  }
  Expression expression(effect.formula, fmt::format("{}:{}", file, reader.line("formula")));
  check_names(effect, expression, reader);
  const auto formula = std::make_shared<const Formula>(std::move(expression), effect);
  effect.force_N = [formula](const Sample& s, const double* p, double force) {
    return (*formula)(s, p, force);
  };
  effect.jet_N = [formula](const Sample& s, const EffectJet* p, const EffectJet& force) {
    return (*formula)(s, p, force);
  };
  check_absence(effect, reader);
  return effect;
}

}  // namespace

std::vector<Effect> parse_effects_toml(const std::string& text, const std::string& file) {
  toml::table document;
  try {
    document = toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError::at(file, static_cast<int>(error.source().begin.line), "{}", error.description());
  }
  const Reader top(document, "the file", file);
  top.only({"effects"});
  std::vector<Effect> effects;
  for (const toml::node& node : top.list("effects")) {
    if (!node.is_table()) throw InputError::at(file, line_of(node), "write each effect as [[effects]]");
    effects.push_back(effect_of(*node.as_table(), file));
    const Effect& added = effects.back();
    if (std::any_of(effects.begin(), effects.end() - 1, [&](const Effect& effect) {
          return effect.name == added.name && effect.form == added.form;
        }))
      throw InputError::at(file, line_of(node), "{} is there twice; give its forms a form", added.name);
  }
  if (effects.empty()) throw InputError::in(file, "has no [[effects]]");
  return effects;
}

std::vector<Effect> read_effects_toml(const std::filesystem::path& path) {
  return parse_effects_toml(read_text(path), path.string());
}

}  // namespace tunnelrig
