#include "tests/replay/scaled_out_flight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <variant>

#include "airworthy/esc_status_t.hpp"
#include "airworthy/flight_state_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "cli/calibrate/effectiveness_learning.h"
#include "cli/eval/flight_run.h"
#include "core/detectors/flight_phase.h"
#include "runtime/bus/channels.h"
#include "runtime/phase/landed_report.h"
#include "tests/replay/scaled_out_rotor.h"

namespace airworthy::testing {
namespace {

using effectiveness::EffectivenessConfig;
using effectiveness::EffectivenessMonitor;
using effectiveness::LossEvent;
using effectiveness::Muted;

constexpr double kRadPerS_per_rpm = std::numbers::pi / 30.0;

struct Inertial {
  std::array<double, 3> accel_m_s2;
  std::array<double, 3> gyro_rad_s;
};
struct Speeds {
  std::vector<double> rad_s;
};
struct Commands {
  std::vector<double> ratio;
};
struct Report {
  LandedReport landed;
  double climb_m_s;
};
struct Event {
  TimePoint time;
  std::variant<Inertial, Speeds, Commands, Report> what;
};

/// All that the detector hears in a flight, in the order of arrival.
rt::Expected<std::vector<Event>> heard_in(const std::string& log, const EffectivenessConfig& config) {
  std::vector<Event> events;
  const auto flight = eval::run_flight(log, "airworthy-effectiveness", [&](rt::Node& node) {
    node.subscribe<esc_status_t>(channel::kEscStatus, [&](const esc_status_t& message) {
      Speeds speeds{message.speed_rpm};
      for (double& speed : speeds.rad_s) speed *= kRadPerS_per_rpm;
      events.push_back({from_us(message.header.time_us), speeds});
    });
    node.subscribe<rotor_command_t>(channel::kRotorCommand, [&](const rotor_command_t& message) {
      events.push_back({from_us(message.header.time_us), Commands{message.command_ratio}});
    });
    node.subscribe<flight_state_t>(channel::kFlightState, [&](const flight_state_t& message) {
      events.push_back({from_us(message.header.time_us),
                        Report{rt::landed_report(message.landed_state), message.climb_m_s}});
    });
    node.subscribe<imu_t>(channel::kImu, [&](const imu_t& message) {
      if (message.sensor_id != config.imu_sensor_id) return;
      Inertial sample{};
      for (std::size_t i = 0; i < 3; ++i) {
        sample.accel_m_s2[i] = message.accel_m_s2[i];
        sample.gyro_rad_s[i] = message.gyro_rad_s[i];
      }
      events.push_back({from_us(message.header.time_us), sample});
    });
    return eval::Detector{};
  });
  if (!flight) return tl::unexpected<rt::Error>{flight.error()};
  return events;
}

/// The detector and the phase of flight that it is told, as they are at one moment.
struct Watch {
  EffectivenessMonitor monitor;
  FlightPhase phase;

  std::optional<LossEvent> hear(const Event& event) {
    if (const auto* speeds = std::get_if<Speeds>(&event.what)) {
      phase.on_rotor_speeds(event.time, speeds->rad_s);
      return monitor.on_speeds(event.time, speeds->rad_s);
    }
    if (const auto* commands = std::get_if<Commands>(&event.what)) {
      phase.on_rotor_commands(event.time, commands->ratio);
      return monitor.on_commands(event.time, commands->ratio);
    }
    if (const auto* report = std::get_if<Report>(&event.what)) {
      phase.on_report(event.time, report->landed, report->climb_m_s);
      monitor.on_report(report->landed);
      return std::nullopt;
    }
    const auto& sample = std::get<Inertial>(event.what);
    phase.on_imu(event.time, sample.accel_m_s2, sample.gyro_rad_s);
    return monitor.on_imu(event.time, sample.accel_m_s2, sample.gyro_rad_s, phase.phase());
  }
};

/// Reported speeds of one rotor at any time: linear between reports. Ask in order of time.
class SpeedSeries {
 public:
  SpeedSeries(const std::vector<Event>& events, std::size_t rotor) {
    for (const Event& event : events) {
      const auto* speeds = std::get_if<Speeds>(&event.what);
      if (speeds != nullptr && rotor < speeds->rad_s.size() && std::isfinite(speeds->rad_s[rotor]))
        samples_.emplace_back(event.time, speeds->rad_s[rotor]);
    }
  }
  [[nodiscard]] double at(TimePoint time) const {
    const auto later = std::lower_bound(samples_.begin(), samples_.end(), time,
                                        [](const auto& sample, TimePoint t) { return sample.first < t; });
    if (later == samples_.end()) return samples_.empty() ? 0.0 : samples_.back().second;
    if (later == samples_.begin()) return later->second;
    const auto before = later - 1;
    const double share = to_seconds(time - before->first) / to_seconds(later->first - before->first);
    return before->second + share * (later->second - before->second);
  }

