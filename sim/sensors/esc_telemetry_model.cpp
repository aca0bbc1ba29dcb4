#include "sim/sensors/esc_telemetry_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace airworthy::sim {
namespace {

constexpr double kRpmPerRadS = 30.0 / std::numbers::pi;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

EscTelemetryModel::EscTelemetryModel(const Realism::Esc& realism, std::size_t rotor_count, std::uint64_t seed)
    : realism_{realism}, rotor_count_{rotor_count}, jitter_{seed, "esc jitter"} {
  for (std::size_t i = 0; i < rotor_count; ++i) random_.emplace_back(seed, "esc", i);
}

void EscTelemetryModel::measure(double time_s, double supply_V,
                                const std::array<double, kMaxRotors>& speed_rad_s,
                                const std::array<EscFault, kMaxRotors>& faults) {
  EscSample sample;
  sample.speed_rpm.fill(kNaN);
  sample.voltage_V.fill(kNaN);
  sample.current_A.fill(kNaN);
  sample.temperature_degC.fill(kNaN);
  for (std::size_t i = 0; i < rotor_count_; ++i) {
    const EscFault& fault = faults[i];
    // Drawn whatever happens, so that a fault changes nothing else.
    const double noise = 1.0 + realism_.noise_ratio * random_[i].normal();
    const bool is_lost = random_[i].chance(realism_.dropout_ratio);
    const double garbage_rpm = random_[i].uniform(0.0, 30000.0);
    double speed_rpm = kRpmPerRadS * speed_rad_s[i] * noise * fault.speed_factor;
    if (realism_.resolution_rpm > 0.0) {
      speed_rpm = realism_.resolution_rpm * std::round(speed_rpm / realism_.resolution_rpm);
    }
    if (fault.is_garbage) speed_rpm = std::round(garbage_rpm);
    if (fault.is_frozen) speed_rpm = last_.speed_rpm[i];
    last_.speed_rpm[i] = speed_rpm;
    if (is_lost || fault.is_silent) continue;
    sample.speed_rpm[i] = speed_rpm;
    sample.voltage_V[i] = supply_V;
    sample.temperature_degC[i] = 35.0 + fault.temperature_offset_K;
  }
  sample.time_s = time_s + realism_.latency_s + realism_.jitter_s * jitter_.uniform();
  // Messages of one link never overtake each other.
  if (!under_way_.empty()) sample.time_s = std::max(sample.time_s, under_way_.back().time_s);
  under_way_.push_back(sample);
}

std::optional<EscSample> EscTelemetryModel::arrived(double time_s) {
  if (under_way_.empty() || under_way_.front().time_s > time_s) return std::nullopt;
  const EscSample sample = under_way_.front();
  under_way_.pop_front();
  return sample;
}

}  // namespace airworthy::sim
