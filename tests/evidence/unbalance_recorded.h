#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_sets.h"

namespace airworthy::testing {

/// Phase coherence, amplitudes and natural unbalance of the Bebop.
[[nodiscard]] nlohmann::json bebop_evidence(const std::filesystem::path& data);
/// What the monitor says of healthy flights.
[[nodiscard]] nlohmann::json healthy_evidence(const std::filesystem::path& data);
/// What the monitor says of CrazyPAD's flights, cut, taped and normal, from their commands alone.
[[nodiscard]] nlohmann::json crazypad_evidence(const std::filesystem::path& data);
/// An unbalance added to recorded acceleration.
[[nodiscard]] nlohmann::json added_evidence(const std::filesystem::path& data, std::uint64_t seed);

}  // namespace airworthy::testing
