#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "sim/sensors/esc_telemetry_model.h"
#include "sim/sensors/imu_model.h"

namespace airworthy::sim {
namespace {

constexpr double kStep_s = 1.0 / Realism::kPhysicsRate_Hz;

/// A perfect sensor.
Realism::Imu perfect_imu() {
  Realism::Imu imu{};
  imu.rate_Hz = 500.0;
  imu.filter_cutoff_Hz = 200.0;
  imu.accel_range_m_s2 = 160.0;
  imu.gyro_range_rad_s = 35.0;
  return imu;
}

/// The sample after `duration_s` of what `truth` gives.
template <class Truth>
ImuSample run(ImuModel& imu, double duration_s, Truth&& truth, const ImuFault& fault = {}) {
  ImuSample sample;
  const int steps = static_cast<int>(std::lround(duration_s / kStep_s));
  const int per_sample = static_cast<int>(std::lround(imu.period_s() / kStep_s));
  for (int i = 1; i <= steps; ++i) {
    const auto [state, accelerations] = truth(i * kStep_s);
    imu.step(state, accelerations, 1.0);
    if (i % per_sample == 0) sample = imu.sample(i * kStep_s, fault);
  }
  return sample;
}

auto at_rest(double) {
  Accelerations accelerations;
  accelerations.specific_force_B_m_s2 = {0.0, 0.0, -kGravity_m_s2};
  return std::pair{State{}, accelerations};
}

TEST(ImuModel, ReadsSpecificForceAndRates) {
  ImuModel imu{perfect_imu(), Eigen::Vector3d::Zero(), kStep_s, 1};
  const ImuSample sample = run(imu, 0.5, at_rest);
  EXPECT_NEAR(sample.accel_m_s2.z(), -kGravity_m_s2, 1e-9);
  EXPECT_NEAR(sample.gyro_rad_s.norm(), 0.0, 1e-12);
  EXPECT_EQ(sample.averaging_window_s, 0.0);
}

TEST(ImuModel, FeelsRotationThroughItsLeverArm) {
  ImuModel imu{perfect_imu(), {0.1, 0.0, 0.0}, kStep_s, 1};
  const ImuSample sample = run(imu, 0.5, [](double) {
    State state;
    state.rates_B_rad_s = {0.0, 0.0, 5.0};
    Accelerations accelerations;
    accelerations.angular_B_rad_s2 = {0.0, 0.0, 20.0};
    return std::pair{state, accelerations};
  });
  EXPECT_NEAR(sample.accel_m_s2.x(), -5.0 * 5.0 * 0.1, 1e-9);  // centripetal
  EXPECT_NEAR(sample.accel_m_s2.y(), 20.0 * 0.1, 1e-9);        // tangential
  EXPECT_NEAR(sample.gyro_rad_s.z(), 5.0, 1e-9);
}

double amplitude_at(double frequency_Hz, double averaging_s) {
  Realism::Imu realism = perfect_imu();
  realism.averaging_window_s = averaging_s;
  if (averaging_s > 0.0) realism.rate_Hz = 1.0 / averaging_s;
  ImuModel imu{realism, Eigen::Vector3d::Zero(), kStep_s, 1};
  double squares = 0.0;
  int samples = 0;
  const int per_sample = static_cast<int>(std::lround(imu.period_s() / kStep_s));
  for (int i = 1; i <= 40'000; ++i) {
    Accelerations accelerations;
    accelerations.specific_force_B_m_s2.x() = std::sin(2.0 * std::numbers::pi * frequency_Hz * i * kStep_s);
    imu.step(State{}, accelerations, 1.0);
    if (i % per_sample != 0) continue;
    const double x = imu.sample(i * kStep_s, {}).accel_m_s2.x();
    if (i > 4000) {
      squares += x * x;
      ++samples;
    }
  }
  return std::sqrt(2.0 * squares / samples);
}

TEST(ImuModel, FiltersLikeASecondOrderButterworth) {
  EXPECT_NEAR(amplitude_at(20.3, 0.0), 1.0, 0.01);
  EXPECT_NEAR(amplitude_at(200.7, 0.0), std::numbers::sqrt2 / 2.0, 0.01);  // the cut-off
  EXPECT_LT(amplitude_at(803.0, 0.0), 0.08);                               // 12 dB per octave
}

TEST(ImuModel, AveragingAttenuatesLikeItsWindow) {
  // sin(πfT)/(πfT) of a 5 ms average, times the filter.
  const double x = std::numbers::pi * 80.3 * 0.005;
  EXPECT_NEAR(amplitude_at(80.3, 0.005) / amplitude_at(80.3, 0.0), std::sin(x) / x, 0.01);
}

TEST(ImuModel, NoiseHasItsDensity) {
  Realism::Imu realism = perfect_imu();
  realism.rate_Hz = 4000.0;
  realism.filter_cutoff_Hz = 1000.0;
  realism.gyro_noise_rad_s_per_sqrt_Hz = 0.01;
  realism.accel_vibration_m_s2_per_sqrt_Hz = 0.02;
  ImuModel imu{realism, Eigen::Vector3d::Zero(), kStep_s, 3};
  double gyro = 0.0;
  double accel = 0.0;
  constexpr int kCount = 200'000;
  for (int i = 0; i < kCount; ++i) {
    imu.step(State{}, Accelerations{}, 0.5);  // half the thrust of hover: half the vibration
    const ImuSample sample = imu.sample(i * kStep_s, {});
    gyro += sample.gyro_rad_s.x() * sample.gyro_rad_s.x();
    accel += sample.accel_m_s2.y() * sample.accel_m_s2.y();
  }
  // Butterworth of second order at a quarter of the rate, bilinear: noise bandwidth 0.25·rate, exactly tan-warped.
  const double bandwidth_Hz = accel / kCount / (0.01 * 0.01);
  EXPECT_NEAR(gyro / kCount / (0.01 * 0.01) / bandwidth_Hz, 1.0, 0.02);
  EXPECT_NEAR(bandwidth_Hz, 1000.0 * std::numbers::pi / (2.0 * std::numbers::sqrt2), 120.0);
}

TEST(ImuModel, QuantisesAndSaturates) {
  Realism::Imu realism = perfect_imu();
  realism.accel_resolution_m_s2 = 0.5;
  realism.accel_range_m_s2 = 9.0;
  ImuModel imu{realism, Eigen::Vector3d::Zero(), kStep_s, 1};
  EXPECT_EQ(run(imu, 0.5, at_rest).accel_m_s2.z(), -9.0);
  const ImuSample sample = run(imu, 0.5, [](double) {
    Accelerations accelerations;
    accelerations.specific_force_B_m_s2 = {1.1, 1.4, 0.2};
    return std::pair{State{}, accelerations};
  });
  EXPECT_EQ(sample.accel_m_s2, Eigen::Vector3d(1.0, 1.5, 0.0));
}

TEST(ImuModel, FaultsShiftAndFreeze) {
  ImuModel imu{perfect_imu(), Eigen::Vector3d::Zero(), kStep_s, 1};
  ImuFault offset;
  offset.gyro_offset_rad_s.y() = 0.3;
  offset.accel_offset_m_s2.x() = -2.0;
  const ImuSample shifted = run(imu, 0.2, at_rest, offset);
  EXPECT_NEAR(shifted.gyro_rad_s.y(), 0.3, 1e-12);
  EXPECT_NEAR(shifted.accel_m_s2.x(), -2.0, 1e-12);
  ImuFault frozen;
  frozen.accel_is_frozen = true;
  const ImuSample still = run(
      imu, 0.2,
      [](double) {
        return std::pair{State{}, Accelerations{}};
      },
      frozen);
  EXPECT_EQ(still.accel_m_s2, shifted.accel_m_s2);
  EXPECT_NEAR(still.gyro_rad_s.y(), 0.0, 1e-12);
}

constexpr std::array<double, kMaxRotors> kSpeeds_rad_s{500.0, 600.0, 0.0, 700.0};

TEST(EscTelemetryModel, DelaysAndNeverOvertakes) {
  Realism::Esc realism{};
  realism.rate_Hz = 100.0;
  realism.latency_s = 0.02;
  realism.jitter_s = 0.03;
  EscTelemetryModel esc{realism, 4, 5};
  double last_s = 0.0;
  int arrived = 0;
  for (int i = 0; i < 5000; ++i) {
    const double now_s = i * 0.002;
    if (i % 5 == 0) esc.measure(now_s, 16.0, kSpeeds_rad_s, {});
    while (const auto sample = esc.arrived(now_s)) {
      EXPECT_LE(sample->time_s, now_s);
      EXPECT_GE(sample->time_s, last_s);
      EXPECT_GE(sample->time_s, arrived * 0.01 + 0.02 - 1e-12);
      last_s = sample->time_s;
      ++arrived;
      EXPECT_NEAR(sample->speed_rpm[0], 500.0 * 30.0 / std::numbers::pi, 1e-9);
    }
  }
  EXPECT_NEAR(arrived, 995, 5);
}

TEST(EscTelemetryModel, LosesQuantisesAndIsNoisy) {
  Realism::Esc realism{};
  realism.rate_Hz = 100.0;
  realism.dropout_ratio = 0.1;
  realism.noise_ratio = 0.01;
  realism.resolution_rpm = 20.0;
  EscTelemetryModel esc{realism, 4, 5};
  int lost = 0;
  double squares = 0.0;
  constexpr int kCount = 20'000;
  for (int i = 0; i < kCount; ++i) {
    esc.measure(i * 0.01, 16.0, kSpeeds_rad_s, {});
    const auto sample = esc.arrived(i * 0.01 + 1e-6);
    ASSERT_TRUE(sample.has_value());
    const double speed_rpm = sample->speed_rpm[1];
    if (std::isnan(speed_rpm)) {
      ++lost;
      continue;
    }
    EXPECT_NEAR(std::remainder(speed_rpm, 20.0), 0.0, 1e-9);
    const double error = speed_rpm / (600.0 * 30.0 / std::numbers::pi) - 1.0;
    squares += error * error;
  }
  EXPECT_NEAR(lost, 0.1 * kCount, 150);
  EXPECT_NEAR(std::sqrt(squares / (kCount - lost)), 0.01, 0.0005);
}

TEST(EscTelemetryModel, FaultsOfOneEscLeaveTheOthersAlone) {
  Realism::Esc realism{};
  realism.rate_Hz = 100.0;
  realism.noise_ratio = 0.01;
  EscTelemetryModel healthy{realism, 4, 5};
  EscTelemetryModel faulty{realism, 4, 5};
  std::array<EscFault, kMaxRotors> faults{};
  faults[0].speed_factor = 7.0;
  faults[0].temperature_offset_K = 273.15;
  faults[1].is_frozen = true;
  faults[2].is_silent = true;
  faulty.measure(0.0, 16.0, kSpeeds_rad_s, {});
  healthy.measure(0.0, 16.0, kSpeeds_rad_s, {});
  const auto before = faulty.arrived(0.0);
  static_cast<void>(healthy.arrived(0.0));
  for (int i = 1; i < 50; ++i) {
    healthy.measure(i * 0.01, 16.0, kSpeeds_rad_s, {});
    faulty.measure(i * 0.01, 16.0, kSpeeds_rad_s, faults);
    const auto good = healthy.arrived(i * 0.01);
    const auto bad = faulty.arrived(i * 0.01);
    ASSERT_TRUE(good && bad);
    EXPECT_NEAR(bad->speed_rpm[0], 7.0 * good->speed_rpm[0], 1e-6);
    EXPECT_NEAR(bad->temperature_degC[0], good->temperature_degC[0] + 273.15, 1e-9);
    EXPECT_EQ(bad->speed_rpm[1], before->speed_rpm[1]);
    EXPECT_TRUE(std::isnan(bad->speed_rpm[2]));
    EXPECT_EQ(bad->speed_rpm[3], good->speed_rpm[3]);
  }
}

}  // namespace
}  // namespace airworthy::sim
