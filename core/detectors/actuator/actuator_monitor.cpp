#include "core/detectors/actuator/actuator_monitor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/estimators/inertial_range.h"
#include "core/math/triangular.h"
#include "core/vehicle/gravity.h"

namespace airworthy::actuator {
namespace {

constexpr double kTurn_rad = 2.0 * std::numbers::pi;
constexpr double kLongestStep_s = 0.1;      // a longer gap starts the flight's estimates anew
constexpr Duration kLongestRepeat{50'000};  // then the autopilot may have been misled as well
constexpr double kRawAccelFactor = 4.0;     // noise before the low-pass over that after it
constexpr double kForceReach = 2.0;  // of weight and thrust: a thrust may come and go within one sample
constexpr Duration kSilent{500'000};
constexpr Duration kRepaired{3'000'000};  // on the ground
constexpr Duration kConsequence{2'000'000};
constexpr double kSuspected = 0.5;  // probability of a fault above which nothing is learned
constexpr double kLeastLearning_s = 0.5;
constexpr double kFirstLearning_s =
    3.0;  // time constant of what is learned at first; grows with the flight to ...
constexpr double kThrustLearning_s = 60.0;
constexpr double kBaselineLearning_s = 20.0;
constexpr double kSpreadRise_s = 3.0;   // gusts come in groups: what was seen once ...
constexpr double kSpreadFall_s = 10.0;  // ... is expected for a while
constexpr double kSpreadFactor = 1.5;
constexpr double kLeastThrustRatio = 0.5;
constexpr double kMostThrustRatio = 2.0;
constexpr double kClimbKnown_m_s = 0.6;         // sigma of a climb worth using
constexpr double kMostInflow = 0.5;             // share of the thrust
constexpr double kMostPitch_rad = 1.4;          // beyond, Euler angles say nothing
constexpr double kWhiteShare = 0.1;             // of a disturbance: what changes from sample to sample
constexpr double kAxisDisturbanceFactor = 5.0;  // of an axis: rotors that differ are a torque that stays
constexpr double kAxisDisturbanceTime_s = 5.0;
constexpr double kAngleNoise_rad_sqrt_s = 0.005;
constexpr double kClimbNoise_m_s_sqrt_s = 0.2;
constexpr double kNotMeasured_variance = 1e8;  // what did not come has no weight
constexpr double kDiffusionTime_s = 1.0;
constexpr double kLeast_variance = 1e-12;  // keeps a covariance positive where no time has passed

double square(double x) { return x * x; }

bool is_loss(double gamma) { return gamma >= kLeastLoss && gamma <= kMostLoss; }

}  // namespace

/// The inertial sample as the observers see it.
struct ActuatorMonitor::Body {
  std::array<double, 3> rate_rad_s;
  double accel_up_m_s2;
  double lowpass_share;
  Eigen::Matrix<double, 3, 1> known_rad_s2;  ///< gyroscopic
};

ActuatorMonitor::ActuatorMonitor(const ActuatorMonitorParams& params) noexcept
    : params_{params},
      mixing_{mixing_matrix(params.vehicle)},
      thrust_{params.vehicle, params.source},
      gyro_{params.gyro_sigma_rad_s},
      accel_{kRawAccelFactor * params.accel_sigma_m_s2} {
  const double hover_m_s2 = kGravity_m_s2 / static_cast<double>(params_.vehicle.rotor_count);
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const double ratio = axis == kYaw      ? params_.yaw_disturbance_ratio
                         : axis == kHeight ? params_.height_disturbance_ratio
                                           : params_.disturbance_ratio;
    disturbance_[axis] =
        ratio * hover_m_s2 * mixing_.row(static_cast<Eigen::Index>(axis)).cwiseAbs().maxCoeff();
  }
  for (auto& policy : rotor_policies_) policy.emplace(params_.rotor);
  for (auto& policy : axis_policies_) policy.emplace(params_.axis);
}

void ActuatorMonitor::watch_ground(Phase phase) noexcept {
  if (phase != Phase::kOnGround) on_ground_since_.reset();
  if (phase == Phase::kOnGround && !on_ground_since_) on_ground_since_ = now_;
  if (on_ground_since_ && now_ - *on_ground_since_ >= kRepaired) forget_flights();
}

void ActuatorMonitor::forget_flights() noexcept {
  thrust_ratio_ = 1.0;
  last_raised_.reset();
  for (auto& policy : rotor_policies_) policy->rearm();
  for (auto& policy : axis_policies_) policy->rearm();
  for (LossVerdict& verdict : rotor_verdicts_) verdict.baseline = 0.0;
}

void ActuatorMonitor::start_flight() noexcept {
  RotorObserver::Prior prior;
  prior.fault_variance.setConstant(square(params_.prior_sigma));
  prior.state_covariance.setZero();
  for (int axis = 0; axis < static_cast<int>(kAxes); ++axis) {
    prior.state_covariance(axis, axis) = 100.0;
    prior.state_covariance(4 + axis, 4 + axis) = square(disturbance_[static_cast<std::size_t>(axis)]);
  }
  rotor_observer_.emplace(prior);
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    AxisObserver::Prior axis_prior;
    axis_prior.fault_variance << 1.0;
    axis_prior.state_covariance.setZero();
    axis_prior.state_covariance.diagonal() << 10.0, 100.0,
        square(kAxisDisturbanceFactor * disturbance_[axis]);
    axis_observers_[axis].emplace(axis_prior);
  }
  flown_s_ = 0.0;
  seen_variance_ = square(params_.first_spread);
}

void ActuatorMonitor::on_attitude(double roll_rad, double pitch_rad, double yaw_rad) noexcept {
  if (!std::isfinite(roll_rad) || !std::isfinite(pitch_rad) || !std::isfinite(yaw_rad)) {
    ++refused_attitudes_;
    return;
  }
  angle_rad_ = {roll_rad, pitch_rad, yaw_rad};
  has_new_angle_ = true;
}

void ActuatorMonitor::on_climb(double climb_m_s) noexcept { climb_m_s_ = climb_m_s; }

void ActuatorMonitor::pause(NotJudged reason) noexcept {
  reason_ = reason;
  rotor_observer_.reset();
  axis_states_.fill({});
  gyro_.restart();
  accel_.restart();
  has_accel_up_ = false;
  const auto stop = [&](LossVerdict& verdict, LossPolicy& policy) {
    policy.pause(now_);
    const double baseline = verdict.baseline;
    verdict = {};
    verdict.baseline = baseline;
    verdict.reason = reason;
    verdict.onset = policy.onset();
  };
  for (std::size_t i = 0; i < kMaxRotors; ++i) stop(rotor_verdicts_[i], *rotor_policies_[i]);
  for (std::size_t i = 0; i < kAxes; ++i) stop(axis_verdicts_[i], *axis_policies_[i]);
}

void ActuatorMonitor::on_clock(TimePoint now) noexcept {
  // A newest sample of the future tells no more than silence does.
  const bool is_silent = has_time_ && (now - now_ > kSilent || now_ - now > kSilent);
  if (is_silent && reason_ != NotJudged::kNoInput) pause(NotJudged::kNoInput);
}

DetectorState ActuatorMonitor::state() const noexcept {
  if (!has_time_) return DetectorState::kInitialising;
  switch (reason_) {
    case NotJudged::kNoInput:
    case NotJudged::kInputTooSlow:
    case NotJudged::kNotFlying:
    case NotJudged::kFrozen:
      return DetectorState::kMuted;
    case NotJudged::kConverging:
      return DetectorState::kConverging;
    default:
      return DetectorState::kMonitoring;
  }
}

void ActuatorMonitor::learn_thrust_ratio(double dt_s) noexcept {
  double nominal_m_s2 = 0.0;
  for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i) {
    nominal_m_s2 += mixing_(kHeight, static_cast<int>(i)) * specific_thrust_m_s2_[i];
    if (rotor_policies_[i]->active() || rotor_policies_[i]->probability() > kSuspected) return;
  }
  if (nominal_m_s2 < 0.3 * kGravity_m_s2) return;
  const double time_s = reason_ == NotJudged::kConverging
                            ? std::clamp(flown_s_, kLeastLearning_s, kFirstLearning_s)
                            : kThrustLearning_s;
  thrust_ratio_ += dt_s / time_s * (accel_up_m_s2_ / nominal_m_s2 - thrust_ratio_);
  thrust_ratio_ = std::clamp(thrust_ratio_, kLeastThrustRatio, kMostThrustRatio);
}

