#include "core/text/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace airworthy {
namespace {

using namespace std::string_literals;

std::string clean(const std::string& text, std::size_t max_bytes) {
  return clean_text<std::string>(text, max_bytes);
}

TEST(CleanText, KeepsWhatIsPrintable) {
  EXPECT_EQ(clean("rotor 2", 64), "rotor 2");
  EXPECT_EQ(clean("12 g·mm ± 3 °C 漢 🚁", 64), "12 g·mm ± 3 °C 漢 🚁");
  EXPECT_EQ(clean("", 64), "");
}

TEST(CleanText, DefusesControlCharacters) {
  EXPECT_EQ(clean("a\x1b[2Jb", 64), "a [2Jb");
  EXPECT_EQ(clean("a\r\n\tb\0c\x7f"s, 64), "a   b c ");
  EXPECT_EQ(clean("a\xc2\x9b 31m", 64), "a  31m") << "the one-character form of ESC [";
}

TEST(CleanText, ReplacesBrokenUtf8) {
  EXPECT_EQ(clean("a\xff\xfe", 64), "a??");
  EXPECT_EQ(clean("\xc0\xaf", 64), "??") << "overlong";
  EXPECT_EQ(clean("\xed\xa0\x80", 64), "???") << "surrogate";
  EXPECT_EQ(clean("\xf4\x90\x80\x80", 64), "????") << "beyond U+10FFFF";
  EXPECT_EQ(clean("\xe6\xbc", 64), "??") << "cut short";
}

TEST(CleanText, CutsBetweenCharacters) {
  EXPECT_EQ(clean("aa漢漢", 5), "aa漢");
  EXPECT_EQ(clean("aa漢漢", 7), "aa漢");
  EXPECT_EQ(clean(std::string(10'000, 'x'), 64).size(), 64U);
}

}  // namespace
}  // namespace airworthy
