#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>

#include "core/estimators/unbalance/signal_power_ekf.h"
#include "tests/support/allocation_guard.h"
#include "tests/support/unbalance_flight.h"

// What SignalPowerEkf must do with any bank.
namespace airworthy::test {

inline SignalPowerParams params_of(const PaperVehicle& vehicle) {
  SignalPowerParams params;
  params.mass_kg = vehicle.mass_kg;
  params.propeller_radius_m = vehicle.radius_m;
  params.initial_tip_mass_mg = vehicle.initial_tip_mass_mg;
  return params;
}

/// All rotors good but for the second.
template <std::size_t N>
std::array<double, N> one_damaged(double damage_mg, double good_mg) {
  std::array<double, N> tip_mass_mg{};
  tip_mass_mg.fill(good_mg);
  tip_mass_mg[1] = damage_mg;
  return tip_mass_mg;
}

template <class Ekf, std::size_t N>
typename Ekf::Sample sample_of(const ModelFlight<N>& flight) {
  using Scalar = typename Ekf::Rotors::value_type;
  typename Ekf::Sample sample;
  sample.time = from_us(std::llround(flight.time_s * 1e6));
  sample.ax_m_s2 = static_cast<Scalar>(flight.ax_m_s2);
  sample.ay_m_s2 = static_cast<Scalar>(flight.ay_m_s2);
  for (std::size_t i = 0; i < N; ++i) sample.speed_rad_s[i] = static_cast<Scalar>(flight.speed_rad_s[i]);
  return sample;
}

/// Flies on for so long, each sample as `change` makes it, and returns the mean NIS of the second half.
template <class Ekf, std::size_t N, class Change>
double fly(Ekf& ekf, ModelFlight<N>& flight, double duration_s, const Change& change) {
  double sum = 0.0;
  int count = 0;
  typename Ekf::Innovation innovation;
  const double begun_s = flight.time_s;
  while (flight.time_s < begun_s + duration_s) {
    flight.step();
    auto sample = sample_of<Ekf>(flight);
    change(sample);
    if (ekf.update(sample, innovation) != UpdateStatus::kFused) continue;
    if (flight.time_s < begun_s + 0.5 * duration_s) continue;
    sum += static_cast<double>(innovation.nis);
    ++count;
  }
  return sum / count;
}

template <class Ekf, std::size_t N>
double fly(Ekf& ekf, ModelFlight<N>& flight, double duration_s) {
  return fly(ekf, flight, duration_s, [](const auto&) {});
}

/// Flies `renumbered` beside `ekf`: rotor i of the one is rotor order[i] of the other.
template <class Ekf, std::size_t N>
void fly_renumbered(Ekf& ekf, Ekf& renumbered, ModelFlight<N>& flight, double duration_s,
                    const std::array<std::size_t, N>& order) {
  typename Ekf::Innovation innovation;
  const double until_s = flight.time_s + duration_s;
  while (flight.time_s < until_s) {
    flight.step();
    const auto sample = sample_of<Ekf>(flight);
    auto other = sample;
    for (std::size_t i = 0; i < N; ++i) other.speed_rad_s[i] = sample.speed_rad_s[order[i]];
    ASSERT_EQ(ekf.update(sample, innovation), renumbered.update(other, innovation));
  }
}

/// Feeds it whatever comes, however wrong.
template <class Ekf>
void feed_anything(Ekf& ekf, int samples) {
  std::mt19937_64 random{81};
  std::uniform_real_distribution<float> exponent{-6.0F, 4.0F};
  std::normal_distribution<float> normal;
  typename Ekf::Sample sample;
  typename Ekf::Innovation innovation;
  for (int k = 0; k < samples; ++k) {
    sample.time += from_seconds(k % 1000 == 0 ? 0.09 : 0.002);
    sample.ax_m_s2 = normal(random) * std::pow(10.0F, exponent(random));
    sample.ay_m_s2 = normal(random);
    for (float& speed : sample.speed_rad_s) speed = std::pow(10.0F, exponent(random));
    static_cast<void>(ekf.update(sample, innovation));
  }
}

template <class Ekf>
void expect_no_heap(const SignalPowerParams& params) {
  Ekf ekf{params};
  typename Ekf::Sample sample;
  typename Ekf::Innovation innovation;
  sample.speed_rad_s.fill(450.0F);
  const AllocationGuard guard;
  float information = 0.0F;
  float power = 0.0F;
  for (int k = 0; k < 1000; ++k) {
    sample.time = from_us(std::int64_t{2000} * k);
    sample.ax_m_s2 = static_cast<float>(k % 7);
    static_cast<void>(ekf.update(sample, innovation));
    const auto told = ekf.isolation();
    information += told.information[0];
    power += told.power[0];
  }
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_TRUE(std::isfinite(information));
  EXPECT_TRUE(std::isfinite(power));
}

template <class Ekf>
void expect_unchanged(const Ekf& ekf, const Ekf& before) {
  EXPECT_EQ(ekf.state(), before.state());
  EXPECT_EQ(ekf.covariance(), before.covariance());
  EXPECT_EQ(ekf.information(), before.information());
  EXPECT_EQ(ekf.fused(), before.fused());
}

/// In a flight that has fused: what is no number leaves no trace.
template <class Ekf, std::size_t N>
void expect_refuses_what_is_no_number(Ekf& ekf, ModelFlight<N>& flight) {
  Ekf clean = ekf;
  const Ekf before = ekf;
  flight.step();
  const auto good = sample_of<Ekf>(flight);
  typename Ekf::Innovation innovation;
  std::int64_t refused = 0;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    for (int field = 0; field < 5; ++field) {
      auto sample = good;
      if (field == 0) sample.ax_m_s2 = bad;
      if (field == 1) sample.ay_m_s2 = bad;
      if (field == 2) sample.speed_rad_s[0] = bad;
      if (field == 3) sample.speed_rad_s[2] = bad;
      if (field == 4) sample.speed_rad_s[3] = bad;
      EXPECT_EQ(ekf.update(sample, innovation), UpdateStatus::kNotFinite);
      expect_unchanged(ekf, before);
      EXPECT_EQ(ekf.refused(), ++refused);
    }
  }
  // Neither have they left a trace in the high-pass or the time.
  EXPECT_EQ(ekf.update(good, innovation), UpdateStatus::kFused);
  EXPECT_EQ(clean.update(good, innovation), UpdateStatus::kFused);
  expect_unchanged(ekf, clean);
}

}  // namespace airworthy::test
