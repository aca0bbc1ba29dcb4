#include "core/estimators/unbalance/order_tracker.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/allocation_guard.h"
#include "tests/support/reference/dense_order_filter.h"

namespace airworthy {
namespace {

using Complex = std::complex<double>;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TimePoint at(double time_s) { return from_us(std::llround((1000.0 + time_s) * 1e6)); }

template <class Scalar>
Complex complex(Phasor<Scalar> p) {
  return {static_cast<double>(p.re), static_cast<double>(p.im)};
}

/// Rotors whose speeds wander about slightly different means, ω = ω₀ + δᵢ + wᵢ·sin(νᵢ·t), and the vibration they
/// make: exact phases, a circle that turns with each rotor and a part against it.
struct World {
  double hover_rad_s = 500.0;
  std::vector<double> offset_rad_s;
  double wander_rad_s = 8.0;
  std::vector<Complex> x;
  std::vector<Complex> y;
  double window_s = 0.0;
  double noise_m_s2 = 0.0;

  World(std::size_t rotors, double hover) : hover_rad_s{hover} {
    for (std::size_t i = 0; i < rotors; ++i) {
      const auto n = static_cast<double>(i);
      offset_rad_s.push_back(4.0 * n - 6.0);
      const Complex own = std::polar(0.2 + 0.3 * n, 1.0 + 2.0 * n);
      const Complex against = 0.3 * std::polar(0.2 + 0.3 * n, 4.0 - n);
      const double spin = i % 2 == 0 ? 1.0 : -1.0;
      x.push_back(own + against);
      y.push_back(Complex{0.0, -spin} * (own - against));
    }
  }

  [[nodiscard]] std::size_t rotors() const { return offset_rad_s.size(); }
  [[nodiscard]] double rate(std::size_t i) const { return 1.1 + 0.37 * static_cast<double>(i); }
  [[nodiscard]] double speed(std::size_t i, double t) const {
    return hover_rad_s + offset_rad_s[i] + wander_rad_s * std::sin(rate(i) * t);
  }
  [[nodiscard]] double phase(std::size_t i, double t) const {
    return (hover_rad_s + offset_rad_s[i]) * t + wander_rad_s * (1.0 - std::cos(rate(i) * t)) / rate(i);
  }
  [[nodiscard]] Eigen::Vector2d accel(double t) const {
    Eigen::Vector2d sum{0.7, -9.0};  // and a constant, as gravity and drag are nearly
    for (std::size_t i = 0; i < rotors(); ++i) {
      const double ratio = speed(i, t) / hover_rad_s;
      const Complex turn = ratio * ratio * std::polar(1.0, phase(i, t));
      sum += Eigen::Vector2d{(x[i] * turn).real(), (y[i] * turn).real()};
    }
    return sum;
  }
  [[nodiscard]] Eigen::Vector2d sample(double t) const {
    if (window_s <= 0.0) return accel(t);
    constexpr int kParts = 40;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int k = 0; k < kParts; ++k) sum += accel(t - window_s * (k + 0.5) / kParts);
    return sum / kParts;
  }
};

template <class Scalar>
OrderTrackerParams<Scalar> params_of(const World& world) {
  OrderTrackerParams<Scalar> params;
  params.reference_speed_rad_s = static_cast<Scalar>(world.hover_rad_s);
  params.smallest_m_s2 = static_cast<Scalar>(0.3);
  params.speed_noise_ratio = static_cast<Scalar>(0.001);
  return params;
}

/// Flies a world: exact speeds every `report_s`, told `late_s` after they were measured.
template <class Scalar, std::size_t N>
class Flight {
 public:
  using Tracker = OrderTracker<Scalar, N>;

  explicit Flight(const World& world, unsigned seed = 1) : Flight{world, params_of<Scalar>(world), seed} {}
  Flight(const World& world, const OrderTrackerParams<Scalar>& params, unsigned seed = 1)
      : tracker{params}, world_{world}, random_{seed} {}

  void fly(double duration_s) {
    const double end_s = time_s + duration_s;
    for (; time_s < end_s - 1e-9; time_s += dt_s) step();
  }

  Tracker tracker;
  double dt_s = 0.002;
  double report_s = 0.01;
  double late_s = 0.0;
  double time_s = 0.0;
  std::array<bool, N> is_silent{};
  bool has_imu = true;
  // What NIS and whiteness need.
  double nis_sum = 0.0;
  double lag_sum = 0.0;
  double power_sum = 0.0;
  int samples = 0;

  void change(const World& world) { world_ = world; }
  [[nodiscard]] double covariance(std::size_t i, std::size_t j) const {
    return static_cast<double>(tracker.covariance_m2_s4(i, j));
  }

