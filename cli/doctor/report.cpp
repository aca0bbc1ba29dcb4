#include "cli/doctor/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace airworthy::doctor {
namespace {

std::ptrdiff_t count(const std::vector<Finding>& findings, Level level) {
  return std::count_if(findings.begin(), findings.end(),
                       [level](const Finding& finding) { return finding.level == level; });
}

/// Further lines of a text stand below its first.
std::string detail(std::string_view label, std::string_view text) {
  if (text.empty()) return {};
  std::string out = fmt::format("    {:<10} ", label);
  for (const char c : text) {
    out += c;
    if (c == '\n') out.append(15, ' ');
  }
  return out + '\n';
}

}  // namespace

std::string_view name(Level level) {
  switch (level) {
    case Level::kOk:
      return "ok";
    case Level::kWarning:
      return "warning";
    case Level::kFailure:
      return "failure";
    case Level::kUnknown:
      return "unknown";
  }
  return "unknown";
}

std::string to_text(const std::vector<Finding>& findings) {
  std::string out;
  for (const auto& finding : findings) {
    out += fmt::format("{:<8} {:<23} {}\n", name(finding.level), finding.id, finding.found);
    if (finding.level == Level::kOk) continue;
    out += detail("why", finding.why) + detail("cure", finding.cure) + detail("for good", finding.permanent);
  }
  out += fmt::format("{} failed, {} warnings, {} ok, {} unknown\n", count(findings, Level::kFailure),
                     count(findings, Level::kWarning), count(findings, Level::kOk),
                     count(findings, Level::kUnknown));
  return out;
}

std::string to_json(const std::vector<Finding>& findings) {
  auto list = nlohmann::json::array();
  for (const auto& finding : findings) {
    list.push_back({{"id", finding.id},
                    {"level", name(finding.level)},
                    {"found", finding.found},
                    {"why", finding.why},
                    {"cure", finding.cure},
                    {"permanent", finding.permanent}});
  }
  const nlohmann::json report{
      {"schema", 1}, {"failures", count(findings, Level::kFailure)}, {"findings", std::move(list)}};
  // Texts may hold a path that is not UTF-8.
  return report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + '\n';
}

bool has_failure(const std::vector<Finding>& findings) { return count(findings, Level::kFailure) > 0; }

}  // namespace airworthy::doctor
