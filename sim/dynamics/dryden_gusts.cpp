#include "sim/dynamics/dryden_gusts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace airworthy::sim {
namespace {

constexpr double kFeet_m = 0.3048;
constexpr double kMostHeight_m = 300.0;
constexpr double kReference_ft = 20.0;
constexpr double kRoughness_ft = 0.15;

// (5)
double shear(double height_m) {
  const double height_ft = std::clamp(height_m, 0.0, kMostHeight_m) / kFeet_m;
  return height_ft <= kRoughness_ft
             ? 0.0
             : std::log(height_ft / kRoughness_ft) / std::log(kReference_ft / kRoughness_ft);
}

}  // namespace

DrydenGusts::DrydenGusts(const Eigen::Vector3d& mean_N_m_s, const Random& random)
    : mean_N_m_s_{mean_N_m_s},
      along_N_{Eigen::Vector3d::UnitX()},
      mean_speed_m_s_{mean_N_m_s.norm()},
      random_{random},
      wind_N_m_s_{Eigen::Vector3d::Zero()} {
  if (mean_speed_m_s_ > 0.0) along_N_ = mean_N_m_s / mean_speed_m_s_;
}

double DrydenGusts::SecondOrder::step(double noise, double time_constant_s, double sigma, double dt_s) {
  // (4) = gain·(√3/(1+Ts) + (1−√3)/(1+Ts)²), T = L/V; noise is held over the step.
  const double decay = std::exp(-dt_s / time_constant_s);
  const double gain = sigma * std::sqrt(time_constant_s);
  const double old_first = first;
  first = decay * first + (1.0 - decay) * noise;
  second = decay * second + (1.0 - decay) * 0.5 * (old_first + first);
  return gain * (std::numbers::sqrt3 * first + (1.0 - std::numbers::sqrt3) * second);
}

const Eigen::Vector3d& DrydenGusts::step(double height_m, double airspeed_m_s, double dt_s) {
  if (mean_speed_m_s_ <= 0.0) return wind_N_m_s_;
  const double height_ft = std::clamp(height_m, kLeastHeight_m, kMostHeight_m) / kFeet_m;
  const double shape = 0.177 + 0.000823 * height_ft;
  const double sigma_w = 0.1 * mean_speed_m_s_;  // (1)
  const double sigma_uv = sigma_w / std::pow(shape, 0.4);
  const double length_w_m = height_ft * kFeet_m;  // (2)
  const double length_uv_m = height_ft / std::pow(shape, 1.2) * kFeet_m;
  const double speed = std::max(airspeed_m_s, kLeastSpeed_m_s);

  // A step of white noise with unit two-sided density in the filters' convention has variance 1/dt; u's filter
  // then has variance σ² when its gain is σ·√(2T).
  const double noise = 1.0 / std::sqrt(dt_s);
  const double time_u_s = length_uv_m / speed;
  const double decay = std::exp(-dt_s / time_u_s);
  u_ = decay * u_ + (1.0 - decay) * sigma_uv * std::sqrt(2.0 * time_u_s) * noise * random_.normal();  // (3)
  const double v = v_.step(noise * random_.normal(), time_u_s, sigma_uv, dt_s);
  const double w = w_.step(noise * random_.normal(), length_w_m / speed, sigma_w, dt_s);
  const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(along_N_);
  const double fade = std::min(1.0, shear(height_m) / shear(kLeastHeight_m));
  wind_N_m_s_ =
      shear(height_m) * mean_N_m_s_ + fade * (u_ * along_N_ + v * across + Eigen::Vector3d{0.0, 0.0, w});
  return wind_N_m_s_;
}

}  // namespace airworthy::sim