 private:
  void step() {
    while (next_report_s_ + late_s <= time_s + 1e-9) {
      std::array<Scalar, N> speeds;
      for (std::size_t i = 0; i < N; ++i) {
        speeds[i] =
            is_silent[i] ? static_cast<Scalar>(kNaN) : static_cast<Scalar>(world_.speed(i, next_report_s_));
      }
      tracker.on_speeds(at(next_report_s_), speeds);
      next_report_s_ += report_s;
    }
    if (!has_imu) return;
    Eigen::Vector2d a = world_.sample(time_s);
    a += world_.noise_m_s2 * Eigen::Vector2d{normal_(random_), normal_(random_)};
    const auto status = tracker.on_accel(at(time_s), static_cast<Scalar>(a.x()), static_cast<Scalar>(a.y()),
                                         static_cast<Scalar>(world_.window_s));
    if (status == UpdateStatus::kFused) note();
  }

  void note() {
    const auto& innovation = tracker.innovation();
    const double scale = std::sqrt(static_cast<double>(innovation.variance_m2_s4));
    const double now = static_cast<double>(innovation.x_m_s2) / scale;
    nis_sum += static_cast<double>(innovation.nis());
    lag_sum += now * last_;
    power_sum += now * now;
    last_ = now;
    ++samples;
  }

  World world_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double next_report_s_ = 0.0;
  double last_ = 0.0;
};

template <std::size_t N>
double worst_error(const Flight<double, N>& flight, const World& world) {
  double worst = 0.0;
  for (std::size_t i = 0; i < N; ++i) {
    worst = std::max(worst, std::abs(std::abs(complex(flight.tracker.x_m_s2(i))) - std::abs(world.x[i])));
    // The phase of Y after X is the shape of the ellipse, whatever the rotor's own phase counts from.
    const Complex shape = complex(flight.tracker.y_m_s2(i)) * std::conj(complex(flight.tracker.x_m_s2(i)));
    worst = std::max(worst, std::abs(shape - world.y[i] * std::conj(world.x[i])));
  }
  return worst;
}

template <std::size_t N>
void expect_symmetric_and_positive(const OrderTracker<double, N>& tracker) {
  Eigen::MatrixXd P(2 * N, 2 * N);
  for (std::size_t i = 0; i < 2 * N; ++i) {
    for (std::size_t j = 0; j < 2 * N; ++j) {
      P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = tracker.covariance_m2_s4(i, j);
    }
  }
  ASSERT_EQ((P - P.transpose()).cwiseAbs().maxCoeff(), 0.0);
  ASSERT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(P).eigenvalues().minCoeff(), 0.0);
}

template <std::size_t N>
void expect_equal(const OrderTracker<double, N>& tracker, const test::DenseOrderFilter& reference) {
  for (std::size_t i = 0; i < N; ++i) {
    const auto r = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(std::abs(complex(tracker.x_m_s2(i)) - reference.amplitude(r, 0)), 0.0, 1e-9) << i;
    EXPECT_NEAR(std::abs(complex(tracker.y_m_s2(i)) - reference.amplitude(r, 1)), 0.0, 1e-9) << i;
    for (std::size_t j = 0; j < N; ++j) {
      const auto c = static_cast<Eigen::Index>(j);
      EXPECT_NEAR(tracker.covariance_m2_s4(2 * i, 2 * j + 1), reference.P(4 * r, 4 * c + 1), 1e-9);
      EXPECT_NEAR(tracker.covariance_m2_s4(2 * i, 2 * j + 1), reference.P(4 * r + 2, 4 * c + 3), 1e-9);
    }
  }
  EXPECT_NEAR(tracker.noise_variance_m2_s4(), reference.noise_variance(), 1e-9);
}

