#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "airworthy/esc_status_t.hpp"
#include "airworthy/flight_state_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "core/detectors/effectiveness/effectiveness_monitor.h"
#include "runtime/detector/fault_reporter.h"
#include "runtime/phase/flight_phase_input.h"
#include "runtime/process/node.h"
#include "services/effectiveness/effectiveness_config.h"

namespace airworthy::effectiveness {

/// Moves messages between the bus and the effectiveness monitor, and runs the filter of every rotor's effectiveness
/// beside it for the status. No arithmetic but of units.
class EffectivenessService {
 public:
  EffectivenessService(rt::Node& node, const EffectivenessConfig& config);

  EffectivenessService(const EffectivenessService&) = delete;
  EffectivenessService& operator=(const EffectivenessService&) = delete;

  /// Shows what became of the time between two inertial samples: judged, or why not. For evaluation.
  using JudgementObserver =
      std::function<void(TimePoint from, TimePoint until, const std::string& why_muted)>;
  void observe_judgement(JudgementObserver observer);

 private:
  /// What the monitor says of the vehicle file; all as at first: it may be right.
  struct Description {
    bool is_numbered_otherwise = false;
    std::uint32_t wrong_spin = 0;
    bool is_spin_named = false;

    bool operator==(const Description&) const = default;
  };

  void on_imu(const imu_t& message);
  void on_esc_status(const esc_status_t& message);
  void on_rotor_command(const rotor_command_t& message);
  void estimate(TimePoint time, const imu_t& message);
  void handle(const std::optional<LossEvent>& event);
  /// Updates the fault of this kind and rotor where it stands, raises it where not, clears it when it is over.
  void tell(const LossEvent& event);
  /// Tells once that the vehicle file describes another vehicle, and what of it looks wrong.
  void check_description(TimePoint now);
  [[nodiscard]] rt::DetectorReport report();
  void note_source();
  [[nodiscard]] std::string muted_reason() const;
  [[nodiscard]] std::size_t rotor_in_question() const;
  [[nodiscard]] bool uses_commands_alone() const;

  rt::Node& node_;
  const EffectivenessConfig& config_;
  rt::FlightPhaseInput phase_;
  EffectivenessMonitor monitor_;
  LossOfEffectivenessFilter<double> filter_;
  std::optional<TimePoint> last_filtered_;
  std::optional<TimePoint> last_imu_;
  TimePoint tick_{};
  JudgementObserver judgement_observer_;
  SpeedSource logged_source_ = SpeedSource::kNone;
  std::array<std::array<bool, kLossKinds>, kMaxRotors> is_raised_{};
  Description described_;
  std::string implausible_;  ///< as last published; empty: the description may be right
  rt::FaultReporter reporter_;
};

}  // namespace airworthy::effectiveness
