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
  std::array<int, N> spin{};                        ///< +1 clockwise seen from above
  std::array<Scalar, N> amplitude_m_s2{};           ///< usual |A₊|, rms
  Scalar against_ratio = static_cast<Scalar>(0.3);  ///< |A₋|/|A₊| of an airframe softer in one direction
  Scalar fault_probability = static_cast<Scalar>(1e-4);  ///< of each rotor being out of balance
};

/// How likely it is that one certain rotor is out of balance and the others are as usual.
///   H₀  z ~ N(0, C),  C = D(b) + P⊕P,  z = (X, Y) of the order tracker, P its covariance               (1)
///   Hᵢ  as H₀, but rotor i has the amplitude a, a² = bᵢ² + max(|Âᵢ|, smallest)², instead of bᵢ: C + Eᵢ·Δ·Eᵢᵀ,
///       Δ = D(a) − D(bᵢ)                                                                               (2)
///   ln p(z|Hᵢ)/p(z|H₀) = ½·rᵢᵀ·(Δ⁻¹ + Wᵢᵢ)⁻¹·rᵢ − ½·ln det(I + Δ·Wᵢᵢ),  W = C⁻¹,  r = W·z              (3)
///   Prior   D(a) of one rotor: A₊ ~ N(0, a²), A₋ ~ N(0, (ρ·a)²), complex, independent; X = A₊ + A₋,
///           Y = −j·s·(A₊ − A₋)                                                                        (4)
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
    std::array<Scalar, N> usual2{};
    std::array<Scalar, N> faulty2{};
    for (std::size_t k = 0; k < N; ++k) {
      const Scalar seen2 = tracker.turning_m_s2(k, prior.spin[k]).squared();
      const Scalar usual = prior.amplitude_m_s2[k];
      faulty2[k] = usual * usual + std::max(seen2, smallest_m_s2 * smallest_m_s2);
      usual2[k] = known[k] ? faulty2[k] : usual * usual;
    }
    for (std::size_t i = 0; i < 2 * N; ++i) {
      for (std::size_t j = 0; j < 2 * N; ++j) {
        const auto row = static_cast<int>(i);
        const auto column = static_cast<int>(j);
        C(row, column) = C(kSize / 2 + row, kSize / 2 + column) = tracker.covariance_m2_s4(i, j);
      }
    }
    for (std::size_t k = 0; k < N; ++k) {
      const Block D = usual2[k] * unit_prior(prior.spin[k], prior.against_ratio);
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) C(place(k, a), place(k, b)) += D(a, b);
      }
    }
    BoundedMatrix<Scalar, kSize> W;
    if (!invert_positive_definite(C, W)) return std::nullopt;
    const Eigen::Matrix<Scalar, kSize, 1> r = W * amplitudes(tracker);
    Verdict verdict;
    for (std::size_t k = 0; k < N; ++k) {
      if (known[k]) continue;
      Block W_i;
      Column r_i;
      for (int a = 0; a < 4; ++a) {
        r_i(a) = r(place(k, a));
        for (int b = 0; b < 4; ++b) W_i(a, b) = W(place(k, a), place(k, b));
      }
      const Block Delta = (faulty2[k] - usual2[k]) * unit_prior(prior.spin[k], prior.against_ratio);
      verdict.log_likelihood_ratio[k] = log_ratio(Delta, W_i, r_i);
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

  /// (4) for a = 1; half of a complex variance lies in each part.
  [[nodiscard]] static Block unit_prior(int spin, Scalar against_ratio) noexcept {
    const Scalar half = static_cast<Scalar>(0.5);
    const Scalar against2 = against_ratio * against_ratio;
    const Scalar own = half * (Scalar{1} + against2);
    const Scalar cross = half * (Scalar{1} - against2) * static_cast<Scalar>(spin);
    Block D = own * Block::Identity();
    D(0, 3) = D(3, 0) = -cross;
    D(1, 2) = D(2, 1) = cross;
    return D;
  }

  /// (3) by Gaussian elimination of (I + Δ·W)·q = Δ·r.
  [[nodiscard]] static Scalar log_ratio(const Block& Delta, const Block& W, const Column& r) noexcept {
    Block M = Block::Identity() + Delta * W;
    Column q = Delta * r;
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
      quadratic += r(p) * q(p);
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
