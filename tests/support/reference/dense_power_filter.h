#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

namespace airworthy::test {

/// What the references of the signal-power filters share: the high-pass of both axes at 1 Hz that must have settled,
/// and the correction of a Kalman filter as a textbook writes it, every product in full.
class DensePowerFilter {
 public:
  Eigen::VectorXd x;
  Eigen::MatrixXd p;
  double nis = 0.0;

 protected:
  explicit DensePowerFilter(Eigen::Index states)
      : x{Eigen::VectorXd::Zero(states)}, p{Eigen::MatrixXd::Zero(states, states)} {}

  /// Takes the next sample; false for the first, which has no time before it.
  bool pass(double time_s, const Eigen::Vector2d& a) {
    const bool is_first = !begun_;
    if (is_first) {
      begun_ = true;
      start_s_ = time_s;
    } else {
      dt_s_ = time_s - time_s_;
      const double pole = std::exp(-2.0 * std::numbers::pi * dt_s_);
      passed_ = pole * passed_ + 0.5 * (1.0 + pole) * (a - last_);
    }
    time_s_ = time_s;
    last_ = a;
    return !is_first;
  }

  [[nodiscard]] bool has_settled() const { return time_s_ - start_s_ >= 3.0 / (2.0 * std::numbers::pi); }
  [[nodiscard]] double dt_s() const { return dt_s_; }
  [[nodiscard]] const Eigen::Vector2d& passed() const { return passed_; }

  /// With gain k and Jacobian H of what is measured.
  template <class Gain, class Jacobian, class Innovation>
  void correct(const Gain& k, const Jacobian& h, const Innovation& innovation) {
    x += k * innovation;
    p = (Eigen::MatrixXd::Identity(x.size(), x.size()) - k * h) * p;
  }

 private:
  bool begun_ = false;
  double start_s_ = 0.0;
  double time_s_ = 0.0;
  double dt_s_ = 0.0;
  Eigen::Vector2d last_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d passed_ = Eigen::Vector2d::Zero();
};

}  // namespace airworthy::test
