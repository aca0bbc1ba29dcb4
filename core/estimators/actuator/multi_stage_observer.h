#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "core/estimators/update_status.h"
#include "core/math/triangular.h"

namespace airworthy {

/// State of a vehicle and loss of each of its actuators at once, in stages: a filter that knows of no fault, one stage
/// for each actuator's fault, and the coupling V between them.
///   Model       x' = A·x + B·u − B·U·γ + g + w,  γ' = γ + w_γ,  y = C·x + v,  U = diag(u);
///               w ~ N(0, Q), w_γ ~ N(0, diag(q)), v ~ N(0, R), independent                            (1)
///   Prediction  W = A·V − B·U;  x̂ ← A·x̂ + B·(u − U·γ̂) + g;  P̃ ← A·P̃·Aᵀ + Q;  V ← W                     (2)
///   Fault j     for each j with qⱼ > 0:  c = qⱼ/(1 + qⱼ·Yⱼⱼ), v = column j of V, z = column j of Y:
///               P̃ ← P̃ + c·v·vᵀ;  V ← V − c·v·zᵀ;  Y ← Y − c·z·zᵀ;  P_γⱼⱼ ← P_γⱼⱼ + qⱼ                     (3)
///   Innovation  e = y − C·x̂;  H = C·V;  S̃ = C·P̃·Cᵀ + R = L·Lᵀ;  S = S̃ + H·P_γ·Hᵀ                         (4)
///   Whitened    M = P̃·Cᵀ·L⁻ᵀ;  H̄ = L⁻¹·H;  ē = L⁻¹·e                                                  (5)
///   Correction  P̃ ← P̃ − M·Mᵀ;  V ← V − M·H̄;  Y ← Y + H̄ᵀ·H̄;  P_γ = Y⁻¹;
///               δ = P_γ·H̄ᵀ·ē;  γ̂ ← γ̂ + δ;  x̂ ← x̂ + M·ē + V·δ;  eᵀ·S⁻¹·e = ēᵀ·(ē − H̄·δ)                 (6)
///   Covariance  P_x = P̃ + V·P_γ·Vᵀ;  cov(x, γ) = V·P_γ                                                 (7)
///   Source      the equations W, V⁻, H, V, x̂, P of multi-stage joint fault observers as they are usually printed;
///               derived, made exact for qⱼ > 0 and cast into (2) to (7) in docs/equations/actuator.md
///   Symbols     γⱼ: lost part of actuator j, 0 healthy, 1 dead; Y = P_γ⁻¹ → information; P̃ → head; V → coupling
///   Deviations  x̂ itself is kept instead of the fault-free x̃ = x̂ − V·γ̂; the noise of γ enters one actuator at a
///               time, (3), which needs no inverse of P_γ
///   Errata      docs/equations/actuator.md#errata: as printed it is exact for q = 0 alone
///   Valid for   P̃ and R positive definite. Equal to the Kalman filter of the augmented state [x; γ] but for rounding.
///               Cost: table in docs/equations/actuator.md, counted; no heap. Plain loops: the same bits everywhere
template <class Scalar, int kStates, int kInputs, int kOutputs>
class MultiStageObserver {
 public:
  using StateVector = Eigen::Matrix<Scalar, kStates, 1>;
  using StateMatrix = Eigen::Matrix<Scalar, kStates, kStates>;
  using InputVector = Eigen::Matrix<Scalar, kInputs, 1>;
  using InputMatrix = Eigen::Matrix<Scalar, kStates, kInputs>;
  using FaultMatrix = Eigen::Matrix<Scalar, kInputs, kInputs>;
  using OutputVector = Eigen::Matrix<Scalar, kOutputs, 1>;
  using OutputMatrix = Eigen::Matrix<Scalar, kOutputs, kStates>;
  using OutputCovariance = Eigen::Matrix<Scalar, kOutputs, kOutputs>;

  struct Prior {
    StateVector state = StateVector::Zero();
    StateMatrix state_covariance = StateMatrix::Identity();
    InputVector fault = InputVector::Zero();
    InputVector fault_variance = InputVector::Ones();  ///< > 0; faults and state independent
  };
  /// From one moment to the next.
  struct Transition {
    StateMatrix a = StateMatrix::Identity();
    InputMatrix b = InputMatrix::Zero();
    InputVector u = InputVector::Zero();
    StateVector known = StateVector::Zero();                 ///< g: what moves the state without an actuator
    StateMatrix noise = StateMatrix::Zero();                 ///< Q
    InputVector fault_noise_variance = InputVector::Zero();  ///< q
  };
  struct Measurement {
    OutputMatrix c = OutputMatrix::Zero();
    OutputVector y = OutputVector::Zero();
    OutputCovariance noise = OutputCovariance::Identity();  ///< R
  };
  struct Innovation {
    OutputVector innovation = OutputVector::Zero();              ///< e
    OutputCovariance covariance = OutputCovariance::Identity();  ///< S
    Scalar nis{0};                                               ///< eᵀ·S⁻¹·e
  };

