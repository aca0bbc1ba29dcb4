#include "core/detectors/flight_phase.h"

#include <algorithm>
#include <cmath>

#include "core/vehicle/gravity.h"

namespace airworthy {
namespace {

constexpr double kLongestStep_s = 0.1;    // a longer gap is no time to integrate over
constexpr double kHistoryStep_s = 0.005;  // 16 of them: 80 ms
constexpr std::size_t kBehind = 5;        // steps: 25 ms
constexpr double kThrustFresh_s = 0.2;    // telemetry older than this is replaced by commands
constexpr double kThrustUnknown_s = 0.5;
constexpr double kReportFresh_s = 3.0;
constexpr double kLeastLearnTime_s = 1.0;  // n of (3) begins here
constexpr double kMostLearnTime_s = 5.0;   // and grows to this
constexpr double kLeastScaleRatio = 0.6;   // learned c over that of the vehicle file
constexpr double kMostScaleRatio = 1.6;

// Thresholds in g, of the table in the header.
constexpr double kContact = 2.0;
constexpr double kLeverArm_m = 0.05;  // of an accelerometer off the centre of mass
constexpr double kCarried = 0.4;      // unexplained force of a standing vehicle
constexpr double kThrustOff = 0.4;
constexpr double kThrustOn = 0.35;
constexpr double kHovering = 0.6;
constexpr double kExplained = 0.35;
constexpr double kTouchDown = 0.35;
constexpr double kLeaning = 0.3;
constexpr double kFreeFall = 0.4;
constexpr double kStillRate_rad_s = 0.3;
constexpr double kStillRoughness_m_s2 = 1.5;
constexpr double kSpeedGained_m_s = 0.4;
constexpr double kClimb_m_s = 0.5;
constexpr double kStill_s = 0.25;
constexpr double kAirborne_s = 0.1;
constexpr double kFalling_s = 0.1;
constexpr double kCarried_s = 2.0;
constexpr double kFree_s = 0.5;
constexpr double kCalm_s = 1.5;
constexpr double kSupported_s = 0.05;

double share(double dt_s, double time_constant_s) { return dt_s / (time_constant_s + dt_s); }

}  // namespace

std::string_view name_of(Phase phase) noexcept {
  static constexpr std::array<std::string_view, kPhaseCount> kNames{"unknown",   "on_ground", "take_off",
                                                                    "in_flight", "landing",   "contact"};
  return kNames[static_cast<std::size_t>(phase)];
}

FlightPhase::FlightPhase(const Multirotor& vehicle) noexcept : vehicle_{vehicle} {
  for (Scale& scale : scale_) scale.value = vehicle.thrust_coefficient_N_s2 / vehicle.mass_kg;
}

double FlightPhase::thrust_m_s2() const noexcept {
  if (!has_thrust_) return std::numeric_limits<double>::quiet_NaN();
  return scale_[source_].value * sum_speed2_[source_];  // (1)
}

void FlightPhase::note_thrust(TimePoint time, Source source, double sum_speed2) noexcept {
  if (thrust_stamps_[source].judge(time) == StampGate::Stamp::kOlder) {
    ++times_gone_back_;
    return;
  }
  sum_speed2_[source] = sum_speed2;
}

void FlightPhase::on_rotor_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept {
  if (speed_rad_s.size() != vehicle_.rotor_count) return;
  double sum = 0.0;
  std::size_t known = 0;
  for (std::size_t i = 0; i < speed_rad_s.size(); ++i) {
    // Beyond twice full speed it is no speed: another unit, or garbage.
    const bool is_speed =
        std::isfinite(speed_rad_s[i]) && std::abs(speed_rad_s[i]) < 2.0 * vehicle_.speed_max_rad_s;
    if (is_speed) {
      last_speed_rad_s_[i] = speed_rad_s[i];
      ++known;
    }
    sum += last_speed_rad_s_[i] * last_speed_rad_s_[i];
  }
  if (known > 0) note_thrust(time, kSpeeds, sum);
}

void FlightPhase::on_rotor_commands(TimePoint time, std::span<const double> command_ratio) noexcept {
  if (command_ratio.size() != vehicle_.rotor_count) return;
  double sum = 0.0;
  for (const double ratio : command_ratio) {
    if (!std::isfinite(ratio)) return;
    const double speed = vehicle_.speed_min_rad_s +
                         std::clamp(ratio, 0.0, 1.0) * (vehicle_.speed_max_rad_s - vehicle_.speed_min_rad_s);
    sum += speed * speed;
  }
  note_thrust(time, kCommands, sum);
}

void FlightPhase::on_report(TimePoint time, LandedReport landed, double climb_m_s) noexcept {
  report_ = landed;
  climb_m_s_ = climb_m_s;
  last_report_ = time;
}

void FlightPhase::choose_source(TimePoint now) noexcept {
  const auto age_s = [&](Source source) {
    const auto& newest = thrust_stamps_[source].newest();
    // Ahead by as much is no better than behind: the stamp is wrong, and what it says will soon be old.
    return newest ? std::abs(to_seconds(now - *newest)) : std::numeric_limits<double>::infinity();
  };
  const Source before = source_;
  source_ = age_s(kSpeeds) <= kThrustFresh_s || age_s(kSpeeds) <= age_s(kCommands) ? kSpeeds : kCommands;
  has_thrust_ = age_s(source_) <= kThrustUnknown_s;
  if (source_ != before || !has_thrust_) history_size_ = history_next_ = 0;
  if (last_report_ && to_seconds(now - *last_report_) > kReportFresh_s) {
    report_ = LandedReport::kUnknown;
    climb_m_s_ = std::numeric_limits<double>::quiet_NaN();
  }
}

double FlightPhase::excess_over_recent_thrust(double up_m_s2) const noexcept {
  const auto recent = std::span{history_}.first(history_size_);
  const auto [least, most] =
      std::minmax_element(recent.begin(), recent.end(),
                          [](const Moment& a, const Moment& b) { return a.thrust_m_s2 < b.thrust_m_s2; });
  if (up_m_s2 > most->thrust_m_s2) return up_m_s2 - most->thrust_m_s2;
  return std::min(0.0, up_m_s2 - least->thrust_m_s2);
}

void FlightPhase::compare() noexcept {
  history_[history_next_] = {
      thrust_m_s2(), {accel_fast_[0].value, accel_fast_[1].value, accel_fast_[2].value}, up_.value};
  history_next_ = (history_next_ + 1) % kHistory;
  history_size_ = std::min(history_size_ + 1, kHistory);
  const std::size_t behind = std::min(kBehind, history_size_ - 1);
  const Moment& then = history_[(history_next_ + kHistory - 1 - behind) % kHistory];
  const auto& felt = then.accel_fast_m_s2;
  unexplained_fast_up_m_s2_ = excess_over_recent_thrust(-felt[2]);  // (2)
  unexplained_m_s2_ = std::hypot(felt[0], felt[1], unexplained_fast_up_m_s2_);
  const double unexplained_up = excess_over_recent_thrust(then.up_m_s2);
  unexplained_up_.step(unexplained_up, share(kHistoryStep_s, 0.05));
  unexplained_slow_.step(unexplained_up, share(kHistoryStep_s, 0.3));
}

void FlightPhase::observe(double dt_s, const std::array<double, 3>& accel,
                          const std::array<double, 3>& gyro) noexcept {
  double rough2 = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    accel_fast_[i].step(accel[i], share(dt_s, 0.015));
    accel_slow_[i].step(accel[i], share(dt_s, 0.3));
    const double deviation = accel_fast_[i].value - accel_slow_[i].value;
    rough2 += deviation * deviation;
  }
  roughness_m_s2_.step(std::sqrt(rough2), share(dt_s, 0.1));
  rates_.step(std::hypot(gyro[0], gyro[1], gyro[2]), share(dt_s, 0.05));
  up_.step(-accel[2], share(dt_s, 0.05));
  if (!has_thrust_) return;

