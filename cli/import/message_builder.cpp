#include "cli/import/message_builder.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "runtime/bus/channels.h"

namespace airworthy::importer {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kScalar = 0;
constexpr int kPerRotor = -1;
constexpr std::size_t kMostRotors = 16;

template <class Message>
struct Field {
  std::string_view name;
  std::string_view unit;
  int elements;  // kScalar, kPerRotor or how many
  void (*set)(Message&, std::size_t, double);
};

template <class Integer>
Integer integer_or(double value, Integer unknown) {
  return std::isnan(value) ? unknown : static_cast<Integer>(std::llround(value));
}

std::span<const Field<imu_t>> fields_of(const imu_t&) {
  static constexpr std::array<Field<imu_t>, 5> kFields{{
      {"sensor_id", "", kScalar,
       [](imu_t& m, std::size_t, double v) { m.sensor_id = integer_or<std::int8_t>(v, 0); }},
      {"accel_m_s2", "m_s2", 3, [](imu_t& m, std::size_t i, double v) { m.accel_m_s2[i] = v; }},
      {"gyro_rad_s", "rad_s", 3, [](imu_t& m, std::size_t i, double v) { m.gyro_rad_s[i] = v; }},
      {"temperature_degC", "degC", kScalar, [](imu_t& m, std::size_t, double v) { m.temperature_degC = v; }},
      {"averaging_window_s", "s", kScalar, [](imu_t& m, std::size_t, double v) { m.averaging_window_s = v; }},
  }};
  return kFields;
}
void make_unknown(imu_t& m, std::size_t) {
  m.sensor_id = 0;
  std::fill(std::begin(m.accel_m_s2), std::end(m.accel_m_s2), kNaN);
  std::fill(std::begin(m.gyro_rad_s), std::end(m.gyro_rad_s), kNaN);
  m.temperature_degC = kNaN;
  m.averaging_window_s = kNaN;
}

std::span<const Field<esc_status_t>> fields_of(const esc_status_t&) {
  using M = esc_status_t;
  static constexpr std::array<Field<M>, 5> kFields{{
      {"speed_rpm", "rpm", kPerRotor, [](M& m, std::size_t i, double v) { m.speed_rpm[i] = v; }},
      {"voltage_V", "V", kPerRotor, [](M& m, std::size_t i, double v) { m.voltage_V[i] = v; }},
      {"current_A", "A", kPerRotor, [](M& m, std::size_t i, double v) { m.current_A[i] = v; }},
      {"temperature_degC", "degC", kPerRotor,
       [](M& m, std::size_t i, double v) { m.temperature_degC[i] = v; }},
      {"error_count", "", kPerRotor,
       [](M& m, std::size_t i, double v) { m.error_count[i] = integer_or<std::int64_t>(v, -1); }},
  }};
  return kFields;
}
void make_unknown(esc_status_t& m, std::size_t rotors) {
  m.source = "import";
  m.rotor_count = static_cast<std::int32_t>(rotors);
  m.speed_rpm.assign(rotors, kNaN);
  m.voltage_V.assign(rotors, kNaN);
  m.current_A.assign(rotors, kNaN);
  m.temperature_degC.assign(rotors, kNaN);
  m.error_count.assign(rotors, -1);
}

std::span<const Field<rotor_command_t>> fields_of(const rotor_command_t&) {
  static constexpr std::array<Field<rotor_command_t>, 1> kFields{{
      {"command_ratio", "ratio", kPerRotor,
       [](rotor_command_t& m, std::size_t i, double v) { m.command_ratio[i] = v; }},
  }};
  return kFields;
}
void make_unknown(rotor_command_t& m, std::size_t rotors) {
  m.rotor_count = static_cast<std::int32_t>(rotors);
  m.command_ratio.assign(rotors, kNaN);
}

std::span<const Field<attitude_t>> fields_of(const attitude_t&) {
  static constexpr std::array<Field<attitude_t>, 4> kFields{{
      {"roll_rad", "rad", kScalar, [](attitude_t& m, std::size_t, double v) { m.roll_rad = v; }},
      {"pitch_rad", "rad", kScalar, [](attitude_t& m, std::size_t, double v) { m.pitch_rad = v; }},
      {"yaw_rad", "rad", kScalar, [](attitude_t& m, std::size_t, double v) { m.yaw_rad = v; }},
      {"rates_rad_s", "rad_s", 3, [](attitude_t& m, std::size_t i, double v) { m.rates_rad_s[i] = v; }},
  }};
  return kFields;
}
void make_unknown(attitude_t& m, std::size_t) {
  m.roll_rad = m.pitch_rad = m.yaw_rad = kNaN;
  std::fill(std::begin(m.rates_rad_s), std::end(m.rates_rad_s), kNaN);
}

std::span<const Field<attitude_setpoint_t>> fields_of(const attitude_setpoint_t&) {
  using M = attitude_setpoint_t;
  static constexpr std::array<Field<M>, 5> kFields{{
      {"roll_rad", "rad", kScalar, [](M& m, std::size_t, double v) { m.roll_rad = v; }},
      {"pitch_rad", "rad", kScalar, [](M& m, std::size_t, double v) { m.pitch_rad = v; }},
      {"yaw_rad", "rad", kScalar, [](M& m, std::size_t, double v) { m.yaw_rad = v; }},
      {"rates_rad_s", "rad_s", 3, [](M& m, std::size_t i, double v) { m.rates_rad_s[i] = v; }},
      {"thrust_ratio", "ratio", kScalar, [](M& m, std::size_t, double v) { m.thrust_ratio = v; }},
  }};
  return kFields;
}
void make_unknown(attitude_setpoint_t& m, std::size_t) {
  m.roll_rad = m.pitch_rad = m.yaw_rad = m.thrust_ratio = kNaN;
  std::fill(std::begin(m.rates_rad_s), std::end(m.rates_rad_s), kNaN);
}

std::span<const Field<flight_state_t>> fields_of(const flight_state_t&) {
  using M = flight_state_t;
  static constexpr std::array<Field<M>, 10> kFields{{
      {"airspeed_m_s", "m_s", kScalar, [](M& m, std::size_t, double v) { m.airspeed_m_s = v; }},
      {"groundspeed_m_s", "m_s", kScalar, [](M& m, std::size_t, double v) { m.groundspeed_m_s = v; }},
      {"climb_m_s", "m_s", kScalar, [](M& m, std::size_t, double v) { m.climb_m_s = v; }},
      {"altitude_m", "m", kScalar, [](M& m, std::size_t, double v) { m.altitude_m = v; }},
      {"altitude_error_m", "m", kScalar, [](M& m, std::size_t, double v) { m.altitude_error_m = v; }},
      {"airspeed_error_m_s", "m_s", kScalar, [](M& m, std::size_t, double v) { m.airspeed_error_m_s = v; }},
      {"crosstrack_error_m", "m", kScalar, [](M& m, std::size_t, double v) { m.crosstrack_error_m = v; }},
      {"armed", "", kScalar, [](M& m, std::size_t, double v) { m.armed = integer_or<std::int8_t>(v, -1); }},
      {"landed_state", "", kScalar,
       [](M& m, std::size_t, double v) { m.landed_state = integer_or<std::int8_t>(v, -1); }},
      {"mode", "", kScalar, [](M& m, std::size_t, double v) { m.mode = integer_or<std::int64_t>(v, -1); }},
  }};
  return kFields;
}
void make_unknown(flight_state_t& m, std::size_t) {
  m.airspeed_m_s = m.groundspeed_m_s = m.climb_m_s = m.altitude_m = kNaN;
  m.altitude_error_m = m.airspeed_error_m_s = m.crosstrack_error_m = kNaN;
  m.armed = -1;
  m.landed_state = -1;
  m.mode = -1;
}

template <class Message>
class BuilderFor final : public MessageBuilder {
 public:
  std::optional<FieldSlot> find(std::string_view name) const override {
    const std::size_t bracket = std::min(name.find('['), name.size());
    const std::string_view base = name.substr(0, bracket);
    const auto fields = fields_of(message_);
    const auto found =
        std::find_if(fields.begin(), fields.end(), [&](const auto& f) { return f.name == base; });
    if (found == fields.end()) return std::nullopt;
    const FieldSlot slot{static_cast<std::size_t>(found - fields.begin()), 0};
    if (found->elements == kScalar) return bracket == name.size() ? std::optional{slot} : std::nullopt;
    const auto element = parse_element(name.substr(bracket));
    const std::size_t most =
        found->elements == kPerRotor ? kMostRotors : static_cast<std::size_t>(found->elements);
    if (!element || *element >= most) return std::nullopt;
    return FieldSlot{slot.field, *element};
  }
  std::string_view unit(FieldSlot slot) const override { return fields_of(message_)[slot.field].unit; }
  bool is_per_rotor(FieldSlot slot) const override {
    return fields_of(message_)[slot.field].elements == kPerRotor;
  }
  void clear(std::size_t rotors) override { make_unknown(message_, rotors); }
  void set(FieldSlot slot, double value) override {
    fields_of(message_)[slot.field].set(message_, slot.element, value);
  }
  void publish(FlightLog& log, TimePoint time) override { log.publish(message_, time); }

