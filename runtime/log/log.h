#pragma once

#include <chrono>
#include <concepts>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

namespace spdlog {
class logger;
namespace sinks {
class sink;
}
}  // namespace spdlog

namespace airworthy::rt {

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning, kError };

/// One `key=value` of a log line. Text is quoted if it is anything but a plain word; a key is a literal.
class LogField {
 public:
  LogField(std::string_view key, std::string_view value) : key_{key}, value_{value} {}
  LogField(std::string_view key, const char* value) : key_{key}, value_{std::string_view{value}} {}
  LogField(std::string_view key, const std::string& value) : key_{key}, value_{std::string_view{value}} {}
  LogField(std::string_view key, bool value) : key_{key}, value_{value} {}
  LogField(std::string_view key, std::floating_point auto value)
      : key_{key}, value_{static_cast<double>(value)} {}
  LogField(std::string_view key, std::signed_integral auto value)
      : key_{key}, value_{static_cast<std::int64_t>(value)} {}
  LogField(std::string_view key, std::unsigned_integral auto value)
      : key_{key}, value_{static_cast<std::uint64_t>(value)} {}

  void append_to(std::string& line) const;

 private:
  std::string_view key_;
  std::variant<std::string_view, bool, double, std::int64_t, std::uint64_t> value_;
};

/// One line on stderr per event worth an operator's eye: transitions, never samples.
///
///   2026-11-22T03:20:00.123Z info airworthy-can link_open path=/dev/ttyUSB0 baud=57600
///
/// Each event may be written kBurst times within kWindow; what comes on top is counted, and the next line of
/// that event, or the end of the program, says `suppressed=K`. The event is a literal word: there are only a
/// few of them. For one thread.
class Log {
 public:
  using Now = std::function<std::chrono::steady_clock::time_point()>;
  using Fields = std::initializer_list<LogField>;

  static constexpr int kBurst = 10;
  static constexpr std::chrono::seconds kWindow{10};

  Log(std::string process, LogLevel level);
  /// For tests: another sink, another clock.
  Log(std::string process, LogLevel level, std::shared_ptr<spdlog::sinks::sink> sink, Now now);
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;
  ~Log();

  void debug(std::string_view event, Fields fields = {}) { write(LogLevel::kDebug, event, fields); }
  void info(std::string_view event, Fields fields = {}) { write(LogLevel::kInfo, event, fields); }
  void warning(std::string_view event, Fields fields = {}) { write(LogLevel::kWarning, event, fields); }
  void error(std::string_view event, Fields fields = {}) { write(LogLevel::kError, event, fields); }

 private:
  struct Rate {
    std::chrono::steady_clock::time_point window_start;
    int written = 0;
    std::int64_t suppressed = 0;
    LogLevel level = LogLevel::kInfo;
  };

  void write(LogLevel level, std::string_view event, Fields fields);

  Now now_;
  std::unique_ptr<spdlog::logger> logger_;
  std::map<std::string, Rate, std::less<>> rates_;
};

}  // namespace airworthy::rt