NotJudged ActuatorMonitor::obstacle(Phase phase) const noexcept {
  if (thrust_.is_too_slow()) return NotJudged::kInputTooSlow;
  if (!thrust_.is_known()) return NotJudged::kNoInput;
  if (phase != Phase::kInFlight) return NotJudged::kNotFlying;
  const Duration repeats = std::max(gyro_.repeats_for(now_), accel_.repeats_for(now_));
  return repeats > kLongestRepeat ? NotJudged::kFrozen : NotJudged::kJudged;
}

void ActuatorMonitor::check_sensors(const MonitorSample& sample) noexcept {
  AxisVector most = AxisVector::Zero();
  for (std::size_t j = 0; j < params_.vehicle.rotor_count; ++j) {
    most += mixing_.col(static_cast<int>(j)).cwiseAbs() * thrust_.specific_thrust_m_s2(j);
  }
  // All rotors at once about any axis; about yaw, where drag does little, they do as much by spinning up.
  const double turn_rad_s = gyro_.since_taken_s(now_) * most.head<3>().maxCoeff();
  has_gyro_ = gyro_.judge(now_, sample.gyro_rad_s, {turn_rad_s, turn_rad_s, turn_rad_s}) ==
              SampleCheck::Verdict::kTaken;
  const double force_m_s2 = kForceReach * std::max(kGravity_m_s2, most(kHeight));
  const double since_s = accel_.since_taken_s(now_);
  has_accel_ = accel_.judge(now_, sample.accel_m_s2, {force_m_s2, force_m_s2, force_m_s2}) ==
               SampleCheck::Verdict::kTaken;
  if (!has_accel_) return;
  const double share = has_accel_up_ ? 1.0 - std::exp(-since_s / params_.accel_lowpass_s) : 1.0;
  accel_up_m_s2_ += share * (-sample.accel_m_s2[2] - accel_up_m_s2_);
  has_accel_up_ = true;
}

