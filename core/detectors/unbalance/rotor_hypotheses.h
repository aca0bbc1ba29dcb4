#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "core/estimators/unbalance/order_tracker.h"
#include "core/math/cholesky.h"
#include "core/math/elementary.h"

namespace airworthy {

/// What is believed of a rotor before the flight is looked at.
template <class Scalar, std::size_t N>
struct UnbalancePrior {
  std::array<int, N> spin{};               ///< +1 clockwise seen from above
  std::array<Scalar, N> amplitude_m_s2{};  ///< usual |A₊|: its rms, or what a calibration says
  bool is_calibrated = false;              ///< then |A₊| is usually within `sigma_m_s2` of amplitude_m_s2
  std::array<Scalar, N> sigma_m_s2{};
  Scalar against_ratio = static_cast<Scalar>(0.3);  ///< |A₋|/|A₊| of an airframe softer in one direction
  Scalar fault_probability = static_cast<Scalar>(1e-4);  ///< of each rotor being out of balance
};

/// How likely it is that one certain rotor is out of balance and the others are as usual.
///   H₀  z ~ N(0, C),  C = D(b) + P⊕P,  z = (X, Y) of the order tracker, P its covariance               (1)
///   Hᵢ  as H₀, but rotor i has the amplitude a, a² = bᵢ² + max(|Âᵢ|, smallest)², instead of bᵢ: C + Eᵢ·Δ·Eᵢᵀ,
///       Δ = D(a) − D(bᵢ)                                                                               (2)
///   ln p(z|Hᵢ)/p(z|H₀) = ½·wᵢᵀ·(Δ⁻¹ + Wᵢᵢ)⁻¹·wᵢ − ½·ln det(I + Δ·Wᵢᵢ),  W = C⁻¹,  w = W·z              (3)
///   Prior   D(a) of one rotor: A₊ ~ N(0, a²), A₋ ~ N(0, (ρ·a)²), complex, independent; X = A₊ + A₋,
///           Y = −j·s·(A₊ − A₋)                                                                        (4)
///   Calibrated  the magnitude b of A₊ is known, its phase is not: with u = Â/|Â|, A₊ ~ N(b·u, σ² along u, ½·b²
///           across), z less these means; Hᵢ adds a growth g along u, g² = max(||Âᵢ| − bᵢ|, smallest)², to (2): Δ = g²·u·uᵀ, and
///           ½·(ρ·g)² to A₋. A rotor that has always shaken must not need to shake more to be blamed      (5)
///   Source  matrix determinant lemma and Woodbury's identity; docs/equations/order_tracking.md
/// z is taken for the truth plus an error of P. The filter's own prior draws it towards 0 where nothing is known, and
/// the P of there is so wide that what is lacking does not matter.
/// Where two rotors turn too alike, P tells so: (3) is then large for both, and neither is likely. The sense of
/// rotation counts: a vibration that turns clockwise is no rotor's that turns the other way.
/// Cost: (4N)³ flops once for all hypotheses; no heap.
template <class Scalar, std::size_t N>
class RotorHypotheses {
  static constexpr auto kSize = static_cast<int>(4 * N);

 public:
  struct Verdict {
    std::array<Scalar, N> log_likelihood_ratio{};  ///< (3), against H₀
    std::array<Scalar, N> log_odds{};              ///< of Hᵢ against all the others and H₀
    Scalar log_odds_faulty = 0;                    ///< of any Hᵢ against H₀
  };

