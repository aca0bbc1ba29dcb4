#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "cli/calibrate/effectiveness_learning.h"
#include "cli/eval/flight_run.h"
#include "services/effectiveness/effectiveness_service.h"
#include "tests/replay/imported.h"
#include "tests/replay/scaled_out_flight.h"
#include "tests/runtime/temporary_folder.h"
#include "tests/support/recorded_data.h"

// Sets of several recorded flights: each is judged after a calibration on the others. docs/evidence_effectiveness_recorded.md
// has the whole tables.

namespace airworthy::effectiveness {
namespace {

/// Recorded flights of one vehicle, imported with a shipped map.
class Set {
 public:
  Set(const std::string& map_name, const std::string& vehicle, const std::vector<std::string>& names,
      std::vector<std::string> overrides, const std::string& suffix) {
    overrides.push_back(std::string{"vehicle="} + AIRWORTHY_CONFIG + "/vehicles/" + vehicle + ".toml");
    auto config = EffectivenessConfig::load(AIRWORTHY_CONFIG "/effectiveness.toml", overrides);
    EXPECT_TRUE(config.has_value()) << (config ? "" : config.error().text);
    config_ = *config;
    for (const std::string& name : names) {
      const auto log = folder_.path() / (name + ".lcm");
      testing::import_recording(testing::recorded_data() / map_name / (name + suffix), map_name, log);
      logs_.push_back(log.string());
    }
  }

  /// The configuration after learning from these logs.
  [[nodiscard]] EffectivenessConfig taught_by(const std::vector<std::string>& logs,
                                              bool keeps_unexcited) const {
    EffectivenessConfig config = config_;
    const auto recordings = calibrate::read_effectiveness_recordings(logs, config, 2);
    EXPECT_TRUE(recordings.has_value()) << (recordings ? "" : recordings.error().text);
    if (!recordings) return config;
    const auto learned = calibrate::learn_effectiveness(*recordings, config, keeps_unexcited);
    EXPECT_TRUE(learned.has_value()) << (learned ? "" : learned.error().text);
    if (learned) config.monitor = with_calibration(config.monitor, *learned);
    return config;
  }
  [[nodiscard]] EffectivenessConfig taught_by_others(const std::string& log, bool keeps_unexcited) const {
    std::vector<std::string> others;
    std::copy_if(logs_.begin(), logs_.end(), std::back_inserter(others),
                 [&log](const std::string& other) { return other != log; });
    return taught_by(others, keeps_unexcited);
  }

  [[nodiscard]] const std::vector<std::string>& logs() const { return logs_; }

