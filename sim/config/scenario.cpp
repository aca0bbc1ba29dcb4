#include "sim/config/scenario.h"

#include <fmt/format.h>

#include <array>
#include <numbers>
#include <numeric>
#include <optional>
#include <string_view>

#include "runtime/config/config_file.h"

namespace airworthy::sim {
namespace {

enum class Subject { kRotor, kSensorAxis, kSensor, kLink };

/// How a kind of fault is written: its word, what it is about, and the key of its magnitude, if it has one.
struct FaultWord {
  FaultKind kind;
  std::string_view word;
  Subject subject;
  std::string_view magnitude_key;
  rt::Range magnitude_range;
  std::string_view growth_key;
};

constexpr rt::Range kAny{-1e6, 1e6};
constexpr rt::Range kShare{0.0, 1.0};
// In the order of FaultKind.
constexpr std::array kFaults{
    FaultWord{FaultKind::kUnbalance, "unbalance", Subject::kRotor, "tip_mass_mg", rt::Range{0.0, 1e5},
              "growth_mg_per_s"},
    FaultWord{FaultKind::kPropellerLost, "propeller_lost", Subject::kRotor, "", kAny, ""},
    FaultWord{FaultKind::kPartialLoss, "partial_loss", Subject::kRotor, "loss_ratio", kShare,
              "growth_ratio_per_s"},
    FaultWord{FaultKind::kStuckCommand, "stuck_command", Subject::kRotor, "", kAny, ""},
    FaultWord{FaultKind::kDeadEsc, "dead_esc", Subject::kRotor, "", kAny, ""},
    FaultWord{FaultKind::kDesync, "desync", Subject::kRotor, "", kAny, ""},
    FaultWord{FaultKind::kTelemetryFrozen, "telemetry_frozen", Subject::kRotor, "", kAny, ""},
    FaultWord{FaultKind::kTelemetryWrongUnit, "telemetry_wrong_unit", Subject::kRotor, "pole_pairs",
              rt::Range{2.0, 20.0}, ""},
    FaultWord{FaultKind::kLinkLoss, "link_loss", Subject::kLink, "", kAny, ""},
    FaultWord{FaultKind::kGyroBias, "gyro_bias", Subject::kSensorAxis, "bias_rad_s", kAny, ""},
    FaultWord{FaultKind::kGyroDrift, "gyro_drift", Subject::kSensorAxis, "", kAny, "drift_rad_s2"},
    FaultWord{FaultKind::kGyroSpike, "gyro_spike", Subject::kSensorAxis, "spike_rad_s", kAny, ""},
    FaultWord{FaultKind::kGyroFreeze, "gyro_freeze", Subject::kSensor, "", kAny, ""},
    FaultWord{FaultKind::kAccelBias, "accel_bias", Subject::kSensorAxis, "bias_m_s2", kAny, ""},
    FaultWord{FaultKind::kAccelDrift, "accel_drift", Subject::kSensorAxis, "", kAny, "drift_m_s3"},
    FaultWord{FaultKind::kAccelSpike, "accel_spike", Subject::kSensorAxis, "spike_m_s2", kAny, ""},
    FaultWord{FaultKind::kAccelFreeze, "accel_freeze", Subject::kSensor, "", kAny, ""},
};

const FaultWord& entry_of(FaultKind kind) { return kFaults[static_cast<std::size_t>(kind)]; }

std::optional<FaultKind> read_kind(rt::ConfigTable table) {
  const auto word = table.required<std::string>("kind");
  std::string words;
  for (const FaultWord& entry : kFaults) {
    if (entry.word == word) return entry.kind;
    words += fmt::format("{}{}", words.empty() ? "" : ", ", entry.word);
  }
  table.fail("kind", fmt::format("must be one of {}, is \"{}\"", words, word));
  return std::nullopt;
}

// What an unknown kind may be written with is not known: none of it is worth a complaint.
void pass_over(rt::ConfigTable table) {
  for (const std::string_view key : {"onset_s", "end_s", "rotor", "angle_deg"}) {
    static_cast<void>(table.if_present<double>(key));
  }
  for (const std::string_view key : {"axis", "link"}) static_cast<void>(table.if_present<std::string>(key));
  for (const FaultWord& entry : kFaults) {
    for (const std::string_view key : {entry.magnitude_key, entry.growth_key}) {
      if (!key.empty()) static_cast<void>(table.if_present<double>(key));
    }
  }
}

Fault read_fault(rt::ConfigTable table, std::size_t rotor_count) {
  Fault fault;
  const auto kind = read_kind(table);
  if (!kind) {
    pass_over(table);
    return fault;
  }
  fault.kind = *kind;
  const FaultWord& entry = entry_of(fault.kind);
  fault.onset_s = table.required<double>("onset_s", rt::Range{0.0, 1e6});
  if (const auto end = table.if_present<double>("end_s", rt::Range{0.0, 1e6})) {
    fault.end_s = *end;
    if (!(fault.end_s > fault.onset_s)) {
      table.fail("end_s", fmt::format("{:g} must exceed onset_s ({:g})", fault.end_s, fault.onset_s),
                 {"onset_s"});
    }
  }
  switch (entry.subject) {
    case Subject::kRotor:
      fault.rotor = static_cast<std::size_t>(
          table.required<int>("rotor", rt::Range{1.0, static_cast<double>(rotor_count)}));
      break;
    case Subject::kSensorAxis:
      fault.axis = table.choice<int>("axis", {{"x", 0}, {"y", 1}, {"z", 2}});
      break;
    case Subject::kSensor:
      break;
    case Subject::kLink:
      fault.link = table.choice<Link>("link", {{"esc", Link::kEsc}, {"autopilot", Link::kAutopilot}});
      break;
  }
  if (fault.kind == FaultKind::kUnbalance) {
    if (const auto angle_deg = table.if_present<double>("angle_deg", rt::Range{-360.0, 360.0})) {
      fault.angle_rad = *angle_deg * std::numbers::pi / 180.0;
    }
  }
  const bool grows = !entry.growth_key.empty();
  if (!entry.magnitude_key.empty()) {
    fault.magnitude = table.required<double>(entry.magnitude_key, entry.magnitude_range);
    if (grows) fault.growth_per_s = table.optional<double>(entry.growth_key, 0.0, kAny);
  } else if (grows) {
    fault.growth_per_s = table.required<double>(entry.growth_key, kAny);
  }
  return fault;
}

Segment read_segment(rt::ConfigTable table) {
  Segment segment;
  segment.manoeuvre = table.choice<Manoeuvre>("manoeuvre", {{"ground", Manoeuvre::kGround},
                                                            {"take_off", Manoeuvre::kTakeOff},
                                                            {"hover", Manoeuvre::kHover},
                                                            {"circle", Manoeuvre::kCircle},
                                                            {"random", Manoeuvre::kRandom},
                                                            {"land", Manoeuvre::kLand}});
  segment.duration_s = table.required<double>("duration_s", rt::Range{0.1, 1e6});
  constexpr rt::Range kSpeed_m_s{0.05, 20.0};
  switch (segment.manoeuvre) {
    case Manoeuvre::kTakeOff:
      segment.height_m = table.optional<double>("height_m", segment.height_m, rt::Range{0.2, 300.0});
      segment.speed_m_s = table.optional<double>("speed_m_s", segment.speed_m_s, kSpeed_m_s);
      break;
    case Manoeuvre::kLand:
      segment.speed_m_s = table.optional<double>("speed_m_s", 0.5, kSpeed_m_s);
      break;
    case Manoeuvre::kCircle:
      segment.radius_m = table.optional<double>("radius_m", segment.radius_m, rt::Range{0.1, 1000.0});
      segment.speed_m_s = table.optional<double>("speed_m_s", segment.speed_m_s, kSpeed_m_s);
      break;
    case Manoeuvre::kRandom:
      segment.box_m = table.optional<double>("box_m", segment.box_m, rt::Range{0.1, 1000.0});
      segment.interval_s = table.optional<double>("interval_s", segment.interval_s, rt::Range{0.1, 1000.0});
      segment.speed_m_s = table.optional<double>("speed_m_s", 2.0, kSpeed_m_s);
      break;
    case Manoeuvre::kGround:
    case Manoeuvre::kHover:
      break;
  }
  return segment;
}

bool is_on_ground_after(Manoeuvre manoeuvre) {
  return manoeuvre == Manoeuvre::kGround || manoeuvre == Manoeuvre::kLand;
}

// A plan starts on the ground and flies only between take-off and landing.
void check_order(rt::ConfigTable root, const Scenario& scenario) {
  bool on_ground = true;
  for (std::size_t i = 0; i < scenario.segments.size(); ++i) {
    const Manoeuvre manoeuvre = scenario.segments[i].manoeuvre;
    const std::string key = fmt::format("segment[{}].manoeuvre", i);
    const bool must_be_on_ground = manoeuvre == Manoeuvre::kGround || manoeuvre == Manoeuvre::kTakeOff;
    if (must_be_on_ground && !on_ground) root.fail(key, "the vehicle is in the air: land first");
    if (!must_be_on_ground && on_ground) root.fail(key, "the vehicle is on the ground: take_off first");
    on_ground = is_on_ground_after(manoeuvre);
  }
  if (scenario.repeats && !on_ground)
    root.fail("repeat", "the plan ends in the air and starts on the ground");
}

}  // namespace

std::string_view word_of(FaultKind kind) { return entry_of(kind).word; }

bool has_magnitude(FaultKind kind) { return !entry_of(kind).magnitude_key.empty(); }

std::string Fault::component() const {
  if (rotor > 0) return fmt::format("rotor {}", rotor);
  if (link == Link::kEsc) return "link esc";
  if (link == Link::kAutopilot) return "link autopilot";
  return "imu";
}

double Scenario::duration_s() const {
  return std::accumulate(segments.begin(), segments.end(), 0.0,
                         [](double sum, const Segment& segment) { return sum + segment.duration_s; });
}

rt::Expected<Scenario> Scenario::load(const std::filesystem::path& path, std::size_t rotor_count,
                                      const std::vector<std::string>& overrides) {
  auto file = rt::ConfigFile::load(path, overrides);
  rt::ConfigTable root = file.root();
  Scenario scenario;
  scenario.description = root.optional<std::string>("description", "");
  scenario.repeats = root.optional<bool>("repeat", false);
  for (const rt::ConfigTable& table : root.tables("segment", {.count = rt::Count::at_least(1)})) {
    scenario.segments.push_back(read_segment(table));
  }
  check_order(root, scenario);
  for (const rt::ConfigTable& table : root.tables("fault"))
    scenario.faults.push_back(read_fault(table, rotor_count));
  return file.finish(std::move(scenario));
}

}  // namespace airworthy::sim
