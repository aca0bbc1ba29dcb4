#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "tests/support/reference/dense_power_filter.h"

namespace airworthy::test {

/// The signal-power filter as a textbook writes an extended Kalman filter: matrices of run-time size, every product
/// in full, the library's exponential, forces and Δ₀ as the source has them. For comparison only.
class DenseSignalPowerEkf : public DensePowerFilter {
 public:
  struct Params {
    Eigen::Index rotors = 4;
    double mass_kg = 1.0;
    double radius_m = 0.1;
    double thrust_coefficient_N_s2 = 7.64e-6;
    double tip_mass_mg = 20.0;
    double r0 = 100.0;
    bool inverts_innovation_covariance = true;  ///< false: as Eq. (32) is printed
    double length_unit_m = 1.0;                 ///< in which z is measured
    double r0_power_of_length = 4.0;            ///< r₀ in m⁴/s⁸; 2 as printed, m²/s⁴
  };

  explicit DenseSignalPowerEkf(const Params& params) : DensePowerFilter{params.rotors + 1}, params_{params} {
    p.diagonal().setConstant(0.01);
    p(params.rotors, params.rotors) = 0.05 * 0.05;
    q_ = Eigen::MatrixXd::Zero(x.size(), x.size());
    q_.diagonal().setConstant(0.2 * 0.2 / 60.0);
    q_(params.rotors, params.rotors) = 0.05 * 0.05 / 60.0;
  }

  void update(double time_s, double ax_m_s2, double ay_m_s2, const Eigen::VectorXd& speed_rad_s) {
    const Eigen::Vector2d a{ax_m_s2 / params_.length_unit_m, ay_m_s2 / params_.length_unit_m};
    if (pass(time_s, a) && has_settled()) fuse(dt_s(), passed().squaredNorm(), speed_rad_s);
  }

  Eigen::Index rotors() const { return params_.rotors; }
  double tip_mass_mg(Eigen::Index rotor) const { return params_.tip_mass_mg * std::exp(x(rotor)); }

 private:
  void fuse(double dt, double z, const Eigen::VectorXd& speed_rad_s) {
    const Eigen::Index n = params_.rotors;
    const double delta0 = 1e-6 * params_.tip_mass_mg * params_.radius_m /
                          (params_.thrust_coefficient_N_s2 * params_.mass_kg) / params_.length_unit_m;
    const double sigma0 = 1.0 / params_.length_unit_m;
    const Eigen::VectorXd f = params_.thrust_coefficient_N_s2 * speed_rad_s.array().square();
    const Eigen::VectorXd delta = delta0 * x.head(n).array().exp();
    const double sigma2 = sigma0 * sigma0 * std::exp(2.0 * x(n));
    double h = 2.0 * sigma2;
    double r =
        4.0 * sigma2 * sigma2 + params_.r0 * std::pow(params_.length_unit_m, -params_.r0_power_of_length);
    Eigen::RowVectorXd jacobian(n + 1);
    for (Eigen::Index i = 0; i < n; ++i) {
      h += f(i) * f(i) * delta(i) * delta(i);
      r += 4.0 * sigma2 * delta(i) * delta(i) * f(i) * f(i);
      jacobian(i) = 2.0 * f(i) * f(i) * delta(i) * delta(i);
      for (Eigen::Index j = 0; j < n; ++j) {
        if (j != i) r += delta(i) * delta(i) * delta(j) * delta(j) * f(i) * f(i) * f(j) * f(j);
      }
    }
    jacobian(n) = 4.0 * sigma2;
    p += q_ * dt;
    const double s = (jacobian * p * jacobian.transpose())(0) + r;
    const Eigen::VectorXd k =
        p * jacobian.transpose() * (params_.inverts_innovation_covariance ? 1.0 / s : s);
    nis = (z - h) * (z - h) / s;
    correct(k, jacobian, z - h);
  }

  Params params_;
  Eigen::MatrixXd q_;
};

}  // namespace airworthy::test
