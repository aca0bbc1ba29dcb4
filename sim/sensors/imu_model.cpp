#include "sim/sensors/imu_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace airworthy::sim {
namespace {

constexpr double kDriftTime_s = 100.0;

double quantised(double value, double resolution, double range) {
  value = std::clamp(value, -range, range);
  return resolution > 0.0 ? resolution * std::round(value / resolution) : value;
}

}  // namespace

ImuModel::Filter ImuModel::butterworth(double cutoff_Hz, double rate_Hz) {
  const double k = std::tan(std::numbers::pi * cutoff_Hz / rate_Hz);  // bilinear transform, prewarped
  const double norm = 1.0 / (1.0 + std::numbers::sqrt2 * k + k * k);
  Filter filter{};
  filter.b0 = k * k * norm;
  filter.b1 = 2.0 * filter.b0;
  filter.b2 = filter.b0;
  filter.a1 = 2.0 * (k * k - 1.0) * norm;
  filter.a2 = (1.0 - std::numbers::sqrt2 * k + k * k) * norm;
  filter.s1.setZero();
  filter.s2.setZero();
  return filter;
}

Eigen::Vector3d ImuModel::Filter::step(const Eigen::Vector3d& x) {
  Eigen::Vector3d y = b0 * x + s1;
  s1 = b1 * x - a1 * y + s2;
  s2 = b2 * x - a2 * y;
  return y;
}

ImuModel::ImuModel(const Realism::Imu& realism, const Eigen::Vector3d& position_B_m, double physics_step_s,
                   std::uint64_t seed)
    : realism_{realism},
      position_B_m_{position_B_m},
      physics_rate_Hz_{1.0 / physics_step_s},
      noise_{seed, "imu noise"},
      accel_filter_{butterworth(realism.filter_cutoff_Hz, physics_rate_Hz_)},
      gyro_filter_{butterworth(realism.filter_cutoff_Hz, physics_rate_Hz_)} {
  Random bias{seed, "imu bias"};
  accel_bias_ = realism.accel_bias_m_s2 * bias.normal3();
  gyro_bias_ = realism.gyro_bias_rad_s * bias.normal3();
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    accel_drift_.emplace_back(realism.accel_drift_m_s2, kDriftTime_s, Random{seed, "accel drift", axis});
    gyro_drift_.emplace_back(realism.gyro_drift_rad_s, kDriftTime_s, Random{seed, "gyro drift", axis});
  }
}

void ImuModel::step(const State& state, const Accelerations& accelerations, double thrust_ratio) {
  const Eigen::Vector3d& rates = state.rates_B_rad_s;
  const Eigen::Vector3d specific_force = accelerations.specific_force_B_m_s2 +
                                         accelerations.angular_B_rad_s2.cross(position_B_m_) +
                                         rates.cross(rates.cross(position_B_m_));  // (1)
  const auto sigma = [&](double sensor, double vibration) {
    // One-sided density N of white noise at rate f has variance N²·f/2.
    return std::hypot(sensor, vibration * thrust_ratio) * std::sqrt(0.5 * physics_rate_Hz_);
  };
  const double accel_sigma =
      sigma(realism_.accel_noise_m_s2_per_sqrt_Hz, realism_.accel_vibration_m_s2_per_sqrt_Hz);
  const double gyro_sigma =
      sigma(realism_.gyro_noise_rad_s_per_sqrt_Hz, realism_.gyro_vibration_rad_s_per_sqrt_Hz);
  accel_now_ = accel_filter_.step(specific_force + accel_sigma * noise_.normal3());
  gyro_now_ = gyro_filter_.step(rates + gyro_sigma * noise_.normal3());
  accel_sum_ += accel_now_;
  gyro_sum_ += gyro_now_;
  ++summed_;
}

Eigen::Vector3d ImuModel::gyro_rad_s(const ImuFault& fault) const {
  if (fault.gyro_is_frozen) return last_.gyro_rad_s;
  return gyro_now_ + gyro_bias_ + fault.gyro_offset_rad_s;
}

ImuSample ImuModel::sample(double time_s, const ImuFault& fault) {
  ImuSample result;
  result.time_s = time_s + realism_.latency_s;
  result.averaging_window_s = realism_.averaging_window_s;
  const bool averages = realism_.averaging_window_s > 0.0 && summed_ > 0;
  Eigen::Vector3d accel = averages ? Eigen::Vector3d{accel_sum_ / summed_} : accel_now_;
  Eigen::Vector3d gyro = averages ? Eigen::Vector3d{gyro_sum_ / summed_} : gyro_now_;
  accel_sum_.setZero();
  gyro_sum_.setZero();
  summed_ = 0;
  accel += accel_bias_ + fault.accel_offset_m_s2;
  gyro += gyro_bias_ + fault.gyro_offset_rad_s;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    accel[axis] = quantised(accel[axis] + accel_drift_[i].step(period_s()), realism_.accel_resolution_m_s2,
                            realism_.accel_range_m_s2);
    gyro[axis] = quantised(gyro[axis] + gyro_drift_[i].step(period_s()), realism_.gyro_resolution_rad_s,
                           realism_.gyro_range_rad_s);
  }
  result.accel_m_s2 = fault.accel_is_frozen ? last_.accel_m_s2 : accel;
  result.gyro_rad_s = fault.gyro_is_frozen ? last_.gyro_rad_s : gyro;
  last_ = result;
  return result;
}

}  // namespace airworthy::sim
