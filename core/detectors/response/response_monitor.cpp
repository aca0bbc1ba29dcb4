#include "core/detectors/response/response_monitor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace airworthy::response {
namespace {

constexpr int kIntervalMemory = 20;  // samples

template <std::size_t... kIndex>
std::array<ResponseChannel, sizeof...(kIndex)> make_channels(
    const std::array<ChannelParams, sizeof...(kIndex)>& params, std::index_sequence<kIndex...> /*unused*/) {
  return {ResponseChannel{params[kIndex]}...};
}

template <std::size_t... kIndex>
std::array<ArxChannel, sizeof...(kIndex)> make_arx_channels(const MonitorParams& params,
                                                            std::index_sequence<kIndex...> /*unused*/) {
  return {
      ArxChannel{params.arx[kIndex], params.channels[kIndex].life_cycle, params.channels[kIndex].warm_up}...};
}

bool all_finite(const std::array<double, 3>& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

}  // namespace

ResponseMonitor::ResponseMonitor(const MonitorParams& params) noexcept
    : params_{params},
      channels_{make_channels(params.channels, std::make_index_sequence<kMostChannels>{})},
      arx_{make_arx_channels(params, std::make_index_sequence<kMostChannels>{})} {}

bool ResponseMonitor::on_imu(const ImuSample& sample) noexcept {
  if (params_.pace != Pace::kInertial) return false;
  if (!all_finite(sample.accel_m_s2) || !all_finite(sample.gyro_rad_s) ||
      (started_ && sample.time <= last_sample_)) {
    ++refused_samples_;
    return false;
  }
  if (!follow(sample.time)) return false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    accel_sum_[axis] += sample.accel_m_s2[axis];
    gyro_sum_[axis] += sample.gyro_rad_s[axis];
  }
  ++averaged_;
  // The sample nearest to the end of the period completes it, whatever the rate of the inertial unit. At
  // about one sample a period each is a tick of its own, however it jitters.
  if (sample.time + typical_interval_ / 2 < tick_time_ + params_.tick_period) return false;
  finish_inertial_tick(sample.time);
  return true;
}

bool ResponseMonitor::on_attitude(TimePoint time, double roll_rad, double pitch_rad) noexcept {
  if (!std::isfinite(roll_rad) || !std::isfinite(pitch_rad) ||
      (attitude_.valid() && time <= attitude_.measured_at())) {
    ++refused_samples_;
    return false;
  }
  attitude_.measure(time, roll_rad, pitch_rad);
  // A flight controller that repeats a value has not measured again.
  const bool fresh = !measured_.known || roll_rad != measured_.roll_rad || pitch_rad != measured_.pitch_rad;
  measured_ = {time, roll_rad, pitch_rad, true};
  if (fresh) sample_arx(Samples::kFresh, time);
  if (params_.pace != Pace::kAttitude || !follow(time)) return false;
  if (time + typical_interval_ / 2 < tick_time_ + params_.tick_period) return false;
  finish_attitude_tick(time);
  return true;
}

void ResponseMonitor::on_attitude_setpoint(TimePoint time, double roll_rad, double pitch_rad,
                                           double thrust_ratio) noexcept {
  if (!std::isfinite(roll_rad) || !std::isfinite(pitch_rad) || (setpoint_.known && time < setpoint_.time)) {
    ++refused_samples_;
    return;
  }
  setpoint_ = {time, roll_rad, pitch_rad, true, thrust_ratio};
  sample_arx(Samples::kEverySetpoint, time);
}

void ResponseMonitor::on_rotor_command(TimePoint time, std::span<const double> command_ratio) noexcept {
  const std::size_t count = std::min(command_ratio.size(), commands_.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(command_ratio[i])) continue;
    if (std::isfinite(commands_[i].ratio) && time < commands_[i].time) {
      ++refused_samples_;
      return;
    }
    commands_[i] = {time, command_ratio[i]};
  }
}

void ResponseMonitor::on_flight_state(const FlightState& state) noexcept {
  if (flight_state_known_ && state.time < flight_state_.time) {
    ++refused_samples_;
    return;
  }
  flight_state_ = state;
  flight_state_known_ = true;
}

