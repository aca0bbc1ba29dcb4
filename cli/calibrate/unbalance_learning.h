#pragma once

#include <array>
#include <string>
#include <vector>

#include "runtime/error.h"
#include "services/unbalance/calibration.h"
#include "services/unbalance/unbalance_config.h"

namespace airworthy::calibrate {

/// A flight with a known mass on one propeller, to measure what the inertial unit feels of it.
struct TrialFlight {
  std::string log;
  int rotor = 0;  ///< 1-based
  double tip_mass_mg = 0.0;
};

struct LearnedUnbalance {
  unbalance::Calibration calibration;
  std::vector<double> smallest_growth_m_s2;  ///< of each rotor: what is found in half of the judgements
  std::vector<std::string> notes;
};

/// Less of judged flight says too little about a rotor.
inline constexpr double kLeastJudged_s = 20.0;

/// In m²/s⁴, over the flights that have taught the signal-power filter for kLeastJudged_s; zeros without one.
[[nodiscard]] std::array<double, kMaxRotors> mean_powers(const std::vector<UnbalancePowers>& flights);

/// Learns the balance of a vehicle's propellers from healthy flights (of a flight with a GROUND_TRUTH fault, the part
/// before it).
///   Latency    of the telemetry: of 0, 4, … 60 ms the one for which the tracked power of all rotors is largest     (1)
///   Noise      of a report: 1.4826·median|ωₖ₋₁ − 2ωₖ + ωₖ₊₁|/√6 over the speed                                  (2)
///   Clocks     of the motor controllers: where SpeedScale ends, median over the flights
///   Motor lag  median over the flights of fit_motor_lag(), for the time without rotor speeds
///   Power      mean of UnbalancePowers over the flights with enough of it, for the time without rotor speeds
///   Baseline   mean amplitude of each rotor; sigma: of single judgements around it, flights pooled              (3)
///   Response   a trial mass m at radius r makes response·B·m·r·ω₀²/M, B of rigid_body_response.h. Of trials with the
///              mass once on either blade its square is ½(a₁² + a₂²) − b², whatever the phase of the baseline b; of one
///              trial it is a² − b² on average over that phase. Sigma of each rotor: of the trial's amplitudes (for one
///              trial b/√2 as well), and of carrying it from the rotor of the trial to this one                    (4)
/// Refuses logs of other vehicles, too little judged flight, rotors that were never judged, and trials that made ten times
/// what (4) expects of a rigid body, or a tenth, with the reason.
[[nodiscard]] rt::Expected<LearnedUnbalance> learn_unbalance(const std::vector<std::string>& logs,
                                                             const std::vector<TrialFlight>& trials,
                                                             const unbalance::UnbalanceConfig& config,
                                                             unsigned jobs);

}  // namespace airworthy::calibrate
