#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/estimators/unbalance/rotor_separation.h"
#include "core/estimators/unbalance/sensor_response.h"
#include "core/estimators/unbalance/speed_scale.h"
#include "core/estimators/unbalance/speed_track.h"
#include "core/estimators/update_status.h"
#include "core/math/elementary.h"
#include "core/math/phasor.h"
#include "core/time/time.h"

namespace airworthy {

/// What an order tracker must know of the vehicle, its sensors, and what is looked for.
template <class Scalar>
struct OrderTrackerParams {
  Scalar reference_speed_rad_s = 500;  ///< ω₀, of a hover: amplitudes are accelerations at this speed
  Scalar smallest_m_s2 = static_cast<Scalar>(0.3);  ///< smallest amplitude to be found: the scale of (5)
  Scalar speed_latency_s = 0;                       ///< from the measurement of a speed to its stamp
  Scalar speed_noise_ratio = static_cast<Scalar>(0.004);  ///< of one report, resolution included, 1σ
  Scalar most_speed_error_ratio = 0;  ///< of the clocks that time the turns; 0 = they are taken for exact
  Scalar low_pass_Hz = 0;             ///< of the accelerometer, Butterworth of second order; 0 = not known
};

/// Which rotor shakes the vehicle, told by the phase of each: order tracking of the first order of N rotors.
///   Model      a_x(t) = Σᵢ (ωᵢ/ω₀)²·Re[Xᵢ·G(jωᵢ)·e^{jθᵢ}] + v,  a_y with Yᵢ alike,  θᵢ = ∫ωᵢ dt             (1)
///   Prediction Xᵢ, Yᵢ: random walks; per second and real part  q_A + ½·q_θ·½·E(|Xᵢ|² + |Yᵢ|²), up to P₀     (2)
///   Update     S = hᵀ·P·h + R;  K = P·h/S;  X ← X + K·(a_x − hᵀ·X), Y alike;  P ← P − K·(P·h)ᵀ              (3)
///   Rotation   A± = (X ± j·s·Y)/2: the part that turns with the rotor, and the part against it               (4)
///   Design     P₀ = (40·smallest)²; q_A = (0.3·smallest)² per s; q_θ = (σ_ω·ω)²·Δt_report + 0.01 per s        (5)
///   Clocks     ωᵢ = (1 + εᵢ)·reported: SpeedScale, within most_speed_error_ratio
///   Noise      R: mean of ½(ν_x² + ν_y²)·max(R/S, 0.1) over 1 s                                             (6)
///   Source     our own, derived in docs/equations/order_tracking.md; a relative of Vold and Leuridan's order tracking
///              by Kalman filters, causal and with all rotors in one state
///   Symbols    Xᵢ, Yᵢ → x_, y_ [m/s² at ω₀, real and imaginary part]; P → P_, one for both axes, as they share h
///              and R; θᵢ → phase_ [rad]; s = +1 clockwise seen from above; G → SensorResponse
///   Deviations innovations beyond 4σ are cut there (impacts); samples wait until every rotor's speed is known on
///              both sides of their time, at most 0.15 s; a gap in the samples or the speeds that breaks the phases
///              forgets the amplitudes; a mean NIS above 10 over 0.2 s (a propeller chips) sets P to P₀, once a second
///              at most; which rotors P may be trusted to tell apart is RotorSeparation's to say
///   Frames     body, x forward, y right; specific force, m/s²
///   Valid for  Δt in [0.5 ms, 0.1 s]; N in 3 … 8; speeds reported at ≥ 4 Hz; cost: 6·(2N)² + 60·N flops, no heap
template <class Scalar, std::size_t N>
class OrderTracker {
 public:
  static constexpr std::size_t kRotors = N;
  static constexpr std::size_t kStates = 2 * N;

  struct Innovation {
    TimePoint time{};
    Scalar x_m_s2 = 0;
    Scalar y_m_s2 = 0;
    Scalar variance_m2_s4 = 1;  ///< S of (3), of each axis
    /// Normalised innovation squared of both axes: mean 2 where the model is right.
    [[nodiscard]] Scalar nis() const noexcept { return (x_m_s2 * x_m_s2 + y_m_s2 * y_m_s2) / variance_m2_s4; }
  };