void ResponseMonitor::on_phase(Phase phase) noexcept {
  phase_ = phase;
  if (phase != Phase::kInFlight) tick_phase_ = phase;
}

void ResponseMonitor::on_clock(TimePoint now) noexcept {
  silent_ = started_ && now - last_sample_ > params_.longest_gap;
}

DetectorState ResponseMonitor::state() const noexcept {
  if (!started_) return DetectorState::kInitialising;
  if (muted() != Muted::kNo) return DetectorState::kMuted;
  const auto verdicts_now = verdicts();
  const bool judging =
      std::any_of(verdicts_now.begin(), verdicts_now.end(),
                  [](const ChannelVerdict& verdict) { return verdict.reason == NotJudged::kJudged; });
  return judging ? DetectorState::kMonitoring : DetectorState::kConverging;
}

// A sample of what sets the pace; false where it is the first one, also after a gap.
bool ResponseMonitor::follow(TimePoint time) noexcept {
  silent_ = false;
  if (!started_ || time - last_sample_ > params_.longest_gap) {
    restart(time);
    return false;
  }
  typical_interval_ += (time - last_sample_ - typical_interval_) / kIntervalMemory;
  last_sample_ = time;
  return true;
}

void ResponseMonitor::restart(TimePoint now) noexcept {
  if (started_) ++gaps_;
  started_ = true;
  typical_interval_ = params_.tick_period;
  last_sample_ = tick_time_ = now;
  averaged_ = 0;
  accel_sum_ = gyro_sum_ = {};
  tick_attitude_ = measured_;
  for (ResponseChannel& channel : channels_) channel.restart_history();
  for (ArxChannel& channel : arx_) channel.restart_history();
}

void ResponseMonitor::sample_arx(Samples samples, TimePoint time) noexcept {
  if (muted_ != Muted::kNo || !measured_.known || !setpoint_.known) return;
  if (params_.needs_flight_phase && phase_ != Phase::kInFlight) return;
  if (time - std::min(measured_.time, setpoint_.time) > params_.input_timeout) return;
  SignalFrame signals;
  signals[Signal::kRoll] = measured_.roll_rad;
  signals[Signal::kPitch] = measured_.pitch_rad;
  signals[Signal::kRollSetpoint] = setpoint_.roll_rad;
  signals[Signal::kPitchSetpoint] = setpoint_.pitch_rad;
  for (std::size_t i = 0; i < static_cast<std::size_t>(params_.channel_count); ++i) {
    if (params_.methods[i] != Method::kArx || params_.arx[i].samples != samples) continue;
    arx_[i].sample(time, signals[params_.arx[i].input], signals[params_.arx[i].output]);
  }
}

void ResponseMonitor::finish_inertial_tick(TimePoint now) noexcept {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    accel_[axis] = accel_sum_[axis] / averaged_;
    gyro_[axis] = gyro_sum_[axis] / averaged_;
  }
  averaged_ = 0;
  accel_sum_ = gyro_sum_ = {};
  const Duration elapsed = now - tick_time_;
  attitude_.step(now, to_seconds(elapsed), gyro_[0], gyro_[1], gyro_[2]);
  const double roll = attitude_.roll_rad();
  euler_pitch_rate_ = gyro_[1] * std::cos(roll) - gyro_[2] * std::sin(roll);
  judge_tick(now, elapsed);
}

void ResponseMonitor::finish_attitude_tick(TimePoint now) noexcept {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const Duration elapsed = now - tick_time_;
  const double elapsed_s = to_seconds(elapsed);
  accel_ = {kUnknown, kUnknown, kUnknown};
  gyro_ = {std::remainder(measured_.roll_rad - tick_attitude_.roll_rad, 2 * std::numbers::pi) / elapsed_s,
           kUnknown, kUnknown};
  euler_pitch_rate_ = (measured_.pitch_rad - tick_attitude_.pitch_rad) / elapsed_s;
  tick_attitude_ = measured_;
  judge_tick(now, elapsed);
}