/// The same samples to tracker and dense reference; the reference is given the speeds the test itself interpolates.
template <std::size_t N>
void expect_the_dense_filter(World world, double dt_s, double low_pass_Hz) {
  world.noise_m_s2 = 0.1;
  auto params = params_of<double>(world);
  params.low_pass_Hz = low_pass_Hz;
  OrderTracker<double, N> tracker{params};
  test::DenseOrderFilter reference{
      static_cast<Eigen::Index>(N),
      {params.reference_speed_rad_s, params.smallest_m_s2, params.speed_noise_ratio, low_pass_Hz}};
  std::mt19937 random{7};
  std::normal_distribution<double> normal;
  const double report_s = 0.01;
  std::vector<std::array<double, N>> reports;
  const auto steps = static_cast<int>(3.0 / dt_s);
  for (int n = 0; static_cast<double>(n) * report_s < 3.0 + 0.1; ++n) {
    std::array<double, N> speeds;
    for (std::size_t i = 0; i < N; ++i) {
      speeds[i] = world.speed(i, n * report_s) * (1.0 + 0.001 * normal(random));
    }
    reports.push_back(speeds);
  }
  std::size_t told = 0;
  for (int k = 5; k < steps; ++k) {
    const double t = k * dt_s;
    for (; static_cast<double>(told) * report_s <= t + 0.03; ++told) {
      tracker.on_speeds(at(static_cast<double>(told) * report_s), reports[told]);
    }
    const Eigen::Vector2d a =
        world.sample(t) + world.noise_m_s2 * Eigen::Vector2d{normal(random), normal(random)};
    (void)tracker.on_accel(at(t), a.x(), a.y(), world.window_s);
    const double middle = t - 0.5 * world.window_s;
    const auto n = static_cast<std::size_t>(middle / report_s + 1e-9);
    const double share = middle / report_s - static_cast<double>(n);
    Eigen::VectorXd speed(N);
    for (std::size_t i = 0; i < N; ++i) {
      speed(static_cast<Eigen::Index>(i)) = (1.0 - share) * reports[n][i] + share * reports[n + 1][i];
    }
    reference.step(dt_s, a, world.window_s, speed, Eigen::VectorXd::Constant(N, report_s));
  }
  expect_equal(tracker, reference);
}

TEST(OrderTracker, EqualsADenseTextbookKalmanFilter) {
  expect_the_dense_filter<4>(World{4, 500.0}, 0.002, 0.0);
  expect_the_dense_filter<6>(World{6, 470.0}, 0.002, 180.0);
  expect_the_dense_filter<4>(World{4, 1520.0}, 0.002, 0.0);
  World averaged{4, 500.0};
  averaged.window_s = 0.005;
  expect_the_dense_filter<4>(averaged, 0.005, 0.0);
}

TEST(OrderTracker, RecoversAmplitudesAndEllipses) {
  World world{4, 500.0};
  world.noise_m_s2 = 0.05;
  Flight<double, 4> flight{world};
  flight.fly(6.0);
  EXPECT_LT(worst_error(flight, world), 0.06);
  // Rotor 4 turns counter-clockwise: its own part and the one against it as they were put in.
  EXPECT_NEAR(flight.tracker.turning_m_s2(3, -1).magnitude(), 1.1, 0.04);
  EXPECT_NEAR(flight.tracker.turning_m_s2(3, 1).magnitude(), 0.33, 0.04);
}

TEST(OrderTracker, RecoversASmallVehicleBeyondHalfTheSamplingRate) {
  World raw{4, 2.0 * std::numbers::pi * 242.0};
  raw.noise_m_s2 = 0.05;
  Flight<double, 4> flight{raw};
  flight.fly(6.0);
  EXPECT_LT(worst_error(flight, raw), 0.08);

  World beyond = raw;  // 300 Hz at 500 Hz folds to 200 Hz, turning backwards
  beyond.hover_rad_s = 2.0 * std::numbers::pi * 300.0;
  Flight<double, 4> folded{beyond};
  folded.fly(6.0);
  EXPECT_LT(worst_error(folded, beyond), 0.08);

  World averaged = raw;  // 16 % of it is left, upside down, and folds to 42 Hz
  averaged.window_s = 0.005;
  averaged.noise_m_s2 = 0.02;
  Flight<double, 4> slow{averaged};
  slow.dt_s = 0.005;
  slow.fly(8.0);
  EXPECT_LT(worst_error(slow, averaged), 0.15);
}

// Data drawn from the model itself: amplitudes that walk as (2) says, noise that is white behind the high-pass. R is
// learned from NIS, so that its mean is no test of R; that R is the true one, whiteness and the error of the
// amplitudes in units of P (NEES) are.
struct Drawn {
  double nis = 0.0;
  double lag = 0.0;
  double nees = 0.0;
  double noise_ratio = 0.0;
  int samples = 0;
};

enum class Walk { kOfTheModel, kOfThePhase };

