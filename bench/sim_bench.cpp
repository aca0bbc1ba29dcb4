// A simulated minute beside the least a simulator of the same vehicle could do in the same run: an explicit
// Euler step of a rigid body with as many quadratic rotors, at the same 4 kHz, with neither sensors, gusts,
// autopilot nor output. `realtime` is simulated seconds per second.
#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <string>

#include "runtime/bus/log_writer.h"
#include "runtime/config/vehicle.h"
#include "sim/config/realism.h"
#include "sim/output/log_output.h"
#include "sim/simulation.h"
#include "tests/support/rotor_ring.h"

namespace airworthy::sim {
namespace {

constexpr double kFlown_s = 2.0;  // of one iteration

/// An F450's body with rotors on a circle, so that only their number differs.
Multirotor vehicle_with(std::size_t rotors) {
  const auto file = rt::VehicleFile::load(std::string{AIRWORTHY_CONFIG} + "/vehicles/f450.toml");
  Multirotor vehicle = file.value().multirotor.value();
  test::put_on_ring(vehicle, rotors, 0.225, -0.02);
  vehicle.thrust_coefficient_N_s2 *= 4.0 / static_cast<double>(rotors);
  return vehicle;
}

/// In the air for as long as the benchmark lasts.
Scenario flight() {
  Scenario scenario;
  scenario.segments = {Segment{.manoeuvre = Manoeuvre::kGround, .duration_s = 1.0},
                       Segment{.manoeuvre = Manoeuvre::kTakeOff, .duration_s = 4.0},
                       Segment{.manoeuvre = Manoeuvre::kRandom, .duration_s = 1e6}};
  return scenario;
}

/// Throws everything away.
class Nobody final : public Output {
 public:
  void on_truth(const Truth&) override {}
  void on_imu(const ImuSample& sample) override { benchmark::DoNotOptimize(sample.time_s); }
  void on_esc(const EscSample& sample) override { benchmark::DoNotOptimize(sample.time_s); }
  void on_attitude(const AutopilotSample& sample) override { benchmark::DoNotOptimize(sample.time_s); }
  void on_commands(const AutopilotSample& sample) override { benchmark::DoNotOptimize(sample.time_s); }
  void on_flight_state(const AutopilotSample& sample, LandedState) override {
    benchmark::DoNotOptimize(sample.time_s);
  }
};

void report(benchmark::State& state) {
  state.counters["realtime"] = benchmark::Counter(kFlown_s, benchmark::Counter::kIsIterationInvariantRate);
}

void fly(benchmark::State& state, Output& output, Simulation& simulation) {
  while (simulation.time_s() < 5.0) simulation.step(output);
  for (auto _ : state) {
    const double until_s = simulation.time_s() + kFlown_s;
    while (simulation.time_s() < until_s) simulation.step(output);
  }
  report(state);
}

void simulation(benchmark::State& state) {
  const Multirotor vehicle = vehicle_with(static_cast<std::size_t>(state.range(0)));
  Simulation simulation{vehicle, flight(), Realism::at(Level::kHard), 1};
  Nobody nobody;
  fly(state, nobody, simulation);
}
BENCHMARK(simulation)->Arg(4)->Arg(6)->Arg(8)->Unit(benchmark::kMillisecond);

/// As `airworthy sim -o`: every message encoded and written to a file. `MB_per_min` is what a simulated minute
/// takes on disk.
void simulation_into_log(benchmark::State& state) {
  const Multirotor vehicle = vehicle_with(static_cast<std::size_t>(state.range(0)));
  const auto path = std::filesystem::temp_directory_path() / "airworthy_sim_bench.lcm";
  {
    auto writer = rt::LogWriter::create(path.string());
    if (!writer) {
      state.SkipWithError(writer.error().text.c_str());
      return;
    }
    LogOutput output{**writer, "bench", vehicle.rotor_count, 1};
    Simulation simulation{vehicle, flight(), Realism::at(Level::kHard), 1};
    fly(state, output, simulation);
    if (!(*writer)->commit()) state.SkipWithError("the log could not be written");
    const double size_MB = 1e-6 * static_cast<double>(std::filesystem::file_size(path));
    state.counters["MB_per_min"] = size_MB * 60.0 / simulation.time_s();
  }
  std::filesystem::remove(path);
}
BENCHMARK(simulation_into_log)->Arg(4)->Arg(6)->Arg(8)->Unit(benchmark::kMillisecond);

/// Runge-Kutta of the simulator's equations alone, ground and rotor phases included.
void dynamics_alone(benchmark::State& state) {
  const MultirotorDynamics dynamics{vehicle_with(static_cast<std::size_t>(state.range(0)))};
  State body = dynamics.at_rest();
  body.position_N_m.z() = -1000.0;
  Inputs inputs;
  for (std::size_t i = 0; i < dynamics.vehicle().rotor_count; ++i) {
    body.speed_rad_s[i] = dynamics.hover_speed_rad_s();
    inputs.rotor[i].speed_target_rad_s = dynamics.hover_speed_rad_s();
  }
  for (auto _ : state) {
    for (int k = 0; k < static_cast<int>(kFlown_s * Realism::kPhysicsRate_Hz); ++k) {
      dynamics.step(body, inputs, Simulation::kPhysicsStep_s);
    }
    benchmark::DoNotOptimize(body.position_N_m.data());
  }
  report(state);
}
BENCHMARK(dynamics_alone)->Arg(4)->Arg(6)->Arg(8)->Unit(benchmark::kMillisecond);

void plain_euler(benchmark::State& state) {
  const auto rotors = static_cast<std::size_t>(state.range(0));
  const Multirotor vehicle = vehicle_with(rotors);
  const double hover_rad_s = std::sqrt(vehicle.mass_kg * kGravity_m_s2 /
                                       (static_cast<double>(rotors) * vehicle.thrust_coefficient_N_s2));
  const Eigen::Vector3d inertia{vehicle.inertia_kg_m2[0], vehicle.inertia_kg_m2[1], vehicle.inertia_kg_m2[2]};
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d rates = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  std::array<double, kMaxRotors> speed{};
  speed.fill(hover_rad_s);
  const double dt = Simulation::kPhysicsStep_s;
  for (auto _ : state) {
    for (int k = 0; k < static_cast<int>(kFlown_s * Realism::kPhysicsRate_Hz); ++k) {
      double thrust = 0.0;
      Eigen::Vector3d moment = Eigen::Vector3d::Zero();
      for (std::size_t i = 0; i < rotors; ++i) {
        const Rotor& rotor = vehicle.rotor[i];
        const double force = vehicle.thrust_coefficient_N_s2 * speed[i] * speed[i];
        thrust += force;
        moment.x() -= rotor.position_m[1] * force;
        moment.y() += rotor.position_m[0] * force;
        moment.z() -= rotor.spin * vehicle.torque_ratio_m * force;
        speed[i] += dt * (hover_rad_s - speed[i]) / vehicle.motor_time_constant_s;
      }
      const Eigen::Vector3d force_N = q * Eigen::Vector3d{0.0, 0.0, -thrust};
      const Eigen::Vector3d momentum = inertia.cwiseProduct(rates);
      position += dt * velocity;
      velocity += dt * (force_N / vehicle.mass_kg + Eigen::Vector3d{0.0, 0.0, kGravity_m_s2});
      const Eigen::Quaterniond turned = q * Eigen::Quaterniond{0.0, rates.x(), rates.y(), rates.z()};
      q.coeffs() += 0.5 * dt * turned.coeffs();
      q.normalize();
      rates += dt * (moment - rates.cross(momentum)).cwiseQuotient(inertia);
    }
    benchmark::DoNotOptimize(position.data());
    benchmark::DoNotOptimize(q.coeffs().data());
  }
  report(state);
}
BENCHMARK(plain_euler)->Arg(4)->Arg(6)->Arg(8)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace airworthy::sim

BENCHMARK_MAIN();
