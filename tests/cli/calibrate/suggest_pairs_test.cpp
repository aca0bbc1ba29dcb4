#include "cli/calibrate/suggest_pairs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

namespace airworthy::calibrate {
namespace {

using response::Signal;
using ::testing::HasSubstr;

/// Flights of 100 s in which every command moves by itself, as a first-order random walk to zero.
class SuggestPairsTest : public ::testing::Test {
 protected:
  SignalRecord flight() {
    SignalRecord record;
    record.tick_s = 0.1;
    record.columns.assign(response::kSignals,
                          std::vector<double>(1000, std::numeric_limits<double>::quiet_NaN()));
    return record;
  }

  std::vector<double> wander() {
    std::vector<double> values(1000);
    double value = 0;
    for (double& one : values) one = value = 0.9 * value + 0.2 * normal_(random_);
    return values;
  }

  std::vector<double>& column(SignalRecord& record, Signal signal) {
    return record.columns[static_cast<std::size_t>(signal)];
  }

  // y(k) = gain·u(k − delay) + noise
  std::vector<double> response_to(const std::vector<double>& u, double gain, std::size_t delay,
                                  double noise) {
    std::vector<double> y(u.size());
    for (std::size_t k = 0; k < y.size(); ++k)
      y[k] = gain * (k < delay ? 0.0 : u[k - delay]) + noise * normal_(random_);
    return y;
  }

  std::mt19937 random_{23};
  std::normal_distribution<double> normal_;
};

TEST_F(SuggestPairsTest, TheRightCommandDelayAndGainComeFirst) {
  auto record = flight();
  column(record, Signal::kRollError) = wander();
  column(record, Signal::kPitchError) = wander();  // a distractor
  column(record, Signal::kRollRate) = response_to(record[Signal::kRollError], 1.5, 3, 0.1);
  const auto suggestions = suggest_pairs({record, record});
  ASSERT_FALSE(suggestions.pairs.empty());
  const PairSuggestion& best = suggestions.pairs.front();
  EXPECT_EQ(best.response, Signal::kRollRate);
  ASSERT_EQ(best.inputs.size(), 1U);
  EXPECT_EQ(best.inputs[0].signal, Signal::kRollError);
  EXPECT_EQ(best.inputs[0].delay_ticks, 3);
  EXPECT_NEAR(best.inputs[0].gain, 1.5, 0.05);
  EXPECT_GT(best.predictability, 0.95);
  EXPECT_GT(best.linearity, 0.99);
  EXPECT_EQ(suggestions.pairs.size(), 1U) << "nothing follows the distractor";
  EXPECT_TRUE(suggestions.multi_input.empty());
}

TEST_F(SuggestPairsTest, ALinearResponseRanksAboveOneThatSaturates) {
  auto record = flight();
  column(record, Signal::kRollError) = wander();
  column(record, Signal::kPitchError) = wander();
  column(record, Signal::kRollRate) = response_to(record[Signal::kRollError], 1.0, 2, 0.05);
  auto pitch_rate = response_to(record[Signal::kPitchError], 6.0, 2, 0.05);
  for (double& rate : pitch_rate) rate = std::clamp(rate, -0.5, 0.5);
  column(record, Signal::kEulerPitchRate) = pitch_rate;
  const auto suggestions = suggest_pairs({record});
  ASSERT_EQ(suggestions.pairs.size(), 2U);
  EXPECT_EQ(suggestions.pairs[0].response, Signal::kRollRate);
  EXPECT_EQ(suggestions.pairs[1].response, Signal::kEulerPitchRate);
  EXPECT_LT(suggestions.pairs[1].linearity, 0.95);
}

TEST_F(SuggestPairsTest, AResponseToSeveralCommandsGetsThemAll) {
  auto record = flight();
  column(record, Signal::kCommand0) = wander();
  column(record, Signal::kCommand1) = wander();
  column(record, Signal::kCommand2) = wander();  // a distractor
  const auto first = response_to(record[Signal::kCommand0], -9.0, 1, 0.2);
  const auto second = response_to(record[Signal::kCommand1], -4.0, 1, 0.2);
  auto& lift = column(record, Signal::kAccelZ);
  for (std::size_t k = 0; k < lift.size(); ++k) lift[k] = first[k] + second[k];
  const auto suggestions = suggest_pairs({record});
  ASSERT_EQ(suggestions.multi_input.size(), 1U);
  const PairSuggestion& pair = suggestions.multi_input[0];
  ASSERT_EQ(pair.inputs.size(), 2U);
  EXPECT_EQ(pair.inputs[0].signal, Signal::kCommand0);
  EXPECT_NEAR(pair.inputs[0].gain, -9.0, 0.2);
  EXPECT_EQ(pair.inputs[1].signal, Signal::kCommand1);
  EXPECT_NEAR(pair.inputs[1].gain, -4.0, 0.2);
  EXPECT_GT(pair.predictability, suggestions.pairs[0].predictability + 0.05);
  EXPECT_THAT(to_table(suggestions, 0.1), HasSubstr("{signal = \"command_1_ratio\", delay_s = 0.1},"));
}

TEST_F(SuggestPairsTest, NoiseFollowsNothing) {
  auto record = flight();
  column(record, Signal::kRollSetpoint) = wander();
  column(record, Signal::kRollRate) = response_to(wander(), 0.0, 0, 1.0);
  const auto suggestions = suggest_pairs({record});
  EXPECT_TRUE(suggestions.pairs.empty());
  EXPECT_EQ(to_table(suggestions, 0.1), "No measured signal follows a commanded one in these logs.\n");
}

TEST_F(SuggestPairsTest, ACommandThatNeverMovesExplainsNothing) {
  auto record = flight();
  column(record, Signal::kRollSetpoint) = std::vector<double>(1000, 0.2);
  column(record, Signal::kRollRate) = wander();
  EXPECT_TRUE(suggest_pairs({record}).pairs.empty());
}

TEST_F(SuggestPairsTest, AnEmptyFlightSuggestsNothing) {
  EXPECT_TRUE(suggest_pairs({}).pairs.empty());
  EXPECT_TRUE(suggest_pairs({flight()}).pairs.empty());
}

TEST_F(SuggestPairsTest, TheJsonSaysTheSame) {
  auto record = flight();
  column(record, Signal::kRollError) = wander();
  column(record, Signal::kRollRate) = response_to(record[Signal::kRollError], 1.5, 3, 0.1);
  const auto document = nlohmann::json::parse(to_json(suggest_pairs({record}), 0.1));
  EXPECT_EQ(document["pairs"][0]["response"], "roll_rate_rad_s");
  EXPECT_EQ(document["pairs"][0]["inputs"][0]["signal"], "roll_error_rad");
  EXPECT_NEAR(document["pairs"][0]["inputs"][0]["delay_s"].get<double>(), 0.3, 1e-9);
}

}  // namespace
}  // namespace airworthy::calibrate
