#pragma once

#include <lcm/eventlog.h>

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "runtime/bus/bus.h"

namespace airworthy::rt {

/// A bus that records: every message published goes into an LCM event log, stamped with the vehicle time at
/// which its header says it was sent, so that the same messages give the same bytes.
///
/// The log is written beside its target as `<target>.partial` and takes the target's name on commit().
/// Without a commit, or after a failure, nothing is left and an older target is as before. A target that exists
/// must be a regular file.
class LogWriter final : public Bus {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<LogWriter>> create(const std::string& path);
  ~LogWriter() override;

  /// The first failure is also kept for commit(), so a caller may leave the result to it.
  [[nodiscard]] Expected<void> publish(const std::string& channel,
                                       std::span<const std::uint8_t> payload) override;

  /// Always an error: a log being written delivers nothing.
  [[nodiscard]] Expected<void> subscribe(const std::string& channel, Handler handler) override;

  /// Writes everything to the disk and gives the log its name. To be called once, last.
  [[nodiscard]] Expected<void> commit();

  /// Why commit() will fail, once it is known.
  [[nodiscard]] const std::optional<Error>& failure() const { return first_failure_; }

  /// Messages written so far, by channel.
  [[nodiscard]] const std::map<std::string, std::int64_t>& messages() const { return messages_; }

 private:
  struct Closer {
    void operator()(lcm_eventlog_t* log) const { lcm_eventlog_destroy(log); }
  };

  LogWriter(lcm_eventlog_t* log, std::string path, std::string partial_path)
      : log_{log}, path_{std::move(path)}, partial_path_{std::move(partial_path)} {}
  tl::unexpected<Error> fail(const std::string& what);

  std::unique_ptr<lcm_eventlog_t, Closer> log_;
  std::string path_;
  std::string partial_path_;
  std::map<std::string, std::int64_t> messages_;
  std::optional<Error> first_failure_;
  bool committed_ = false;
};

}  // namespace airworthy::rt