Drawn draw(unsigned seed, Walk kind) {
  constexpr std::size_t kN = 4;
  constexpr double kDt_s = 0.002;
  constexpr double kNoise = 0.25;
  World world{kN, 500.0};
  const auto params = params_of<double>(world);
  OrderTracker<double, kN> tracker{params};
  std::mt19937 random{seed};
  std::normal_distribution<double> normal;
  std::array<Complex, kN> x;
  std::array<Complex, kN> y;
  std::array<double, kN> phase{};
  for (std::size_t i = 0; i < kN; ++i) {
    x[i] = {normal(random), normal(random)};
    y[i] = {normal(random), normal(random)};
  }
  const double alpha = 1.0 / (1.0 + world.hover_rad_s / 3.0 * kDt_s);
  Eigen::Vector2d raw = Eigen::Vector2d::Zero();
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  Eigen::Vector2d behind = Eigen::Vector2d::Zero();
  Drawn drawn;
  double last = 0.0;
  double lag = 0.0;
  double power = 0.0;
  SensorResponse<double> response{world.hover_rad_s / 3.0, 0.0};
  (void)response.high_pass({0.0, 0.0}, kDt_s);
  for (int k = 0; k < 7000; ++k) {
    std::array<double, kN> speeds;
    const double t = k * kDt_s;
    Eigen::Vector2d wanted = kNoise * Eigen::Vector2d{normal(random), normal(random)};
    for (std::size_t i = 0; i < kN; ++i) {
      speeds[i] = world.speed(i, t);
      if (k > 0) phase[i] += 0.5 * (speeds[i] + world.speed(i, t - kDt_s)) * kDt_s;
      const double q_phase = 0.01 + std::pow(params.speed_noise_ratio * speeds[i], 2) * kDt_s;
      const double walk = 0.3 * params.smallest_m_s2 * std::sqrt(kDt_s);
      double spread = walk;
      if (kind == Walk::kOfThePhase) {
        const Complex turned = std::polar(1.0, std::sqrt(q_phase * kDt_s) * normal(random));
        x[i] *= turned;
        y[i] *= turned;
      } else {
        const double mean = 0.5 * (std::norm(x[i]) + std::norm(y[i]));
        spread = std::hypot(walk, std::sqrt(0.5 * q_phase * mean * kDt_s));
      }
      x[i] += spread * Complex{normal(random), normal(random)};
      y[i] += spread * Complex{normal(random), normal(random)};
      const double ratio = speeds[i] / world.hover_rad_s;
      const Complex seen =
          ratio * ratio * complex(response.at(speeds[i], kDt_s, 0.0)) * std::polar(1.0, phase[i]);
      wanted += Eigen::Vector2d{(x[i] * seen).real(), (y[i] * seen).real()};
    }
    // The sample that the high-pass turns into what is wanted.
    if (k > 0) {
      const Eigen::Vector2d new_middle = wanted / alpha - behind + middle;
      raw += new_middle / alpha - middle;
      middle = new_middle;
      behind = wanted;
    }
    tracker.on_speeds(at(t), speeds);
    if (tracker.on_accel(at(t), raw.x(), raw.y(), 0.0) != UpdateStatus::kFused || k < 5000) continue;
    const auto& innovation = tracker.innovation();
    const double now = innovation.x_m_s2 / std::sqrt(innovation.variance_m2_s4);
    drawn.nis += innovation.nis();
    lag += now * last;
    power += now * now;
    last = now;
    ++drawn.samples;
  }
  drawn.nis /= drawn.samples;
  drawn.lag = lag / power;
  drawn.noise_ratio = std::sqrt(tracker.noise_variance_m2_s4()) / kNoise;
  Eigen::MatrixXd P(2 * kN, 2 * kN);
  Eigen::VectorXd error_x(2 * kN);
  Eigen::VectorXd error_y(2 * kN);
  for (std::size_t i = 0; i < 2 * kN; ++i) {
    for (std::size_t j = 0; j < 2 * kN; ++j) {
      P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = tracker.covariance_m2_s4(i, j);
    }
    const std::size_t rotor = i / 2;
    const Complex dx = complex(tracker.x_m_s2(rotor)) - x[rotor];
    const Complex dy = complex(tracker.y_m_s2(rotor)) - y[rotor];
    error_x(static_cast<Eigen::Index>(i)) = i % 2 == 0 ? dx.real() : dx.imag();
    error_y(static_cast<Eigen::Index>(i)) = i % 2 == 0 ? dy.real() : dy.imag();
  }
  drawn.nees = error_x.dot(P.llt().solve(error_x)) + error_y.dot(P.llt().solve(error_y));
  return drawn;
}

TEST(OrderTracker, IsConsistentOnDataDrawnFromItsModel) {
  constexpr int kSeeds = 200;
  double nis = 0.0;
  double nees = 0.0;
  double lag = 0.0;
  int samples = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Drawn drawn = draw(seed, Walk::kOfTheModel);
    nis += drawn.nis / kSeeds;
    nees += drawn.nees / kSeeds;
    lag += drawn.lag / kSeeds;
    samples += drawn.samples;
    // ±4.5 sigma of an estimate from the last second: about 2·500 values.
    EXPECT_NEAR(drawn.noise_ratio, 1.0, 0.1) << "seed " << seed;
    EXPECT_NEAR(drawn.lag, 0.0, 4.0 / std::sqrt(drawn.samples)) << "seed " << seed;
  }
  std::printf("NIS %.4f, NEES %.2f of 16, lag-1 %.5f, %d samples\n", nis, nees, lag, samples);
  // Bands of χ² means, 95 % for NIS, 99 % for the others; k values with n degrees of freedom have variance 2·n/k.
  EXPECT_NEAR(nis, 2.0, 1.96 * std::sqrt(2.0 * 2.0 / samples));
  EXPECT_NEAR(nees, 16.0, 2.58 * std::sqrt(2.0 * 16.0 / kSeeds));
  EXPECT_NEAR(lag, 0.0, 2.58 / std::sqrt(samples));
}

