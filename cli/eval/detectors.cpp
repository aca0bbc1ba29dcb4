#include "cli/eval/detectors.h"

#include "core/assert.h"
#include "services/effectiveness/effectiveness_service.h"
#include "services/unbalance/unbalance_service.h"

namespace airworthy::eval {
namespace {

/// The service refers to its configuration, so both live and die together.
template <class Config, class Service>
auto maker_of(const Config& config) {
  struct Pair {
    Pair(rt::Node& node, const Config& of) : config{of}, service{node, config} {}
    Config config;
    Service service;
  };
  return [config](rt::Node& node, JudgementLog& judgement) {
    auto pair = std::make_shared<Pair>(node, config);
    if constexpr (requires { pair->service.observe_judgement({}); }) {
      pair->service.observe_judgement(
          [&judgement](TimePoint from, TimePoint until, const std::string& why_muted) {
            judgement.note(from, until, why_muted);
          });
    }
    return pair;
  };
}

template <class Config, class Service>
rt::Expected<ConfiguredDetector> load(const std::string& process, const std::string& config_path,
                                      const std::vector<std::string>& overrides) {
  const auto config = Config::load(config_path, overrides);
  if (!config) return tl::unexpected<rt::Error>{config.error()};
  return ConfiguredDetector{process, config->vehicle, maker_of<Config, Service>(*config)};
}

}  // namespace

const std::vector<std::string>& detector_names() {
  static const std::vector<std::string> names{"response", "effectiveness", "unbalance"};
  return names;
}

rt::Expected<ConfiguredDetector> load_detector(const std::string& name, const std::string& config_path,
                                               const std::vector<std::string>& overrides) {
  if (name == "effectiveness") {
    return load<effectiveness::EffectivenessConfig, effectiveness::EffectivenessService>(
        "airworthy-effectiveness", config_path, overrides);
  }
  AW_ASSERT(name == "unbalance");  // the command line was checked against detector_names()
  return load<unbalance::UnbalanceConfig, unbalance::UnbalanceService>("airworthy-unbalance", config_path,
                                                                       overrides);
}

}  // namespace airworthy::eval
