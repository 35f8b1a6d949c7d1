#include "datasets/csv.h"

#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(Csv, KeepsCellTextAsWritten) {
  const Sheet sheet = parse_csv("a,b\n 1.50 ,\"x, \"\"y\"\"\"\n,\n", "t.csv");
  EXPECT_THAT(sheet.columns, ElementsAre("a", "b"));
  ASSERT_EQ(sheet.rows.size(), 2u);
  EXPECT_THAT(sheet.rows[0].cells, ElementsAre(" 1.50 ", "x, \"y\""));
  EXPECT_EQ(format_csv(sheet), "a,b\n 1.50 ,\"x, \"\"y\"\"\"\n,\n");
}

TEST(Csv, TakesWindowsLineEndsAndByteOrderMark) {
  const Sheet sheet = parse_csv(
      "\xEF\xBB\xBF"
      "a,b\r\n1,2\r\n\r\n3,\"4\r\n5\"\r\n",
      "t.csv");
  ASSERT_EQ(sheet.rows.size(), 2u);
  EXPECT_THAT(sheet.rows[0].cells, ElementsAre("1", "2"));
  EXPECT_THAT(sheet.rows[1].cells, ElementsAre("3", "4\r\n5"));
  EXPECT_EQ(sheet.rows[1].line, 4);
}

TEST(Csv, NamesFileLineAndColumnOfWhatIsWrong) {
  EXPECT_THAT(message_of([] { parse_csv("", "t.csv"); }), HasSubstr("t.csv:1: the file is empty"));
  EXPECT_THAT(message_of([] { parse_csv("a,b\r1,2\r3,4\r\n", "t.csv"); }),
              HasSubstr("t.csv: its lines end with CR alone"));
  EXPECT_THAT(message_of([] { parse_csv("a,b\r (mV)\n1,2\n3,4\n", "t.csv"); }),
              HasSubstr("t.csv: line 1 has a CR before its end"));
  EXPECT_THAT(message_of([] { parse_csv("a,a\n1,2\n", "t.csv"); }),
              testing::EndsWith("column a stands twice in the header"));
  EXPECT_THAT(
      message_of([] { parse_csv("a,b1,1,1", "t.csv"); }),
      HasSubstr("t.csv:1: column 1 stands twice in the header; the file is this one line: has it lost"));
  EXPECT_THAT(message_of([] { parse_csv("a,b\n1,2\n1\n", "t.csv"); }),
              HasSubstr("t.csv:3: 1 cells where the header has 2"));
  EXPECT_THAT(message_of([] { parse_csv("a\n\"1\n2\n", "t.csv"); }), HasSubstr("t.csv:2: a quote is opened"));
  EXPECT_THAT(message_of([] {
                parse_csv(
                    "a\n\xB0"
                    "C\n",
                    "t.csv");
              }),
              HasSubstr("t.csv:2: this is not UTF-8"));
  const Sheet sheet = parse_csv("a\nx\n", "t.csv");
  EXPECT_THAT(message_of([&] { (void)sheet.number(0, "a"); }),
              HasSubstr("t.csv:2: column a: 'x' is not a finite"));
  const Sheet european = parse_csv("a,b\n(N),\"1,5\"\n(N),x\n", "t.csv");
  EXPECT_THAT(message_of([&] { (void)european.number(0, "a"); }), HasSubstr("a row of units: take it out"));
  EXPECT_THAT(
      message_of([&] { (void)european.number(0, "b"); }),
      HasSubstr("'1,5' is not a finite decimal number (not recorded: leave it empty; a decimal comma"));
  EXPECT_THAT(message_of([&] { (void)european.number(1, "a"); }), Not(HasSubstr("units")));
  EXPECT_THAT(message_of([&] { (void)european.require_number(1, "b"); }),
              HasSubstr("a number is required here, and 'x' is no finite decimal one"));
  EXPECT_THAT(message_of([&] { (void)sheet.require("b"); }),
              HasSubstr("t.csv:1: the required column b is missing"));
}

