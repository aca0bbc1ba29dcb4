#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/config/scenario.h"
#include "sim/random.h"

namespace airworthy::sim {

/// Where the vehicle should be, in north-east-down from the take-off point.
struct Reference {
  Manoeuvre manoeuvre = Manoeuvre::kGround;
  double segment_time_s = 0.0;  ///< since the manoeuvre began
  Eigen::Vector3d position_N_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_N_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_N_m_s2 = Eigen::Vector3d::Zero();
  double most_speed_m_s = 2.0;  ///< of corrections
};

/// Turns the segments of a scenario into references over time.
class FlightPlan {
 public:
  FlightPlan(const Scenario& scenario, const Random& random);

  /// Times must not go back. After the last segment: what it ended with, on the ground or in a hover.
  Reference at(double time_s);

 private:
  void begin(std::size_t segment);

  std::vector<Segment> segments_;
  bool repeats_;
  Random random_;
  std::size_t current_ = 0;
  double begun_s_ = 0.0;
  Eigen::Vector3d anchor_N_m_ = Eigen::Vector3d::Zero();  ///< where the segment began
  Eigen::Vector3d set_point_N_m_ = Eigen::Vector3d::Zero();
  double next_set_point_s_ = 0.0;
  bool is_over_ = false;
};

}  // namespace airworthy::sim