UpdateStatus ActuatorMonitor::on_imu(const MonitorSample& sample, Phase phase) noexcept {
  if (const UpdateStatus status = inertial_status(sample.accel_m_s2, sample.gyro_rad_s);
      status != UpdateStatus::kFused) {
    ++refused_;
    return status;
  }
  const StampGate::Stamp stamp = stamps_.judge(sample.time);
  if (stamp == StampGate::Stamp::kSame || stamp == StampGate::Stamp::kOlder) {
    ++refused_;
    return UpdateStatus::kTimeBackward;
  }
  const bool is_restart = stamp == StampGate::Stamp::kRestart;
  const double dt_s = has_time_ && !is_restart ? to_seconds(sample.time - now_) : 0.0;
  now_ = sample.time;
  has_time_ = true;
  if (is_restart && last_raised_ > now_) last_raised_.reset();
  if (is_restart) on_ground_since_.reset();
  if (is_restart || dt_s > kLongestStep_s) pause(NotJudged::kNoInput);
  const double step_s = std::min(dt_s, kLongestStep_s);
  thrust_.advance(now_, step_s);
  check_sensors(sample);
  watch_ground(phase);
  if (const NotJudged reason = obstacle(phase); reason != NotJudged::kJudged) {
    pause(reason);
    return UpdateStatus::kFused;
  }
  if (!rotor_observer_) {
    start_flight();
    reason_ = NotJudged::kConverging;
  }
  if (!estimate(sample.gyro_rad_s, step_s)) {
    ++refused_;
    pause(NotJudged::kNoInput);
    return UpdateStatus::kNotFinite;
  }
  learn_thrust_ratio(step_s);
  flown_s_ += step_s;
  reason_ = flown_s_ < to_seconds(params_.settle) ? NotJudged::kConverging : NotJudged::kJudged;
  judge_rotors();
  judge_axes();
  learn_spread(step_s);
  return UpdateStatus::kFused;
}

// Euler's equations with the rotors' angular momentum h about z: I·ω̇ = M − ω × (I·ω + h·e_z) − ḣ·e_z.
Eigen::Matrix<double, 3, 1> ActuatorMonitor::gyroscopic(
    const std::array<double, 3>& rate_rad_s) const noexcept {
  const auto& [p, q, r] = rate_rad_s;
  const auto& inertia = params_.vehicle.inertia_kg_m2;
  const double h = thrust_.angular_momentum_N_m_s();
  return {((inertia[1] - inertia[2]) * q * r - q * h) / inertia[0],
          ((inertia[2] - inertia[0]) * p * r + p * h) / inertia[1],
          ((inertia[0] - inertia[1]) * p * q - thrust_.spin_up_torque_N_m()) / inertia[2]};
}

