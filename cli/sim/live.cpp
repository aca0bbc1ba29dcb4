#include "cli/sim/live.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "sim/output/mavlink_output.h"
#include "sim/output/pseudo_terminal.h"
#include "sim/simulation.h"

namespace airworthy::sim_command {

rt::Expected<LiveFlight> fly_live(const Flight& flight, const std::filesystem::path& link, double speed,
                                  const Progress& progress) {
  using Clock = std::chrono::steady_clock;
  auto terminal = sim::PseudoTerminal::open(link);
  if (!terminal) return tl::unexpected<rt::Error>{terminal.error()};
  sim::MavlinkOutput output{[&](std::span<const std::uint8_t> bytes) { (*terminal)->write(bytes); },
                            flight.vehicle.multirotor->rotor_count};
  sim::Simulation simulation{*flight.vehicle.multirotor, flight.scenario, flight.realism, flight.seeds};
  LiveFlight result;
  timespec boottime{};
  clock_gettime(CLOCK_BOOTTIME, &boottime);
  result.start_boottime_us = boottime.tv_sec * 1'000'000 + boottime.tv_nsec / 1000;
  const Clock::time_point start = Clock::now();
  while (simulation.time_s() < flight.duration_s) {
    const auto due = start + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>{simulation.time_s() / speed});
    std::this_thread::sleep_until(due);
    const std::chrono::duration<double> behind = Clock::now() - due;
    result.most_behind_s = std::max(result.most_behind_s, behind.count());
    const auto received = (*terminal)->read();
    if (!received.empty()) output.on_received(received, simulation.time_s());
    simulation.step(output);
    if (!progress(simulation.time_s())) break;
  }
  result.flown_s = simulation.time_s();
  result.writes_dropped = (*terminal)->writes_dropped();
  return result;
}

}  // namespace airworthy::sim_command