  /// Rotors in `known` are known to be out of balance already and explain what they can under every hypothesis;
  /// their own log_odds are 0. Empty where the covariance is not positive definite.
  template <class Tracker>
  [[nodiscard]] static std::optional<Verdict> test(const Tracker& tracker,
                                                   const UnbalancePrior<Scalar, N>& prior,
                                                   const std::array<bool, N>& known,
                                                   Scalar smallest_m_s2) noexcept {
    BoundedMatrix<Scalar, kSize> C = BoundedMatrix<Scalar, kSize>::Zero(kSize, kSize);
    for (std::size_t i = 0; i < 2 * N; ++i) {
      for (std::size_t j = 0; j < 2 * N; ++j) {
        const auto row = static_cast<int>(i);
        const auto column = static_cast<int>(j);
        C(row, column) = C(kSize / 2 + row, kSize / 2 + column) = tracker.covariance_m2_s4(i, j);
      }
    }
    std::array<Belief, N> belief;
    Eigen::Matrix<Scalar, kSize, 1> z = amplitudes(tracker);
    for (std::size_t k = 0; k < N; ++k) {
      belief[k] = belief_of(tracker.turning_m_s2(k, prior.spin[k]), prior, k, smallest_m_s2);
      Block D = belief[k].usual;
      if (known[k]) D += belief[k].growth;
      for (int a = 0; a < 4; ++a) {
        z(place(k, a)) -= belief[k].mean(a);
        for (int b = 0; b < 4; ++b) C(place(k, a), place(k, b)) += D(a, b);
      }
    }
    BoundedMatrix<Scalar, kSize> W;
    if (!invert_positive_definite(C, W)) return std::nullopt;
    const Eigen::Matrix<Scalar, kSize, 1> w = W * z;
    Verdict verdict;
    for (std::size_t k = 0; k < N; ++k) {
      if (known[k]) continue;
      Block W_i;
      Column w_i;
      for (int a = 0; a < 4; ++a) {
        w_i(a) = w(place(k, a));
        for (int b = 0; b < 4; ++b) W_i(a, b) = W(place(k, a), place(k, b));
      }
      verdict.log_likelihood_ratio[k] = log_ratio(belief[k].growth, W_i, w_i);
    }
    weigh(known, log(prior.fault_probability), verdict);
    return verdict;
  }

 private:
  using Block = Eigen::Matrix<Scalar, 4, 4>;
  using Column = Eigen::Matrix<Scalar, 4, 1>;

  /// Where Re X, Im X, Re Y, Im Y of a rotor stand in z.
  static constexpr int place(std::size_t rotor, int part) noexcept {
    const int first = 2 * static_cast<int>(rotor);
    return part < 2 ? first + part : kSize / 2 + first + part - 2;
  }

  template <class Tracker>
  [[nodiscard]] static Eigen::Matrix<Scalar, kSize, 1> amplitudes(const Tracker& tracker) noexcept {
    Eigen::Matrix<Scalar, kSize, 1> z;
    for (std::size_t k = 0; k < N; ++k) {
      const auto x = tracker.x_m_s2(k);
      const auto y = tracker.y_m_s2(k);
      z(place(k, 0)) = x.re;
      z(place(k, 1)) = x.im;
      z(place(k, 2)) = y.re;
      z(place(k, 3)) = y.im;
    }
    return z;
  }

  /// Of one rotor's (Re X, Im X, Re Y, Im Y).
  struct Belief {
    Column mean = Column::Zero();
    Block usual = Block::Zero();   ///< D under H₀
    Block growth = Block::Zero();  ///< Δ
  };

  /// What A₊ (or A₋, with the opposite spin) = 1·direction makes of X and Y.
  [[nodiscard]] static Column seen_of(Phasor<Scalar> direction, int spin) noexcept {
    const auto s = static_cast<Scalar>(spin);
    return Column{direction.re, direction.im, s * direction.im, -s * direction.re};
  }

  /// Variances of A₊ along `direction` and across it, and of either part of A₋.
  [[nodiscard]] static Block spread(Phasor<Scalar> direction, int spin, Scalar along, Scalar across,
                                    Scalar against) noexcept {
    const Column u = seen_of(direction, spin);
    const Column v = seen_of({-direction.im, direction.re}, spin);
    const Column a = seen_of({1, 0}, -spin);
    const Column b = seen_of({0, 1}, -spin);
    return along * (u * u.transpose()) + across * (v * v.transpose()) +
           against * (a * a.transpose() + b * b.transpose());
  }