 private:
  std::vector<std::pair<TimePoint, double>> samples_;
};

struct Moment {
  std::size_t next;  ///< event
  TimePoint time;
  Watch watch;
};

/// The flight from one moment on, with one rotor scaled out: the first alarm.
std::optional<LossEvent> watch_without(const std::vector<Event>& events, const Moment& moment,
                                       const SpeedSeries& speeds, Duration late, ScaledOutRotor scaled) {
  Watch watch = moment.watch;
  TimePoint before = moment.time;
  for (std::size_t k = moment.next; k < events.size(); ++k) {
    if (events[k].time > moment.time + kScaledOutJudged) break;
    Event event = events[k];
    if (auto* sample = std::get_if<Inertial>(&event.what); sample != nullptr && event.time > before) {
      scaled.step(to_seconds(event.time - before), speeds.at(before + late), speeds.at(event.time + late),
                  sample->accel_m_s2, sample->gyro_rad_s);
      before = event.time;
    }
    if (auto found = watch.hear(event)) return found;
  }
  return std::nullopt;
}

}  // namespace

rt::Expected<ScaledOutFlight> scale_out(const std::string& log, const EffectivenessConfig& judging,
                                        const EffectivenessConfig& truth) {
  const auto heard = heard_in(log, judging);
  if (!heard) return tl::unexpected<rt::Error>{heard.error()};
  const std::vector<Event>& events = *heard;
  if (events.empty()) return rt::fail_with(log + ": holds nothing for the detector");
  const auto recordings = calibrate::read_effectiveness_recordings({log}, truth, 1);
  if (!recordings) return tl::unexpected<rt::Error>{recordings.error()};
  const Multirotor& vehicle = truth.monitor.vehicle;
  Duration late = truth.monitor.speeds.telemetry_latency;
  if (truth.monitor.learns_inertial_delay) {
    const auto delay = calibrate::inertial_delay_of(recordings->front(), truth.monitor);
    if (!delay) return tl::unexpected<rt::Error>{delay.error()};
    late -= *delay;
  }

  std::vector<SpeedSeries> speeds;
  for (std::size_t i = 0; i < vehicle.rotor_count; ++i) speeds.emplace_back(events, i);
  ScaledOutFlight result;
  Watch watch{EffectivenessMonitor{judging.monitor}, FlightPhase{judging.monitor.vehicle}};
  const TimePoint start = events.front().time;
  TimePoint next_onset = start + kScaledOutSpacing;
  for (std::size_t k = 0; k < events.size(); ++k) {
    if (watch.hear(events[k])) ++result.healthy_alarms;
    const TimePoint now = events[k].time;
    if (!std::holds_alternative<Inertial>(events[k].what) || now < next_onset) continue;
    next_onset += kScaledOutSpacing;
    if (now + kScaledOutJudged > events.back().time) continue;
    if (watch.monitor.muted() != Muted::kNot) {
      ++result.muted_onsets;
      continue;
    }
    const Moment moment{k + 1, now, watch};
    for (std::size_t rotor = 0; rotor < vehicle.rotor_count; ++rotor) {
      for (const double loss : kScaledOutLosses) {
        const ScaledOutRotor scaled{truth.monitor.effectiveness, vehicle, rotor, loss};
        result.outcomes.push_back({to_seconds(now - start), rotor, loss,
                                   watch_without(events, moment, speeds[rotor], late, scaled), 0.0});
        ScaledOutcome& outcome = result.outcomes.back();
        if (outcome.found) outcome.delay_s = to_seconds(outcome.found->decided - now);
      }
    }
  }
  result.judged_s = watch.monitor.judged_s();
  return result;
}

}  // namespace airworthy::testing