  history_age_s_ += dt_s;
  if (history_size_ > 0 && history_age_s_ < kHistoryStep_s) return;
  history_age_s_ = 0.0;
  compare();
}

void FlightPhase::learn(double dt_s) noexcept {
  if (phase_ == Phase::kOnGround) standing_up_m_s2_.step(up_.value, share(dt_s, 0.5));
  if (phase_ != Phase::kInFlight || !has_thrust_) return;
  Scale& scale = scale_[source_];
  const double thrust = thrust_m_s2();
  if (thrust < 0.5 * kGravity_m_s2 || rates_.value > 3.0 || unexplained_m_s2_ > kGravity_m_s2) return;
  scale.seconds = std::clamp(scale.seconds + dt_s, kLeastLearnTime_s, kMostLearnTime_s);
  const double nominal = vehicle_.thrust_coefficient_N_s2 / vehicle_.mass_kg;
  scale.value += dt_s / scale.seconds * (up_.value / sum_speed2_[source_] - scale.value);  // (3)
  scale.value = std::clamp(scale.value, kLeastScaleRatio * nominal, kMostScaleRatio * nominal);
}

Phase FlightPhase::by_report() const noexcept {
  switch (report_) {
    case LandedReport::kOnGround:
      return Phase::kOnGround;
    case LandedReport::kInAir:
      return Phase::kInFlight;
    case LandedReport::kTakingOff:
      return Phase::kTakeOff;
    case LandedReport::kLanding:
      return Phase::kLanding;
    case LandedReport::kUnknown:
      break;
  }
  return Phase::kUnknown;
}