  [[nodiscard]] static Belief belief_of(Phasor<Scalar> seen, const UnbalancePrior<Scalar, N>& prior,
                                        std::size_t k, Scalar smallest_m_s2) noexcept {
    const Scalar half = static_cast<Scalar>(0.5);
    const Scalar usual = prior.amplitude_m_s2[k];
    const Scalar usual2 = half * usual * usual;
    const Scalar rho2 = prior.against_ratio * prior.against_ratio;
    const Scalar size = seen.magnitude();
    const Phasor<Scalar> u = size > Scalar{0} ? Scalar{1} / size * seen : Phasor<Scalar>{1, 0};
    Belief belief;
    if (!prior.is_calibrated) {
      const Scalar faulty = std::max(size, smallest_m_s2);
      const Scalar more2 = half * faulty * faulty;
      belief.usual = spread(u, prior.spin[k], usual2, usual2, rho2 * usual2);  // (4)
      belief.growth = spread(u, prior.spin[k], more2, more2, rho2 * more2);
      return belief;
    }
    const Scalar sigma2 = prior.sigma_m_s2[k] * prior.sigma_m_s2[k];
    const Scalar growth = std::max(std::abs(size - usual), smallest_m_s2);
    belief.mean = usual * seen_of(u, prior.spin[k]);  // (5)
    belief.usual = spread(u, prior.spin[k], sigma2, usual2 + sigma2, rho2 * (usual2 + sigma2));
    belief.growth = spread(u, prior.spin[k], growth * growth, Scalar{0}, half * rho2 * growth * growth);
    return belief;
  }

  /// (3) by Gaussian elimination of (I + Δ·W)·q = Δ·w.
  [[nodiscard]] static Scalar log_ratio(const Block& Delta, const Block& W, const Column& w) noexcept {
    Block M = Block::Identity() + Delta * W;
    Column q = Delta * w;
    Scalar log_determinant = 0;
    for (int p = 0; p < 4; ++p) {
      int pivot = p;
      for (int row = p + 1; row < 4; ++row) {
        if (std::abs(M(row, p)) > std::abs(M(pivot, p))) pivot = row;
      }
      if (pivot != p) {
        M.row(p).swap(M.row(pivot));
        std::swap(q(p), q(pivot));
      }
      log_determinant += log(std::abs(M(p, p)));
      for (int row = p + 1; row < 4; ++row) {
        const Scalar factor = M(row, p) / M(p, p);
        for (int column = p; column < 4; ++column) M(row, column) -= factor * M(p, column);
        q(row) -= factor * q(p);
      }
    }
    Scalar quadratic = 0;
    for (int p = 3; p >= 0; --p) {
      for (int column = p + 1; column < 4; ++column) q(p) -= M(p, column) * q(column);
      q(p) /= M(p, p);
      quadratic += w(p) * q(p);
    }
    return static_cast<Scalar>(0.5) * (quadratic - log_determinant);
  }

  static void weigh(const std::array<bool, N>& known, Scalar log_prior, Verdict& verdict) noexcept {
    // ln Σ e^l over H₀ and all Hⱼ but `left_out`, without overflow; the empty sum is never asked for.
    const auto log_sum = [&](std::size_t left_out, bool with_healthy) {
      Scalar most = with_healthy ? Scalar{0} : -std::numeric_limits<Scalar>::max();
      for (std::size_t j = 0; j < N; ++j) {
        if (j != left_out && !known[j]) most = std::max(most, log_prior + verdict.log_likelihood_ratio[j]);
      }
      Scalar sum = with_healthy ? airworthy::exp(-most) : Scalar{0};
      for (std::size_t j = 0; j < N; ++j) {
        if (j != left_out && !known[j])
          sum += airworthy::exp(log_prior + verdict.log_likelihood_ratio[j] - most);
      }
      return sum > Scalar{0} ? most + log(sum) : most;
    };
    for (std::size_t i = 0; i < N; ++i) {
      if (!known[i]) verdict.log_odds[i] = log_prior + verdict.log_likelihood_ratio[i] - log_sum(i, true);
    }
    verdict.log_odds_faulty = log_sum(N, false);
  }
};

}  // namespace airworthy