 private:
  rt::TemporaryFolder folder_;
  EffectivenessConfig config_;
  std::vector<std::string> logs_;
};

eval::Flight evaluate(const std::string& log, const EffectivenessConfig& config) {
  eval::JudgementLog judgement;
  auto flight = eval::run_flight(log, "airworthy-effectiveness", [&](rt::Node& node) {
    auto service = std::make_shared<EffectivenessService>(node, config);
    service->observe_judgement([&judgement](TimePoint from, TimePoint until, const std::string& why_muted) {
      judgement.note(from, until, why_muted);
    });
    return service;
  });
  EXPECT_TRUE(flight.has_value()) << (flight ? "" : flight.error().text);
  if (!flight) return {};
  flight->judgement = judgement;
  return *flight;
}

// 70 to 90 inertial samples a second over a radio that stamps on arrival, rates of 5 rad/s.
TEST(EffectivenessSets, TheCrazyflieIsJudgedAndSilent) {
  if (!std::filesystem::exists(testing::recorded_data() / "crazyflie_brushless_rpm"))
    GTEST_SKIP() << "no recorded flights in " << testing::recorded_data();
  const Set set{"crazyflie_brushless_rpm",
                "crazyflie_brushless",
                {"square_run1", "square_run2", "square_run4"},
                {"input.imu_rate_Hz=80", "input.inertial_delay_learned=true"},
                ".csv.xz"};
  for (const std::string& log : set.logs()) {
    const auto flight = evaluate(log, set.taught_by_others(log, false));
    EXPECT_TRUE(flight.alarms.empty()) << log;
    EXPECT_GT(flight.judgement.judged_s(), 15.0) << log;
  }
}

// No rotor reports in these runs. What fails acts up to 52 ms before its label, as the body's motion shows.
TEST(EffectivenessSets, NamesMotor1OfEverySimulatedPx4FlightByItsCommands) {
  if (!std::filesystem::exists(testing::recorded_data() / "rflymad_sim"))
    GTEST_SKIP() << "no recorded flights in " << testing::recorded_data();
  const Set fast{
      "rflymad_sim",
      "rflymad",
      {"TestCase_1_2000000000", "TestCase_3_2000000002", "TestCase_5_2000000004", "TestCase_7_2000000006"},
      {"input.imu_rate_Hz=225"},
      ""};
  const auto check = [](const std::string& log, const EffectivenessConfig& config) {
    const auto flight = evaluate(log, config);
    ASSERT_TRUE(flight.truth && flight.truth->onset) << log;
    ASSERT_FALSE(flight.alarms.empty()) << log;
    EXPECT_EQ(flight.alarms.front().component, "rotor 1") << log;
    const double after_label_s = to_seconds(flight.alarms.front().time - *flight.truth->onset);
    std::printf("%s: %.0f ms after the label, k %.2f\n", flight.name.c_str(), 1e3 * after_label_s,
                flight.alarms.front().magnitude);
    EXPECT_GT(after_label_s, -0.052) << log;
    EXPECT_LT(after_label_s, 0.1) << log;
    EXPECT_GT(flight.judgement.judged_s(), 10.0) << log;
  };
  for (const std::string& log : fast.logs()) check(log, fast.taught_by_others(log, false));
  // Commands ten times a second are enough to judge by, not to learn from.
  const Set slow{
      "rflymad_sim",
      "rflymad",
      {"TestCase_1_1000000000", "TestCase_3_1000000002", "TestCase_5_1000000004", "TestCase_7_1000000006"},
      {"input.imu_rate_Hz=180"},
      ""};
  for (const std::string& log : slow.logs()) check(log, fast.taught_by(fast.logs(), false));
}

TEST(EffectivenessSets, FindsARotorScaledOutOfARealThrow) {
  if (!std::filesystem::exists(testing::recorded_data() / "indiflight_throw"))
    GTEST_SKIP() << "no recorded flights in " << testing::recorded_data();
  const Set set{"indiflight_throw",
                "indiflight_throw",
                {"LOG00259", "LOG00266", "LOG00273", "LOG00276"},
                {},
                ".csv.xz"};
  const auto judging = set.taught_by({set.logs()[1], set.logs()[3]}, false);
  const auto truth = set.taught_by({set.logs()[0], set.logs()[2]}, false);
  const auto flight = testing::scale_out(set.logs()[0], judging, truth);
  ASSERT_TRUE(flight.has_value()) << flight.error().text;
  EXPECT_EQ(flight->healthy_alarms, 0);
  std::vector<double> delays_s;
  std::size_t missed = 0;
  for (const auto& one : flight->outcomes) {
    if (one.loss < 1.0) continue;
    if (!one.found) {  // while the motors are pulsed one by one, or tumbling
      ++missed;
      continue;
    }
    EXPECT_EQ(one.found->rotor, one.rotor) << one.onset_s;
    delays_s.push_back(one.delay_s);
  }
  ASSERT_GE(delays_s.size(), 20U);
  EXPECT_LE(10 * missed, delays_s.size());
  std::sort(delays_s.begin(), delays_s.end());
  std::printf("%zu propellers scaled out: %.0f ms median, %.0f ms at most\n", delays_s.size(),
              1e3 * delays_s[delays_s.size() / 2], 1e3 * delays_s.back());
  EXPECT_LT(delays_s[delays_s.size() / 2], 0.025);
}

}  // namespace
}  // namespace airworthy::effectiveness