bool FlightPhase::has_left_the_ground(double dt_s) noexcept {
  const double g = kGravity_m_s2;
  const double thrust = thrust_m_s2();
  // Speed gained since the thrust rose; standing, it starts over.
  const double g0 = standing_up_m_s2_.has_value ? standing_up_m_s2_.value : g;
  if (phase_ == Phase::kOnGround || phase_ == Phase::kContact || thrust < kThrustOn * g)
    speed_gained_m_s_ = 0.0;
  // In a landing the ground's push must not count: what the rotors alone would give does.
  const double lift = phase_ == Phase::kLanding ? thrust : up_.value;
  speed_gained_m_s_ = std::max(0.0, speed_gained_m_s_ + (lift - g0) * dt_s);
  const bool lifts = speed_gained_m_s_ > kSpeedGained_m_s &&
                     std::abs(unexplained_up_.value / g) < kExplained && thrust > 0.5 * g;
  const bool climbs = climb_m_s_ > kClimb_m_s && thrust > 0.5 * g;
  return airborne_.for_s(lifts || climbs, dt_s, kAirborne_s);
}

Phase FlightPhase::next(double dt_s) noexcept {
  if (!has_thrust_ || phase_ != Phase::kUnknown) carried_.reset();
  if (!has_thrust_) return by_report();
  const double g = kGravity_m_s2;
  const double thrust = thrust_m_s2();
  const double unexplained = unexplained_m_s2_ / g;
  const double up = unexplained_up_.value / g;
  const double rates2 = rates_.value * rates_.value;

  const bool is_still = rates_.value < kStillRate_rad_s && roughness_m_s2_.value < kStillRoughness_m_s2;
  const bool is_falling =
      std::hypot(accel_fast_[0].value, accel_fast_[1].value, accel_fast_[2].value) < kFreeFall * g &&
      thrust < kThrustOff * g;
  const bool fell = falling_.for_s(is_falling, dt_s, kFalling_s);
  const bool rests =
      still_.for_s(is_still && unexplained > kCarried && thrust < kThrustOff * g, dt_s, kStill_s);

  const bool is_airborne = has_left_the_ground(dt_s);

  if (unexplained > kContact + rates2 * kLeverArm_m / g) {
    free_.reset();
    return Phase::kContact;
  }
  if (rests) return Phase::kOnGround;
  switch (phase_) {
    case Phase::kUnknown: {
      const bool is_carried = carried_.for_s(thrust > kHovering * g && std::abs(up) < kLeaning, dt_s,
                                             report_ == LandedReport::kInAir ? kStill_s : kCarried_s);
      return fell || is_airborne || is_carried ? Phase::kInFlight : Phase::kUnknown;
    }
    case Phase::kOnGround:
      if (fell) return Phase::kInFlight;
      return thrust > kThrustOn * g ? Phase::kTakeOff : Phase::kOnGround;
    case Phase::kTakeOff:
      return fell || is_airborne ? Phase::kInFlight : Phase::kTakeOff;
    case Phase::kInFlight: {
      const bool touched = (unexplained_fast_up_m_s2_ - unexplained_slow_.value) / g > kTouchDown;
      const bool leans = supported_.for_s(up > kLeaning, dt_s, kSupported_s);
      if (is_falling) return Phase::kInFlight;
      if (!touched && !leans && report_ != LandedReport::kLanding) return Phase::kInFlight;
      calm_.reset();
      speed_gained_m_s_ = 0.0;
      return Phase::kLanding;
    }
    case Phase::kLanding: {
      if (report_ == LandedReport::kLanding) return Phase::kLanding;
      const bool calm = calm_.for_s(std::abs(up) < 0.5 * kLeaning && thrust > 0.5 * g, dt_s, kCalm_s);
      return fell || is_airborne || calm ? Phase::kInFlight : Phase::kLanding;
    }
    case Phase::kContact: {
      const bool is_free = free_.for_s(unexplained < kExplained && thrust > kThrustOn * g, dt_s, kFree_s);
      if (fell) return Phase::kInFlight;
      if (is_free) calm_.reset();
      return is_free ? Phase::kLanding : Phase::kContact;
    }
  }
  return phase_;
}

void FlightPhase::on_imu(TimePoint time, const std::array<double, 3>& accel_m_s2,
                         const std::array<double, 3>& gyro_rad_s) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    if (!std::isfinite(accel_m_s2[i]) || !std::isfinite(gyro_rad_s[i])) return;
  }
  const StampGate::Stamp stamp = stamps_.judge(time);
  if (stamp == StampGate::Stamp::kSame || stamp == StampGate::Stamp::kOlder) {
    ++times_gone_back_;
    return;
  }
  const bool is_restart = stamp == StampGate::Stamp::kRestart;
  const double since_last_s = has_time_ && !is_restart ? to_seconds(time - now_) : 0.0;
  const double dt_s = std::min(since_last_s, kLongestStep_s);
  now_ = time;
  if (!has_time_ || since_ > time) since_ = time;
  has_time_ = true;
  const bool had_thrust = has_thrust_ && since_last_s <= kThrustUnknown_s;
  choose_source(time);
  // Of a take-off not seen throughout (4) does not know the speed gained: that it flies must be shown anew.
  if (has_thrust_ && !had_thrust && phase_ == Phase::kTakeOff) phase_ = Phase::kUnknown;
  observe(dt_s, accel_m_s2, gyro_rad_s);
  learn(dt_s);
  const Phase phase = next(dt_s);
  if (phase == phase_) return;
  phase_ = phase;
  since_ = time;
}

}  // namespace airworthy
