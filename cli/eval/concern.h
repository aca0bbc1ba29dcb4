#pragma once

#include <string_view>

#include "cli/eval/flight.h"

namespace airworthy::eval {

/// The one place that says which faults are whose, and by which names a fault may be called: docs/evaluation.md has it as
/// tables. Where it knows neither kind nor component, nobody is to find the fault.

/// Whether the detector ("response", "effectiveness", "unbalance") is to find this fault. Of any other it must not
/// speak: the parts it names have nothing.
[[nodiscard]] bool watches(std::string_view detector, const Truth& fault);

/// How an alarm names a fault, from bad to good.
enum class Named {
  kAnother,  ///< a part that has nothing, or the opposite fault
  kAmong,    ///< the failed part is one of the candidates
  kRight,    ///< the failed part, or the control that is lost with it
};

[[nodiscard]] Named named(const Alarm& alarm, const Truth& fault);

[[nodiscard]] const char* to_string(Named named);

}  // namespace airworthy::eval
