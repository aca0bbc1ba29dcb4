#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <vector>

#include "tests/support/reference/dense_power_filter.h"

namespace airworthy::test {

/// The signal-power filter in bands that follow the rotors, as a textbook writes it: complex numbers, matrices of
/// run-time size, one joint update with the full innovation covariance. For comparison only.
class DenseRotorBands : public DensePowerFilter {
 public:
  struct Params {
    double reference_m = 0.0;  ///< U₀/m
    std::vector<double> spin;
    double speed_error = 0.02;
    double correlation_s = 0.3;
    double sigma = 0.8;
    double walk = 0.2 * 0.2 / 60.0;  ///< per second
    double memory_s = 60.0;
  };

  explicit DenseRotorBands(const Params& params)
      : DensePowerFilter{static_cast<Eigen::Index>(params.spin.size()) + 1},
        params_{params},
        n_{x.size() - 1},
        information{Eigen::MatrixXd::Zero(n_ + 1, n_ + 1)},
        explained{Eigen::VectorXd::Zero(n_ + 1)},
        y_{Eigen::VectorXcd::Zero(n_)},
        phase_{Eigen::VectorXd::Zero(n_)},
        correlation_{Eigen::MatrixXcd::Zero(n_, n_)},
        gain_{Eigen::MatrixXd::Zero(n_, n_)},
        noise_{Eigen::VectorXd::Zero(n_)} {
    p.diagonal().setConstant(params.sigma * params.sigma);
  }

  void update(double time_s, double ax_m_s2, double ay_m_s2, const Eigen::VectorXd& given_rad_s) {
    if (pass(time_s, {ax_m_s2, ay_m_s2})) step(dt_s(), given_rad_s, has_settled());
  }

  [[nodiscard]] Eigen::VectorXd powers() const { return information.fullPivLu().solve(explained).head(n_); }

 private:
  using Complex = std::complex<double>;
  Params params_;
  Eigen::Index n_;

 public:
  Eigen::MatrixXd information;
  Eigen::VectorXd explained;
  double scale = 1.0;

 private:
  void step(double dt, const Eigen::VectorXd& given_rad_s, bool fuses) {
    const Eigen::VectorXd speed = scale * given_rad_s;
    const Eigen::VectorXcd before = y_;
    Eigen::VectorXd z(n_);
    Eigen::VectorXd felt(n_);
    Eigen::MatrixXd expected(n_, n_);
    for (Eigen::Index i = 0; i < n_; ++i) {
      const double kappa = 1.0 - std::exp(-params_.speed_error * speed(i) * dt);
      const double own = params_.spin[static_cast<std::size_t>(i)] * speed(i);
      phase_(i) += own * dt;
      y_(i) += kappa * (Complex{passed().x(), passed().y()} * std::polar(1.0, -phase_(i)) - y_(i));
      noise_(i) = std::pow(1.0 - kappa, 2) * noise_(i) + 2.0 * kappa * kappa;
      z(i) = std::norm(y_(i));
      felt(i) = std::imag(std::conj(before(i)) * y_(i));
      for (Eigen::Index j = 0; j < n_; ++j) {
        const double other = params_.spin[static_cast<std::size_t>(j)] * speed(j);
        const double amplitude = params_.reference_m * speed(j) * speed(j);
        const Complex turned =
            correlation_(i, j) * std::exp(Complex{-params_.speed_error * speed(j), other - own} * dt);
        gain_(i, j) = std::pow(1.0 - kappa, 2) * gain_(i, j) +
                      2.0 * kappa * (1.0 - kappa) * amplitude * turned.real() +
                      std::pow(kappa * amplitude, 2);
        correlation_(i, j) = (1.0 - kappa) * turned + kappa * amplitude;
        expected(i, j) = kappa * amplitude * turned.imag();
      }
    }
    if (fuses) fuse(dt, z, felt, expected, speed);
  }

  void fuse(double dt, const Eigen::VectorXd& z, const Eigen::VectorXd& felt, const Eigen::MatrixXd& expected,
            const Eigen::VectorXd& speed) {
    const Eigen::VectorXd square = (2.0 * x.array()).exp();
    Eigen::MatrixXd g(n_, n_ + 1);  // ∂h/∂s
    g << gain_, noise_;
    const Eigen::VectorXd h = g * square;
    const Eigen::MatrixXd jacobian = 2.0 * g * square.asDiagonal();
    const Eigen::VectorXd r = h.array().square() * params_.correlation_s / dt;
    p += params_.walk * dt * Eigen::MatrixXd::Identity(n_ + 1, n_ + 1);
    const Eigen::MatrixXd s = jacobian * p * jacobian.transpose() + Eigen::MatrixXd{r.asDiagonal()};
    const Eigen::MatrixXd k = p * jacobian.transpose() * s.inverse();
    nis = (z - h).dot(s.inverse() * (z - h)) / static_cast<double>(n_);
    correct(k, jacobian, z - h);

    felt_ += dt / (dt + 0.5) * (z.sum() - felt_);
    modelled_ += dt / (dt + 0.5) * (h.sum() - modelled_);
    const double misfit = std::max(1.0, felt_ / modelled_);
    const double keep = 1.0 / (1.0 + dt / params_.memory_s);
    const Eigen::MatrixXd weight = (misfit * misfit * r).cwiseInverse().asDiagonal();
    information = keep * information + g.transpose() * weight * g;
    explained = keep * explained + g.transpose() * weight * z;

    double turned = 0.0;
    for (Eigen::Index i = 0; i < n_; ++i) {
      turned += (felt(i) - expected.row(i).dot(square.head(n_))) /
                (params_.spin[static_cast<std::size_t>(i)] * speed(i) * dt);
    }
    scale += 2.0 * dt / 5.0 * turned / (z.sum() + (gain_ * square.head(n_)).sum());
    if (std::abs(scale - learned_with_) > params_.speed_error) {
      learned_with_ = scale;
      information.setZero();
      explained.setZero();
    }
  }

  Eigen::VectorXcd y_;
  Eigen::VectorXd phase_;
  Eigen::MatrixXcd correlation_;
  Eigen::MatrixXd gain_;
  Eigen::VectorXd noise_;
  double felt_ = 0.0;
  double modelled_ = 0.0;
  double learned_with_ = 1.0;
};

}  // namespace airworthy::test