bool ActuatorMonitor::estimate(const std::array<double, 3>& gyro_rad_s, double dt_s) noexcept {
  Body body{gyro_rad_s, accel_up_m_s2_, 1.0 - std::exp(-dt_s / params_.accel_lowpass_s), {}};
  const RotorObserver::StateVector& x = rotor_observer_->state();
  if (!has_gyro_) body.rate_rad_s = {x(0), x(1), x(2)};
  body.known_rad_s2 = gyroscopic(body.rate_rad_s);
  find_thrusts(body);
  find_missed(dt_s);
  if (estimate_rotors(body, dt_s) != UpdateStatus::kFused) return false;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    if (estimate_axis(axis, body, dt_s) != UpdateStatus::kFused) return false;
  }
  has_new_angle_ = false;
  climb_m_s_ = std::numeric_limits<double>::quiet_NaN();
  return true;
}

void ActuatorMonitor::find_missed(double dt_s) noexcept {  // (5)
  const RotorThrust::Missed missed = thrust_.take_missed();
  AxisVector impulse = AxisVector::Zero();
  for (std::size_t j = 0; j < params_.vehicle.rotor_count; ++j) {
    impulse += mixing_.col(static_cast<int>(j)) * missed.impulse_m_s[j];
  }
  missed_variance_ = impulse.cwiseAbs2();
  if (missed.period_s > 0.0) {
    const double period3_s3 = missed.period_s * missed.period_s * missed.period_s;
    const double share = missed.period_s / (missed.period_s + kDiffusionTime_s);
    input_diffusion_ += share * (4.0 * missed_variance_ / period3_s3 - input_diffusion_);
  }
  missed_variance_ += dt_s * thrust_.unknown_s2() * input_diffusion_;
}

// A rotor that moves along its axis meets less air or more: thrust · (1 − inflow · axial airspeed / tip speed).
void ActuatorMonitor::find_thrusts(const Body& body) noexcept {
  const auto& [p, q, r] = body.rate_rad_s;
  const double climb_m_s =
      axis_states_[kHeight].position_sigma < kClimbKnown_m_s
          ? axis_states_[kHeight].position * std::cos(angle_rad_[0]) * std::cos(angle_rad_[1])
          : 0.0;
  for (std::size_t j = 0; j < params_.vehicle.rotor_count; ++j) {
    const auto& hub = params_.vehicle.rotor[j].position_m;
    const auto& axis = params_.vehicle.rotor[j].thrust_axis;
    const double axial_m_s = axis[0] * (q * hub[2] - r * hub[1]) + axis[1] * (r * hub[0] - p * hub[2]) +
                             axis[2] * (p * hub[1] - q * hub[0] - climb_m_s);
    const double tip_m_s = params_.vehicle.propeller_radius_m * thrust_.speed_rad_s(j);
    const double lost = tip_m_s > 0.0 ? params_.vehicle.inflow_ratio * axial_m_s / tip_m_s : 0.0;
    specific_thrust_m_s2_[j] =
        thrust_.specific_thrust_m_s2(j) * (1.0 - std::clamp(lost, -kMostInflow, kMostInflow));
  }
}