// The phase turns an amplitude, (2) spreads it evenly: right in the mean over all directions, X and Y share the turn,
// so that NEES varies more from flight to flight.
TEST(OrderTracker, APhaseThatWalksIsNoMoreThanItsCovarianceSays) {
  constexpr int kSeeds = 200;
  double sum = 0.0;
  double squares = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const double nees = draw(seed, Walk::kOfThePhase).nees;
    sum += nees;
    squares += nees * nees;
  }
  const double mean = sum / kSeeds;
  const double spread = std::sqrt((squares / kSeeds - mean * mean) / kSeeds);
  std::printf("NEES %.2f of 16, standard error %.2f\n", mean, spread);
  EXPECT_NEAR(mean, 16.0, 1.96 * spread);
}

// A limit: the noise of a sensor is white ahead of the high-pass. Behind it, twice α·(1 − z⁻¹)/(1 − α·z⁻¹), its
// lag-1 correlation is r₁/r₀ of that filter, and (3) takes the noise for white. What the filter has yet to learn of
// the rotors, at 80 Hz, is correlated the other way and hides a part.
TEST(OrderTracker, WhiteNoiseAheadOfTheHighPassLeavesInnovationsCorrelated) {
  World world{4, 500.0};
  world.noise_m_s2 = 0.25;
  Flight<double, 4> flight{world, 3};
  flight.fly(2.0);
  flight.lag_sum = flight.power_sum = flight.nis_sum = 0.0;
  flight.samples = 0;
  flight.fly(80.0);
  const double alpha = 1.0 / (1.0 + 500.0 / 3.0 * 0.002);
  std::vector<double> h(400, 0.0);  // impulse response of both stages
  double first = 0.0;
  double second = 0.0;
  double input = 0.0;
  for (std::size_t k = 0; k < h.size(); ++k) {
    const double u = k == 0 ? 1.0 : 0.0;
    const double new_first = alpha * (first + u - input);
    second = alpha * (second + new_first - first);
    first = new_first;
    input = u;
    h[k] = second;
  }
  double r0 = 0.0;
  double r1 = 0.0;
  for (std::size_t k = 0; k < h.size(); ++k) {
    r0 += h[k] * h[k];
    if (k > 0) r1 += h[k] * h[k - 1];
  }
  const double lag = flight.lag_sum / flight.power_sum;
  EXPECT_LT(r1 / r0, -0.09);
  EXPECT_LT(lag, -3.0 / std::sqrt(flight.samples));
  EXPECT_GT(lag, r1 / r0 - 2.0 / std::sqrt(flight.samples));
  EXPECT_NEAR(flight.nis_sum / flight.samples, 2.0, 0.03);
}

TEST(OrderTracker, KeepsItsCovarianceSymmetricAndPositive) {
  World world{4, 500.0};
  world.noise_m_s2 = 0.3;
  Flight<double, 4> flight{world};
  for (int k = 0; k < 100; ++k) {
    flight.fly(0.05);
    expect_symmetric_and_positive(flight.tracker);
  }
  World alike{4, 500.0};
  alike.offset_rad_s.assign(4, 0.0);
  alike.wander_rad_s = 0.0;
  Flight<double, 4> still{alike};
  for (int k = 0; k < 60; ++k) {
    still.fly(0.5);
    expect_symmetric_and_positive(still.tracker);
  }
}

TEST(OrderTracker, PermutingTheRotorsPermutesTheAnswer) {
  const std::array<std::size_t, 4> order{2, 0, 3, 1};
  World world{4, 500.0};
  OrderTracker<double, 4> plain{params_of<double>(world)};
  OrderTracker<double, 4> permuted{params_of<double>(world)};
  for (int k = 0; k < 2500; ++k) {
    const double t = k * 0.002;
    std::array<double, 4> speeds;
    std::array<double, 4> moved;
    for (std::size_t i = 0; i < 4; ++i) speeds[i] = world.speed(i, t);
    for (std::size_t i = 0; i < 4; ++i) moved[i] = speeds[order[i]];
    const Eigen::Vector2d a = world.accel(t);
    plain.on_speeds(at(t), speeds);
    permuted.on_speeds(at(t), moved);
    (void)plain.on_accel(at(t), a.x(), a.y(), 0.0);
    (void)permuted.on_accel(at(t), a.x(), a.y(), 0.0);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(std::abs(complex(permuted.x_m_s2(i)) - complex(plain.x_m_s2(order[i]))), 0.0, 1e-9);
    EXPECT_NEAR(permuted.turning_variance_m2_s4(i), plain.turning_variance_m2_s4(order[i]), 1e-9);
    for (std::size_t j = 0; j < 4; ++j) {
      if (i != j) {
        EXPECT_EQ(permuted.are_apart(i, j), plain.are_apart(order[i], order[j]));
      }
    }
  }
}

