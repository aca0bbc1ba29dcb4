#include "cli/import/summary.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace airworthy::importer {

std::string to_text(const std::vector<LogSummary>& logs) {
  std::string text;
  for (const LogSummary& log : logs) {
    text += fmt::format("{}: {:.1f} s\n", log.log, static_cast<double>(log.end_us - log.start_us) * 1e-6);
    for (const auto& [channel, count] : log.messages) text += fmt::format("  {:8} {}\n", count, channel);
    for (const auto& [reason, count] : log.left_out)
      text += fmt::format("  {:8} left out: {}\n", count, reason);
  }
  return text;
}

std::string to_json(const std::vector<LogSummary>& logs) {
  nlohmann::ordered_json document;
  document["logs"] = nlohmann::ordered_json::array();
  for (const LogSummary& log : logs) {
    nlohmann::ordered_json entry;
    entry["log"] = log.log;
    entry["vehicle"] = log.vehicle;
    entry["start_us"] = log.start_us;
    entry["end_us"] = log.end_us;
    entry["messages"] = log.messages;
    entry["left_out"] = log.left_out;
    document["logs"].push_back(std::move(entry));
  }
  return document.dump(2) + '\n';
}

}  // namespace airworthy::importer