UpdateStatus ActuatorMonitor::estimate_rotors(const Body& body, double dt_s) noexcept {  // (1)
  RotorObserver::Transition model;
  RotorObserver::Measurement measurement;
  const double keep = std::exp(-dt_s / params_.disturbance_time_s);
  const double drift = square(params_.drift_sigma_1_sqrt_s) * dt_s;
  for (std::size_t j = 0; j < params_.vehicle.rotor_count; ++j) {
    const auto column = static_cast<int>(j);
    model.u(column) = thrust_ratio_ * specific_thrust_m_s2_[j];
    model.b.block<3, 1>(0, column) = dt_s * mixing_.block<3, 1>(0, column);
    model.b(3, column) = body.lowpass_share * mixing_(kHeight, column);
    model.fault_noise_variance(column) = drift;
  }
  model.known.head<3>() = dt_s * body.known_rad_s2;
  model.a(3, 3) = 1.0 - body.lowpass_share;
  for (int axis = 0; axis < 4; ++axis) {
    const bool is_height = axis == kHeight;
    const double share = is_height ? body.lowpass_share : dt_s;
    const double disturbance = disturbance_[static_cast<std::size_t>(axis)];
    model.a(axis, 4 + axis) = share;
    model.a(4 + axis, 4 + axis) = keep;
    model.noise(4 + axis, 4 + axis) = square(disturbance) * (1.0 - keep * keep);
    model.noise(axis, axis) = square(kWhiteShare * disturbance * share) +
                              (is_height ? 0.0 : missed_variance_(axis)) + kLeast_variance;
    measurement.c(axis, axis) = 1.0;
    const double commanded = (mixing_.row(axis) * model.u).value();
    measurement.noise(axis, axis) = is_height ? accel_variance() : rate_variance(commanded);
    measurement.y(axis) = is_height ? body.accel_up_m_s2 : body.rate_rad_s[static_cast<std::size_t>(axis)];
  }
  return rotor_observer_->step(model, measurement, innovation_);
}

// The gyro sees a thrust by timing_sigma_s earlier or later than it is thought to act.
double ActuatorMonitor::rate_variance(double commanded_rad_s2) const noexcept {
  if (!has_gyro_) return kNotMeasured_variance;
  return square(params_.gyro_sigma_rad_s) + square(params_.timing_sigma_s * commanded_rad_s2);
}

double ActuatorMonitor::accel_variance() const noexcept {
  return has_accel_ ? square(params_.accel_sigma_m_s2) : kNotMeasured_variance;
}

ActuatorMonitor::AxisObserver::Transition ActuatorMonitor::axis_transition(std::size_t axis, const Body& body,
                                                                           double dt_s) const noexcept {
  AxisObserver::Transition model;
  const bool is_height = axis == kHeight;
  const auto row = static_cast<int>(axis);
  const double share = is_height ? body.lowpass_share : dt_s;
  const double disturbance = (is_height ? 1.0 : kAxisDisturbanceFactor) * disturbance_[axis];
  const double keep = std::exp(-dt_s / kAxisDisturbanceTime_s);
  const double roll_rad = angle_rad_[0];
  const double pitch_rad = std::clamp(angle_rad_[1], -kMostPitch_rad, kMostPitch_rad);
  const double q = body.rate_rad_s[1];
  const double r = body.rate_rad_s[2];
  const double yaw_rate = q * std::sin(roll_rad) + r * std::cos(roll_rad);
  // How the position moves besides by its own rate: the kinematics of the z-y-x Euler angles, and weight.
  const std::array<double, kAxes> known{yaw_rate * std::tan(pitch_rad),
                                        q * (std::cos(roll_rad) - 1.0) - r * std::sin(roll_rad),
                                        yaw_rate / std::cos(pitch_rad) - r, -kGravity_m_s2};
  model.a(0, 1) = is_height ? dt_s * std::cos(roll_rad) * std::cos(pitch_rad) : dt_s;
  model.a(1, 1) = is_height ? 1.0 - share : 1.0;
  model.a(1, 2) = share;
  model.a(2, 2) = keep;
  model.b(1, 0) = share;
  for (std::size_t j = 0; j < params_.vehicle.rotor_count; ++j) {
    model.u(0) += thrust_ratio_ * mixing_(row, static_cast<int>(j)) * specific_thrust_m_s2_[j];
  }
  model.known(0) = dt_s * known[axis];
  model.known(1) = is_height ? 0.0 : dt_s * body.known_rad_s2(row);
  model.noise(0, 0) =
      square(is_height ? kClimbNoise_m_s_sqrt_s : kAngleNoise_rad_sqrt_s) * dt_s + kLeast_variance;
  model.noise(1, 1) =
      square(kWhiteShare * disturbance * share) + (is_height ? 0.0 : missed_variance_(row)) + kLeast_variance;
  model.noise(2, 2) = square(disturbance) * (1.0 - keep * keep);
  model.fault_noise_variance(0) = square(params_.drift_sigma_1_sqrt_s) * dt_s;
  return model;
}

