#include "tests/sim/effectiveness_flights.h"

#include <cmath>
#include <numbers>

#include "core/detectors/flight_phase.h"
#include "sim/random.h"
#include "sim/simulation.h"

namespace airworthy::sim {
namespace {

using effectiveness::EffectivenessMonitor;
using effectiveness::LossEvent;

// Time 0 of a flight in vehicle time; any will do.
constexpr double kStart_s = 100.0;

// The published filter, for any number of rotors: a tenth of a second back to 1 in what it does not see, the reading of
// a single fault against the flight so far, and more than one report of the speeds must agree.
constexpr double kPullRatio = 0.02;
constexpr double kUnexplained = 0.2;
constexpr Duration kPersistence{12'000};

TimePoint at(double time_s) { return TimePoint{Duration{std::llround((kStart_s + time_s) * 1e6)}}; }
double seconds(TimePoint time) { return to_seconds(time.time_since_epoch()) - kStart_s; }

/// The best that the same innovations allow: a cumulative sum for the true rotor and the true size, with the threshold
/// that one sum needs for the same rate of false alarms.
class Clairvoyant {
 public:
  Clairvoyant(const effectiveness::EffectivenessParams& params, const Fault& fault)
      : rotor_{fault.rotor - 1},
        threshold_{loss_threshold(params.false_alarms_per_hour, params.samples_per_s, 1)},
        test_{params.vehicle.rotor_count, {}, {LossRange<double>{loss(fault), loss(fault), 3.0}}} {}

  static void see(void* context, const MotionSample<double>& sample, TimePoint now) {
    auto& self = *static_cast<Clairvoyant*>(context);
    self.test_.step(sample);
    if (!self.found_ && self.test_.evidence(0, self.rotor_) >= self.threshold_) self.found_ = now;
  }

  [[nodiscard]] std::optional<TimePoint> found() const { return found_; }
  /// Before the fault there is nothing to know.
  void forget() { found_.reset(); }

 private:
  static double loss(const Fault& fault) {
    return fault.kind == FaultKind::kPropellerLost ? 1.0 : fault.magnitude;
  }

  std::size_t rotor_;
  double threshold_;
  RotorLossTest<double, kMaxRotors, 1> test_;
  std::optional<TimePoint> found_;
};

/// Feeds both detectors with what the devices send, in that order.
class Detectors final : public Output {
 public:
  Detectors(const effectiveness::EffectivenessParams& params, const EffectivenessFlight& flight,
            EffectivenessOutcome& outcome)
      : rotors_{params.vehicle.rotor_count},
        mischief_{flight.mischief},
        telemetry_until_s_{flight.telemetry_until_s},
        random_{flight.seed, "mischief"},
        phase_{params.vehicle},
        monitor_{params},
        synchronised_{params.speeds},
        filter_{params.effectiveness, general()},
        outcome_{outcome} {}

  void on_truth(const Truth&) override {}
  void on_imu(const ImuSample& sample) override {
    if (is_gap(sample.time_s)) return;
    feed(sample);
    if (mischief_ == Mischief::kDuplicates) feed(sample);
  }
  void on_esc(const EscSample& sample) override {
    if (is_gap(sample.time_s) || sample.time_s >= telemetry_until_s_) return;
    feed(sample);
    if (mischief_ == Mischief::kDuplicates) feed(sample);
  }
  void on_attitude(const AutopilotSample&) override {}
  void on_commands(const AutopilotSample& sample) override {
    if (is_gap(sample.time_s)) return;
    feed(sample);
    if (mischief_ == Mischief::kDuplicates) feed(sample);
  }
  void on_flight_state(const AutopilotSample& sample, LandedState landed) override {
    phase_.on_report(at(sample.time_s), static_cast<LandedReport>(landed),
                     -sample.estimate.velocity_N_m_s.z());
    monitor_.on_report(static_cast<LandedReport>(landed));
  }

  [[nodiscard]] EffectivenessMonitor& monitor() { return monitor_; }
  [[nodiscard]] bool faithful_done() const { return faithful_done_; }

 private:
  [[nodiscard]] bool is_gap(double time_s) const {
    return mischief_ == Mischief::kGaps && std::fmod(time_s, 1.0) < 0.05;
  }

  void feed(const ImuSample& sample) {
    const std::array<double, 3> accel{sample.accel_m_s2.x(), sample.accel_m_s2.y(), sample.accel_m_s2.z()};
    const std::array<double, 3> gyro{sample.gyro_rad_s.x(), sample.gyro_rad_s.y(), sample.gyro_rad_s.z()};
    const TimePoint time = at(sample.time_s);
    phase_.on_imu(time, accel, gyro);
    note(monitor_.on_imu(time, accel, gyro, phase_.phase()), sample.time_s);
    run_faithful(time, accel, gyro);
  }
  void feed(const EscSample& sample) {
    std::array<double, kMaxRotors> speeds{};
    for (std::size_t i = 0; i < rotors_; ++i) {
      speeds[i] = sample.speed_rpm[i] * std::numbers::pi / 30.0;
      if (mischief_ == Mischief::kSpikes && random_.chance(0.05)) speeds[i] = random_.uniform(0.0, 3000.0);
    }
    const auto span = std::span{speeds}.first(rotors_);
    phase_.on_rotor_speeds(at(sample.time_s), span);
    synchronised_.on_speed(at(sample.time_s), span);
    note(monitor_.on_speeds(at(sample.time_s), span), sample.time_s);
  }
  void feed(const AutopilotSample& sample) {
    const auto span = std::span{sample.control.command_ratio}.first(rotors_);
    phase_.on_rotor_commands(at(sample.time_s), span);
    synchronised_.on_command(at(sample.time_s), span);
    note(monitor_.on_commands(at(sample.time_s), span), sample.time_s);
  }

  static LossOfEffectivenessParams<double> general() {
    LossOfEffectivenessParams<double> result;
    result.pull_ratio = kPullRatio;
    return result;
  }

  void note(const std::optional<LossEvent>& event, double now_s) {
    if (!event) return;
    outcome_.ours.push_back({event->rotor, now_s, event->effectiveness, event->sigma, event->kind, *event});
  }

  void run_faithful(TimePoint time, const std::array<double, 3>& accel, const std::array<double, 3>& gyro) {
    if (!synchronised_.advance(time)) return;
    const double dt_s = last_ ? to_seconds(time - *last_) : 0.0;
    last_ = time;
    static_cast<void>(filter_.update(dt_s, synchronised_.speeds(), gyro, accel[2]));
    // Listened to where ours is: what ground and take-off do to it is another matter.
    if (monitor_.muted() == effectiveness::Muted::kNot) was_judging_ = true;
    if (faithful_done_ || !was_judging_ ||
        (monitor_.muted() != effectiveness::Muted::kNot &&
         monitor_.muted() != effectiveness::Muted::kRotorLost)) {
      return;
    }
    const auto lost = filter_.single_lost(0.9, kUnexplained);
    filter_.learn_reference(dt_s);
    if (lost != suspect_) suspected_since_ = time;
    suspect_ = lost;
    if (!lost || time - suspected_since_ < kPersistence) return;
    faithful_done_ = true;
    outcome_.faithful.push_back({*lost,
                                 seconds(time),
                                 filter_.effectiveness(*lost),
                                 0.0,
                                 effectiveness::LossKind::kPropellerLost,
                                 {}});
  }

  std::size_t rotors_;
  Mischief mischief_;
  double telemetry_until_s_;
  Random random_;
  FlightPhase phase_;
  EffectivenessMonitor monitor_;
  RotorSpeedPredictor<double> synchronised_;
  LossOfEffectivenessFilter<double> filter_;
  EffectivenessOutcome& outcome_;
  std::optional<TimePoint> last_;
  bool was_judging_ = false;
  bool faithful_done_ = false;
  std::optional<std::size_t> suspect_;
  TimePoint suspected_since_{};
};

Scenario plan(const EffectivenessFlight& flight) {
  Scenario scenario;
  scenario.segments = {Segment{.manoeuvre = Manoeuvre::kGround, .duration_s = 1.5},
                       Segment{.manoeuvre = Manoeuvre::kTakeOff, .duration_s = 3.0},
                       Segment{.manoeuvre = flight.manoeuvre, .duration_s = flight.duration_s - 4.5}};
  if (!flight.fault) {
    scenario.segments.push_back(Segment{.manoeuvre = Manoeuvre::kLand, .duration_s = 8.0, .speed_m_s = 0.5});
    scenario.repeats = flight.cycles > 1;
  } else {
    scenario.faults = {*flight.fault};
  }
  return scenario;
}

}  // namespace

effectiveness::EffectivenessParams effectiveness_params(const Multirotor& vehicle) {
  effectiveness::EffectivenessParams params;
  params.vehicle = vehicle;
  params.effectiveness = EffectivenessMatrix<double>::of(vehicle);
  params.speeds.rotor_count = vehicle.rotor_count;
  params.speeds.time_constant_s = vehicle.motor_time_constant_s;
  params.speeds.speed_min_rad_s = vehicle.speed_min_rad_s;
  params.speeds.speed_max_rad_s = vehicle.speed_max_rad_s;
  // What an integrator reads off one log: see airworthy calibrate.
  params.speeds.command_latency = Duration{5'000};
  params.speeds.telemetry_latency = Duration{10'000};
  // The vehicle has flown before.
  params.mapping_is_known = true;
  return params;
}

EffectivenessOutcome fly(const EffectivenessFlight& flight,
                         const effectiveness::EffectivenessParams& params) {
  EffectivenessOutcome outcome;
  const Scenario scenario = plan(flight);
  Simulation simulation{flight.vehicle, scenario, flight.realism, flight.seed};
  Detectors detectors{params, flight, outcome};
  const double end_s =
      flight.fault ? flight.fault->onset_s + flight.give_up_s : flight.cycles * (flight.duration_s + 8.0);
  std::optional<Clairvoyant> clairvoyant;
  if (flight.fault &&
      (flight.fault->kind == FaultKind::kPropellerLost || flight.fault->kind == FaultKind::kPartialLoss)) {
    clairvoyant.emplace(params, *flight.fault);
    detectors.monitor().observe(&Clairvoyant::see, &*clairvoyant);
  }
  double last_contact_s = 0.0;
  bool on_ground = true;
  while (simulation.time_s() < end_s) {
    if (clairvoyant && simulation.time_s() < flight.fault->onset_s) clairvoyant->forget();
    if (flight.fault && simulation.time_s() < flight.fault->onset_s)
      outcome.was_judging = detectors.monitor().muted() == effectiveness::Muted::kNot;
    simulation.step(detectors);
    if (const auto muted = detectors.monitor().muted(); muted != effectiveness::Muted::kPhase)
      outcome.muted_in_flight = muted;
    if (simulation.has_contact()) last_contact_s = simulation.time_s();
    const bool grounded = simulation.time_s() - last_contact_s < 0.05;
    if (on_ground && !grounded && outcome.take_offs++ == 0) outcome.lift_off_s = simulation.time_s();
    on_ground = grounded;
    if (!grounded) outcome.flown_s += 1.0 / Controller::kRate_Hz;
    if (const auto spin = detectors.monitor().wrong_spin(); spin && !outcome.wrong_spin)
      outcome.wrong_spin_s = simulation.time_s();
    outcome.wrong_spin = detectors.monitor().wrong_spin();
    const bool needs_filter = !flight.fault || flight.fault->kind != FaultKind::kOverEffective;
    if (flight.fault && !outcome.ours.empty() && (detectors.faithful_done() || !needs_filter)) break;
  }
  if (clairvoyant && clairvoyant->found()) outcome.clairvoyant_s = seconds(*clairvoyant->found());
  outcome.muted = detectors.monitor().muted();
  outcome.judged_s = detectors.monitor().judged_s();
  outcome.is_spin_named = detectors.monitor().slow().is_spin_named();
  outcome.spin_evidence = detectors.monitor().slow().spin_evidence();
  outcome.unexplained = detectors.monitor().test().unexplained_disturbances();
  return outcome;
}

}  // namespace airworthy::sim
