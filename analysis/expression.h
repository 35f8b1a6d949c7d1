// Expressions over columns, as users write them (muParser's syntax). A column whose name is no identifier
// stands in single quotes: 'ESC signal (µs)' > 1500. rank(COLUMN) is the row's place within its group, 0
// to 1.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

class Expression {
 public:
  /// `file` names where the text came from, for messages. Throws InputError where it is no expression.
  Expression(std::string_view text, const std::string& file);
  ~Expression();
  Expression(Expression&&) noexcept;

  /// Names that it depends on; ranks as "rank(COLUMN)".
  const std::vector<std::string>& names() const { return names_; }

  /// Values in the order of `names`. Not for use by two threads at once.
  double operator()(const std::vector<double>& values) const;

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
  std::vector<std::string> names_;
};

}  // namespace tunnelrig