// float counts phases to 2e-7 rad a sample: 1e-3 rad in 10 s. Amplitudes agree to 1 %.
TEST(OrderTracker, FloatTracksDouble) {
  for (const double hover_rad_s : {500.0, 1520.0}) {
    World world{4, hover_rad_s};
    world.noise_m_s2 = 0.1;
    Flight<double, 4> wide{world};
    Flight<float, 4> narrow{world};
    wide.fly(10.0);
    narrow.fly(10.0);
    for (std::size_t i = 0; i < 4; ++i) {
      const Complex expected = complex(wide.tracker.x_m_s2(i));
      EXPECT_NEAR(std::abs(complex(narrow.tracker.x_m_s2(i))), std::abs(expected), 0.01) << hover_rad_s;
      EXPECT_NEAR(narrow.covariance(2 * i, 2 * i), wide.covariance(2 * i, 2 * i),
                  0.02 * wide.covariance(2 * i, 2 * i));
    }
  }
}

TEST(OrderTracker, FloatStaysPositiveForAnHourOfEqualSpeeds) {
  World alike{4, 500.0};
  alike.offset_rad_s.assign(4, 0.0);
  alike.wander_rad_s = 0.0;
  OrderTracker<float, 4> tracker{params_of<float>(alike)};
  const std::array<float, 4> speeds{500.0F, 500.0F, 500.0F, 500.0F};
  double phase = 0.0;
  for (int k = 0; k < 500 * 600; ++k) {
    const double t = k * 0.002;
    if (k % 5 == 0) tracker.on_speeds(at(t), speeds);
    phase = std::fmod(phase + 1.0, 2.0 * std::numbers::pi);
    (void)tracker.on_accel(at(t), static_cast<float>(std::cos(phase)), static_cast<float>(std::sin(phase)),
                           0.0F);
    for (std::size_t i = 0; i < 8; ++i) ASSERT_GT(tracker.covariance_m2_s4(i, i), 0.0F) << t;
  }
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_LE(tracker.covariance_m2_s4(i, i), 144.0F * 1.001F);  // never less sure than at first
  }
}

TEST(OrderTracker, EqualSpeedsLeaveTheDifferenceUnknown) {
  World world{4, 500.0};
  world.offset_rad_s = {0.0, 0.0, 5.0, -5.0};
  world.wander_rad_s = 0.0;
  world.noise_m_s2 = 0.05;
  Flight<double, 4> flight{world};
  flight.fly(10.0);
  const auto variance_of_difference = [&flight](std::size_t i, std::size_t j) {
    return flight.covariance(2 * i, 2 * i) + flight.covariance(2 * j, 2 * j) -
           2.0 * flight.covariance(2 * i, 2 * j);
  };
  const double prior = 2.0 * std::pow(40.0 * 0.3, 2);
  EXPECT_GT(variance_of_difference(0, 1), 0.9 * prior);
  EXPECT_LT(variance_of_difference(2, 3), 1e-3 * prior);
  EXPECT_FALSE(flight.tracker.are_apart(0, 1));
  EXPECT_FALSE(flight.tracker.are_apart(1, 0));
  EXPECT_TRUE(flight.tracker.are_apart(0, 2));
  EXPECT_TRUE(flight.tracker.are_apart(2, 3));
  // Their sum is known.
  const Complex sum = complex(flight.tracker.x_m_s2(0)) + complex(flight.tracker.x_m_s2(1));
  EXPECT_NEAR(std::abs(sum), std::abs(world.x[0] + world.x[1]), 0.05);
}

int pairs_apart(const OrderTracker<double, 4>& tracker) {
  int count = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < i; ++j) count += tracker.are_apart(i, j) ? 1 : 0;
  }
  return count;
}