  struct Counters {
    std::int64_t fused = 0;
    std::int64_t not_finite = 0;
    std::int64_t time_backward = 0;
    std::int64_t speed_refused = 0;  ///< a report older than the one before it
    std::int64_t speed_unknown = 0;  ///< samples without the speed of every rotor
    std::int64_t cut = 0;            ///< innovations beyond 4σ
    std::int64_t reopened = 0;       ///< sudden changes
  };

  explicit OrderTracker(const OrderTrackerParams<Scalar>& params) noexcept
      : params_{params}, response_{Scalar{0}, params.low_pass_Hz} {
    forget();
  }

  /// Amplitudes as before the first sample; speeds and phases go on.
  void forget() noexcept {
    reopen();
    separation_.reset();
    x_.fill(0);
    y_.fill(0);
  }

  /// Speeds in rad/s, of either sign, stamped with `time`; NaN = not in this report.
  void on_speeds(TimePoint time, std::span<const Scalar, N> speed_rad_s) noexcept {
    const TimePoint measured = time - from_seconds(static_cast<double>(params_.speed_latency_s));
    for (std::size_t i = 0; i < N; ++i) {
      if (!std::isfinite(speed_rad_s[i])) continue;
      if (!track_[i].add(measured, std::abs(speed_rad_s[i]))) ++counters_.speed_refused;
    }
  }

  /// A sample of the accelerometer, stamped with the end of its average over `window_s` (0 = raw).
  /// kNotFinite also for a negative window. kConverging: it waits for the speeds at its time; every sample that no
  /// longer waits is fused.
  UpdateStatus on_accel(TimePoint time, Scalar a_x_m_s2, Scalar a_y_m_s2, Scalar window_s) noexcept {
    const bool has_window = std::isfinite(window_s) && window_s >= Scalar{0};
    if (!std::isfinite(a_x_m_s2) || !std::isfinite(a_y_m_s2) || !has_window) {
      ++counters_.not_finite;
      return UpdateStatus::kNotFinite;
    }
    if (has_newest_ && time <= newest_) {
      ++counters_.time_backward;
      return UpdateStatus::kTimeBackward;
    }
    newest_ = time;
    has_newest_ = true;
    if (waiting_ == kMostWaiting) fuse_oldest();
    queue_[(oldest_ + waiting_++) % kMostWaiting] = {time, {a_x_m_s2, a_y_m_s2}, window_s};
    const std::int64_t fused_before = counters_.fused;
    while (waiting_ > 0 && need_not_wait(queue_[oldest_].time)) fuse_oldest();
    return counters_.fused > fused_before ? UpdateStatus::kFused : UpdateStatus::kConverging;
  }

  /// What is known of the clock error of a rotor's speed, from earlier flights.
  void start_speed_error(std::size_t rotor, Scalar ratio) noexcept { scale_[rotor].start_at(ratio); }
  [[nodiscard]] Scalar speed_error_ratio(std::size_t rotor) const noexcept {
    return scale_[rotor].error_ratio();
  }

