#pragma once

#include <string>
#include <vector>

#include "cli/import/flight_log.h"

namespace airworthy::importer {

/// For people: one paragraph a log.
[[nodiscard]] std::string to_text(const std::vector<LogSummary>& logs);

/// {"logs":[{"log","vehicle","start_us","end_us","messages":{channel:count},"left_out":{reason:count}}]}
[[nodiscard]] std::string to_json(const std::vector<LogSummary>& logs);

}  // namespace airworthy::importer
