#include "services/response/response_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/config/named_calibration.h"
#include "runtime/config/vehicle.h"
#include "services/response/calibration.h"

namespace airworthy::response {
namespace {

using rt::ConfigTable;
using rt::Range;

int delay_in_ticks(ConfigTable table, const char* key, double delay_s, double tick_s) {
  const double ticks = delay_s / tick_s;
  if (std::abs(ticks - std::round(ticks)) > 1e-6) {
    table.fail(key, fmt::format("{} is not a multiple of input.tick_period_s ({})", delay_s, tick_s));
  }
  if (std::round(ticks) > Regressor::kMostDelayTicks) {
    table.fail(key, fmt::format("{} is more than {} ticks", delay_s, Regressor::kMostDelayTicks));
    return 0;
  }
  return static_cast<int>(std::round(ticks));
}

Signal signal_named(const std::string& name, ConfigTable table) {
  for (int i = 0; i < kSignals; ++i) {
    if (kSignalNames[static_cast<std::size_t>(i)] == name) return static_cast<Signal>(i);
  }
  std::string known;
  for (const std::string_view one : kSignalNames) known += (known.empty() ? "" : ", ") + std::string{one};
  table.fail("signal", fmt::format("\"{}\" is not one of {}", name, known));
  return Signal::kOne;
}

Term read_term(ConfigTable table, double tick_s) {
  Term term;
  term.signal = signal_named(table.required<std::string>("signal"), table);
  term.transform = table.choice<Transform>("transform",
                                           {{"none", Transform::kNone},
                                            {"sine", Transform::kSine},
                                            {"absolute_sine", Transform::kAbsoluteSine},
                                            {"load_factor", Transform::kLoadFactor}},
                                           Transform::kNone);
  term.lowpass_s = table.optional<double>("lowpass_s", 0.0, Range{0.0, 60.0});
  term.delay_ticks =
      delay_in_ticks(table, "delay_s", table.optional<double>("delay_s", 0.0, Range{0.0, 60.0}), tick_s);
  if (const auto minus = table.if_present<double>("minus_delay_s", Range{0.0, 60.0})) {
    term.minus_delay_ticks = delay_in_ticks(table, "minus_delay_s", *minus, tick_s);
  }
  return term;
}

std::string unit_of(Signal signal) {
  const std::string_view name = to_string(signal);
  if (name.ends_with("_m_s2")) return "m/s^2";
  if (name.ends_with("_rad_s")) return "rad/s";
  if (name.ends_with("_rad")) return "rad";
  if (name.ends_with("_m_s")) return "m/s";
  if (name.ends_with("_m")) return "m";
  return "1";
}

DelayedRegressionParams read_regression(ConfigTable table, int terms, double tick_s) {
  DelayedRegressionParams params;
  params.terms = terms;
  const double delay_s = table.optional<double>("learning_delay_s", 2.0, Range{0.1, 60.0});
  const double delay_ticks = std::round(delay_s / tick_s);
  if (delay_ticks < 1 || delay_ticks >= kMostLearningDelayTicks) {
    table.fail("learning_delay_s",
               fmt::format("{} is not between 1 and {} ticks", delay_s, kMostLearningDelayTicks - 1));
  } else {
    params.delay_ticks = static_cast<int>(delay_ticks);
  }
  params.huber_sigmas = table.optional<double>("huber_sigmas", params.huber_sigmas, Range{0.5, 100.0});
  params.ridge = table.optional<double>("ridge", params.ridge, Range{0.0, 1e6});
  params.extrapolation_gain =
      table.optional<double>("extrapolation_gain", params.extrapolation_gain, Range{0.0, 1e6});
  return params;
}

CusumParams read_cusum(ConfigTable table) {
  CusumParams params;
  params.threshold = table.required<double>("threshold", Range{0.1, 1000.0});
  return params;
}

EvidenceParams read_evidence(ConfigTable table) {
  EvidenceParams params;
  params.alternative = table.choice<Alternative>(
      "alternative", {{"shift", Alternative::kShift}, {"gain_loss", Alternative::kGainLoss}},
      Alternative::kShift);
  if (params.alternative == Alternative::kShift) {
    params.drift_sigmas = table.required<double>("drift_sigmas", Range{0.0, 10.0});
    params.clip_sigmas = table.optional<double>("clip_sigmas", 4.0, Range{0.1, 100.0});
    if (params.clip_sigmas <= params.drift_sigmas) {
      table.fail("clip_sigmas",
                 fmt::format("{} must exceed drift_sigmas ({})", params.clip_sigmas, params.drift_sigmas),
                 {"drift_sigmas"});
    }
    return params;
  }
  params.remaining_gain = table.required<double>("remaining_gain", Range{0.0, 1.0}.without_max());
  params.sigma_inflation =
      table.optional<double>("sigma_inflation", params.sigma_inflation, Range{1.0, 10.0});
  params.clip_sigmas = table.optional<double>("clip_sigmas", 3.0, Range{0.1, 100.0});
  params.most_per_tick = table.optional<double>("most_per_tick", params.most_per_tick, Range{0.01, 100.0});
  return params;
}

FaultLifeCycleParams read_life_cycle(ConfigTable table) {
  FaultLifeCycleParams params;
  params.latched = table.optional<bool>("latched", false);
  params.clear_ratio = table.optional<double>("clear_ratio", params.clear_ratio, Range{0.0, 0.9});
  params.clear_after = from_seconds(
      table.optional<double>("clear_after_s", to_seconds(params.clear_after), Range{0.1, 600.0}));
  return params;
}

ChannelMeaning read_meaning(ConfigTable table, Signal response) {
  ChannelMeaning meaning;
  meaning.name = table.required<std::string>("name");
  meaning.component = table.required<std::string>("component");
  meaning.fault_kind = table.required<std::string>("fault_kind");
  meaning.severity = table.choice<rt::Severity>("severity", {{"advisory", rt::Severity::kAdvisory},
                                                             {"caution", rt::Severity::kCaution},
                                                             {"warning", rt::Severity::kWarning}});
  meaning.summary = table.required<std::string>("summary");
  meaning.candidates = table.optional<std::vector<std::string>>("candidates", {});
  meaning.unit = unit_of(response);
  return meaning;
}

ArxParams read_arx(ConfigTable table, Duration input_timeout) {
  ArxParams params;
  params.output =
      table.choice<Signal>("output", {{"roll_rad", Signal::kRoll}, {"pitch_rad", Signal::kPitch}});
  params.input = table.choice<Signal>("input", {{"roll_setpoint_rad", Signal::kRollSetpoint},
                                                {"pitch_setpoint_rad", Signal::kPitchSetpoint}});
  params.samples = table.choice<Samples>(
      "samples", {{"every_setpoint", Samples::kEverySetpoint}, {"fresh", Samples::kFresh}}, params.samples);
  params.past_outputs = table.optional<int>("past_outputs", params.past_outputs, Range{0, kMostPastValues});
  params.past_inputs = table.optional<int>("past_inputs", params.past_inputs, Range{0, kMostPastValues});
  params.forgetting = table.optional<double>("forgetting", params.forgetting, Range{0.5, 1.0});
  params.prior_variance = table.optional<double>("prior_variance", params.prior_variance, Range{1e-12, 1e12});
  params.excitation_floor =
      table.optional<double>("excitation_floor", params.excitation_floor, Range{0.0, 1e3});
  params.threshold_sigmas =
      table.optional<double>("threshold_sigmas", params.threshold_sigmas, Range{0.5, 1e3});
  const int terms = params.past_outputs + params.past_inputs + 1;
  params.arm_after_samples =
      table.optional<int>("arm_after_samples", params.arm_after_samples, Range{2, 1'000'000});
  if (params.arm_after_samples < terms) {
    table.fail("arm_after_samples",
               fmt::format("{} samples cannot tell {} coefficients apart", params.arm_after_samples, terms),
               {"past_outputs", "past_inputs"});
  }
  params.settled_change = table.optional<double>("settled_change", params.settled_change, Range{1e-12, 1e6});
  params.settled_samples =
      table.optional<int>("settled_samples", params.settled_samples, Range{1, 1'000'000});
  params.moments_after_samples =
      table.optional<int>("moments_after_samples", params.moments_after_samples, Range{0, 1'000'000});
  params.longest_gap = input_timeout;
  return params;
}

ChannelParams read_channel(ConfigTable table, double tick_s, Duration warm_up) {
  ChannelParams params;
  params.warm_up = warm_up;
  params.response = read_term(table.required_table("response"), tick_s);
  const auto terms = table.tables("terms");
  if (terms.empty() || terms.size() > static_cast<std::size_t>(kMostTerms)) {
    table.fail("terms", fmt::format("{} terms; must be 1 to {}", terms.size(), kMostTerms));
  } else {
    for (ConfigTable term : terms) {
      const auto index = static_cast<std::size_t>(params.term_count++);
      params.terms[index] = read_term(term, tick_s);
      params.commanded[index] = term.optional<bool>("commanded", false);
      params.warm_only[index] = term.optional<bool>("warm_only", false);
    }
  }
  params.least_sigma = table.optional<double>("least_sigma", 0.0, Range{0.0, 1e9});
  params.evidence = read_evidence(table);
  if (params.evidence.alternative == Alternative::kShift) {
    params.side =
        table.choice<Side>("side", {{"low", Side::kLow}, {"high", Side::kHigh}, {"both", Side::kBoth}});
  } else if (std::count(params.commanded.begin(), params.commanded.end(), true) == 0) {
    table.fail("terms", "a gain_loss channel needs at least one term with commanded = true");
  }
  if (params.evidence.alternative == Alternative::kShift) {
    params.warm_drift_sigmas =
        table.optional<double>("warm_drift_sigmas", params.evidence.drift_sigmas, Range{0.0, 10.0});
    if (params.evidence.clip_sigmas <= params.warm_drift_sigmas) {
      table.fail("clip_sigmas",
                 fmt::format("{} must exceed warm_drift_sigmas ({})", params.evidence.clip_sigmas,
                             params.warm_drift_sigmas),
                 {"warm_drift_sigmas", "drift_sigmas"});
    }
  }
  params.regression = read_regression(table, params.term_count, tick_s);
  params.cusum = read_cusum(table);
  params.life_cycle = read_life_cycle(table);
  return params;
}

void read_calibration(ConfigTable root, bool cold, ResponseConfig& config) {
  const auto calibration = rt::named_calibration(root, config.vehicle, !cold, load_calibration);
  if (!calibration) return;
  auto monitor = with_calibration(config.monitor, config.channel_names(), *calibration);
  if (!monitor) return root.fail("calibration", monitor.error().text, {"channel"});
  config.monitor = *monitor;
}

rt::Expected<ResponseConfig> load_from(const std::string& path, const std::vector<std::string>& overrides,
                                       bool cold) {
  auto file = rt::ConfigFile::load(path, overrides);
  ConfigTable root = file.root();
  ResponseConfig config;
  const rt::VehicleFile vehicle = rt::VehicleFile::named_by(root);
  config.vehicle = vehicle.name;
  config.multirotor = vehicle.multirotor;

  ConfigTable input = root.table("input");
  config.imu_sensor_id = input.optional<int>("imu_sensor_id", 0, Range{0, 127});
  const double tick_s = input.optional<double>("tick_period_s", 0.1, Range{0.01, 1.0});
  MonitorParams& monitor = config.monitor;
  monitor.pace =
      input.choice<Pace>("pace", {{"imu", Pace::kInertial}, {"attitude", Pace::kAttitude}}, Pace::kInertial);
  // Where the attitude sets the pace there is too little inertial data to tell the phase by.
  monitor.needs_flight_phase = vehicle.multirotor.has_value() && monitor.pace == Pace::kInertial;
  monitor.tick_period = from_seconds(tick_s);
  monitor.longest_gap = from_seconds(input.optional<double>("longest_gap_s", 1.0, Range{0.1, 60.0}));
  monitor.input_timeout = from_seconds(input.optional<double>("input_timeout_s", 2.0, Range{0.1, 60.0}));
  monitor.min_groundspeed_m_s = input.optional<double>("min_groundspeed_m_s", 0.0, Range{0.0, 100.0});
  const Duration warm_up = from_seconds(input.optional<double>("warm_up_s", 20.0, Range{0.0, 600.0}));

  const auto channels = root.tables("channel", {.unique_key = "name"});
  if (channels.empty() || channels.size() > static_cast<std::size_t>(kMostChannels)) {
    root.fail("channel", fmt::format("{} channels; must be 1 to {}", channels.size(), kMostChannels));
  } else {
    for (ConfigTable table : channels) {
      const auto index = static_cast<std::size_t>(monitor.channel_count++);
      ChannelParams& params = monitor.channels[index];
      monitor.methods[index] = table.choice<Method>(
          "method", {{"regression", Method::kRegression}, {"arx", Method::kArx}}, Method::kRegression);
      if (monitor.methods[index] == Method::kArx) {
        monitor.arx[index] = read_arx(table, monitor.input_timeout);
        params.response.signal = monitor.arx[index].output;
        params.warm_up = warm_up;
        params.life_cycle = read_life_cycle(table);
      } else {
        params = read_channel(table, tick_s, warm_up);
      }
      config.channels.push_back(read_meaning(table, params.response.signal));
    }
  }
  if (root.has("calibration")) read_calibration(root, cold, config);
  config.hash = file.hash();
  return file.finish(std::move(config));
}

}  // namespace

std::vector<std::string> ResponseConfig::channel_names() const {
  std::vector<std::string> names;
  for (const ChannelMeaning& channel : channels) names.push_back(channel.name);
  return names;
}

rt::Expected<ResponseConfig> ResponseConfig::load(const std::string& path,
                                                  const std::vector<std::string>& overrides) {
  return load_from(path, overrides, false);
}

rt::Expected<ResponseConfig> ResponseConfig::load_cold(const std::string& path,
                                                       const std::vector<std::string>& overrides) {
  return load_from(path, overrides, true);
}

}  // namespace airworthy::response