  /// Of the newest sample that was fused.
  [[nodiscard]] const Innovation& innovation() const noexcept { return innovation_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  /// R of (6). m²/s⁴.
  [[nodiscard]] Scalar noise_variance_m2_s4() const noexcept { return R_; }
  [[nodiscard]] Phasor<Scalar> x_m_s2(std::size_t rotor) const noexcept { return state(x_, rotor); }
  [[nodiscard]] Phasor<Scalar> y_m_s2(std::size_t rotor) const noexcept { return state(y_, rotor); }
  /// A± of (4) for `spin` s, or its opposite for the part against the rotor.
  [[nodiscard]] Phasor<Scalar> turning_m_s2(std::size_t rotor, int spin) const noexcept {
    const Phasor<Scalar> turned = Phasor<Scalar>{0, static_cast<Scalar>(spin)} * y_m_s2(rotor);
    return static_cast<Scalar>(0.5) * (x_m_s2(rotor) + turned);
  }
  /// Element of P, shared by both axes; states 2·rotor (real) and 2·rotor + 1 (imaginary). m²/s⁴.
  [[nodiscard]] Scalar covariance_m2_s4(std::size_t i, std::size_t j) const noexcept { return P_[i][j]; }
  /// Variance of the real part of A± of a rotor, whatever the others do: the inverse of its information. m²/s⁴.
  [[nodiscard]] Scalar turning_variance_m2_s4(std::size_t rotor) const noexcept {
    const Scalar re = covariance_m2_s4(2 * rotor, 2 * rotor);
    const Scalar im = covariance_m2_s4(2 * rotor + 1, 2 * rotor + 1);
    return static_cast<Scalar>(0.25) * (re + im);
  }
  /// θ of (1), in 0 … 2π.
  [[nodiscard]] Scalar phase_rad(std::size_t rotor) const noexcept { return phase_[rotor]; }
  /// Whether two rotors have turned differently enough of late for P to be believed between them.
  [[nodiscard]] bool are_apart(std::size_t i, std::size_t j) const noexcept {
    return separation_.are_apart(i, j);
  }
  /// Whether the model explains what was felt in the last 0.2 s: not in a sudden change, nor before R is learned.
  [[nodiscard]] bool explains() const noexcept { return change_nis_ < kExplainedNis; }
  /// The speed of each rotor at the newest fused sample. rad/s.
  [[nodiscard]] const std::array<Scalar, N>& speed_rad_s() const noexcept { return speed_; }

 private:
  static constexpr std::size_t kMostWaiting = 128;
  static constexpr Scalar kLeastHighPass_rad_s = 30;
  static constexpr Duration kLongestWait{150'000};
  static constexpr Scalar kSpeedUnknown_s = static_cast<Scalar>(0.3);
  static constexpr Scalar kLongestStep_s = static_cast<Scalar>(0.1);
  static constexpr Scalar kMostSigmas = 4;
  static constexpr Scalar kNoiseTime_s = 1;
  static constexpr Scalar kChangeTime_s = static_cast<Scalar>(0.2);
  static constexpr Scalar kChangeNis = 10;
  static constexpr Scalar kExplainedNis = 4;
  static constexpr Scalar kChangeRest_s = 1;
  static constexpr Scalar kPhaseWalk_rad2_s = static_cast<Scalar>(0.01);
  static constexpr Scalar kTwoPi = static_cast<Scalar>(6.283185307179586);

  using Vector = std::array<Scalar, kStates>;
  struct Sample {
    TimePoint time{};
    std::array<Scalar, 2> accel_m_s2{};
    Scalar window_s = 0;
  };

  [[nodiscard]] Scalar& P(std::size_t i, std::size_t j) noexcept { return P_[i][j]; }
  /// (5): wide beside any amplitude, or what two rotors share would seem to be known of each.
  [[nodiscard]] Scalar prior_variance_m2_s4() const noexcept {
    const Scalar sigma = Scalar{40} * params_.smallest_m_s2;
    return sigma * sigma;
  }
  static Phasor<Scalar> state(const Vector& v, std::size_t rotor) noexcept {
    return {v[2 * rotor], v[2 * rotor + 1]};
  }

  void reopen() noexcept {
    for (auto& row : P_) row.fill(0);
    for (std::size_t i = 0; i < kStates; ++i) P(i, i) = prior_variance_m2_s4();
    change_nis_ = 2;
    since_reopened_s_ = 0;
  }

  /// What the walk of (2) cannot follow: without it the cut would let the amplitudes creep, the noise swell, and
  /// another rotor take the share that the right one lacks. Values are cut as innovations are: an impact is no change.
  void watch_for_change(Scalar dt_s) noexcept {
    const Scalar nis = std::min(innovation_.nis(), Scalar{2} * kMostSigmas * kMostSigmas);
    change_nis_ += dt_s / (kChangeTime_s + dt_s) * (nis - change_nis_);
    since_reopened_s_ += dt_s;
    if (change_nis_ < kChangeNis || since_reopened_s_ < kChangeRest_s) return;
    reopen();
    ++counters_.reopened;
  }

  [[nodiscard]] bool need_not_wait(TimePoint time) const noexcept {
    if (newest_ - time >= kLongestWait) return true;
    return std::all_of(track_.begin(), track_.end(), [time](const SpeedTrack<Scalar>& track) {
      return !track.is_empty() && track.newest_time() >= time;
    });
  }

  void fuse_oldest() noexcept {
    const Sample sample = queue_[oldest_];
    oldest_ = (oldest_ + 1) % kMostWaiting;
    --waiting_;
    fuse(sample);
  }

  void fuse(const Sample& sample) noexcept {
    const auto dt_s = static_cast<Scalar>(to_seconds(sample.time - fused_at_));
    const bool continues = is_started_ && dt_s <= kLongestStep_s;
    if (!read_speeds(sample)) {
      ++counters_.speed_unknown;
      if (is_started_) forget();
      is_started_ = false;
      return;
    }
    fused_at_ = sample.time;
    if (!continues) {
      if (is_started_) forget();
      response_.restart(sample.accel_m_s2);
      last_speed_ = speed_;
      is_started_ = true;
      return;
    }
    if (dt_mean_s_ <= Scalar{0}) {
      dt_mean_s_ = dt_s;
      response_.set_high_pass(high_pass_rad_s(dt_s));
    }
    dt_mean_s_ += static_cast<Scalar>(0.05) * (dt_s - dt_mean_s_);
    const auto accel = response_.high_pass(sample.accel_m_s2, dt_s);
    predict(dt_s);
    update(sample, accel, regressor(sample.window_s), dt_s);
    ++counters_.fused;
  }

  /// Two poles at a third of the hover speed: the vehicle's own motion and the mount's reach 50 Hz. Where slow sampling
  /// folds the rotor down, at a third of where it comes to lie.
  [[nodiscard]] Scalar high_pass_rad_s(Scalar dt_s) const noexcept {
    const Scalar turns = params_.reference_speed_rad_s * dt_s / kTwoPi;
    const Scalar part = turns - std::floor(turns);
    const Scalar folded_rad_s = std::min(part, Scalar{1} - part) * kTwoPi / dt_s;
    return std::max(std::min(params_.reference_speed_rad_s, folded_rad_s) / Scalar{3}, kLeastHighPass_rad_s);
  }

  bool read_speeds(const Sample& sample) noexcept {
    const TimePoint middle = sample.time - from_seconds(0.5 * static_cast<double>(sample.window_s));
    for (std::size_t i = 0; i < N; ++i) {
      const auto value = track_[i].at(middle);
      if (!value || value->spacing_s > kSpeedUnknown_s) return false;
      speed_[i] = (Scalar{1} + scale_[i].error_ratio()) * value->speed_rad_s;
      spacing_s_[i] = value->spacing_s;
    }
    return true;
  }

  void predict(Scalar dt_s) noexcept {
    const Scalar amplitude_walk = static_cast<Scalar>(0.3) * params_.smallest_m_s2;
    for (std::size_t i = 0; i < N; ++i) {
      Scalar& phase = phase_[i];
      phase += static_cast<Scalar>(0.5) * (speed_[i] + last_speed_[i]) * dt_s;
      phase -= kTwoPi * std::floor(phase / kTwoPi);
      const Scalar speed_sigma = params_.speed_noise_ratio * speed_[i];
      phase_walk_rad2_s_[i] = kPhaseWalk_rad2_s + speed_sigma * speed_sigma * spacing_s_[i];  // (5)
      // E|X|² = |X|² + trace: what is not known of an amplitude turns with the phase too.
      const Scalar squared =
          x_m_s2(i).squared() + y_m_s2(i).squared() + Scalar{2} * (P(2 * i, 2 * i) + P(2 * i + 1, 2 * i + 1));
      const Scalar q = dt_s * (amplitude_walk * amplitude_walk +
                               static_cast<Scalar>(0.25) * phase_walk_rad2_s_[i] * squared);
      for (std::size_t part = 2 * i; part < 2 * i + 2; ++part) {  // (2)
        P(part, part) = std::max(P(part, part), std::min(P(part, part) + q, prior_variance_m2_s4()));
      }
    }
    separation_.step(speed_, phase_walk_rad2_s_, dt_s);
    last_speed_ = speed_;
  }

  /// h of (3): hᵀ·(Re Xᵢ, Im Xᵢ) = (ωᵢ/ω₀)²·Re[Xᵢ·G·e^{jθᵢ}].
  [[nodiscard]] Vector regressor(Scalar window_s) const noexcept {
    Vector h{};
    for (std::size_t i = 0; i < N; ++i) {
      const Scalar speed = speed_[i];
      const Scalar ratio = speed / params_.reference_speed_rad_s;
      const SinCos<Scalar> turn = sincos(phase_[i]);
      const Phasor<Scalar> seen =
          ratio * ratio * (response_.at(speed, dt_mean_s_, window_s) * Phasor<Scalar>{turn.cos, turn.sin});
      h[2 * i] = seen.re;
      h[2 * i + 1] = -seen.im;
    }
    return h;
  }

  void update(const Sample& sample, const std::array<Scalar, 2>& accel, const Vector& h,
              Scalar dt_s) noexcept {
    Vector Ph{};
    Scalar hPh = 0;
    innovation_ = {sample.time, accel[0], accel[1], 1};
    for (std::size_t i = 0; i < kStates; ++i) {
      Scalar sum = 0;
      for (std::size_t j = 0; j < kStates; ++j) sum += P(i, j) * h[j];
      Ph[i] = sum;
      hPh += sum * h[i];
      innovation_.x_m_s2 -= h[i] * x_[i];
      innovation_.y_m_s2 -= h[i] * y_[i];
    }
    if (R_ <= Scalar{0}) R_ = std::max(power(), params_.smallest_m_s2 * params_.smallest_m_s2);
    const Scalar S = hPh + R_;
    innovation_.variance_m2_s4 = S;
    const Scalar most = kMostSigmas * std::sqrt(S);
    const Scalar nu_x = std::clamp(innovation_.x_m_s2, -most, most);
    const Scalar nu_y = std::clamp(innovation_.y_m_s2, -most, most);
    if (nu_x != innovation_.x_m_s2 || nu_y != innovation_.y_m_s2) ++counters_.cut;
    if (params_.most_speed_error_ratio > Scalar{0}) learn_scale(Ph, nu_x / S, nu_y / S);
    for (std::size_t i = 0; i < kStates; ++i) {  // (3)
      const Scalar k = Ph[i] / S;
      x_[i] += k * nu_x;
      y_[i] += k * nu_y;
      for (std::size_t j = 0; j <= i; ++j) {
        P(i, j) -= k * Ph[j];
        P(j, i) = P(i, j);
      }
    }
    learn_noise(S, dt_s);
    watch_for_change(dt_s);
  }

  [[nodiscard]] Scalar power() const noexcept {
    const Scalar x = innovation_.x_m_s2;
    const Scalar y = innovation_.y_m_s2;
    return static_cast<Scalar>(0.5) * (x * x + y * y);
  }

  /// SpeedScale (2) for the correction Ph·ν/S that is about to be made.
  void learn_scale(const Vector& Ph, Scalar x_share, Scalar y_share) noexcept {
    for (std::size_t i = 0; i < N; ++i) {
      const std::size_t re = 2 * i;
      const std::size_t im = re + 1;
      const Scalar across =
          x_share * (x_[re] * Ph[im] - x_[im] * Ph[re]) + y_share * (y_[re] * Ph[im] - y_[im] * Ph[re]);
      const Scalar variance = Scalar{2} * (P(re, re) + P(im, im));
      const Scalar squared = x_m_s2(i).squared() + y_m_s2(i).squared();
      scale_[i].learn(across / (squared + Scalar{4} * variance), speed_[i], params_.most_speed_error_ratio);
    }
  }

  /// (6): at rest where the mean NIS is 2; one sample moves R by a limited factor.
  void learn_noise(Scalar S, Scalar dt_s) noexcept {
    const Scalar share = std::max(R_ / S, static_cast<Scalar>(0.1));
    const Scalar observed = std::min(share * power(), Scalar{10} * R_);
    R_ += dt_s / (kNoiseTime_s + dt_s) * (observed - R_);
    const Scalar least = static_cast<Scalar>(0.01) * params_.smallest_m_s2;
    R_ = std::max(R_, least * least);
  }

  OrderTrackerParams<Scalar> params_;
  SensorResponse<Scalar> response_;
  std::array<SpeedTrack<Scalar>, N> track_{};
  std::array<SpeedScale<Scalar>, N> scale_{};
  std::array<Sample, kMostWaiting> queue_{};
  std::size_t oldest_ = 0;
  std::size_t waiting_ = 0;
  TimePoint newest_{};
  bool has_newest_ = false;

  bool is_started_ = false;
  TimePoint fused_at_{};
  Scalar dt_mean_s_ = 0;
  std::array<Scalar, N> speed_{};
  std::array<Scalar, N> last_speed_{};
  std::array<Scalar, N> spacing_s_{};
  std::array<Scalar, N> phase_{};
  std::array<Scalar, N> phase_walk_rad2_s_{};
  RotorSeparation<Scalar, N> separation_;
  std::array<Vector, kStates> P_{};
  Vector x_{};
  Vector y_{};
  Scalar R_ = 0;
  Scalar change_nis_ = 2;
  Scalar since_reopened_s_ = 0;
  Innovation innovation_;
  Counters counters_;
};

}  // namespace airworthy
