#include "cli/import/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>

namespace airworthy::importer {
namespace {

constexpr std::int64_t kFirstShow_ms = 500;
constexpr std::int64_t kShowPeriod_ms = 100;

// A signal handler can reach nothing else.
volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int) { stop_requested = 1; }

std::int64_t now_ms() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

}  // namespace

void stop_on_signals() {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
}

ProgressLine::ProgressLine()
    : is_terminal_{::isatty(STDERR_FILENO) == 1}, next_show_ms_{now_ms() + kFirstShow_ms} {}

ProgressLine::~ProgressLine() { clear(); }

Progress ProgressLine::of(const std::string& name, std::size_t index, std::size_t count) {
  return [this, name, index, count](double done_ratio) -> rt::Expected<void> {
    if (stop_requested != 0) return rt::fail_with(name + ": interrupted");
    if (is_terminal_ && now_ms() >= next_show_ms_) {
      show(fmt::format("[{}/{}] {:3.0f} % {}", index + 1, count, done_ratio * 100.0, name));
      next_show_ms_ = now_ms() + kShowPeriod_ms;
    }
    return {};
  };
}

void ProgressLine::show(const std::string& text) {
  fmt::print(stderr, "\r{}\033[K", text);
  std::fflush(stderr);
  shown_ = true;
}

void ProgressLine::clear() {
  if (shown_) fmt::print(stderr, "\r\033[K");
  shown_ = false;
}

}  // namespace airworthy::importer
