#pragma once

#include <Eigen/Dense>

namespace airworthy::reference {

/// The update of core/estimators/effectiveness/loss_of_effectiveness_filter.h as a textbook writes it: dense, all
/// rows at once, Joseph form, and the reading of one fault as a generalised least squares problem.
struct DenseEffectivenessFilter {
  Eigen::VectorXd k;
  Eigen::MatrixXd P;

  void update(const Eigen::MatrixXd& H, const Eigen::VectorXd& z, const Eigen::MatrixXd& R, double q,
              double pull, double most) {
    const Eigen::Index n = k.size();
    const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);
    k = Eigen::VectorXd::Ones(n) + (1.0 - pull) * (k - Eigen::VectorXd::Ones(n));
    P = (1.0 - pull) * (1.0 - pull) * P + q * I;
    const Eigen::MatrixXd S = H * P * H.transpose() + R;
    const Eigen::MatrixXd K = P * H.transpose() * S.inverse();
    k += K * (z - H * k);
    P = (I - K * H) * P * (I - K * H).transpose() + K * R * K.transpose();
    k = k.cwiseMax(0.0).cwiseMin(most);
  }

  struct SingleFault {
    double effectiveness;
    double variance;
    double unexplained;
  };
  /// Least squares of d ~ N(e_i·x, P) in x.
  [[nodiscard]] SingleFault single_fault(Eigen::Index i) const {
    const Eigen::VectorXd d = k - Eigen::VectorXd::Ones(k.size());
    const Eigen::MatrixXd W = P.inverse();
    const Eigen::VectorXd e = Eigen::VectorXd::Unit(k.size(), i);
    const double x = (e.transpose() * W * d).value() / W(i, i);
    const Eigen::VectorXd left = d - x * e;
    return {1.0 + x, 1.0 / W(i, i), (left.transpose() * W * left).value()};
  }
};

}  // namespace airworthy::reference
