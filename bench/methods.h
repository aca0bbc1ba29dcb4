#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace airworthy::bench {

/// Steps of a method, by its name in the table of benchmarks.
template <class Steps>
struct Method {
  std::string_view name;
};

/// Calls run(steps) with new steps of the method of that name; false if there is none.
template <class Run, class... Steps>
bool run_method(std::string_view name, const Run& run, const Method<Steps>&... methods) {
  return ((methods.name == name && (run(Steps{}), true)) || ...);
}

/// Calls with_count(N), N a constant, for one of the numbers of rotors that are counted and timed; false for any other.
template <class WithCount>
bool with_rotor_count(std::int64_t rotors, const WithCount& with_count) {
  switch (rotors) {
    case 4:
      return with_count(std::integral_constant<std::size_t, 4>{});
    case 6:
      return with_count(std::integral_constant<std::size_t, 6>{});
    case 8:
      return with_count(std::integral_constant<std::size_t, 8>{});
    default:
      return false;
  }
}

}  // namespace airworthy::bench
