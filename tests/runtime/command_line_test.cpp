#include "runtime/process/command_line.h"

#include <gtest/gtest.h>
#include <sysexits.h>

namespace airworthy::rt {
namespace {

enum class Colour : std::uint8_t { kRed, kGreen };

struct Options {
  double timeout_s = 0.0;
  std::uint64_t seed = 0;
  Colour colour = Colour::kRed;
};

/// What is printed on stderr, of which the hint to --help is checked here; empty if the options are taken.
std::string complaint(std::vector<const char*> arguments, Options& options) {
  CLI::App app{"Tests.", "airworthy x"};
  app.add_option("--timeout", options.timeout_s)->check(is_number(Range{0.0, 60.0}.without_min()));
  app.add_option("--seed", options.seed)->check(is_whole_number(0));
  app.add_option("--jobs")->check(is_whole_number(1, 256));
  add_words<Colour>(app, "--colour", options.colour, {{"red", Colour::kRed}, {"green", Colour::kGreen}}, "");
  arguments.insert(arguments.begin(), "airworthy-x");
  testing::internal::CaptureStderr();
  const auto code = parse_command_line(app, static_cast<int>(arguments.size()), arguments.data());
  std::string text = testing::internal::GetCapturedStderr();
  if (!code) return text;
  EXPECT_EQ(*code, EX_USAGE);
  const std::string hint = "\nprocess_test: run with --help for the options\n";
  const std::size_t at = text.rfind(hint);
  return at == std::string::npos ? "no hint: " + text : text.substr(0, at);
}

std::string complaint(const std::vector<const char*>& arguments) {
  Options options;
  return complaint(arguments, options);
}

TEST(CommandLine, TakesWhatIsWithinItsRange) {
  Options options;
  EXPECT_EQ(complaint({"--timeout", "1.5e1", "--seed", "18446744073709551615", "--colour", "green"}, options),
            "");
  EXPECT_EQ(options.timeout_s, 15.0);
  EXPECT_EQ(options.seed, 18446744073709551615U);
  EXPECT_EQ(options.colour, Colour::kGreen);
}

TEST(CommandLine, NamesTheOptionAndTheRangeOfANumber) {
  for (const std::string text :
       {"0", "60.5", "-1", "nan", "inf", "-inf", "1e300", "1e400", "two", "5 s", ""}) {
    EXPECT_EQ(complaint({"--timeout", text.c_str()}),
              "process_test: --timeout: must lie in (0, 60], is " + text);
  }
}

TEST(CommandLine, AWholeNumberIsNeitherWrappedNorRounded) {
  for (const std::string text :
       {"-1", "18446744073709551616", "99999999999999999999999", "1.5", "1e3", "nan", "x", "010", "0x10"}) {
    EXPECT_EQ(complaint({"--seed", text.c_str()}),
              "process_test: --seed: must be a whole number in [0, 18446744073709551615], is " + text);
  }
  EXPECT_EQ(complaint({"--jobs", "0"}), "process_test: --jobs: must be a whole number in [1, 256], is 0");
}

TEST(CommandLine, AWordIsOneOfThoseAndNotItsNumber) {
  for (const char* text : {"blue", "1", "RED"}) {
    EXPECT_EQ(complaint({"--colour", text}), "process_test: --colour: must be one of red, green") << text;
  }
}

TEST(CommandLine, AnythingElseIsSaidWithTheProgramsNameToo) {
  EXPECT_EQ(complaint({"--size"}), "process_test: The following argument was not expected: --size");
}

TEST(CommandLine, HelpEndsWell) {
  CLI::App app{"Tests.", "airworthy x"};
  testing::internal::CaptureStdout();
  EXPECT_EQ(parse_command_line(app, 2, std::array{"airworthy-x", "--help"}.data()), EX_OK);
  EXPECT_EQ(testing::internal::GetCapturedStdout().rfind("Tests.\nUsage: airworthy x", 0), 0U);
}

}  // namespace
}  // namespace airworthy::rt
