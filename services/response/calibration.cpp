#include "services/response/calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>

namespace airworthy::response {
namespace {

using rt::ConfigTable;
using rt::Count;
using rt::Range;

std::string describe(const Term& term, double tick_s) {
  std::string text{to_string(term.signal)};
  switch (term.transform) {
    case Transform::kNone:
      break;
    case Transform::kSine:
      text += " sine";
      break;
    case Transform::kAbsoluteSine:
      text += " absolute_sine";
      break;
    case Transform::kLoadFactor:
      text += " load_factor";
      break;
  }
  if (term.lowpass_s > 0) text += fmt::format(" lowpass {} s", term.lowpass_s);
  if (term.delay_ticks > 0) text += fmt::format(" delay {:.6g} s", term.delay_ticks * tick_s);
  if (term.minus_delay_ticks) text += fmt::format(" minus delay {:.6g} s", *term.minus_delay_ticks * tick_s);
  return text;
}

Calibration::Channel read_channel(ConfigTable table) {
  Calibration::Channel channel;
  channel.name = table.required<std::string>("name");
  channel.model = table.required<std::vector<std::string>>("model", {}, Count{2, kMostTerms + 1});
  const std::size_t terms = channel.model.empty() ? 0 : channel.model.size() - 1;
  const auto theta = table.required<std::vector<double>>("theta");
  const auto gram = table.required<std::vector<double>>("gram");
  if (theta.size() != terms) {
    table.fail("theta", fmt::format("{} values for a model of {} terms", theta.size(), terms), {"model"});
  } else if (gram.size() != terms * terms) {
    table.fail("gram",
               fmt::format("{} values; a model of {} terms needs {}", gram.size(), terms, terms * terms),
               {"model"});
  } else {
    std::copy(theta.begin(), theta.end(), channel.prior.theta.begin());
    std::copy(gram.begin(), gram.end(), channel.prior.gram.begin());
  }
  channel.prior.sigma = table.required<double>("sigma", Range{0.0, 1e9}.without_min());
  channel.prior.threshold = table.required<double>("threshold", Range{0.1, 1000.0});
  channel.prior.worth_samples = table.required<std::int64_t>("worth_samples", Range{36.0, 1e7});
  channel.samples = table.optional<std::int64_t>("samples", 0);
  channel.flight_spread = table.optional<double>("flight_spread", 0.0);
  return channel;
}

std::string numbers(std::span<const double> values) {
  return fmt::format("[{:.17g}]", fmt::join(values, ", "));
}

std::string quoted(const std::vector<std::string>& words) {
  return words.empty() ? "[]" : fmt::format("[\"{}\"]", fmt::join(words, "\", \""));
}

}  // namespace

std::vector<std::string> describe(const ChannelParams& params, Duration tick_period) {
  const double tick_s = to_seconds(tick_period);
  std::vector<std::string> model{describe(params.response, tick_s)};
  for (int i = 0; i < params.term_count; ++i) {
    model.push_back(describe(params.terms[static_cast<std::size_t>(i)], tick_s));
  }
  return model;
}

rt::Expected<Calibration> load_calibration(const std::string& path) {
  auto file = rt::ConfigFile::load(path);
  ConfigTable root = file.root();
  Calibration calibration;
  calibration.vehicle = root.required<std::string>("vehicle");
  calibration.false_alarms_per_hour =
      root.required<double>("false_alarms_per_hour", Range{0.0, 1e3}.without_min());
  const auto configurations = root.tables("configuration", {.count = Count{1, kMostConfigurations}});
  for (ConfigTable table : configurations) {
    Calibration::Configuration& configuration = calibration.configurations.emplace_back();
    configuration.airspeed_sensor = table.required<bool>("airspeed_sensor");
    configuration.flights = table.optional<int>("flights", 0);
    configuration.flown_s = table.optional<double>("flown_s", 0.0);
    for (const ConfigTable& channel :
         table.tables("channel", {.unique_key = "name", .count = Count{1, kMostChannels}})) {
      configuration.channels.push_back(read_channel(channel));
    }
  }
  if (calibration.configurations.size() == 2 &&
      calibration.configurations[0].airspeed_sensor == calibration.configurations[1].airspeed_sensor) {
    root.fail("configuration", "two configurations with the same airspeed_sensor");
  }
  calibration.hash = file.hash();
  return file.finish(std::move(calibration));
}

rt::Expected<MonitorParams> with_calibration(MonitorParams monitor,
                                             const std::vector<std::string>& channel_names,
                                             const Calibration& calibration) {
  monitor.configuration_count = 0;
  for (const Calibration::Configuration& learned : calibration.configurations) {
    VehicleConfiguration& configuration =
        monitor.configurations[static_cast<std::size_t>(monitor.configuration_count++)];
    configuration = {};
    configuration.airspeed_sensor = learned.airspeed_sensor;
    for (const Calibration::Channel& channel : learned.channels) {
      const auto found = std::find(channel_names.begin(), channel_names.end(), channel.name);
      if (found == channel_names.end()) {
        return rt::fail_with(
            fmt::format("channel \"{}\" was calibrated but is not configured; "
                        "there are: {}. Calibrate again.",
                        channel.name, fmt::join(channel_names, ", ")));
      }
      const auto index = static_cast<std::size_t>(found - channel_names.begin());
      const auto model = describe(monitor.channels[index], monitor.tick_period);
      if (monitor.methods[index] != Method::kRegression || model != channel.model) {
        return rt::fail_with(fmt::format(
            "channel \"{}\" was calibrated for the model [{}] but is configured as [{}]. Calibrate again.",
            channel.name, fmt::join(channel.model, ", "), fmt::join(model, ", ")));
      }
      configuration.priors[index] = channel.prior;
    }
  }
  return monitor;
}

std::string to_toml(const Calibration& calibration) {
  std::string text = fmt::format(
      "# What the healthy flights of this vehicle say about its responses. Written by `airworthy calibrate`; "
      "learn\n"
      "# it again after a change of the vehicle or of the channels' terms.\n\n"
      "vehicle = \"{}\"\n"
      "false_alarms_per_hour = {}            # of each channel, that the thresholds are set for\n",
      calibration.vehicle, calibration.false_alarms_per_hour);
  for (const Calibration::Configuration& configuration : calibration.configurations) {
    text += fmt::format("\n[[configuration]]\nairspeed_sensor = {}\nflights = {}\nflown_s = {:.1f}\n",
                        configuration.airspeed_sensor, configuration.flights, configuration.flown_s);
    for (const Calibration::Channel& channel : configuration.channels) {
      const std::size_t terms = channel.model.size() - 1;
      text += fmt::format(
          "\n[[configuration.channel]]\nname = \"{}\"\nmodel = {}\ntheta = {}\ngram = {}\nsigma = {:.17g}\n"
          "threshold = {:.6g}\nworth_samples = {}\nsamples = {}\nflight_spread = {:.6g}\n",
          channel.name, quoted(channel.model), numbers(std::span{channel.prior.theta}.first(terms)),
          numbers(std::span{channel.prior.gram}.first(terms * terms)), channel.prior.sigma,
          channel.prior.threshold, channel.prior.worth_samples, channel.samples, channel.flight_spread);
    }
  }
  return text;
}

}  // namespace airworthy::response