ActuatorMonitor::AxisObserver::Measurement ActuatorMonitor::axis_measurement(std::size_t axis,
                                                                             const Body& body,
                                                                             double input) const noexcept {
  AxisObserver::Measurement measurement;
  const bool is_height = axis == kHeight;
  const bool has_position = is_height ? std::isfinite(climb_m_s_) : has_new_angle_;
  const double sigma = is_height ? params_.climb_sigma_m_s : params_.angle_sigma_rad;
  const double expected = axis_observers_[axis]->state()(0);
  measurement.c(0, 0) = measurement.c(1, 1) = 1.0;
  measurement.noise(0, 0) = has_position ? square(sigma) : kNotMeasured_variance;
  measurement.y(0) = expected;
  if (has_position) {
    measurement.y(0) =
        is_height ? climb_m_s_ : expected + std::remainder(angle_rad_[axis] - expected, kTurn_rad);
  }
  measurement.noise(1, 1) = is_height ? accel_variance() : rate_variance(input);
  measurement.y(1) = is_height ? body.accel_up_m_s2 : body.rate_rad_s[axis];
  return measurement;
}

UpdateStatus ActuatorMonitor::estimate_axis(std::size_t axis, const Body& body,
                                            double dt_s) noexcept {  // (2)
  AxisObserver& observer = *axis_observers_[axis];
  const AxisObserver::Transition model = axis_transition(axis, body, dt_s);
  AxisObserver::Innovation innovation;
  const UpdateStatus status = observer.step(model, axis_measurement(axis, body, model.u(0)), innovation);
  const AxisObserver::StateMatrix covariance = observer.state_covariance();
  const AxisObserver::StateVector& x = observer.state();
  axis_states_[axis] = {.position = x(0),
                        .position_sigma = std::sqrt(covariance(0, 0)),
                        .rate = x(1),
                        .rate_sigma = std::sqrt(covariance(1, 1)),
                        .disturbance = x(2),
                        .commanded = model.u(0)};
  return status;
}

void ActuatorMonitor::learn_spread(double dt_s) noexcept {
  const std::size_t rotors = params_.vehicle.rotor_count;
  double mean_square = 0.0;
  for (std::size_t i = 0; i < rotors; ++i) {
    if (rotor_policies_[i]->active() || rotor_policies_[i]->probability() > kSuspected) return;
    mean_square += square(rotor_verdicts_[i].test_gamma) / static_cast<double>(rotors);
  }
  const double spread_time_s = mean_square > seen_variance_ ? kSpreadRise_s : kSpreadFall_s;
  seen_variance_ += dt_s / spread_time_s * (mean_square - seen_variance_);  // (4)
  const double time_s = std::clamp(flown_s_, kFirstLearning_s, kBaselineLearning_s);
  for (std::size_t i = 0; i < rotors; ++i) {
    double& baseline = rotor_verdicts_[i].baseline;
    baseline += dt_s / time_s * (rotor_observer_->fault()(static_cast<int>(i)) - baseline);
    baseline = std::clamp(baseline, -params_.most_baseline, params_.most_baseline);
  }
}

// Columns of rotors that the vehicle does not have are zero and independent of the rest.
bool ActuatorMonitor::explain_rotors() noexcept {  // (3)
  RotorObserver::FaultMatrix p = rotor_observer_->fault_covariance();
  RotorObserver::InputVector loss = rotor_observer_->fault();
  for (std::size_t j = 0; j < params_.vehicle.rotor_count; ++j) {
    const auto at = static_cast<int>(j);
    p(at, at) += square(rotor_policies_[j]->active() ? 1.0 : params_.healthy_spread);
    loss(at) -= rotor_verdicts_[j].baseline;
  }
  RotorObserver::FaultMatrix l;
  if (!factor_cholesky(p, l)) return false;
  RotorObserver::FaultMatrix y;
  invert_from_factor(l, y);
  const RotorObserver::InputVector score = y * loss;
  for (std::size_t j = 0; j < params_.vehicle.rotor_count; ++j) {
    const auto at = static_cast<int>(j);
    LossVerdict& verdict = rotor_verdicts_[j];
    const bool active = rotor_policies_[j]->active();
    verdict.gamma = rotor_observer_->fault()(at);
    verdict.sigma = std::sqrt(rotor_observer_->fault_covariance()(at, at));
    verdict.test_gamma = active ? loss(at) : score(at) / y(at, at);
    verdict.test_sigma =
        active ? std::hypot(verdict.sigma, params_.healthy_spread)
               : std::max(1.0 / std::sqrt(y(at, at)), kSpreadFactor * std::sqrt(seen_variance_));
    // Only a loss counts: a rotor that gives more than it should explains nothing.
    explained_[j] = score(at) > 0.0 && !active ? square(score(at)) / (2.0 * y(at, at)) : 0.0;
  }
  return true;
}

