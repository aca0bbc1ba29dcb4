#include "runtime/process/command_line.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <charconv>
#include <system_error>

#include "runtime/process/exit.h"

namespace airworthy::rt {
namespace {

template <class Number>
std::optional<Number> whole_text_as(const std::string& text) {
  Number number{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return number;
}

}  // namespace

CLI::Validator is_number(Range range) {
  return CLI::Validator{[range](const std::string& text) -> std::string {
                          const auto value = whole_text_as<double>(text);
                          if (value && range.contains(*value)) return {};
                          // The requirement of any finite number is the range.
                          return fmt::format("{}, is {}", range.requirement(0.0), text);
                        },
                        "NUMBER"};
}

CLI::Validator is_whole_number(std::uint64_t least, std::uint64_t most) {
  return CLI::Validator{[least, most](const std::string& text) -> std::string {
                          const auto value = whole_text_as<std::uint64_t>(text);
                          // With a leading zero CLI11 would read it as octal.
                          const bool is_plain = value && fmt::format("{}", *value) == text;
                          if (is_plain && *value >= least && *value <= most) return {};
                          return fmt::format("must be a whole number in [{}, {}], is {}", least, most, text);
                        },
                        "INTEGER"};
}

std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::Success& success) {  // help or version
    static_cast<void>(app.exit(success));
    return EX_OK;
  } catch (const CLI::ParseError& error) {
    return wrong_usage(error.what());
  }
}

int wrong_usage(const std::string& reason) {
  return fail(EX_USAGE, Error{reason + "\nrun with --help for the options"});
}

}  // namespace airworthy::rt