// Which a filter that believes the phases would not notice: equal speeds, reported with noise.
TEST(OrderTracker, EqualSpeedsWithNoisyTelemetryAreNotApart) {
  World world{4, 1520.0};
  world.offset_rad_s.assign(4, 0.0);
  OrderTrackerParams<double> params = params_of<double>(world);
  params.speed_noise_ratio = 0.003;
  OrderTracker<double, 4> tracker{params};
  std::mt19937 random{21};
  std::normal_distribution<double> normal;
  int apart = 0;
  for (int k = 0; k < 500 * 120; ++k) {
    const double t = k * 0.002;
    if (k % 5 == 0) {
      std::array<double, 4> speeds;
      for (double& speed : speeds) speed = 1520.0 * (1.0 + 0.003 * normal(random));
      tracker.on_speeds(at(t), speeds);
    }
    (void)tracker.on_accel(at(t), std::cos(1520.0 * t), std::sin(1520.0 * t), 0.0);
    apart += pairs_apart(tracker);
  }
  EXPECT_EQ(apart, 0);
}

TEST(OrderTracker, UsesNoHeap) {
  World world{4, 500.0};
  Flight<double, 4> flight{world};
  flight.fly(0.5);
  const test::AllocationGuard guard;
  flight.fly(0.5);
  EXPECT_EQ(guard.allocations(), 0U);
}

void expect_twins(OrderTracker<double, 4>& tracker, OrderTracker<double, 4>& twin, const World& world,
                  double t) {
  for (int k = 0; k < 200; ++k) {
    const double now = t + 0.002 * k;
    std::array<double, 4> speeds;
    for (std::size_t i = 0; i < 4; ++i) speeds[i] = world.speed(i, now);
    tracker.on_speeds(at(now), speeds);
    twin.on_speeds(at(now), speeds);
    const Eigen::Vector2d a = world.accel(now);
    (void)tracker.on_accel(at(now), a.x(), a.y(), 0.0);
    (void)twin.on_accel(at(now), a.x(), a.y(), 0.0);
    ASSERT_EQ(tracker.innovation().x_m_s2, twin.innovation().x_m_s2);
    ASSERT_EQ(tracker.x_m_s2(2).re, twin.x_m_s2(2).re);
  }
}

TEST(OrderTracker, RefusedSamplesChangeNothing) {
  World world{4, 500.0};
  Flight<double, 4> flight{world};
  flight.fly(2.0);
  const OrderTracker<double, 4> before = flight.tracker;
  auto& tracker = flight.tracker;
  const double t = flight.time_s;
  EXPECT_EQ(tracker.on_accel(at(t), kNaN, 0.0, 0.0), UpdateStatus::kNotFinite);
  EXPECT_EQ(tracker.on_accel(at(t), 0.0, HUGE_VAL, 0.0), UpdateStatus::kNotFinite);
  EXPECT_EQ(tracker.on_accel(at(t), 0.0, 0.0, kNaN), UpdateStatus::kNotFinite);
  EXPECT_EQ(tracker.on_accel(at(t), 0.0, 0.0, -0.005), UpdateStatus::kNotFinite);
  EXPECT_EQ(tracker.on_accel(at(t - 0.002), 50.0, 0.0, 0.0), UpdateStatus::kTimeBackward);
  EXPECT_EQ(tracker.on_accel(at(t - 1.0), 50.0, 0.0, 0.0), UpdateStatus::kTimeBackward);
  tracker.on_speeds(at(t - 1.0), std::array{1.0, 1.0, 1.0, 1.0});
  tracker.on_speeds(at(t + 1.0), std::array{kNaN, kNaN, HUGE_VAL, kNaN});
  EXPECT_EQ(tracker.counters().not_finite, 4);
  EXPECT_EQ(tracker.counters().time_backward, 2);
  EXPECT_EQ(tracker.counters().speed_refused, 4);
  OrderTracker<double, 4> twin = before;
  expect_twins(tracker, twin, world, t);
}

TEST(OrderTracker, AGapInTheSamplesForgetsWhatHasNoPhaseAnyMore) {
  World world{4, 500.0};
  Flight<double, 4> flight{world};
  flight.fly(4.0);
  EXPECT_LT(worst_error(flight, world), 0.03);
  flight.has_imu = false;
  flight.fly(0.5);
  flight.has_imu = true;
  flight.fly(0.004);
  EXPECT_EQ(flight.covariance(0, 0), std::pow(40.0 * 0.3, 2));
  EXPECT_EQ(flight.tracker.x_m_s2(3).magnitude(), 0.0);
  flight.fly(4.0);
  EXPECT_LT(worst_error(flight, world), 0.03);
}

TEST(OrderTracker, LostSamplesAreNoGap) {
  World world{4, 500.0};
  Flight<double, 4> flight{world};
  for (int k = 0; k < 100; ++k) {
    flight.fly(0.05);
    flight.has_imu = false;
    flight.fly(0.002 * (k % 4));
    flight.has_imu = true;
  }
  EXPECT_LT(worst_error(flight, world), 0.12);
  EXPECT_LT(flight.covariance(0, 0), 0.05);
}

