#include "cli/eval/nested.h"

#include <fmt/format.h>

#include "cli/eval/flight_run.h"

namespace airworthy::eval {

std::vector<rt::Expected<Flight>> run_nested(const std::vector<std::string>& logs, const std::string& vehicle,
                                             const response::ResponseConfig& config,
                                             const calibrate::FlightName& flight_name,
                                             const calibrate::LearningParams& learning) {
  std::vector<rt::Expected<calibrate::HealthyFlight>> healthy(logs.size());
  calibrate::for_each_parallel(logs.size(), learning.jobs, [&](std::size_t i) {
    healthy[i] = calibrate::read_healthy_flight(logs[i], config);
    if (!healthy[i]) return;
    healthy[i]->group = flight_name.of(healthy[i]->name);
    const auto checked = check_vehicle(logs[i], healthy[i]->vehicle, vehicle);
    if (!checked) healthy[i] = tl::unexpected<rt::Error>{checked.error()};
  });
  std::vector<rt::Expected<Flight>> flights(logs.size());
  calibrate::LearningParams one_thread = learning;
  one_thread.jobs = 1;
  calibrate::for_each_parallel(logs.size(), learning.jobs, [&](std::size_t i) {
    if (!healthy[i]) {
      flights[i] = tl::unexpected{healthy[i].error()};
      return;
    }
    std::vector<const calibrate::HealthyFlight*> others;
    for (const auto& other : healthy) {
      if (other && other->truth_known && other->group != healthy[i]->group) others.push_back(&*other);
    }
    const auto learned = calibrate::learn(others, config, one_thread);
    if (!learned) {
      flights[i] = rt::fail_with(fmt::format("without {}: {}", healthy[i]->name, learned.error().text));
      return;
    }
    const auto monitor = with_calibration(config.monitor, config.channel_names(), learned->calibration);
    if (!monitor) {
      flights[i] = tl::unexpected{monitor.error()};
      return;
    }
    response::ResponseConfig warm = config;
    warm.monitor = *monitor;
    flights[i] = run_flight(logs[i], warm);
  });
  return flights;
}

}  // namespace airworthy::eval
