#include "cli/eval/concern.h"

#include <algorithm>
#include <array>

namespace airworthy::eval {
namespace {

constexpr std::string_view kOverEffective = "over_effective";
constexpr std::string_view kRotors = "rotors";  // as a name: some of them

/// A part of a fixed-wing, and the control that is lost with it as the response detector's channels call it.
struct Control {
  std::string_view part;
  std::string_view control;
};
constexpr std::array<Control, 9> kControls{{
    {"engine", "engine"},
    {"rudder", "lateral control"},
    {"elevator", "pitch control"},
    {"left aileron", "roll control"},
    {"right aileron", "roll control"},
    {"left elevon", "roll control"},
    {"left elevon", "pitch control"},
    {"right elevon", "roll control"},
    {"right elevon", "pitch control"},
}};

/// Kinds of faults of a rotor that are not a matter of its thrust alone.
struct RotorKind {
  std::string_view kind;
  bool is_of_thrust;
  bool is_of_balance;
};
constexpr std::array<RotorKind, 5> kRotorKinds{{
    {"unbalance", false, true},
    {"propeller_unbalance", false, true},
    {"propeller_damage", true, true},
    {"telemetry_frozen", false, false},  // the rotor is well, what is said of it is not
    {"telemetry_wrong_unit", false, false},
}};

template <class Table, class Predicate>
bool any(const Table& table, Predicate predicate) {
  return std::any_of(table.begin(), table.end(), predicate);
}

bool is_rotor(std::string_view component) { return component.starts_with("rotor "); }

bool is_called(std::string_view name, std::string_view component) {
  return name == component ||
         any(kControls, [&](const Control& row) { return row.part == component && row.control == name; });
}

// A rotor whose thrust is lost does not give too much. Of one that does not obey either may be true.
bool is_opposite(const Alarm& alarm, const Truth& fault) {
  if (fault.fault_kind == "stuck_command" || fault.fault_kind == "desync") return false;
  return (alarm.fault_kind == kOverEffective) != (fault.fault_kind == kOverEffective);
}

}  // namespace

bool watches(std::string_view detector, const Truth& fault) {
  if (!is_rotor(fault.component)) {
    return detector == "response" &&
           any(kControls, [&](const Control& row) { return row.part == fault.component; });
  }
  const auto row = std::find_if(kRotorKinds.begin(), kRotorKinds.end(),
                                [&](const RotorKind& of) { return of.kind == fault.fault_kind; });
  if (row == kRotorKinds.end()) return detector != "unbalance";
  return detector == "unbalance" ? row->is_of_balance : row->is_of_thrust;
}

Named named(const Alarm& alarm, const Truth& fault) {
  if (is_opposite(alarm, fault)) return Named::kAnother;
  if (is_called(alarm.component, fault.component)) return Named::kRight;
  const bool is_candidate = any(alarm.candidates, [&](const std::string& candidate) {
    return candidate == fault.component || (candidate == kRotors && is_rotor(fault.component));
  });
  return is_candidate ? Named::kAmong : Named::kAnother;
}

const char* to_string(Named named) {
  switch (named) {
    case Named::kRight:
      return "right";
    case Named::kAmong:
      return "one of several";
    case Named::kAnother:
      break;
  }
  return "another";
}

}  // namespace airworthy::eval