void ActuatorMonitor::judge_rotors() noexcept {
  if (!explain_rotors()) {
    ++refused_;
    return;
  }
  for (std::size_t rotor = 0; rotor < params_.vehicle.rotor_count; ++rotor) judge_rotor(rotor);
}

void ActuatorMonitor::judge_rotor(std::size_t rotor) noexcept {
  LossVerdict& verdict = rotor_verdicts_[rotor];
  LossPolicy& policy = *rotor_policies_[rotor];
  if (!policy.active()) compare(rotor);
  verdict.reason = NotJudged::kJudged;
  if (reason_ == NotJudged::kConverging) {
    verdict.reason = NotJudged::kConverging;
  } else if (!is_loss(verdict.test_gamma)) {
    verdict.reason = NotJudged::kImplausible;
  } else if (!policy.active() && !(verdict.test_sigma <= params_.rotor_judged_sigma)) {
    verdict.reason = NotJudged::kNotObservable;
  }
  verdict.gamma = std::clamp(verdict.gamma, kLeastLoss, kMostLoss);
  verdict.test_gamma = std::clamp(verdict.test_gamma, kLeastLoss, kMostLoss);
  // A second failure must be beyond doubt: the first one's effects are not all in the model.
  const bool may_raise = verdict.reason == NotJudged::kJudged && verdict.lead >= 0.0 && !is_consequence() &&
                         (verdict.is_isolated || !any_rotor_failed());
  verdict.transition = policy.step(verdict.test_gamma, verdict.test_sigma, may_raise, now_);
  verdict.probability = policy.probability();
  verdict.onset = policy.onset();
  if (verdict.transition == FaultLifeCycle::Transition::kRaise) last_raised_ = now_;
}

bool ActuatorMonitor::is_consequence() const noexcept {
  return last_raised_ && now_ - *last_raised_ < kConsequence;
}

// Which rotors explain nearly as much as this one.
void ActuatorMonitor::compare(std::size_t rotor) noexcept {
  LossVerdict& verdict = rotor_verdicts_[rotor];
  double next = 0.0;
  verdict.candidates = 1U << rotor;
  for (std::size_t k = 0; k < params_.vehicle.rotor_count; ++k) {
    if (k == rotor) continue;
    next = std::max(next, explained_[k]);
    if (explained_[k] > explained_[rotor] - params_.isolation_log_likelihood) verdict.candidates |= 1U << k;
  }
  verdict.lead = explained_[rotor] - next;
  verdict.is_isolated = verdict.lead >= params_.isolation_log_likelihood;
}

bool ActuatorMonitor::any_rotor_failed() const noexcept {
  return std::any_of(rotor_policies_.begin(), rotor_policies_.end(),
                     [](const auto& policy) { return policy->active(); });
}

void ActuatorMonitor::judge_axes() noexcept {
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    LossVerdict& verdict = axis_verdicts_[axis];
    verdict.gamma = verdict.test_gamma = axis_observers_[axis]->fault()(0);
    verdict.sigma = verdict.test_sigma = std::sqrt(axis_observers_[axis]->fault_covariance()(0, 0));
    const bool is_seen = verdict.sigma <= params_.axis_judged_sigma;
    verdict.reason = reason_ == NotJudged::kConverging ? NotJudged::kConverging
                     : !thrust_.is_prompt()            ? NotJudged::kInputTooSlow
                     : !is_seen                        ? NotJudged::kNotExcited
                     : is_loss(verdict.gamma)          ? NotJudged::kJudged
                                                       : NotJudged::kImplausible;
    verdict.gamma = verdict.test_gamma = std::clamp(verdict.gamma, kLeastLoss, kMostLoss);
    // A rotor that has failed takes its part of every axis with it.
    const bool may_raise = verdict.reason == NotJudged::kJudged && !is_consequence() && !any_rotor_failed();
    verdict.transition = axis_policies_[axis]->step(verdict.test_gamma, verdict.test_sigma, may_raise, now_);
    verdict.probability = axis_policies_[axis]->probability();
    verdict.onset = axis_policies_[axis]->onset();
  }
}

}  // namespace airworthy::actuator
