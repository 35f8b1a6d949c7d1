#include "analysis/expression.h"

#include "support/message_of.h"

#include <map>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using testing::HasSubstr;
using testing::UnorderedElementsAre;

/// Value with every name looked up.
double value(const std::string& text, const std::map<std::string, double>& of) {
  const Expression expression(text, "table.toml");
  std::vector<double> values;
  for (const std::string& name : expression.names()) values.push_back(of.at(name));
  return expression(values);
}

TEST(Expression, ComparesAndCalculates) {
  EXPECT_EQ(value("N > 5000", {{"N", 5001}}), 1);
  EXPECT_EQ(value("N > 5000", {{"N", 5000}}), 0);
  EXPECT_EQ(value("N > 5000 && D < 10 || P == 3", {{"N", 6000}, {"D", 11}, {"P", 3}}), 1);
  EXPECT_DOUBLE_EQ(value("sqrt(a)*b^2 - a/b", {{"a", 4}, {"b", 3}}), 2 * 9 - 4.0 / 3);
  EXPECT_EQ(value("1", {}), 1);
}

TEST(Expression, TakesTheSameNameOnce) {
  EXPECT_THAT(Expression("a + a * a + b", "f").names(), UnorderedElementsAre("a", "b"));
  EXPECT_THAT(Expression("'ESC signal (µs)' + 'ESC signal (µs)'", "f").names(),
              UnorderedElementsAre("ESC signal (µs)"));
}

TEST(Expression, QuotesNamesThatAreNoIdentifiers) {
  EXPECT_EQ(value("'ESC signal (µs)' > 1500 && N > 1", {{"ESC signal (µs)", 1600}, {"N", 2}}), 1);
  EXPECT_EQ(value("'ESC signal (µs)' > 1500 && N > 1", {{"ESC signal (µs)", 1400}, {"N", 2}}), 0);
}

TEST(Expression, RanksAreNamesOfTheirOwn) {
  EXPECT_THAT(Expression("rank(N) > 0.7 && N < 9 && rank('a b') < 1", "f").names(),
              UnorderedElementsAre("rank(N)", "N", "rank(a b)"));
  EXPECT_EQ(value("rank(N) > 0.7", {{"rank(N)", 0.8}}), 1);
  EXPECT_THAT(Expression("frank + 1", "f").names(), UnorderedElementsAre("frank"));
}

TEST(Expression, MistakesNameFileAndExpression) {
  for (const std::string text :
       {"N >", "(N > 3", "N > > 3", "'N", "rank(N", "rank('N)", "nosuch(N)", "3 4", "N @ 2", ""}) {
    const std::string message = test::message_of([&] { Expression(text, "my.toml: hold_out"); });
    EXPECT_THAT(message, HasSubstr("my.toml: hold_out")) << text;
    EXPECT_THAT(message, HasSubstr(text));
  }
}

TEST(Expression, SurvivesBeingMoved) {
  Expression first("a * 2", "f");
  const Expression second(std::move(first));
  EXPECT_EQ(second({21}), 42);
}

TEST(Expression, ColumnsNamedLikeItsOwnIdentifiersStayApart) {
  const Expression expression("v0_ + 10 * 'a b' + 100 * vv0_", "t.toml");
  ASSERT_EQ(expression.names().size(), 3u);
  std::vector<double> values;
  for (const std::string& name : expression.names())
    values.push_back(name == "v0_" ? 1 : name == "a b" ? 2 : 3);
  EXPECT_EQ(expression(values), 321);
}

}  // namespace
}  // namespace tunnelrig