  explicit MultiStageObserver(const Prior& prior) noexcept
      : now_{.state = prior.state, .head = prior.state_covariance, .fault = prior.fault} {
    for (int j = 0; j < kInputs; ++j) {
      now_.fault_covariance(j, j) = prior.fault_variance(j);
      now_.information(j, j) = Scalar{1} / prior.fault_variance(j);
    }
  }

  /// Carries the estimate on. kNotFinite: nothing happened.
  UpdateStatus predict(const Transition& model) noexcept {
    Estimate next = now_;
    propagate(model, next);
    for (int j = 0; j < kInputs; ++j) {
      if (model.fault_noise_variance(j) > Scalar{0}) widen(j, model.fault_noise_variance(j), next);
    }
    return accept(next);
  }

  /// Fuses what was measured. kNotFinite: nothing happened, `innovation` is meaningless.
  UpdateStatus correct(const Measurement& measurement, Innovation& innovation) noexcept {
    Estimate next = now_;
    if (!fuse(measurement, next, innovation)) return refuse();
    return accept(next);
  }

  /// Both, or neither.
  UpdateStatus step(const Transition& model, const Measurement& measurement,
                    Innovation& innovation) noexcept {
    const Estimate before = now_;
    UpdateStatus status = predict(model);
    if (status == UpdateStatus::kFused) status = correct(measurement, innovation);
    if (status != UpdateStatus::kFused) now_ = before;
    return status;
  }

  [[nodiscard]] const StateVector& state() const noexcept { return now_.state; }
  [[nodiscard]] const InputVector& fault() const noexcept { return now_.fault; }
  [[nodiscard]] const FaultMatrix& fault_covariance() const noexcept { return now_.fault_covariance; }
  [[nodiscard]] const FaultMatrix& fault_information() const noexcept { return now_.information; }
  [[nodiscard]] StateMatrix state_covariance() const noexcept {  // (7)
    return now_.head + now_.coupling * now_.fault_covariance * now_.coupling.transpose();
  }
  [[nodiscard]] InputMatrix cross_covariance() const noexcept {
    return now_.coupling * now_.fault_covariance;
  }
  [[nodiscard]] std::int64_t refused() const noexcept { return refused_; }

 private:
  struct Estimate {
    StateVector state;
    StateMatrix head;
    InputVector fault;
    InputMatrix coupling = InputMatrix::Zero();
    FaultMatrix information = FaultMatrix::Zero();
    FaultMatrix fault_covariance = FaultMatrix::Zero();
  };

  static void propagate(const Transition& model, Estimate& to) noexcept {  // (2)
    InputVector working;
    for (int j = 0; j < kInputs; ++j) working(j) = model.u(j) - model.u(j) * to.fault(j);
    const Estimate from = to;
    StateMatrix ap;
    for (int i = 0; i < kStates; ++i) {
      to.state(i) = model.known(i) + row_times(model.a, i, from.state, 0) + row_times(model.b, i, working, 0);
      for (int j = 0; j < kStates; ++j) ap(i, j) = row_times(model.a, i, from.head, j);
      for (int j = 0; j < kInputs; ++j) {
        to.coupling(i, j) = row_times(model.a, i, from.coupling, j) - model.b(i, j) * model.u(j);
      }
    }
    for (int i = 0; i < kStates; ++i) {
      for (int j = 0; j <= i; ++j) {
        Scalar sum = model.noise(i, j);
        for (int k = 0; k < kStates; ++k) sum += ap(i, k) * model.a(j, k);
        to.head(i, j) = to.head(j, i) = sum;
      }
    }
  }

  static void widen(int fault, Scalar variance, Estimate& to) noexcept {  // (3)
    const StateVector v = to.coupling.col(fault);
    const InputVector z = to.information.col(fault);
    const Scalar c = variance / (Scalar{1} + variance * z(fault));
    for (int i = 0; i < kStates; ++i) {
      const Scalar cv = c * v(i);
      for (int j = 0; j <= i; ++j) to.head(i, j) = to.head(j, i) = to.head(i, j) + cv * v(j);
      for (int j = 0; j < kInputs; ++j) to.coupling(i, j) -= cv * z(j);
    }
    for (int i = 0; i < kInputs; ++i) {
      const Scalar cz = c * z(i);
      for (int j = 0; j <= i; ++j) {
        to.information(i, j) = to.information(j, i) = to.information(i, j) - cz * z(j);
      }
    }
    to.fault_covariance(fault, fault) += variance;
  }