 private:
  // "[2]"
  static std::optional<std::size_t> parse_element(std::string_view text) {
    if (text.size() < 3 || text.front() != '[' || text.back() != ']') return std::nullopt;
    std::size_t element = 0;
    const char* end = text.data() + text.size() - 1;
    const auto [stop, error] = std::from_chars(text.data() + 1, end, element);
    if (error != std::errc{} || stop != end) return std::nullopt;
    return element;
  }

  Message message_;
};

struct UnitRow {
  std::string_view from;
  std::string_view to;
  double factor;
  double offset;
};
constexpr double kStandardGravity_m_s2 = 9.80665;
constexpr std::array<UnitRow, 18> kUnits{{
    {"g", "m_s2", kStandardGravity_m_s2, 0.0},
    {"mg", "m_s2", kStandardGravity_m_s2 * 1e-3, 0.0},
    {"deg", "rad", std::numbers::pi / 180.0, 0.0},
    {"deg_s", "rad_s", std::numbers::pi / 180.0, 0.0},
    {"mrad_s", "rad_s", 1e-3, 0.0},
    {"rad_s", "rpm", 30.0 / std::numbers::pi, 0.0},
    {"rev_s", "rpm", 60.0, 0.0},
    {"percent", "ratio", 0.01, 0.0},
    {"cm_s", "m_s", 0.01, 0.0},
    {"km_h", "m_s", 1.0 / 3.6, 0.0},
    {"kn", "m_s", 1852.0 / 3600.0, 0.0},
    {"cm", "m", 0.01, 0.0},
    {"mm", "m", 0.001, 0.0},
    {"ft", "m", 0.3048, 0.0},
    {"mV", "V", 0.001, 0.0},
    {"mA", "A", 0.001, 0.0},
    {"K", "degC", 1.0, -273.15},
    {"ms", "s", 0.001, 0.0},
}};

}  // namespace

