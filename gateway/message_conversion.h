#pragma once

#include <optional>

#include "airworthy/detector_status_t.hpp"
#include "airworthy/driver_status_t.hpp"
#include "airworthy/fault_event_t.hpp"
#include "airworthy/process_status_t.hpp"
#include "airworthy/vehicle_health_t.hpp"
#include "gateway/health/health_input.h"
#include "gateway/health/health_snapshot.h"

namespace airworthy::gateway {

/// Message to input of the health model. Nothing if a field that decides (state, phase) has no meaning.
[[nodiscard]] std::optional<health::ProcessSign> to_input(const process_status_t& message);
[[nodiscard]] std::optional<health::LinkReport> to_input(const driver_status_t& message);
[[nodiscard]] std::optional<health::FaultReport> to_input(const fault_event_t& message);
[[nodiscard]] std::optional<health::DetectorReport> to_input(const detector_status_t& message);

[[nodiscard]] vehicle_health_t to_message(const health::HealthSnapshot& snapshot);

}  // namespace airworthy::gateway