/// RFC 3629, section 4: what passes here is written as JSON later, and its writer is strict.
TEST(Csv, TextIsUtf8ToTheLetter) {
  for (const char* text : {"", "a", "\xC2\x80", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80",
                           "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"})
    EXPECT_TRUE(is_utf8(text)) << text;
  for (const char* text :
       {"\xFF", "\x80", "\xC0\x80", "\xC1\xBF", "\xC3", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xED\xBF\xBF",
        "\xE1\x80", "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xF1\x80\x80\xC0"}) {
    EXPECT_FALSE(is_utf8(text)) << text;
    EXPECT_THAT(message_of([&] { parse_csv(fmt::format("a\n{}\n", text), "t.csv"); }),
                HasSubstr("t.csv:2: this is not UTF-8"));
  }
}

TEST(Csv, NumbersAreStrict) {
  EXPECT_EQ(parse_number("1.5"), 1.5);
  EXPECT_EQ(parse_number(" -2e3\t"), -2000);
  EXPECT_EQ(parse_number("+4"), 4);
  for (const char* text : {"", "nan", "inf", "1,5", "1 2", "0x10", "1.5V", "--1"}) {
    EXPECT_FALSE(parse_number(text)) << text;
  }
}

TEST(Csv, OtherSeparatorsAreNamed) {
  const auto missing = [](const std::string& text) {
    return message_of([&] { (void)parse_csv(text, "t.csv").require("y"); });
  };
  EXPECT_THAT(
      missing("g;y;x\na;1;0.1\n"),
      HasSubstr("t.csv:1: the required column y is missing; the header looks separated by semicolons"));
  EXPECT_THAT(missing("g\ty\tx\na\t1\t0.1\n"), HasSubstr("separated by tabs: commas are needed"));
  EXPECT_THAT(missing("g;y;x\na;1,5;0,1\n"),
              HasSubstr("3 cells where the header has 1 columns; the header looks separated by semicolons"));
  EXPECT_THAT(missing("g,x\na,1\n"), testing::EndsWith("the required column y is missing"));
  EXPECT_THAT(missing("made in May\ng,y\na,1\n"),
              HasSubstr("t.csv:2: 2 cells where the header has 1 columns; line 1 must be the header"));
}

TEST(WriteText, KeepsLinksAndDevices) {
  const test::TemporaryFolder folder;
  write_text(folder / "old.txt", "old");
  std::filesystem::create_symlink("old.txt", folder / "link.txt");
  std::filesystem::create_symlink("new.txt", folder / "dangling.txt");
  std::filesystem::create_symlink("/dev/null", folder / "nothing.txt");
  for (const char* name : {"link.txt", "dangling.txt", "nothing.txt"}) {
    write_text(folder / name, "text");
    EXPECT_TRUE(std::filesystem::is_symlink(folder / name)) << name;
  }
  EXPECT_EQ(read_text(folder / "old.txt"), "text");
  EXPECT_EQ(read_text(folder / "new.txt"), "text");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_EQ(test::message_of([&] { write_text("/dev/full", "text"); }),
            "/dev/full: cannot be written: No space left on device");
}

TEST(OpenToWrite, SaysWhyNot) {
  const test::TemporaryFolder folder;
  write_text(folder / "c.db", "SQLite format 3, say");
  EXPECT_THAT(message_of([&] { open_to_write(folder / "c.db"); }), HasSubstr("it is a campaign file"));
  EXPECT_THAT(message_of([&] { open_to_write(folder / "none" / "x"); }),
              HasSubstr("cannot be written: No such"));
  open_to_write(folder / "x") << "bytes";
  EXPECT_EQ(read_text(folder / "x"), "bytes");
}

TEST(WriteText, NeverOverACampaignFile) {
  const test::TemporaryFolder folder;
  const std::string text = "SQLite format 3" + std::string(100, '\0');
  write_text(folder / "c.db", text);
  EXPECT_THAT(test::message_of([&] { write_text(folder / "c.db", "a,b\n"); }),
              testing::HasSubstr("it is a campaign file"));
  EXPECT_EQ(read_text(folder / "c.db"), text);
}

}  // namespace
}  // namespace tunnelrig
