#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/vehicle/multirotor.h"
#include "gateway/feed/feed_config.h"
#include "gateway/health/health_config.h"
#include "runtime/config/config_file.h"

namespace airworthy::gateway {

/// config/gateway.toml
struct GatewayConfig {
  std::string vehicle;
  std::optional<Multirotor> multirotor;  ///< where the vehicle file describes one
  std::string hash;
  FeedConfig feed;
  health::HealthConfig health;

  [[nodiscard]] static rt::Expected<GatewayConfig> load(const std::string& path,
                                                        const std::vector<std::string>& overrides);
};

}  // namespace airworthy::gateway
