#pragma once

#include <string_view>

#include "core/time/time.h"

namespace airworthy::rt {

enum class Role { kInput, kDerived, kTruth };

/// A row of lcmtypes/channels.toml.
struct ChannelInfo {
  std::string_view name;  ///< without the vehicle prefix
  Role role;
  std::string_view producer;  ///< process name, or "driver", "detector", "any", "import"
  double nominal_Hz;          ///< 0 = as received or on change
  Duration staleness;         ///< 0 = not supervised
};

/// A channel with its message type, so that publishing the wrong type does not compile.
template <class Message>
struct Channel {
  ChannelInfo info;
};

}  // namespace airworthy::rt
