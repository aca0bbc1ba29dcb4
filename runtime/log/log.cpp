#include "runtime/log/log.h"

#include <fmt/format.h>
#include <spdlog/logger.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace airworthy::rt {
namespace {

spdlog::level::level_enum to_spdlog(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

bool is_plain(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ||
         std::string_view{"_-+./:@%,*?&#()[]{}"}.find(c) != std::string_view::npos;
}

void append_text(std::string& line, std::string_view text) {
  if (!text.empty() && std::all_of(text.begin(), text.end(), is_plain)) {
    line += text;
    return;
  }
  line += '"';
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      line += '\\';
      line += c;
    } else if (c == '\n') {
      line += "\\n";
    } else if (byte < 0x20 || byte == 0x7f) {
      fmt::format_to(std::back_inserter(line), "\\x{:02x}", byte);
    } else {
      line += c;
    }
  }
  line += '"';
}

}  // namespace

void LogField::append_to(std::string& line) const {
  line += ' ';
  line += key_;
  line += '=';
  if (const auto* text = std::get_if<std::string_view>(&value_)) {
    append_text(line, *text);
  } else {
    std::visit([&line](const auto& value) { fmt::format_to(std::back_inserter(line), "{}", value); }, value_);
  }
}

Log::Log(std::string process, LogLevel level)
    : Log{std::move(process), level, std::make_shared<spdlog::sinks::stderr_sink_st>(),
          &std::chrono::steady_clock::now} {}

Log::Log(std::string process, LogLevel level, std::shared_ptr<spdlog::sinks::sink> sink, Now now)
    : now_{std::move(now)}, logger_{std::make_unique<spdlog::logger>(std::move(process), std::move(sink))} {
  logger_->set_level(to_spdlog(level));
  logger_->flush_on(spdlog::level::debug);
  logger_->set_formatter(std::make_unique<spdlog::pattern_formatter>("%Y-%m-%dT%H:%M:%S.%eZ %l %n %v",
                                                                     spdlog::pattern_time_type::utc));
}

Log::~Log() {
  for (const auto& [event, rate] : rates_) {
    if (rate.suppressed > 0) logger_->log(to_spdlog(rate.level), "{} suppressed={}", event, rate.suppressed);
  }
}

void Log::write(LogLevel level, std::string_view event, Fields fields) {
  if (!logger_->should_log(to_spdlog(level))) return;
  auto found = rates_.find(event);
  if (found == rates_.end()) found = rates_.emplace(std::string{event}, Rate{}).first;
  Rate& rate = found->second;
  rate.level = level;
  const auto now = now_();
  if (rate.written == 0 || now - rate.window_start >= kWindow) {
    rate.window_start = now;
    rate.written = 0;
  }
  if (rate.written >= kBurst) {
    ++rate.suppressed;
    return;
  }
  ++rate.written;
  std::string line{event};
  for (const LogField& field : fields) field.append_to(line);
  if (const auto suppressed = std::exchange(rate.suppressed, 0); suppressed > 0) {
    LogField{"suppressed", suppressed}.append_to(line);
  }
  logger_->log(to_spdlog(level), spdlog::string_view_t{line});
}

}  // namespace airworthy::rt
