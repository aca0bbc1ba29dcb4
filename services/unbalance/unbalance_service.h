#pragma once

#include <functional>
#include <memory>

#include "airworthy/esc_status_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "core/detectors/unbalance/unbalance_monitor.h"
#include "runtime/detector/fault_reporter.h"
#include "runtime/phase/flight_phase_input.h"
#include "runtime/process/node.h"
#include "services/unbalance/unbalance_config.h"

namespace airworthy::unbalance {

/// A monitor for the vehicle's number of rotors, 3 to 8.
[[nodiscard]] std::unique_ptr<UnbalanceMonitor> make_monitor(const UnbalanceParams& params);

/// Moves messages between the bus and the unbalance monitor. No arithmetic but of units.
class UnbalanceService {
 public:
  UnbalanceService(rt::Node& node, const UnbalanceConfig& config);

  /// Shows the monitor after each judgement, to learn from a recorded flight.
  void observe(std::function<void(const UnbalanceMonitor&)> observer) { observer_ = std::move(observer); }

  UnbalanceService(const UnbalanceService&) = delete;
  UnbalanceService& operator=(const UnbalanceService&) = delete;

 private:
  void on_imu(const imu_t& message);
  void on_esc_status(const esc_status_t& message);
  void report_all();
  /// ", 10 to 20" in mg at the tip; empty if there is none.
  [[nodiscard]] std::string interval_of(const UnbalanceReading& reading) const;
  void report_rotor(std::size_t index, const RotorUnbalance& rotor);
  void report_ambiguity();
  [[nodiscard]] rt::DetectorReport report() const;
  [[nodiscard]] std::string reason_of(const RotorUnbalance& rotor) const;
  [[nodiscard]] std::vector<evidence_t> evidence_of(std::size_t index, const RotorUnbalance& rotor) const;

  rt::Node& node_;
  const UnbalanceConfig& config_;
  double mg_per_kg_m_;  ///< at the tip, of a mass times radius
  rt::FlightPhaseInput phase_;
  std::unique_ptr<UnbalanceMonitor> monitor_;
  double window_s_ = 0.0;
  std::function<void(const UnbalanceMonitor&)> observer_;
  rt::FaultReporter reporter_;
};

}  // namespace airworthy::unbalance
