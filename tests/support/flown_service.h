#pragma once

#include <string>
#include <utility>

#include "airworthy/tick_t.hpp"
#include "sim/output/log_output.h"
#include "sim/simulation.h"
#include "tests/support/detector_bench.h"

namespace airworthy::test {

/// A simulated multirotor at hard realism, and a detector's service that listens to it.
template <class Service, class Config>
class FlownService : public DetectorBench {
 protected:
  /// What flies need not be what the configuration describes.
  FlownService(const std::string& process, Config config, const Multirotor& flies,
               const sim::Scenario& scenario, sim::Seeds seeds)
      : DetectorBench{config.vehicle, process, sim::LogOutput::vehicle_time(0.0)},
        config_{std::move(config)},
        output_{*bus_, config_.vehicle, flies.rotor_count, 1},
        simulation_{flies, scenario, sim::Realism::at(sim::Level::kHard), seeds} {}

  void fly_until(double time_s) {
    while (simulation_.time_s() < time_s) {
      simulation_.step(output_);
      deliver();
      clock_.advance_to(clock_.now() + Duration{2'000});
    }
  }

  /// For two seconds only the gateway's clock is heard.
  void fall_silent() {
    rt::Node gateway{*bus_, clock_, log_, {config_.vehicle, "airworthy-gateway", 9}};
    auto ticks = gateway.advertise(channel::kTick);
    for (int i = 0; i < 40; ++i) {
      clock_.advance_to(clock_.now() + Duration{50'000});
      tick_t tick{};
      ticks.publish(tick, sim::LogOutput::vehicle_time(simulation_.time_s() + 0.05 * i));
      deliver();
    }
  }

  Config config_;
  sim::LogOutput output_;
  sim::Simulation simulation_;
  Service service_{node_, config_};
};

}  // namespace airworthy::test
