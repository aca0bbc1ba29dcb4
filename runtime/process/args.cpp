#include "runtime/process/args.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <string_view>

#include "runtime/process/command_line.h"

namespace airworthy::rt {
namespace {

std::string default_lcm_url() {
  const char* from_environment = std::getenv("LCM_DEFAULT_URL");
  return from_environment != nullptr && *from_environment != '\0' ? from_environment : Args::kDefaultLcmUrl;
}

tl::unexpected<Exit> bad_usage(std::string_view reason) {
  return tl::unexpected<Exit>{Exit{EX_USAGE, fmt::format("{}\nrun with --help for the options", reason)}};
}

std::string without_trailing_newlines(std::string text) {
  text.resize(text.find_last_not_of('\n') + 1);
  return text;
}

}  // namespace

tl::expected<Args, Exit> Args::parse(int argc, const char* const* argv, const ProgramInfo& program) {
  Args args;
  args.lcm_url = default_lcm_url();
  CLI::App app{program.about, program.name};
  try {
    app.set_help_flag("--help", "Print this and exit");
    app.set_version_flag("--version", fmt::format("{} {}", program.name, AIRWORTHY_VERSION),
                         "Print the version and exit");
    app.add_option("--config", args.config_path, "Configuration file")->required()->type_name("FILE");
    app.add_option("--set", args.overrides, "Override a key of the configuration; may be repeated")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--lcm-url", args.lcm_url,
                   "Bus; default $LCM_DEFAULT_URL, else " + std::string{kDefaultLcmUrl})
        ->type_name("URL");
    app.add_flag("--check-config", args.check_config, "Check the configuration and exit");
    add_words<LogLevel>(app, "--log-level", args.log_level,
                        {{"debug", LogLevel::kDebug},
                         {"info", LogLevel::kInfo},
                         {"warning", LogLevel::kWarning},
                         {"error", LogLevel::kError}},
                        "Least important level that is logged; default info");
    add_words<ClockSource>(app, "--clock", args.clock,
                           {{"live", ClockSource::kLive}, {"tick", ClockSource::kTick}},
                           "Time from this computer, or from TICK messages; default live");
    auto* time_scale = app.add_option("--time-scale", args.time_scale,
                                      "Vehicle seconds per real second, with --clock live; default 1")
                           ->type_name("N");
    app.parse(argc, argv);
    if (!(args.time_scale > 0.0) || !std::isfinite(args.time_scale)) {
      return bad_usage("--time-scale: must be greater than 0 and finite");
    }
    if (time_scale->count() > 0 && args.clock != ClockSource::kLive) {
      return bad_usage("--time-scale: only with --clock live");
    }
    return args;
  } catch (const CLI::CallForHelp&) {
    return tl::unexpected<Exit>{Exit{EX_OK, without_trailing_newlines(app.help())}};
  } catch (const CLI::CallForVersion& version) {
    return tl::unexpected<Exit>{Exit{EX_OK, version.what()}};
  } catch (const std::exception& error) {
    return bad_usage(error.what());
  }
}

}  // namespace airworthy::rt
