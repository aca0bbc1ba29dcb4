#include "services/unbalance/unbalance_service.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/detectors/unbalance/rotor_unbalance_monitor.h"
#include "runtime/bus/channels.h"

namespace airworthy::unbalance {
namespace {

constexpr double kRadPerS_per_rpm = std::numbers::pi / 30.0;
constexpr double kGMm_per_kg_m = 1e6;

std::string rotor_name(std::size_t index) { return fmt::format("rotor {}", index + 1); }

std::vector<std::string> names_in(std::uint32_t mask) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < kMaxRotors; ++i) {
    if ((mask >> i & 1U) != 0U) names.push_back(rotor_name(i));
  }
  return names;
}

}  // namespace

std::unique_ptr<UnbalanceMonitor> make_monitor(const UnbalanceParams& params) {
  switch (params.vehicle.rotor_count) {
    case 3:
      return std::make_unique<RotorUnbalanceMonitor<3>>(params);
    case 4:
      return std::make_unique<RotorUnbalanceMonitor<4>>(params);
    case 5:
      return std::make_unique<RotorUnbalanceMonitor<5>>(params);
    case 6:
      return std::make_unique<RotorUnbalanceMonitor<6>>(params);
    case 7:
      return std::make_unique<RotorUnbalanceMonitor<7>>(params);
    default:
      AW_ASSERT(params.vehicle.rotor_count == 8);  // the vehicle file was checked
      return std::make_unique<RotorUnbalanceMonitor<8>>(params);
  }
}

UnbalanceService::UnbalanceService(rt::Node& node, const UnbalanceConfig& config)
    : node_{node},
      config_{config},
      mg_per_kg_m_{kGMm_per_kg_m / config.monitor.vehicle.propeller_radius_m},
      phase_{node, config.monitor.vehicle},
      monitor_{make_monitor(config.monitor)},
      reporter_{node, "unbalance", [this] { return report(); }} {
  node_.subscribe<esc_status_t>(channel::kEscStatus,
                                [this](const esc_status_t& message) { on_esc_status(message); });
  node_.subscribe<rotor_command_t>(channel::kRotorCommand, [this](const rotor_command_t& message) {
    monitor_->on_commands(from_us(message.header.time_us), message.command_ratio);
  });
  node_.subscribe<tick_t>(channel::kTick, [this](const tick_t& message) {
    if (monitor_->on_clock(from_us(message.header.time_us))) report_all();
  });
  // After the phase's own subscription: what it must know of this sample has been queued.
  node_.subscribe<imu_t>(channel::kImu, [this](const imu_t& message) { on_imu(message); });
}

void UnbalanceService::on_esc_status(const esc_status_t& message) {
  std::vector<double> speeds(message.speed_rpm);
  for (double& speed : speeds) speed *= kRadPerS_per_rpm;
  if (speeds.size() != config_.monitor.vehicle.rotor_count) node_.counters().add("speeds.wrong_rotor_count");
  monitor_->on_speeds(from_us(message.header.time_us), speeds);
}

void UnbalanceService::on_imu(const imu_t& message) {
  if (message.sensor_id != config_.imu_sensor_id) return;
  const TimePoint time = from_us(message.header.time_us);
  monitor_->on_phase(phase_.advance_to(time).phase());
  window_s_ = message.averaging_window_s;
  if (!monitor_->on_accel(time, message.accel_m_s2[0], message.accel_m_s2[1], message.averaging_window_s)) {
    return;
  }
  report_all();
}

void UnbalanceService::report_all() {
  if (observer_) observer_(*monitor_);
  const auto rotors = monitor_->rotors();
  for (std::size_t i = 0; i < rotors.size(); ++i) report_rotor(i, rotors[i]);
  report_ambiguity();
}

std::vector<evidence_t> UnbalanceService::evidence_of(std::size_t index, const RotorUnbalance& rotor) const {
  using rt::evidence;
  const UnbalanceInnovation innovation = monitor_->innovation();
  const double sigma = rotor.sigma_m_s2;
  const double g_mm_per_m_s2 = kGMm_per_kg_m * UnbalanceMonitor::kg_m_per_m_s2(config_.monitor, index);
  const UnbalanceReading& reading = rotor.reading;
  std::vector<evidence_t> all{evidence("unbalance", g_mm_per_m_s2 * rotor.amplitude_m_s2, "g*mm"),
                              evidence("unbalance_sigma", g_mm_per_m_s2 * sigma, "g*mm"),
                              evidence("growth", kGMm_per_kg_m * reading.growth_kg_m, "g*mm"),
                              evidence("growth_sigma", kGMm_per_kg_m * reading.sigma_kg_m, "g*mm"),
                              evidence("tip_mass_growth", mg_per_kg_m_ * reading.growth_kg_m, "mg"),
                              evidence("tip_mass_growth_low", mg_per_kg_m_ * reading.low_kg_m, "mg"),
                              evidence("tip_mass_growth_high", mg_per_kg_m_ * reading.high_kg_m, "mg"),
                              evidence("amplitude", rotor.amplitude_m_s2, "m/s^2"),
                              evidence("information", sigma > 0.0 ? 1.0 / (sigma * sigma) : 0.0, "s^4/m^2"),
                              evidence("by_signal_power", rotor.by_power ? 1.0 : 0.0, "1"),
                              evidence("log_odds", rotor.log_odds, "1"),
                              evidence("test_ratio", rotor.test_ratio, "1"),
                              evidence("nis_mean", innovation.nis, "1"),
                              evidence("innovation_sigma", innovation.noise_m_s2, "m/s^2")};
  // What is not known is left out: no interval of a rotor that is not judged.
  all.erase(
      std::remove_if(all.begin(), all.end(), [](const evidence_t& one) { return !std::isfinite(one.value); }),
      all.end());
  return all;
}

