#include "cli/sim/record.h"

#include "runtime/bus/log_writer.h"
#include "sim/output/log_output.h"
#include "sim/simulation.h"

namespace airworthy::sim_command {
namespace {

constexpr int kStepsPerReport = 500;

}  // namespace

rt::Expected<Recording> record(const Flight& flight, const std::filesystem::path& log,
                               const Progress& progress) {
  auto writer = rt::LogWriter::create(log.string());
  if (!writer) return tl::unexpected<rt::Error>{writer.error()};
  sim::LogOutput output{**writer, flight.vehicle.name, flight.vehicle.multirotor->rotor_count,
                        flight.seeds.flight};
  sim::Simulation simulation{*flight.vehicle.multirotor, flight.scenario, flight.realism, flight.seeds};
  for (std::int64_t step = 0; simulation.time_s() < flight.duration_s; ++step) {
    simulation.step(output);
    if ((*writer)->failure()) break;  // a full disk will not become emptier; commit() says what it was
    if (step % kStepsPerReport == 0 && !progress(simulation.time_s())) return Recording{{}, true};
  }
  if (const auto committed = (*writer)->commit(); !committed)
    return tl::unexpected<rt::Error>{committed.error()};
  return Recording{(*writer)->messages(), false};
}

}  // namespace airworthy::sim_command