TEST(OrderTracker, WaitsForOneRotorAndForgetsWhenItStaysSilent) {
  World world{4, 500.0};
  Flight<double, 4> flight{world};
  flight.fly(4.0);
  flight.is_silent[1] = true;
  flight.fly(0.2);  // a few lost reports are bridged
  EXPECT_EQ(flight.tracker.counters().speed_unknown, 0);
  EXPECT_LT(flight.covariance(0, 0), 0.05);
  flight.fly(1.0);
  const auto& counters = flight.tracker.counters();
  EXPECT_GT(counters.speed_unknown, 300);
  EXPECT_EQ(flight.covariance(0, 0), std::pow(40.0 * 0.3, 2));
  flight.is_silent[1] = false;
  flight.fly(4.0);
  EXPECT_LT(worst_error(flight, world), 0.03);
}

TEST(OrderTracker, SpeedsThatComeLateAreAsGoodAsAny) {
  World world{4, 500.0};
  Flight<double, 4> prompt{world};
  Flight<double, 4> late{world};
  late.late_s = 0.06;
  prompt.fly(3.0);
  late.fly(3.0);
  // Both once more, until each has fused the same samples.
  prompt.has_imu = late.has_imu = false;
  const auto fused = late.tracker.counters().fused;
  EXPECT_GT(fused, prompt.tracker.counters().fused - 40);
  late.late_s = 0.0;
  late.fly(0.06);
  prompt.fly(0.06);
  prompt.has_imu = late.has_imu = true;
  prompt.fly(0.01);
  late.fly(0.01);
  EXPECT_EQ(late.tracker.counters().fused, prompt.tracker.counters().fused);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(late.tracker.x_m_s2(i).re, prompt.tracker.x_m_s2(i).re);
}

TEST(OrderTracker, ReportsFourTimesASecondAreEnough) {
  World world{4, 500.0};
  world.wander_rad_s = 0.0;
  Flight<double, 4> flight{world};
  flight.report_s = 0.25;
  flight.fly(6.0);
  EXPECT_EQ(flight.tracker.counters().speed_unknown, 0);
  EXPECT_LT(worst_error(flight, world), 0.05);
}

// What a wrong latency does: the phase is wrong by the change of speed within it, so it is steady speeds that forgive.
TEST(OrderTracker, AWrongLatencyCostsAsMuchAsTheSpeedChangesWithinIt) {
  World steady{4, 500.0};
  steady.wander_rad_s = 0.0;
  World wandering = steady;
  wandering.wander_rad_s = 20.0;
  const auto error_of = [](const World& world, double latency_s) {
    auto params = params_of<double>(world);
    params.speed_latency_s = latency_s;
    Flight<double, 4> flight{world, params};
    flight.fly(6.0);
    return worst_error(flight, world);
  };
  EXPECT_LT(error_of(steady, 0.03), 0.05);
  EXPECT_LT(error_of(wandering, 0.0), 0.05);
  EXPECT_GT(error_of(wandering, 0.03), 0.1);
}

TEST(OrderTracker, AnImpactIsCut) {
  World world{4, 500.0};
  world.noise_m_s2 = 0.3;
  Flight<double, 4> flight{world};
  flight.fly(4.0);
  const Complex before = complex(flight.tracker.x_m_s2(2));
  (void)flight.tracker.on_accel(at(flight.time_s), 50.0, 50.0, 0.0);
  flight.time_s += 0.002;
  flight.fly(0.1);
  EXPECT_GT(flight.tracker.counters().cut, 0);
  EXPECT_EQ(flight.tracker.counters().reopened, 0);
  EXPECT_LT(std::abs(complex(flight.tracker.x_m_s2(2)) - before), 0.3);
}

TEST(OrderTracker, ASuddenChangeIsFollowedAtOnceAndLeavesTheOthersAlone) {
  World world{4, 500.0};
  world.noise_m_s2 = 0.3;
  Flight<double, 4> flight{world};
  flight.fly(4.0);
  ASSERT_EQ(flight.tracker.counters().reopened, 0);
  const Complex y_over_x = world.y[1] / world.x[1];
  world.x[1] = std::polar(15.0, 0.4);
  world.y[1] = y_over_x * world.x[1];
  flight.change(world);
  flight.fly(1.0);
  EXPECT_EQ(flight.tracker.counters().reopened, 1);
  EXPECT_NEAR(std::abs(complex(flight.tracker.x_m_s2(1))), 15.0, 0.8);
  for (const std::size_t other : {0U, 2U, 3U}) {
    EXPECT_NEAR(std::abs(complex(flight.tracker.x_m_s2(other))), std::abs(world.x[other]),
                4.0 * std::sqrt(flight.covariance(2 * other, 2 * other)));
  }
}

}  // namespace
}  // namespace airworthy
