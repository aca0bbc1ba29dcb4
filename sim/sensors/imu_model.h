#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sim/config/realism.h"
#include "sim/dynamics/multirotor_dynamics.h"
#include "sim/random.h"

namespace airworthy::sim {

struct ImuSample {
  double time_s = 0.0;                                   ///< of the measurement; the end of the average
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero();  ///< specific force, body frame
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();
  double averaging_window_s = 0.0;
};

/// What a fault does to the inertial unit.
struct ImuFault {
  Eigen::Vector3d accel_offset_m_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_offset_rad_s = Eigen::Vector3d::Zero();
  bool accel_is_frozen = false;
  bool gyro_is_frozen = false;
};

/// Accelerometer and gyroscope as an autopilot passes them on: lever arm, noise, anti-alias filter (Butterworth,
/// second order) at the physics rate; then bias, drift, range, resolution, and an average if asked for.
///   Specific force at the sensor   f + Ω̇×r + Ω×(Ω×r)                                             (1)
/// Broadband vibration is white noise whose density grows with the thrust.
class ImuModel {
 public:
  ImuModel(const Realism::Imu& realism, const Eigen::Vector3d& position_B_m, double physics_step_s,
           std::uint64_t seed);

  /// One physics step; `thrust_ratio` is the thrust over that of hover.
  void step(const State& state, const Accelerations& accelerations, double thrust_ratio);
  /// The sample due now, of the averaging window that ends here.
  [[nodiscard]] ImuSample sample(double time_s, const ImuFault& fault);
  /// What the autopilot's own rate loop reads at this moment.
  [[nodiscard]] Eigen::Vector3d gyro_rad_s(const ImuFault& fault) const;
  [[nodiscard]] double period_s() const { return 1.0 / realism_.rate_Hz; }

 private:
  // Direct form 2 transposed, three axes at once.
  struct Filter {
    double b0, b1, b2, a1, a2;
    Eigen::Vector3d s1 = Eigen::Vector3d::Zero();
    Eigen::Vector3d s2 = Eigen::Vector3d::Zero();
    Eigen::Vector3d step(const Eigen::Vector3d& x);
  };
  static Filter butterworth(double cutoff_Hz, double rate_Hz);

  Realism::Imu realism_;
  Eigen::Vector3d position_B_m_;
  double physics_rate_Hz_;
  Random noise_;
  Eigen::Vector3d accel_bias_;
  Eigen::Vector3d gyro_bias_;
  std::vector<GaussMarkov> accel_drift_;
  std::vector<GaussMarkov> gyro_drift_;
  Filter accel_filter_;
  Filter gyro_filter_;
  // Sums since the last sample, for the average; the newest value otherwise.
  Eigen::Vector3d accel_sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_now_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_now_ = Eigen::Vector3d::Zero();
  int summed_ = 0;
  ImuSample last_;
};

}  // namespace airworthy::sim
