// The file as a whole: syntax, content that is no TOML, files that cannot be read.

#include <gtest/gtest.h>

#include <random>

#include "tests/runtime/config_support.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::rt {
namespace {

std::string syntax_error(std::string_view text) {
  auto file = ConfigFile::parse(text, "t.toml", {"a.b=1"});
  // Nothing is said of keys in a file that could not be parsed.
  EXPECT_EQ(file.root().required<int>("absent"), 0);
  EXPECT_EQ(file.root().required_table("policy").optional<int>("order", 3), 3);
  file.root().fail("absent", "is missing");
  return errors_of(file);
}

TEST(ConfigFiles, SyntaxErrors) {
  EXPECT_EQ(syntax_error("a = 1\nb = \n"),
            "t.toml:2:5: Error while parsing key-value pair: expected value, saw '\\n'");
  EXPECT_EQ(syntax_error("a = 1\n  a = 2\n"),
            "t.toml:2:7: Error while parsing key-value pair: cannot redefine existing integer 'a'");
  EXPECT_EQ(syntax_error("[policy\n"),
            "t.toml:1:8: Error while parsing table header: expected ']', saw '\\n'");
  EXPECT_EQ(syntax_error("a = 99999999999999999999"),
            "t.toml:1:25: Error while parsing decimal integer: '99999999999999999999' is not representable "
            "in 64 bits");
}

TEST(ConfigFiles, SyntaxErrorsStayOnOneLine) {
  const std::string text = syntax_error("\"a\\nb\" = 1\n\"a\\nb\" = 2\n");
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  EXPECT_EQ(text.find("t.toml:2:"), 0U) << text;
}

TEST(ConfigFiles, LettersOutsideStrings) {
  EXPECT_EQ(syntax_error("\xc3\xa4 = 1\n"),
            "t.toml:1:1: Error while parsing root table: expected keys, tables, whitespace or comments, saw "
            "'\xc3\xa4'");
  EXPECT_EQ(syntax_error("a = \xc3\xa4\n"),
            "t.toml:1:5: Error while parsing value: could not determine value type");
  EXPECT_EQ(
      syntax_error("[\xef\xb2\xbf]\n"),
      "t.toml:1:2: Error while parsing key: expected bare key starting character or string delimiter, saw "
      "'\xef\xb2\xbf'");
}

TEST(ConfigFiles, LettersAfterALineEndingBackslash) {
  auto file = ConfigFile::parse("a = \"\"\"x\\\n  \xc3\xa4\"\"\"\n", "t.toml");
  EXPECT_EQ(file.root().required<std::string>("a"), "x\xc3\xa4");
  EXPECT_EQ(errors_of(file), "");
}

TEST(ConfigFiles, BinaryGarbage) {
  EXPECT_EQ(syntax_error(std::string_view{"\x7f"
                                          "ELF\x02\x01\x01\0\0\0",
                                          10}),
            "t.toml:1:1: Error while parsing root table: expected keys, tables, whitespace or comments, saw "
            "'\\u007F'");
  EXPECT_EQ(syntax_error("a = \"\xff\xfe\"\n"), "t.toml:1:5: Encountered invalid utf-8 sequence");
}

TEST(ConfigFiles, RandomBytesAreAnErrorAndNothingWorse) {
  std::mt19937 random{20261122};
  for (int round = 0; round < 2000; ++round) {
    std::string text(random() % 64, '\0');
    for (char& c : text) c = static_cast<char>(random() % 256);
    auto file = ConfigFile::parse(text, "t.toml");
    EXPECT_EQ(file.root().required<int>("mandatory"), 0);
    EXPECT_NE(errors_of(file), "");
  }
}

TEST(ConfigFiles, EmptyFileMissesItsMandatoryKeys) {
  const TemporaryFolder folder;
  const auto path = folder.write("t.toml", "");
  auto file = ConfigFile::load(path);
  EXPECT_EQ(file.root().required<int>("a"), 0);
  EXPECT_EQ(errors_of(file), path.string() + ":1:1: a: missing mandatory key");
}

TEST(ConfigFiles, LoadedFileIsRead) {
  const TemporaryFolder folder;
  const auto path =
      folder.write("t.toml", "\xef\xbb\xbf# byte order mark and DOS line ends\r\na = 1\r\nb = 2\r\n");
  auto file = ConfigFile::load(path, {"b=3"});
  EXPECT_EQ(file.root().required<int>("a"), 1);
  EXPECT_EQ(file.root().required<int>("b"), 3);
  EXPECT_EQ(errors_of(file), "");
}

TEST(ConfigFiles, MissingFile) {
  auto file = ConfigFile::load("/nowhere/t.toml", {"a=1", "broken"});
  EXPECT_EQ(file.root().required<int>("a"), 0);
  EXPECT_EQ(errors_of(file), "/nowhere/t.toml: cannot be opened: No such file or directory");
}

TEST(ConfigFiles, FolderInsteadOfAFile) {
  const TemporaryFolder folder;
  auto file = ConfigFile::load(folder.path());
  EXPECT_EQ(errors_of(file), folder.path().string() + ": cannot be read: Is a directory");
}

TEST(ConfigFiles, NoPath) {
  auto file = ConfigFile::load("");
  EXPECT_EQ(errors_of(file), ": cannot be opened: No such file or directory");
}

TEST(ConfigFiles, HugeFile) {
  const TemporaryFolder folder;
  auto file = ConfigFile::load(folder.write("largest.toml", std::string(ConfigFile::kMaxBytes, '\n')));
  EXPECT_EQ(errors_of(file), "");
  const auto huge = folder.write("huge.toml", std::string(ConfigFile::kMaxBytes + 1, '\n'));
  auto refused = ConfigFile::load(huge);
  EXPECT_EQ(errors_of(refused), huge.string() + ": is larger than 1048576 bytes, no configuration is");
  auto endless = ConfigFile::load("/dev/zero");
  EXPECT_EQ(errors_of(endless), "/dev/zero: is larger than 1048576 bytes, no configuration is");
}

TEST(ConfigFiles, LongFileIsReadInFull) {
  std::string text;
  for (int i = 0; i < 2000; ++i) text += "[[channel]]\nname = \"channel " + std::to_string(i) + "\"\n";
  auto file = ConfigFile::parse(text, "t.toml");
  int count = 0;
  for (ConfigTable channel : file.root().tables("channel", {.unique_key = "name"})) {
    EXPECT_EQ(channel.required<std::string>("name"), "channel " + std::to_string(count++));
  }
  EXPECT_EQ(count, 2000);
  EXPECT_EQ(errors_of(file), "");
}

// toml++ 3.3 frees nested tables recursively: without a limit these end in a stack overflow.
TEST(ConfigFiles, BottomlessNesting) {
  std::string dotted;
  for (int i = 0; i < 200'000; ++i) dotted += "a.";
  EXPECT_EQ(syntax_error(dotted + "a = 1\n"), "t.toml:1:66: more than 32 dots in one line");
  EXPECT_EQ(syntax_error("\n[" + dotted + "a]\n"), "t.toml:2:67: more than 32 dots in one line");
  const std::string numbers = syntax_error("1" + std::string(100, '.') + "\n");
  EXPECT_EQ(numbers, "t.toml:1:34: more than 32 dots in one line");

  std::string digits = "1";
  for (int i = 0; i < 200'000; ++i) digits += ".1";
  EXPECT_EQ(syntax_error(digits + " = 1\n").find("more than 32 dots in one line") != std::string::npos, true);

  EXPECT_EQ(syntax_error("a = " + std::string(200'000, '[')).substr(0, 9), "t.toml:1:");
  EXPECT_EQ(syntax_error("a = " + std::string(40, '[') + std::string(40, ']') + "\n"),
            "t.toml:1:37: nested more than 32 deep");

  // As deep as the two limits allow together: arrays of inline tables, each line a dotted key.
  std::string deep = "a = ";
  for (int i = 0; i < 100; ++i) deep += "[\n{ a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a = ";
  deep += "1";
  for (int i = 0; i < 100; ++i) deep += " }]";
  EXPECT_EQ(syntax_error(deep).substr(0, 7), "t.toml:");
}

TEST(ConfigFiles, ManyNumbersInOneLineAreNoNesting) {
  std::string text = "a = [0.5";
  for (int i = 0; i < 99; ++i) text += ", -1.5e3";
  auto file = ConfigFile::parse(text + "] # .................................................\n", "t.toml");
  EXPECT_EQ(file.root().required<std::vector<double>>("a").size(), 0U);
  EXPECT_NE(errors_of(file), "");
  auto good =
      ConfigFile::parse("# .................................................\n" + text + "]\n", "t.toml");
  EXPECT_EQ(good.root().required<std::vector<double>>("a").size(), 100U);
  EXPECT_EQ(errors_of(good), "");
}

}  // namespace
}  // namespace airworthy::rt