std::unique_ptr<MessageBuilder> MessageBuilder::of(std::string_view channel) {
  if (channel == channel::kImu.info.name) return std::make_unique<BuilderFor<imu_t>>();
  if (channel == channel::kEscStatus.info.name) return std::make_unique<BuilderFor<esc_status_t>>();
  if (channel == channel::kRotorCommand.info.name) return std::make_unique<BuilderFor<rotor_command_t>>();
  if (channel == channel::kAttitude.info.name) return std::make_unique<BuilderFor<attitude_t>>();
  if (channel == channel::kAttitudeSetpoint.info.name)
    return std::make_unique<BuilderFor<attitude_setpoint_t>>();
  if (channel == channel::kFlightState.info.name) return std::make_unique<BuilderFor<flight_state_t>>();
  return nullptr;
}

std::vector<std::string_view> MessageBuilder::channels() {
  return {
      channel::kImu.info.name,      channel::kEscStatus.info.name,        channel::kRotorCommand.info.name,
      channel::kAttitude.info.name, channel::kAttitudeSetpoint.info.name, channel::kFlightState.info.name};
}

std::optional<UnitConversion> find_conversion(std::string_view from, std::string_view to) {
  if (from == to) return UnitConversion{};
  for (const UnitRow& row : kUnits) {
    if (row.from == from && row.to == to) return UnitConversion{row.factor, row.offset};
  }
  return std::nullopt;
}

std::vector<std::string_view> units_for(std::string_view to) {
  std::vector<std::string_view> units{to};
  for (const UnitRow& row : kUnits) {
    if (row.to == to) units.push_back(row.from);
  }
  return units;
}

}  // namespace airworthy::importer
