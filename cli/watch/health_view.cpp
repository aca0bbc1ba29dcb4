#include "cli/watch/health_view.h"

#include <fmt/format.h>

#include <limits>

#include "core/text/utf8.h"

namespace airworthy::watch {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestText_bytes = 512;
constexpr std::size_t kMostEntries = 512;

const json* member(const json& object, const std::string& key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

std::string text(const json& object, const std::string& key) {
  const json* value = member(object, key);
  if (value == nullptr || !value->is_string()) return {};
  return clean_text<std::string>(value->get_ref<const std::string&>(), kLongestText_bytes);
}

bool flag(const json& object, const std::string& key) {
  const json* value = member(object, key);
  return value != nullptr && value->is_boolean() && value->get<bool>();
}

std::optional<std::int64_t> integer(const json& object, const std::string& key) {
  const json* value = member(object, key);
  if (value == nullptr || !value->is_number_integer()) return std::nullopt;
  if (value->is_number_unsigned() &&
      value->get<std::uint64_t>() > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
    return std::nullopt;
  }
  return value->get<std::int64_t>();
}

std::string number_text(const json& object, const std::string& key) {
  const json* value = member(object, key);
  return value != nullptr && value->is_number() ? fmt::format("{:.3g}", value->get<double>()) : std::string{};
}

template <class Function>
void for_each(const json& object, const std::string& key, Function function) {
  const json* list = member(object, key);
  if (list == nullptr || !list->is_array()) return;
  std::size_t left = kMostEntries;
  for (const json& item : *list) {
    if (left-- == 0) return;
    function(item);
  }
}

std::string magnitude(const json& fault) {
  std::string value = number_text(fault, "magnitude");
  if (value.empty()) return {};
  if (const std::string sigma = number_text(fault, "magnitude_sigma"); !sigma.empty()) value += " ± " + sigma;
  if (const std::string unit = text(fault, "magnitude_unit"); !unit.empty() && unit != "1")
    value += " " + unit;
  return value;
}

Since since(const json& object, const std::string& name, std::optional<std::int64_t> now_us) {
  Since since{std::nullopt, text(object, name + "_utc")};
  const auto then_us = integer(object, name + "_us");
  std::int64_t age_us = 0;
  if (now_us && then_us && !__builtin_sub_overflow(*now_us, *then_us, &age_us) && age_us >= 0)
    since.age_us = age_us;
  return since;
}

FaultView fault_view(const json& fault, std::optional<std::int64_t> now_us) {
  FaultView view;
  view.producer = text(fault, "producer");
  view.id = fmt::format("{}/{}/{}", view.producer, integer(fault, "session").value_or(-1),
                        integer(fault, "number").value_or(-1));
  view.phase = text(fault, "phase");
  view.component = text(fault, "component");
  view.fault_kind = text(fault, "fault_kind");
  view.severity = text(fault, "severity");
  view.advice = text(fault, "advice");
  view.summary = text(fault, "summary");
  view.magnitude = magnitude(fault);
  view.unconfirmed = text(fault, "unconfirmed");
  view.latched = flag(fault, "latched");
  view.since = since(fault, "detected", now_us);
  return view;
}

}  // namespace

HealthView health_view(const json& body) {
  HealthView view;
  const auto now_us = integer(body, "time_us");
  view.vehicle = text(body, "vehicle");
  view.utc = text(body, "time_utc");
  view.status = text(body, "status");
  view.flight_phase = text(body, "flight_phase");
  view.root_cause = text(body, "root_cause");
  view.advice = text(body, "advice");
  for_each(body, "components", [&](const json& item) {
    ComponentView component{text(item, "component"),
                            text(item, "status"),
                            since(item, "since", now_us),
                            {},
                            text(item, "advice")};
    for_each(item, "reasons", [&](const json& reason) {
      if (!reason.is_string()) return;
      component.reasons.push_back(
          clean_text<std::string>(reason.get_ref<const std::string&>(), kLongestText_bytes));
    });
    view.components.push_back(std::move(component));
  });
  for_each(body, "processes", [&](const json& item) {
    view.processes.push_back({text(item, "process"), text(item, "status"), flag(item, "expected"),
                              since(item, "since", now_us), integer(item, "restarts").value_or(0),
                              text(item, "detail")});
  });
  for_each(body, "links", [&](const json& item) {
    LinkView link{text(item, "driver"), text(item, "link"), text(item, "status"),
                  since(item, "since", now_us), text(item, "detail")};
    for_each(item, "rates", [&](const json& rate) {
      const json* value = member(rate, "rate_Hz");
      if (value == nullptr || !value->is_number() || value->get<double>() <= 0.0) return;
      link.rates.push_back(fmt::format("{} {:.3g} Hz", text(rate, "name"), value->get<double>()));
    });
    view.links.push_back(std::move(link));
  });
  for_each(body, "faults", [&](const json& item) { view.faults.push_back(fault_view(item, now_us)); });
  return view;
}

FaultView event_view(const json& body) {
  const json* event = member(body, "event");
  return fault_view(event == nullptr ? json::object() : *event, integer(body, "time_us"));
}

}  // namespace airworthy::watch
