#include "cli/calibrate/healthy_flight.h"

#include <algorithm>
#include <cmath>

#include "cli/calibrate/tail.h"
#include "cli/eval/flight_run.h"

namespace airworthy::calibrate {
namespace {

using response::ResponseConfig;
using response::ResponseMonitor;

bool all_finite(const BoundedVector<double, response::kMostTerms>& x) { return x.allFinite(); }

TimePoint healthy_until(const eval::Flight& flight) {
  return flight.truth && flight.truth->onset ? *flight.truth->onset - HealthyFlight::kBeforeOnset
                                             : TimePoint::max();
}

}  // namespace

rt::Expected<HealthyFlight> read_healthy_flight(const std::string& log_path, const ResponseConfig& config) {
  struct Tick {
    TimePoint time;
    std::vector<double> responses;
    std::vector<double> regressors;
  };
  std::vector<Tick> ticks;
  HealthyFlight healthy;
  const auto flight = eval::run_flight(log_path, config, [&](const ResponseMonitor& monitor) {
    if (monitor.muted() != response::Muted::kNo) return;
    Tick& tick = ticks.emplace_back();
    tick.time = monitor.tick_time();
    for (int i = 0; i < config.monitor.channel_count; ++i) {
      tick.responses.push_back(monitor.verdicts()[static_cast<std::size_t>(i)].observed);
      const auto& x = monitor.channel(i).regressors();
      const bool known = all_finite(x) && std::isfinite(tick.responses.back());
      if (!known) tick.responses.back() = std::nan("");
      tick.regressors.insert(tick.regressors.end(), x.begin(), x.end());
    }
    healthy.airspeed_sensor = monitor.airspeed_sensor();
  });
  if (!flight) return tl::unexpected{flight.error()};
  healthy.log_path = log_path;
  healthy.group = healthy.name = flight->name;
  healthy.vehicle = flight->vehicle;
  healthy.truth_known = flight->truth.has_value();
  healthy.channels.resize(static_cast<std::size_t>(config.monitor.channel_count));
  const TimePoint from = flight->start + HealthyFlight::kSettle;
  const TimePoint until = healthy_until(*flight);
  for (const Tick& tick : ticks) {
    if (tick.time < from || tick.time >= until) continue;
    healthy.flown_s += to_seconds(config.monitor.tick_period);
    auto x = tick.regressors.begin();
    for (std::size_t i = 0; i < healthy.channels.size(); ++i) {
      const auto next = x + config.monitor.channels[i].term_count;
      if (std::isfinite(tick.responses[i])) {
        healthy.channels[i].response.push_back(tick.responses[i]);
        healthy.channels[i].regressors.insert(healthy.channels[i].regressors.end(), x, next);
      }
      x = next;
    }
  }
  return healthy;
}

rt::Expected<std::vector<std::vector<double>>> block_maxima(const std::string& log_path,
                                                            const ResponseConfig& config) {
  const auto channels = static_cast<std::size_t>(config.monitor.channel_count);
  struct Tick {
    TimePoint time;
    std::vector<double> statistics;
  };
  std::vector<Tick> ticks;
  const auto flight = eval::run_flight(log_path, config, [&](const ResponseMonitor& monitor) {
    Tick& tick = ticks.emplace_back();
    tick.time = monitor.tick_time();
    bool judged = false;
    for (std::size_t i = 0; i < channels; ++i) {
      const response::ChannelVerdict& verdict = monitor.verdicts()[i];
      judged = judged || verdict.reason == response::NotJudged::kJudged;
      tick.statistics.push_back(verdict.test_ratio * monitor.channel(static_cast<int>(i)).threshold());
    }
    if (!judged || monitor.muted() != response::Muted::kNo) ticks.pop_back();
  });
  if (!flight) return tl::unexpected{flight.error()};
  const TimePoint until = healthy_until(*flight);
  std::vector<std::vector<double>> maxima(channels);
  const auto per_block = static_cast<std::size_t>(Tail::kBlock_s / to_seconds(config.monitor.tick_period));
  std::size_t count = 0;
  for (const Tick& tick : ticks) {
    if (tick.time >= until) break;
    const bool fresh = count++ % per_block == 0;
    for (std::size_t i = 0; i < channels; ++i) {
      if (fresh) maxima[i].push_back(0);
      maxima[i].back() = std::max(maxima[i].back(), tick.statistics[i]);
    }
  }
  if (count % per_block != 0 && count % per_block < per_block / 2) {  // too short a rest
    for (auto& channel : maxima) channel.pop_back();
  }
  return maxima;
}

}  // namespace airworthy::calibrate
