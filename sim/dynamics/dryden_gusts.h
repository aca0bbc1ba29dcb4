#pragma once

#include <Eigen/Core>

#include "sim/random.h"

namespace airworthy::sim {

/// Continuous gusts with the Dryden spectra of MIL-F-8785C for low altitude (below 1000 ft).
///   Intensities  σ_w = 0.1·W20,  σ_u = σ_v = σ_w / (0.177 + 0.000823·h)^0.4,  h in ft                       (1)
///   Lengths      L_w = h,  L_u = L_v = h / (0.177 + 0.000823·h)^1.2                                          (2)
///   Filters      H_u = σ_u·√(2L_u/(πV)) / (1 + L_u·s/V)                                                      (3)
///                H_v,w = σ·√(L/(πV))·(1 + √3·L·s/V) / (1 + L·s/V)²                                          (4)
///   Shear        mean wind = W20·ln(h/0.15) / ln(20/0.15), h in ft, none below 0.15 ft                      (5)
/// driven by white noise of unit density. V is the speed at which the frozen field passes: airspeed, at least
/// kLeastSpeed_m_s. h is held within [kLeastHeight_m, 300 m] but for (5);
/// near the ground the gusts fade as the mean does.
class DrydenGusts {
 public:
  static constexpr double kLeastSpeed_m_s = 1.0;
  static constexpr double kLeastHeight_m = 3.0;

  /// `mean_N_m_s` is the steady wind at 20 ft; its speed sets the intensity.
  DrydenGusts(const Eigen::Vector3d& mean_N_m_s, const Random& random);

  /// Wind, steady and gusts, after dt_s more seconds, in north-east-down.
  const Eigen::Vector3d& step(double height_m, double airspeed_m_s, double dt_s);
  [[nodiscard]] const Eigen::Vector3d& wind_N_m_s() const { return wind_N_m_s_; }

 private:
  // The second-order filter (4) as two equal lags in a row.
  struct SecondOrder {
    double first = 0.0;
    double second = 0.0;
    double step(double noise, double time_constant_s, double sigma, double dt_s);
  };

  Eigen::Vector3d mean_N_m_s_;
  Eigen::Vector3d along_N_;  // direction of u
  double mean_speed_m_s_;    ///< at 20 ft
  Random random_;
  double u_ = 0.0;
  SecondOrder v_;
  SecondOrder w_;
  Eigen::Vector3d wind_N_m_s_;
};

}  // namespace airworthy::sim
