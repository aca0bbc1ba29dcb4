// The three reference runs of the multi-stage joint fault observer, our table beside the source's.
//   x = [angle; rate] on each of four channels, A = [1 Ts; 0 1], B = [0; Ts/I], C = [1 0], Ts = 0.01 s, I = 0.1 kg·m²,
//   Q = 0.001·1, R = 0.01.
// Not stated there and chosen here: u = 10 N·m constant, q = 1e-4 per sample, P₀ = 0.01 for the states and 1 for γ.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>

#include "core/estimators/actuator/multi_stage_observer.h"

namespace airworthy {
namespace {

constexpr int kChannels = 4;
constexpr int kSamples = 500;
constexpr int kRuns = 20;
constexpr double kPeriod_s = 0.01;
constexpr double kInertia_kg_m2 = 0.1;
constexpr double kTorque_N_m = 10.0;
constexpr double kSettled = 0.02;  // |γ̂ − γ|
constexpr double kClaimedFaultRmse = 0.01;
constexpr double kClaimedStateRmse = 0.0015;

using Observer = MultiStageObserver<double, 2 * kChannels, kChannels, kChannels>;
using Fault = std::array<double, kChannels>;

/// How the stated Q and R are read: what the plant and the sensor really do, and what the observer believes.
struct Reading {
  const char* name;
  double plant_variance;
  double sensor_variance;
  double believed_sensor_variance;
};
constexpr double kQ = 1e-3;
constexpr Reading kLetter{"w ~ Q, v ~ R", kQ, 1e-2, 1e-2};
constexpr Reading kDeviation{"w ~ Q, R a standard deviation", kQ, 1e-4, 1e-4};
constexpr Reading kQuietPlant{"w = 0, R a standard deviation", 0.0, 1e-4, 1e-4};
constexpr Reading kNoiseless{"w = 0, v = 0, observer tuned to Q, R", 0.0, 0.0, 1e-2};

struct Outcome {
  int settled = 0;  ///< samples from the onset until every channel stays within kSettled; worst of the runs
  double fault_rmse = 0;   ///< of the last 200 samples
  double angle_rmse = 0;   ///< rad, the same
  double angle_sigma = 0;  ///< what the filter says no estimator can be better than, under its model
};

Observer::Transition transition() {
  Observer::Transition model;
  for (int c = 0; c < kChannels; ++c) {
    model.a(2 * c, 2 * c + 1) = kPeriod_s;
    model.b(2 * c + 1, c) = kPeriod_s / kInertia_kg_m2;
    model.u(c) = kTorque_N_m;
    model.fault_noise_variance(c) = 1e-4;
  }
  model.noise = kQ * Observer::StateMatrix::Identity();
  return model;
}

Outcome run(const Reading& reading, const Fault& fault, int onset) {
  Outcome outcome;
  const Observer::Transition model = transition();
  int counted = 0;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    std::mt19937 random{seed};
    std::normal_distribution<double> normal;
    Observer::Prior prior;
    prior.state_covariance *= 0.01;
    Observer observer{prior};
    Observer::Measurement measurement;
    measurement.noise *= reading.believed_sensor_variance;
    Observer::StateVector x = Observer::StateVector::Zero();
    for (int k = 0; k < kSamples; ++k) {
      Observer::InputVector working = model.u;
      for (int c = 0; c < kChannels; ++c) {
        if (k >= onset) working(c) *= 1.0 - fault[static_cast<std::size_t>(c)];
      }
      x = (model.a * x + model.b * working).eval();
      for (double& state : x) state += std::sqrt(reading.plant_variance) * normal(random);
      for (int c = 0; c < kChannels; ++c) {
        measurement.c(c, 2 * c) = 1.0;
        measurement.y(c) = x(2 * c) + std::sqrt(reading.sensor_variance) * normal(random);
      }
      Observer::Innovation innovation;
      EXPECT_EQ(observer.step(model, measurement, innovation), UpdateStatus::kFused);
      for (int c = 0; c < kChannels; ++c) {
        const double error = observer.fault()(c) - (k >= onset ? fault[static_cast<std::size_t>(c)] : 0.0);
        if (k >= onset && std::abs(error) > kSettled)
          outcome.settled = std::max(outcome.settled, k + 1 - onset);
        if (k < kSamples - 200) continue;
        const double angle_error = observer.state()(2 * c) - x(2 * c);
        outcome.fault_rmse += error * error;
        outcome.angle_rmse += angle_error * angle_error;
        ++counted;
      }
    }
    outcome.angle_sigma = std::sqrt(observer.state_covariance()(0, 0));
  }
  outcome.fault_rmse = std::sqrt(outcome.fault_rmse / counted);
  outcome.angle_rmse = std::sqrt(outcome.angle_rmse / counted);
  return outcome;
}

void print(const char* name, const Reading& reading, const Outcome& outcome) {
  std::printf("| %s | %s | %s | %.4f | %.4f | %.4f |\n", name, reading.name,
              outcome.settled >= 200 ? "not within 200" : std::to_string(outcome.settled).c_str(),
              outcome.fault_rmse, outcome.angle_rmse, outcome.angle_sigma);
}

struct ReferenceRun {
  const char* name;
  Fault fault;
  int onset;
  int claimed_samples;
};
constexpr ReferenceRun kConstant{"(a) 0.2 on all four", {0.2, 0.2, 0.2, 0.2}, 0, 50};
constexpr ReferenceRun kDifferent{"(b) 0.2 0.3 0.4 0.5", {0.2, 0.3, 0.4, 0.5}, 0, 100};
constexpr ReferenceRun kJump{"(c) 0 to that at sample 200", {0.2, 0.3, 0.4, 0.5}, 200, 100};

TEST(ReferenceRuns, WithoutNoiseTheObserverDoesWhatTheSourceSays) {
  for (const ReferenceRun& one : {kConstant, kDifferent, kJump}) {
    const Outcome outcome = run(kNoiseless, one.fault, one.onset);
    print(one.name, kNoiseless, outcome);
    EXPECT_LE(outcome.settled, one.claimed_samples) << one.name;
    EXPECT_LT(outcome.fault_rmse, kClaimedFaultRmse) << one.name;
    EXPECT_LT(outcome.angle_rmse, kClaimedStateRmse) << one.name;
  }
}

// Before y comes, the angle is uncertain by at least its process noise; y, with variance R, leaves 1/(1/Q + 1/R) of it.
// No estimator has a smaller error on a plant that really has that noise.
TEST(ReferenceRuns, WithTheStatedNoiseTheSourcesStateErrorIsOutOfReach) {
  for (const Reading& reading : {kLetter, kDeviation}) {
    const double bound = std::sqrt(1.0 / (1.0 / kQ + 1.0 / reading.sensor_variance));
    EXPECT_GT(bound, 6.0 * kClaimedStateRmse);
    for (const ReferenceRun& one : {kConstant, kDifferent, kJump}) {
      const Outcome outcome = run(reading, one.fault, one.onset);
      print(one.name, reading, outcome);
      EXPECT_GT(outcome.angle_rmse, bound);
      // The filter knows what it does not know: what it predicts is what happens.
      EXPECT_NEAR(outcome.angle_rmse, outcome.angle_sigma, 0.1 * outcome.angle_sigma);
    }
  }
}

TEST(ReferenceRuns, WithAQuietPlantAndAGoodSensorTheFaultIsAsGoodAsTheSourceSaysAndTheStateIsNot) {
  for (const ReferenceRun& one : {kConstant, kDifferent, kJump}) {
    const Outcome outcome = run(kQuietPlant, one.fault, one.onset);
    print(one.name, kQuietPlant, outcome);
    EXPECT_LE(outcome.settled, 100) << one.name;
    EXPECT_LT(outcome.fault_rmse, kClaimedFaultRmse) << one.name;
    EXPECT_GT(outcome.angle_rmse, kClaimedStateRmse) << one.name;
  }
}

}  // namespace
}  // namespace airworthy
