#include "cli/eval/concern.h"

#include <gtest/gtest.h>

namespace airworthy::eval {
namespace {

Truth fault(const std::string& component, const std::string& kind) {
  return {component, kind, from_us(0), std::nullopt};
}

Named named_so(const std::string& component, const std::string& kind, const Truth& truth,
               const std::vector<std::string>& candidates = {}) {
  return named({from_us(0), from_us(0), component, kind, 0.0, candidates}, truth);
}

TEST(Watches, WhoseFaultIsWhose) {
  struct Row {
    Truth fault;
    bool response, effectiveness, unbalance;
  };
  const std::vector<Row> rows{
      {fault("engine", "thrust_loss"), true, false, false},
      {fault("rudder", "hardover_left"), true, false, false},
      {fault("left aileron", "stuck"), true, false, false},
      {fault("right elevon", "actuator_offset"), true, false, false},
      {fault("rotor 3", "partial_loss"), true, true, false},
      {fault("rotor 3", "over_effective"), true, true, false},
      {fault("rotor 3", "dead_esc"), true, true, false},
      {fault("rotor 3", "a kind nobody knows"), true, true, false},
      {fault("rotor 3", "unbalance"), false, false, true},
      {fault("rotor 3", "propeller_unbalance"), false, false, true},
      {fault("rotor 3", "propeller_damage"), true, true, true},
      {fault("rotor 3", "telemetry_frozen"), false, false, false},
      {fault("rotor 3", "telemetry_wrong_unit"), false, false, false},
      {fault("imu", "gyro_freeze"), false, false, false},
      {fault("link esc", "link_loss"), false, false, false},
      {fault("airframe", "added_weight"), false, false, false},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(row.fault.component + " " + row.fault.fault_kind);
    EXPECT_EQ(watches("response", row.fault), row.response);
    EXPECT_EQ(watches("effectiveness", row.fault), row.effectiveness);
    EXPECT_EQ(watches("unbalance", row.fault), row.unbalance);
  }
}

TEST(NamedSo, ThePartOrTheControlThatIsLostWithItIsRight) {
  EXPECT_EQ(named_so("rotor 3", "propeller_lost", fault("rotor 3", "partial_loss")), Named::kRight);
  EXPECT_EQ(named_so("rotor 1", "partial_loss", fault("rotor 3", "partial_loss")), Named::kAnother);
  EXPECT_EQ(named_so("engine", "thrust_loss", fault("engine", "thrust_loss")), Named::kRight);
  EXPECT_EQ(named_so("pitch control", "control_effectiveness_loss", fault("engine", "thrust_loss")),
            Named::kAnother);
  EXPECT_EQ(named_so("roll control", "response_anomaly", fault("left aileron", "stuck")), Named::kRight);
  EXPECT_EQ(named_so("pitch control", "response_anomaly", fault("left aileron", "stuck")), Named::kAnother);
  EXPECT_EQ(named_so("pitch control", "response_anomaly", fault("left elevon", "stuck")), Named::kRight);
  EXPECT_EQ(named_so("lateral control", "lateral_force_anomaly", fault("rudder", "stuck")), Named::kRight);
}

TEST(NamedSo, OneOfSeveralCandidatesIsNotIsolated) {
  const Truth truth = fault("rotor 3", "unbalance");
  EXPECT_EQ(named_so("rotors", "unbalance", truth, {"rotor 1", "rotor 3"}), Named::kAmong);
  EXPECT_EQ(named_so("rotors", "unbalance", truth, {"rotor 1", "rotor 2"}), Named::kAnother);
  EXPECT_EQ(named_so("roll control", "response_anomaly", fault("rotor 1", "propeller_lost"), {"rotors"}),
            Named::kAmong);
}

TEST(NamedSo, TooMuchThrustContradictsALoss) {
  EXPECT_EQ(named_so("rotor 3", "over_effective", fault("rotor 3", "partial_loss")), Named::kAnother);
  EXPECT_EQ(named_so("rotor 3", "partial_loss", fault("rotor 3", "over_effective")), Named::kAnother);
  EXPECT_EQ(named_so("rotor 3", "over_effective", fault("rotor 3", "over_effective")), Named::kRight);
  EXPECT_EQ(named_so("rotor 3", "over_effective", fault("rotor 3", "stuck_command")), Named::kRight);
}

}  // namespace
}  // namespace airworthy::eval
