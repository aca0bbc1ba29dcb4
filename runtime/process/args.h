#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "runtime/log/log.h"
#include "runtime/process/exit.h"

namespace airworthy::rt {

/// Where a process takes the time from: the computer's clock, or TICK messages on the bus (a replay).
enum class ClockSource : std::uint8_t { kLive, kTick };

/// What --help and --version say.
struct ProgramInfo {
  std::string name;   ///< airworthy-unbalance
  std::string about;  ///< one sentence
};

/// The command line every process shares.
struct Args {
  static constexpr const char* kDefaultLcmUrl = "udpm://239.255.76.67:7667?ttl=0";

  std::string config_path;             ///< --config FILE, mandatory
  std::vector<std::string> overrides;  ///< --set key.path=value, any number of times; for ConfigFile::load
  std::string lcm_url;  ///< --lcm-url, else the environment's LCM_DEFAULT_URL, else kDefaultLcmUrl
  LogLevel log_level = LogLevel::kInfo;
  ClockSource clock = ClockSource::kLive;
  double time_scale = 1.0;  ///< vehicle seconds per real second; only with the live clock
  bool check_config = false;

  /// The arguments, or how the program must end: code 0 with help or version, EX_USAGE with what is wrong.
  [[nodiscard]] static tl::expected<Args, Exit> parse(int argc, const char* const* argv,
                                                      const ProgramInfo& program);
};

}  // namespace airworthy::rt
