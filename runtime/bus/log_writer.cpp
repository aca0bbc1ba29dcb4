#include "runtime/bus/log_writer.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "runtime/bus/log_bus.h"
#include "runtime/file/output_file.h"

namespace airworthy::rt {

Expected<std::unique_ptr<LogWriter>> LogWriter::create(const std::string& path) {
  if (const auto checked = check_output_path(path); !checked) return tl::unexpected<Error>{checked.error()};
  const std::string partial_path = path + ".partial";
  errno = 0;
  lcm_eventlog_t* log = lcm_eventlog_create(partial_path.c_str(), "w");
  if (log == nullptr) return fail_with(fmt::format("{}: {}", partial_path, std::strerror(errno)));
  return std::unique_ptr<LogWriter>{new LogWriter{log, path, partial_path}};
}

LogWriter::~LogWriter() {
  if (!committed_) ::unlink(partial_path_.c_str());
}

tl::unexpected<Error> LogWriter::fail(const std::string& what) {
  const Error error{fmt::format("{}: {}", path_, what)};
  if (!first_failure_) first_failure_ = error;
  return tl::unexpected<Error>{error};
}

Expected<void> LogWriter::publish(const std::string& channel, std::span<const std::uint8_t> payload) {
  const TimePoint sent = sent_time(payload);
  if (sent < TimePoint{}) return fail("a message on " + channel + " without a vehicle time");
  // LCM takes pointers to mutable data but only reads what they point to.
  lcm_eventlog_event_t event{};
  event.timestamp = to_us(sent);
  event.channellen = static_cast<std::int32_t>(channel.size());
  event.datalen = static_cast<std::int32_t>(payload.size());
  event.channel = const_cast<char*>(channel.c_str());
  event.data = const_cast<std::uint8_t*>(payload.data());
  errno = 0;
  if (lcm_eventlog_write_event(log_.get(), &event) != 0) return fail(std::strerror(errno));
  ++messages_[channel];
  return {};
}

Expected<void> LogWriter::subscribe(const std::string& channel, Handler) {
  return fail_with(fmt::format("{}: cannot listen to {} on a log that is being written", path_, channel));
}

Expected<void> LogWriter::commit() {
  if (first_failure_) return tl::unexpected<Error>{*first_failure_};
  std::FILE* file = log_->f;
  if (std::fflush(file) != 0 || std::ferror(file) != 0 || ::fsync(::fileno(file)) != 0) {
    return fail(std::strerror(errno));
  }
  log_.reset();
  if (std::rename(partial_path_.c_str(), path_.c_str()) != 0) return fail(std::strerror(errno));
  committed_ = true;
  return {};
}

}  // namespace airworthy::rt
