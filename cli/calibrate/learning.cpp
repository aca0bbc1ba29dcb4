#include "cli/calibrate/learning.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <thread>

#include "cli/calibrate/median.h"

namespace airworthy::calibrate {
namespace {

using response::Calibration;
using response::ChannelPrior;
using response::kMostTerms;
using response::ResponseConfig;
using Flights = std::vector<const HealthyFlight*>;
using Matrix = BoundedMatrix<double, kMostTerms>;
using Vector = BoundedVector<double, kMostTerms>;

constexpr double kHuberSigmas = 2.0;
constexpr int kReweightings = 6;
constexpr double kUnseenGram = 1e-4;  // share of a term's mean square
constexpr double kThresholdOutOfReach =
    1e6;  // so that no alarm stops the learning while statistics are taken
constexpr double kLowestThreshold = 1.0;

std::set<std::string> groups_of(const Flights& flights) {
  std::set<std::string> groups;
  for (const HealthyFlight* flight : flights) groups.insert(flight->group);
  return groups;
}

struct Fit {
  ChannelPrior prior;
  std::int64_t samples = 0;
};

// (1), (2) of the header; empty where the samples do not determine the terms.
std::optional<Fit> fit_prior(const Flights& flights, std::size_t channel, int terms,
                             std::int64_t worth_samples) {
  Fit fit;
  std::vector<double> y;
  std::vector<double> x;
  for (const HealthyFlight* flight : flights) {
    const HealthyFlight::Samples& samples = flight->channels[channel];
    y.insert(y.end(), samples.response.begin(), samples.response.end());
    x.insert(x.end(), samples.regressors.begin(), samples.regressors.end());
  }
  fit.samples = static_cast<std::int64_t>(y.size());
  if (fit.samples < std::int64_t{3} * terms) return std::nullopt;
  std::vector<double> weights(y.size(), 1.0);
  std::vector<double> errors(y.size());
  Vector theta;
  Matrix gram;
  const auto size = static_cast<std::size_t>(terms);
  for (int round = 0; round < kReweightings; ++round) {
    gram = Matrix::Zero(terms, terms);
    Vector b = Vector::Zero(terms);
    double weight_sum = 0;
    for (std::size_t k = 0; k < y.size(); ++k) {
      const double* row = x.data() + k * size;
      for (int i = 0; i < terms; ++i) {
        for (int j = 0; j <= i; ++j) gram(i, j) += weights[k] * row[i] * row[j];
        b(i) += weights[k] * row[i] * y[k];
      }
      weight_sum += weights[k];
    }
    gram /= weight_sum;
    b /= weight_sum;
    for (int i = 0; i < terms; ++i) {
      gram(i, i) += kUnseenGram * std::max(gram(i, i), 1e-12);
      for (int j = 0; j < i; ++j) gram(j, i) = gram(i, j);
    }
    Matrix inverse;
    if (!invert_positive_definite<double, kMostTerms>(gram, inverse)) return std::nullopt;
    theta = inverse * b;
    for (std::size_t k = 0; k < y.size(); ++k) {
      const double* row = x.data() + k * size;
      double expected = 0;
      for (int i = 0; i < terms; ++i) expected += theta(i) * row[i];
      errors[k] = std::abs(y[k] - expected);
    }
    fit.prior.sigma = std::max(1.4826 * median(errors), 1e-9);
    for (std::size_t k = 0; k < y.size(); ++k) {
      weights[k] = std::min(1.0, kHuberSigmas * fit.prior.sigma / std::max(errors[k], 1e-300));
    }
  }
  auto next = fit.prior.gram.begin();
  for (int i = 0; i < terms; ++i) {
    fit.prior.theta[static_cast<std::size_t>(i)] = theta(i);
    for (int j = 0; j < terms; ++j) *next++ = gram(i, j);
  }
  fit.prior.worth_samples = worth_samples;
  fit.prior.threshold = kThresholdOutOfReach;
  return fit;
}

double mean_residual(const HealthyFlight::Samples& samples, const ChannelPrior& prior, int terms) {
  double sum = 0;
  for (std::size_t k = 0; k < samples.response.size(); ++k) {
    sum += samples.response[k];
    for (int i = 0; i < terms; ++i) {
      sum -= prior.theta[static_cast<std::size_t>(i)] *
             samples.regressors[k * static_cast<std::size_t>(terms) + static_cast<std::size_t>(i)];
    }
  }
  return samples.response.empty() ? 0 : sum / static_cast<double>(samples.response.size());
}

// One configuration's priors, thresholds still out of reach.
Calibration::Configuration fit_configuration(const Flights& flights, const ResponseConfig& config,
                                             const LearningParams& params, std::vector<std::string>* notes) {
  Calibration::Configuration configuration;
  configuration.airspeed_sensor = flights.front()->airspeed_sensor;
  configuration.flights = static_cast<int>(groups_of(flights).size());
  for (const HealthyFlight* flight : flights) configuration.flown_s += flight->flown_s;
  for (std::size_t i = 0; i < config.channels.size(); ++i) {
    if (config.monitor.methods[i] != response::Method::kRegression) continue;
    const int terms = config.monitor.channels[i].term_count;
    const auto fit = fit_prior(flights, i, terms, params.worth_samples);
    if (!fit) {
      if (notes != nullptr) {
        notes->push_back(fmt::format(
            "channel \"{}\" stays cold {} airspeed sensor: its inputs were missing, or never moved",
            config.channels[i].name, configuration.airspeed_sensor ? "with" : "without"));
      }
      continue;
    }
    Calibration::Channel channel;
    channel.name = config.channels[i].name;
    channel.model = describe(config.monitor.channels[i], config.monitor.tick_period);
    channel.prior = fit->prior;
    channel.samples = fit->samples;
    double square = 0;
    for (const HealthyFlight* flight : flights) {
      const double mean = mean_residual(flight->channels[i], fit->prior, terms);
      square += mean * mean;
    }
    channel.flight_spread = std::sqrt(square / static_cast<double>(flights.size()));
    configuration.channels.push_back(channel);
  }
  return configuration;
}

Flights without(const Flights& flights, const std::string& group) {
  Flights rest;
  std::copy_if(flights.begin(), flights.end(), std::back_inserter(rest),
               [&group](const HealthyFlight* flight) { return flight->group != group; });
  return rest;
}

}  // namespace

void for_each_parallel(std::size_t count, unsigned jobs, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  const auto worker = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::jthread> workers;
  for (unsigned i = 1; i < jobs; ++i) workers.emplace_back(worker);
  worker();
}

rt::Expected<Learned> learn(const std::vector<const HealthyFlight*>& flights, const ResponseConfig& config,
                            const LearningParams& params) {
  if (flights.empty()) return rt::fail_with("no flights to learn from");
  const auto& methods = config.monitor.methods;
  if (std::count(methods.begin(), methods.begin() + config.monitor.channel_count,
                 response::Method::kRegression) == 0) {
    return rt::fail_with("no channel is of method regression, so there is nothing to learn");
  }
  Learned learned;
  learned.calibration.vehicle = flights.front()->vehicle;
  learned.calibration.false_alarms_per_hour = params.false_alarms_per_hour;
  for (const HealthyFlight* flight : flights) {
    if (flight->vehicle != learned.calibration.vehicle) {
      return rt::fail_with(fmt::format("{}: of vehicle \"{}\", but {} is of \"{}\": one vehicle at a time",
                                       flight->log_path, flight->vehicle, flights.front()->log_path,
                                       learned.calibration.vehicle));
    }
  }

  // What each flight's statistics would have been with a prior that has not seen it.
  std::vector<std::vector<double>> maxima(config.channels.size());
  for (const bool airspeed_sensor : {false, true}) {
    Flights members;
    std::copy_if(flights.begin(), flights.end(), std::back_inserter(members),
                 [&](const HealthyFlight* flight) { return flight->airspeed_sensor == airspeed_sensor; });
    if (members.empty()) continue;
    const auto independent = groups_of(members).size();
    if (independent < kFewestFlights) {
      learned.notes.push_back(fmt::format(
          "{} airspeed sensor: {} independent flight{}; {} are needed, so this "
          "configuration stays cold",
          airspeed_sensor ? "with" : "without", independent, independent == 1 ? "" : "s", kFewestFlights));
      continue;
    }
    std::vector<rt::Expected<std::vector<std::vector<double>>>> seen(members.size());
    for_each_parallel(members.size(), params.jobs, [&](std::size_t i) {
      ResponseConfig warm = config;
      Calibration others;
      others.configurations.push_back(
          fit_configuration(without(members, members[i]->group), config, params, nullptr));
      const auto monitor = with_calibration(config.monitor, config.channel_names(), others);
      if (!monitor) {
        seen[i] = tl::unexpected{monitor.error()};
        return;
      }
      warm.monitor = *monitor;
      seen[i] = block_maxima(members[i]->log_path, warm);
    });
    for (const auto& one : seen) {
      if (!one) return tl::unexpected{one.error()};
      for (std::size_t c = 0; c < maxima.size(); ++c) {
        maxima[c].insert(maxima[c].end(), (*one)[c].begin(), (*one)[c].end());
      }
    }
    learned.calibration.configurations.push_back(fit_configuration(members, config, params, &learned.notes));
  }
  if (learned.calibration.configurations.empty()) {
    return rt::fail_with(fmt::format("too few flights: {}", learned.notes.front()));
  }

  for (std::size_t c = 0; c < maxima.size(); ++c) {
    learned.tails.push_back(fit_tail(maxima[c]));
    const Tail& tail = learned.tails.back();
    for (Calibration::Configuration& configuration : learned.calibration.configurations) {
      const auto channel = std::find_if(configuration.channels.begin(), configuration.channels.end(),
                                        [&](const auto& one) { return one.name == config.channels[c].name; });
      if (channel == configuration.channels.end()) continue;
      if (tail.blocks < Tail::kFewestBlocks) {
        learned.notes.push_back(
            fmt::format("channel \"{}\" stays cold: {} blocks of {:g} s were judged; {} are needed",
                        channel->name, tail.blocks, Tail::kBlock_s, Tail::kFewestBlocks));
        configuration.channels.erase(channel);
        continue;
      }
      channel->prior.threshold = std::max(kLowestThreshold, tail.threshold(params.false_alarms_per_hour));
    }
  }
  auto& configurations = learned.calibration.configurations;
  configurations.erase(std::remove_if(configurations.begin(), configurations.end(),
                                      [](const auto& one) { return one.channels.empty(); }),
                       configurations.end());
  if (configurations.empty()) {
    return rt::fail_with(fmt::format("nothing could be learned: {}", fmt::join(learned.notes, "; ")));
  }
  return learned;
}

}  // namespace airworthy::calibrate