std::string UnbalanceService::interval_of(const UnbalanceReading& reading) const {
  if (std::isnan(reading.low_kg_m)) return "";
  const double low_mg = mg_per_kg_m_ * std::max(0.0, reading.low_kg_m);
  if (std::isinf(reading.high_kg_m)) return fmt::format(", {:.2g} or more", low_mg);
  return fmt::format(", {:.2g} to {:.2g}", low_mg, mg_per_kg_m_ * reading.high_kg_m);
}

void UnbalanceService::report_rotor(std::size_t index, const RotorUnbalance& rotor) {
  if (rotor.transition == FaultLifeCycle::Transition::kNone) return;
  const double growth = kGMm_per_kg_m * rotor.reading.growth_kg_m;
  rt::Fault fault;
  fault.component = rotor_name(index);
  fault.fault_kind = "unbalance";
  fault.severity =
      rotor.growth_m_s2 > config_.monitor.caution_m_s2 ? rt::Severity::kCaution : rt::Severity::kAdvisory;
  fault.magnitude = growth;
  fault.magnitude_sigma = kGMm_per_kg_m * rotor.reading.sigma_kg_m;
  fault.magnitude_unit = "g*mm";
  fault.onset = rotor.onset;
  fault.summary = fmt::format("out of balance by {:.2g} g*mm ({:.3g} mg at the tip{}){}", growth,
                              mg_per_kg_m_ * rotor.reading.growth_kg_m, interval_of(rotor.reading),
                              config_.monitor.has_baseline ? " more than calibrated" : "; not calibrated");
  fault.evidence = evidence_of(index, rotor);
  reporter_.report(index, rotor.transition, monitor_->judged_at(), fault);
}

void UnbalanceService::report_ambiguity() {
  if (monitor_->ambiguity() == FaultLifeCycle::Transition::kNone) return;
  rt::Fault fault;
  fault.component = "rotors";
  fault.fault_kind = "unbalance";
  fault.severity = rt::Severity::kAdvisory;
  fault.onset = monitor_->ambiguous_since();
  fault.candidates = names_in(monitor_->candidates());
  fault.summary = fmt::format("out of balance, cannot isolate yet: {}", fmt::join(fault.candidates, ", "));
  reporter_.report(config_.monitor.vehicle.rotor_count, monitor_->ambiguity(), monitor_->judged_at(), fault);
}

std::string UnbalanceService::reason_of(const RotorUnbalance& rotor) const {
  switch (rotor.reason) {
    case UnbalanceNotJudged::kJudged:
      break;
    case UnbalanceNotJudged::kNotFlying:
      return fmt::format("not in flight: {}", name_of(phase_.phase().phase()));
    case UnbalanceNotJudged::kInertialStale:
      return "inertial data stale";
    case UnbalanceNotJudged::kConverging:
      return "converging";
    case UnbalanceNotJudged::kSpeedUnknown:
      return "rotor speeds missing, stale or more than 0.3 s apart";
    case UnbalanceNotJudged::kSpeedImplausible:
      return "rotor speeds implausible: frozen, or far from what carries the vehicle";
    case UnbalanceNotJudged::kUnfitInertialData:
      return fmt::format("inertial data unfit: average over {:.3g} ms, low-pass at {:.4g} Hz",
                         1e3 * window_s_, config_.monitor.low_pass_Hz);
    case UnbalanceNotJudged::kConfounded:
      return fmt::format("cannot isolate yet: turns too much like {}",
                         fmt::join(names_in(rotor.confounded_with), ", "));
  }
  return "";
}

rt::DetectorReport UnbalanceService::report() const {
  rt::DetectorReport report;
  report.state = monitor_->state();
  const auto rotors = monitor_->rotors();
  if (report.state == DetectorState::kMuted) report.muted_reason = reason_of(rotors.front());
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    const std::string reason =
        report.state == DetectorState::kInitialising ? "no inertial data yet" : reason_of(rotors[i]);
    report.components.push_back(rt::assessment(rotor_name(i), reason, evidence_of(i, rotors[i])));
  }
  const UnbalanceInnovation innovation = monitor_->innovation();
  node_.counters()["samples_fused"] = innovation.samples;
  node_.counters()["samples_refused"] = innovation.samples_refused;
  node_.counters()["speeds_refused"] = innovation.speeds_refused;
  return report;
}

}  // namespace airworthy::unbalance
