#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/import/flight_log.h"

namespace airworthy::importer {

/// A field of a message, of an array one element.
struct FieldSlot {
  std::size_t field = 0;
  std::size_t element = 0;
};

/// Fills the messages of one channel by the names of their fields: `roll_rad`, `accel_m_s2[2]`.
class MessageBuilder {
 public:
  /// The builder for a channel's name; null if there is none.
  [[nodiscard]] static std::unique_ptr<MessageBuilder> of(std::string_view channel);
  /// Names of all channels that have one.
  [[nodiscard]] static std::vector<std::string_view> channels();

  MessageBuilder() = default;
  MessageBuilder(const MessageBuilder&) = delete;
  MessageBuilder& operator=(const MessageBuilder&) = delete;
  virtual ~MessageBuilder() = default;

  /// The field with this name, with [element] if it is an array.
  [[nodiscard]] virtual std::optional<FieldSlot> find(std::string_view name) const = 0;
  /// Its unit as in its name, "" if it has none.
  [[nodiscard]] virtual std::string_view unit(FieldSlot slot) const = 0;

  /// Makes everything unknown. `rotors` is the length of arrays that have one element a rotor.
  virtual void clear(std::size_t rotors) = 0;
  /// NaN = unknown.
  virtual void set(FieldSlot slot, double value) = 0;
  virtual void publish(FlightLog& log, TimePoint time) = 0;
  /// Whether arrays have one element a rotor.
  [[nodiscard]] virtual bool is_per_rotor(FieldSlot slot) const = 0;
};

/// How a value in one unit becomes one in another: value · factor + offset.
struct UnitConversion {
  double factor = 1.0;
  double offset = 0.0;
};

/// The conversion from a unit called `from` to a field's unit; nothing if it is not known.
[[nodiscard]] std::optional<UnitConversion> find_conversion(std::string_view from, std::string_view to);
/// Units that convert to a field's unit, itself included.
[[nodiscard]] std::vector<std::string_view> units_for(std::string_view to);

}  // namespace airworthy::importer
