#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <vector>

namespace airworthy::test {

/// Equations (1) to (6) of order_tracker.h as a textbook would write them: one Kalman filter for both axes with all
/// 4·N states, dense matrices of run-time size, Joseph's form, the library's complex numbers.
class DenseOrderFilter {
 public:
  using Complex = std::complex<double>;

  struct Params {
    double reference_speed_rad_s;
    double smallest_m_s2;
    double speed_noise_ratio;
    double low_pass_Hz;
  };

  DenseOrderFilter(Eigen::Index rotors, const Params& params)
      : n_{rotors},
        params_{params},
        x(Eigen::VectorXd::Zero(4 * rotors)),
        P(Eigen::MatrixXd::Identity(4 * rotors, 4 * rotors)),
        phase_(Eigen::VectorXd::Zero(rotors)),
        last_speed_(Eigen::VectorXd::Zero(rotors)) {
    P *= prior();
  }

  /// `speed` at the middle of the sample's average, `spacing_s` of the reports around it.
  void step(double dt_s, const Eigen::Vector2d& accel, double window_s, const Eigen::VectorXd& speed_rad_s,
            const Eigen::VectorXd& spacing_s) {
    if (!started_) {
      input_ = accel;
      first_.setZero();
      second_.setZero();
      last_speed_ = speed_rad_s;
      started_ = true;
      return;
    }
    const double corner = std::min(params_.reference_speed_rad_s / 6.0, 75.0);
    const double alpha = 1.0 / (1.0 + corner * dt_s);
    const Eigen::Vector2d first = alpha * (first_ + accel - input_);
    second_ = alpha * (second_ + first - first_);
    first_ = first;
    input_ = accel;

    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(2, 4 * n_);
    for (Eigen::Index i = 0; i < n_; ++i) {
      phase_(i) += 0.5 * (speed_rad_s(i) + last_speed_(i)) * dt_s;
      walk(i, dt_s, speed_rad_s(i), spacing_s(i));
      const double ratio = speed_rad_s(i) / params_.reference_speed_rad_s;
      const Complex seen =
          ratio * ratio * gain(speed_rad_s(i), alpha, dt_s, window_s) * std::polar(1.0, phase_(i));
      H(0, 4 * i) = H(1, 4 * i + 2) = seen.real();
      H(0, 4 * i + 1) = H(1, 4 * i + 3) = -seen.imag();
    }
    last_speed_ = speed_rad_s;
    update(H, dt_s);
  }

  /// Complex amplitude of a rotor along an axis (0 x, 1 y).
  [[nodiscard]] Complex amplitude(Eigen::Index rotor, Eigen::Index axis) const {
    return {x(4 * rotor + 2 * axis), x(4 * rotor + 2 * axis + 1)};
  }
  [[nodiscard]] double noise_variance() const { return R_; }

 private:
  [[nodiscard]] double prior() const { return std::pow(40.0 * params_.smallest_m_s2, 2); }

  void walk(Eigen::Index i, double dt_s, double speed_rad_s, double spacing_s) {
    const double q_phase = 0.01 + std::pow(params_.speed_noise_ratio * speed_rad_s, 2) * spacing_s;
    const auto moment = [&](Eigen::Index a) {
      return x.segment(a, 2).squaredNorm() + P(a, a) + P(a + 1, a + 1);
    };
    const double mean = 0.5 * (moment(4 * i) + moment(4 * i + 2));
    const double q = dt_s * (std::pow(0.3 * params_.smallest_m_s2, 2) + 0.5 * q_phase * mean);
    for (Eigen::Index k = 4 * i; k < 4 * i + 4; ++k) {
      P(k, k) = std::max(P(k, k), std::min(P(k, k) + q, prior()));
    }
  }

  [[nodiscard]] Complex gain(double speed_rad_s, double alpha, double dt_s, double window_s) const {
    const Complex back = std::polar(1.0, -speed_rad_s * dt_s);
    Complex result = std::pow(alpha * (1.0 - back) / (1.0 - alpha * back), 2);
    if (params_.low_pass_Hz > 0.0) {
      const double ratio = speed_rad_s / (2.0 * M_PI * params_.low_pass_Hz);
      result /= Complex{1.0 - ratio * ratio, std::sqrt(2.0) * ratio};
    }
    const double half = 0.5 * speed_rad_s * window_s;
    return half > 0.0 ? std::sin(half) / half * result : result;
  }

  void update(const Eigen::MatrixXd& H, double dt_s) {
    const Eigen::Vector2d nu = second_ - H * x;
    const double power = 0.5 * nu.squaredNorm();
    if (R_ <= 0.0) R_ = std::max(power, params_.smallest_m_s2 * params_.smallest_m_s2);
    const Eigen::Matrix2d R = R_ * Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d S = H * P * H.transpose() + R;
    const Eigen::MatrixXd K = P * H.transpose() * S.inverse();
    const double most = 4.0 * std::sqrt(S(0, 0));
    x += K * nu.cwiseMax(-most).cwiseMin(most);
    const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(4 * n_, 4 * n_) - K * H;
    P = rest * P * rest.transpose() + K * R * K.transpose();
    const double observed = std::min(std::max(R_ / S(0, 0), 0.1) * power, 10.0 * R_);
    R_ += dt_s / (1.0 + dt_s) * (observed - R_);
    R_ = std::max(R_, std::pow(0.01 * params_.smallest_m_s2, 2));
  }

  Eigen::Index n_;
  Params params_;

 public:
  Eigen::VectorXd x;  ///< Re X, Im X, Re Y, Im Y of each rotor
  Eigen::MatrixXd P;

 private:
  bool started_ = false;
  double R_ = 0.0;
  Eigen::Vector2d input_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d first_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d second_ = Eigen::Vector2d::Zero();
  Eigen::VectorXd phase_;
  Eigen::VectorXd last_speed_;
};

}  // namespace airworthy::test
