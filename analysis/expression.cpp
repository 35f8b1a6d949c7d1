#include "analysis/expression.h"

#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>

#include <muParser.h>

namespace tunnelrig {

struct Expression::Parser {
  mu::Parser parser;
  std::deque<double> values;  // muParser keeps their addresses

  static double* add(const char*, void* self) {
    auto& values = static_cast<Parser*>(self)->values;
    values.push_back(0);
    return &values.back();
  }
};

namespace {

/// Quoted names and ranks become identifiers v0_, v1_, …, with as many v as keep them apart from the names
/// that the text has; `names` says what each stands for.
std::string with_identifiers(std::string_view text, const std::string& file,
                             std::map<std::string, std::string>& names) {
  std::string result, prefix = "v";
  while (text.find(prefix) != std::string_view::npos) prefix += "v";
  const auto put = [&](const std::string& name) {
    for (const auto& [identifier, known] : names)
      if (known == name) {
        result += identifier;
        return;
      }
    const std::string identifier = fmt::format("{}{}_", prefix, names.size());
    names.emplace(identifier, name);
    result += identifier;
  };
  const auto quoted = [&](std::size_t& at) {
    const auto end = text.find('\'', at + 1);
    if (end == std::string_view::npos)
      throw InputError::in(file, "the expression {} has a quote without an end", text);
    std::string name(text.substr(at + 1, end - at - 1));
    at = end + 1;
    return name;
  };
  for (std::size_t at = 0; at < text.size();) {
    const bool word_before =
        at > 0 && (std::isalnum(static_cast<unsigned char>(text[at - 1])) != 0 || text[at - 1] == '_');
    if (text.substr(at).starts_with("rank(") && !word_before) {
      at += 5;
      std::string name;
      if (at < text.size() && text[at] == '\'') {
        name = quoted(at);
      } else {
        while (at < text.size() && text[at] != ')') name += text[at++];
      }
      if (at >= text.size() || text[at] != ')')
        throw InputError::in(file, "the expression {} has a rank( without its )", text);
      ++at;
      put("rank(" + name + ")");
    } else if (text[at] == '\'') {
      put(quoted(at));
    } else {
      result += text[at++];
    }
  }
  return result;
}

}  // namespace

Expression::Expression(std::string_view text, const std::string& file) : parser_(std::make_unique<Parser>()) {
  std::map<std::string, std::string> names;
  try {
    parser_->parser.SetVarFactory(&Parser::add, parser_.get());
    parser_->parser.SetExpr(with_identifiers(text, file, names));
    std::map<const double*, std::string> by_address;
    for (const auto& [identifier, address] : parser_->parser.GetUsedVar()) {
      const auto known = names.find(identifier);
      by_address[address] = known == names.end() ? identifier : known->second;
    }
    parser_->parser.Eval();
    for (const double& value : parser_->values) names_.push_back(by_address[&value]);
  } catch (const mu::Parser::exception_type& error) {
    throw InputError::in(
        file,
        "{} is no expression: {} (a name that is not all letters, digits and _ stands in single quotes)",
        text, error.GetMsg());
  }
}

Expression::~Expression() = default;
Expression::Expression(Expression&&) noexcept = default;

double Expression::operator()(const std::vector<double>& values) const {
  std::copy(values.begin(), values.end(), parser_->values.begin());
  return parser_->parser.Eval();
}

}  // namespace tunnelrig
