#include "sim/flight/flight_plan.h"

#include <algorithm>
#include <cmath>

namespace airworthy::sim {

FlightPlan::FlightPlan(const Scenario& scenario, const Random& random)
    : segments_{scenario.segments}, repeats_{scenario.repeats}, random_{random} {}

void FlightPlan::begin(std::size_t segment) {
  // The anchor is the last reference, so that the reference never jumps but at random set-points.
  const Segment& left = segments_[current_];
  if (left.manoeuvre == Manoeuvre::kTakeOff) anchor_N_m_.z() = -left.height_m;
  if (left.manoeuvre == Manoeuvre::kLand) anchor_N_m_.z() = 0.0;
  begun_s_ += left.duration_s;
  current_ = segment;
  set_point_N_m_ = anchor_N_m_;
  next_set_point_s_ = begun_s_;
}

Reference FlightPlan::at(double time_s) {
  while (!is_over_ && time_s >= begun_s_ + segments_[current_].duration_s) {
    if (current_ + 1 < segments_.size()) {
      begin(current_ + 1);
    } else if (repeats_) {
      begin(0);
    } else {
      is_over_ = true;
    }
  }
  const Segment& segment = segments_[current_];
  Reference reference;
  reference.manoeuvre = segment.manoeuvre;
  reference.segment_time_s = time_s - begun_s_;
  reference.position_N_m = anchor_N_m_;
  const double t = reference.segment_time_s;
  switch (segment.manoeuvre) {
    case Manoeuvre::kGround:
    case Manoeuvre::kHover:
      break;
    case Manoeuvre::kTakeOff: {
      const double height = std::min(segment.speed_m_s * t, segment.height_m);
      reference.position_N_m.z() = -height;
      if (height < segment.height_m) reference.velocity_N_m_s.z() = -segment.speed_m_s;
      break;
    }
    case Manoeuvre::kCircle: {
      // Starts at the anchor, whose circle lies to the north of it.
      const double rate = segment.speed_m_s / segment.radius_m;
      const Eigen::Vector3d out{-std::cos(rate * t), std::sin(rate * t), 0.0};
      const Eigen::Vector3d along{std::sin(rate * t), std::cos(rate * t), 0.0};
      reference.position_N_m += segment.radius_m * (Eigen::Vector3d::UnitX() + out);
      reference.velocity_N_m_s = segment.speed_m_s * along;
      reference.acceleration_N_m_s2 = -segment.speed_m_s * rate * out;
      break;
    }
    case Manoeuvre::kRandom:
      while (time_s >= next_set_point_s_) {
        const Eigen::Vector3d box{segment.box_m, segment.box_m, 0.5 * segment.box_m};
        const Eigen::Vector3d share{random_.uniform(-1.0, 1.0), random_.uniform(-1.0, 1.0),
                                    random_.uniform(-1.0, 1.0)};
        set_point_N_m_ = anchor_N_m_ + box.cwiseProduct(share);
        next_set_point_s_ += segment.interval_s;
      }
      reference.position_N_m = set_point_N_m_;
      reference.most_speed_m_s = segment.speed_m_s;
      break;
    case Manoeuvre::kLand:
      reference.position_N_m.z() += segment.speed_m_s * t;  // through the ground: what stops it is contact
      reference.velocity_N_m_s.z() = segment.speed_m_s;
      break;
  }
  if (is_over_ && segment.manoeuvre == Manoeuvre::kTakeOff) reference.position_N_m.z() = -segment.height_m;
  return reference;
}

}  // namespace airworthy::sim