void ResponseMonitor::judge_tick(TimePoint now, Duration elapsed) noexcept {
  tick_time_ = now;
  muted_ = take_muted();
  if (muted_ == Muted::kNo) flown_ += elapsed;
  choose_configuration();
  signals_ = frame(now);
  const bool silent = muted_ != Muted::kNo;
  const double tick_s = to_seconds(elapsed);
  for (std::size_t i = 0; i < static_cast<std::size_t>(params_.channel_count); ++i) {
    const bool is_arx = params_.methods[i] == Method::kArx;
    if (silent && params_.needs_flight_phase) {
      verdicts_[i] = is_arx ? arx_[i].pause(now) : channels_[i].pause(signals_, tick_s, now);
    } else {
      verdicts_[i] = is_arx ? arx_[i].step(now, flown_, silent)
                            : channels_[i].step(signals_, tick_s, now, flown_, silent);
    }
  }
}

Muted ResponseMonitor::take_muted() noexcept {
  const Phase phase = std::exchange(tick_phase_, phase_);
  if (!flying()) return Muted::kNotFlying;
  if (!params_.needs_flight_phase || phase == Phase::kInFlight) return Muted::kNo;
  muted_phase_ = phase;
  return Muted::kNotInFlight;
}

void ResponseMonitor::choose_configuration() noexcept {
  if (configured_ || muted_ != Muted::kNo) return;
  if (flight_state_known_ && flight_state_.airspeed_m_s > params_.airspeed_sensor_above_m_s) {
    airspeed_sensor_ = true;
  }
  if (flown_ < params_.configuration_after) return;
  configured_ = true;
  for (int c = 0; c < params_.configuration_count; ++c) {
    const VehicleConfiguration& configuration = params_.configurations[static_cast<std::size_t>(c)];
    if (configuration.airspeed_sensor != airspeed_sensor_) continue;
    for (std::size_t i = 0; i < static_cast<std::size_t>(params_.channel_count); ++i) {
      if (configuration.priors[i] && !channels_[i].warm_start(*configuration.priors[i])) ++refused_priors_;
    }
  }
}

SignalFrame ResponseMonitor::frame(TimePoint now) const noexcept {
  SignalFrame signals;
  signals[Signal::kAccelX] = accel_[0];
  signals[Signal::kAccelY] = accel_[1];
  signals[Signal::kAccelZ] = accel_[2];
  signals[Signal::kRollRate] = gyro_[0];
  signals[Signal::kPitchRate] = gyro_[1];
  signals[Signal::kYawRate] = gyro_[2];
  if (attitude_.valid() && now - attitude_.measured_at() <= params_.input_timeout) {
    signals[Signal::kRoll] = attitude_.roll_rad();
    signals[Signal::kPitch] = attitude_.pitch_rad();
    signals[Signal::kEulerPitchRate] = euler_pitch_rate_;
  }
  if (setpoint_.known && now - setpoint_.time <= params_.input_timeout) {
    signals[Signal::kRollSetpoint] = setpoint_.roll_rad;
    signals[Signal::kPitchSetpoint] = setpoint_.pitch_rad;
    signals[Signal::kRollError] = setpoint_.roll_rad - signals[Signal::kRoll];
    signals[Signal::kPitchError] = setpoint_.pitch_rad - signals[Signal::kPitch];
    signals[Signal::kThrustSetpoint] = setpoint_.thrust_ratio;
  }
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    if (now - commands_[i].time > params_.input_timeout) continue;
    signals[static_cast<Signal>(static_cast<std::size_t>(Signal::kCommand0) + i)] = commands_[i].ratio;
  }
  if (flight_state_known_ && now - flight_state_.time <= params_.input_timeout) {
    signals[Signal::kAltitudeError] = flight_state_.altitude_error_m;
    signals[Signal::kAirspeedError] = flight_state_.airspeed_error_m_s;
    signals[Signal::kAirspeed] = flight_state_.airspeed_m_s;
    signals[Signal::kClimb] = flight_state_.climb_m_s;
  }
  return signals;
}

bool ResponseMonitor::flying() const noexcept {
  if (!flight_state_known_) return true;
  if (flight_state_.armed == 0 || flight_state_.landed_state == 1) return false;
  // A comparison with NaN is false: an unknown ground speed does not say that the vehicle stands.
  return !(flight_state_.groundspeed_m_s < params_.min_groundspeed_m_s);
}

}  // namespace airworthy::response