  static bool fuse(const Measurement& measurement, Estimate& to, Innovation& innovation) noexcept {
    const OutputMatrix& c = measurement.c;
    Eigen::Matrix<Scalar, kOutputs, kStates> m;  // Mᵀ; at first C·P̃
    Eigen::Matrix<Scalar, kOutputs, kInputs> h;
    OutputCovariance s;
    for (int i = 0; i < kOutputs; ++i) {  // (4)
      for (int j = 0; j < kStates; ++j) m(i, j) = row_times(c, i, to.head, j);
      for (int j = 0; j < kInputs; ++j) h(i, j) = row_times(c, i, to.coupling, j);
      for (int j = 0; j <= i; ++j) {
        Scalar sum = measurement.noise(i, j);
        for (int k = 0; k < kStates; ++k) sum += m(i, k) * c(j, k);
        s(i, j) = sum;
      }
      innovation.innovation(i) = measurement.y(i) - row_times(c, i, to.state, 0);
    }
    set_covariance(s, h, to.fault_covariance, innovation.covariance);
    OutputCovariance l;
    if (!factor_cholesky(s, l)) return false;
    OutputVector e = innovation.innovation;
    solve_lower(l, m);  // (5)
    solve_lower(l, h);
    solve_lower(l, e);
    return update(m, h, e, to, innovation.nis);
  }

  static void set_covariance(const OutputCovariance& s, const Eigen::Matrix<Scalar, kOutputs, kInputs>& h,
                             const FaultMatrix& fault_covariance, OutputCovariance& whole) noexcept {
    for (int i = 0; i < kOutputs; ++i) {
      InputVector hp;
      for (int j = 0; j < kInputs; ++j) hp(j) = row_times(h, i, fault_covariance, j);
      for (int j = 0; j <= i; ++j) whole(i, j) = whole(j, i) = s(i, j) + row_times(h, j, hp, 0);
    }
  }

  static bool update(const Eigen::Matrix<Scalar, kOutputs, kStates>& m,
                     const Eigen::Matrix<Scalar, kOutputs, kInputs>& h, const OutputVector& e, Estimate& to,
                     Scalar& nis) noexcept {  // (6)
    for (int i = 0; i < kInputs; ++i) {
      for (int j = 0; j <= i; ++j) {
        to.information(i, j) = to.information(j, i) = to.information(i, j) + columns_product(h, i, h, j);
      }
    }
    FaultMatrix l;
    if (!factor_cholesky(to.information, l)) return false;
    invert_from_factor(l, to.fault_covariance);
    InputVector he;
    for (int j = 0; j < kInputs; ++j) he(j) = columns_product(h, j, e, 0);
    InputVector change;
    for (int j = 0; j < kInputs; ++j) {
      change(j) = row_times(to.fault_covariance, j, he, 0);
      to.fault(j) += change(j);
    }
    for (int i = 0; i < kStates; ++i) {
      for (int j = 0; j <= i; ++j) {
        to.head(i, j) = to.head(j, i) = to.head(i, j) - columns_product(m, i, m, j);
      }
      for (int j = 0; j < kInputs; ++j) to.coupling(i, j) -= columns_product(m, i, h, j);
      to.state(i) += columns_product(m, i, e, 0) + row_times(to.coupling, i, change, 0);
    }
    nis = Scalar{0};
    for (int i = 0; i < kOutputs; ++i) nis += e(i) * (e(i) - row_times(h, i, change, 0));
    return true;
  }

  // Σₖ a(i, k)·b(k, j)
  template <class A, class B>
  static Scalar row_times(const A& a, int i, const B& b, int j) noexcept {
    Scalar sum = a(i, 0) * b(0, j);
    for (int k = 1; k < static_cast<int>(A::ColsAtCompileTime); ++k) sum += a(i, k) * b(k, j);
    return sum;
  }
  // Σₖ a(k, i)·b(k, j)
  template <class A, class B>
  static Scalar columns_product(const A& a, int i, const B& b, int j) noexcept {
    Scalar sum = a(0, i) * b(0, j);
    for (int k = 1; k < static_cast<int>(A::RowsAtCompileTime); ++k) sum += a(k, i) * b(k, j);
    return sum;
  }

  UpdateStatus refuse() noexcept {
    ++refused_;
    return UpdateStatus::kNotFinite;
  }

  UpdateStatus accept(const Estimate& next) noexcept {
    using std::isfinite;
    for (int i = 0; i < kStates; ++i) {
      if (!isfinite(next.state(i)) || !isfinite(next.head(i, i))) return refuse();
      for (int j = 0; j < kInputs; ++j) {
        if (!isfinite(next.coupling(i, j))) return refuse();
      }
    }
    for (int j = 0; j < kInputs; ++j) {
      if (!isfinite(next.fault(j)) || !isfinite(next.fault_covariance(j, j)) ||
          !isfinite(next.information(j, j)))
        return refuse();
    }
    now_ = next;
    return UpdateStatus::kFused;
  }

  Estimate now_;
  std::int64_t refused_ = 0;
};

}  // namespace airworthy
