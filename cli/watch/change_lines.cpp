#include "cli/watch/change_lines.h"

#include <fmt/format.h>

#include <utility>

namespace airworthy::watch {
namespace {

std::string join(const std::vector<std::string>& texts) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : "; ") + text;
  return joined;
}

std::string with(std::string text, const std::string& detail) {
  if (!detail.empty()) text += ": " + detail;
  return text;
}

}  // namespace

std::vector<std::string> ChangeLines::add(const HealthView& view) {
  std::map<std::string, Line> now;
  const auto put = [&](const std::string& subject, const std::string& state, const std::string& detail) {
    now[subject] = {state + "\n" + detail, with(subject + " " + state, detail)};
  };
  if (!view.flight_phase.empty()) put("flight phase", view.flight_phase, "");
  for (const ComponentView& c : view.components) {
    put("component " + c.name, c.status, join(c.reasons));
    // The text of a fault follows its numbers; the fault has lines of its own.
    if (c.status != "unknown") now["component " + c.name].state = c.status;
  }
  for (const ProcessView& p : view.processes) put("process " + p.name, p.status, p.detail);
  for (const LinkView& l : view.links) put("link " + l.name + " of " + l.driver, l.status, l.detail);
  for (const FaultView& f : view.faults) {
    put("fault " + f.id,
        fmt::format("{} {} {}{}{}", f.severity, f.component, f.fault_kind, f.latched ? " latched" : "",
                    f.unconfirmed.empty() ? "" : " unconfirmed (" + f.unconfirmed + ")"),
        f.summary);
    now["fault " + f.id].state = f.severity + f.component + f.unconfirmed;
  }

  std::vector<std::string> lines;
  std::string vehicle = fmt::format("vehicle {} {}{}{}", view.vehicle, view.status,
                                    view.root_cause.empty() ? "" : ", root cause " + view.root_cause,
                                    view.advice.empty() ? "" : ": " + view.advice);
  if (vehicle != vehicle_) lines.push_back(vehicle);
  vehicle_ = std::move(vehicle);
  for (const auto& [subject, line] : now) {
    const auto before = known_.find(subject);
    if (before == known_.end() || before->second.state != line.state) lines.push_back(line.text);
  }
  for (const auto& [subject, line] : known_) {
    if (now.contains(subject)) continue;
    lines.push_back(subject + (subject.starts_with("fault ") ? " cleared" : " is no longer reported"));
  }
  known_ = std::move(now);
  return lines;
}

std::string event_line(const FaultView& event) {
  const std::string text =
      fmt::format("event {} {} {} {}{}, fault {}", event.phase, event.severity, event.component,
                  event.fault_kind, event.magnitude.empty() ? "" : " " + event.magnitude, event.id);
  return with(text, event.summary);
}

}  // namespace airworthy::watch
