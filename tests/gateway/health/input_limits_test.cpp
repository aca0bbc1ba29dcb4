#include "gateway/health/input_limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/gateway/health/health_bench.h"

namespace airworthy::health {
namespace {

using namespace std::string_literals;

TEST(CleanText, KeepsWhatIsPrintable) {
  EXPECT_EQ(clean_text("rotor 2", 64), "rotor 2");
  EXPECT_EQ(clean_text("12 g·mm ± 3 °C 漢 🚁", 64), "12 g·mm ± 3 °C 漢 🚁");
  EXPECT_EQ(clean_text("", 64), "");
}

TEST(CleanText, DefusesControlCharacters) {
  EXPECT_EQ(clean_text("a\x1b[2Jb", 64), "a [2Jb");
  EXPECT_EQ(clean_text("a\r\n\tb\0c\x7f"s, 64), "a   b c ");
  EXPECT_EQ(clean_text("a\xc2\x9b 31m", 64), "a  31m") << "the one-character form of ESC [";
}

TEST(CleanText, ReplacesBrokenUtf8) {
  EXPECT_EQ(clean_text("a\xff\xfe", 64), "a??");
  EXPECT_EQ(clean_text("\xc0\xaf", 64), "??") << "overlong";
  EXPECT_EQ(clean_text("\xed\xa0\x80", 64), "???") << "surrogate";
  EXPECT_EQ(clean_text("\xf4\x90\x80\x80", 64), "????") << "beyond U+10FFFF";
  EXPECT_EQ(clean_text("\xe6\xbc", 64), "??") << "cut short";
}

TEST(CleanText, CutsBetweenCharacters) {
  EXPECT_EQ(clean_text("aa漢漢", 5), "aa漢");
  EXPECT_EQ(clean_text("aa漢漢", 7), "aa漢");
  EXPECT_EQ(clean_text(std::string(10'000, 'x'), 64).size(), 64U);
}

TEST(BoundInput, ImpossibleNumbersBecomeUnknown) {
  const double infinity = std::numeric_limits<double>::infinity();
  Speaker speaker{"p"};
  HealthCounters counters;
  FaultReport fault = speaker.fault(at_s(0), 1, FaultPhase::kRaise, Severity::kWarning, "");
  fault.probability = 1.5;
  fault.magnitude = infinity;
  fault.magnitude_sigma = -1.0;
  fault.onset = TimePoint::min();
  fault.detected = TimePoint::max();
  fault.evidence = {{"x", -infinity, "m"}};
  Input input{fault};
  bound_input(input, HealthLimits{}, counters);
  const auto& bounded = std::get<FaultReport>(input);
  EXPECT_TRUE(std::isnan(bounded.probability));
  EXPECT_TRUE(std::isnan(bounded.magnitude));
  EXPECT_TRUE(std::isnan(bounded.magnitude_sigma));
  EXPECT_TRUE(std::isnan(bounded.evidence[0].value));
  EXPECT_EQ(bounded.component, "unnamed component");
  EXPECT_GT(bounded.detected - bounded.onset, Duration::zero()) << "no overflow";

  for (const double age : {-1.0, infinity, -infinity, kNaN}) {
    Input link{speaker.link(at_s(0), true, age)};
    bound_input(link, HealthLimits{}, counters);
    EXPECT_TRUE(std::isnan(std::get<LinkReport>(link).seconds_since_data)) << age;
  }
}

TEST(BoundInput, CutsListsAndCountsIt) {
  Speaker speaker{"p"};
  HealthCounters counters;
  FaultReport fault = speaker.fault(at_s(0), 1, FaultPhase::kRaise, Severity::kWarning, "rotor 1");
  fault.candidates.assign(1000, std::string(1000, 'c'));
  fault.evidence.assign(1000, {"x", 1.0, "m"});
  DetectorReport report = speaker.verdict(at_s(0), DetectorState::kMonitoring, {}, {fault});
  report.components.assign(1000, {"rotor 1", true, ""});
  Input input{report};
  const HealthLimits limits;
  bound_input(input, limits, counters);
  const auto& bounded = std::get<DetectorReport>(input);
  EXPECT_EQ(bounded.components.size(), limits.components_per_detector);
  EXPECT_EQ(bounded.active.at(0).candidates.size(), limits.candidates_per_fault);
  EXPECT_EQ(bounded.active.at(0).candidates.at(0).size(), limits.name_bytes);
  EXPECT_EQ(bounded.active.at(0).evidence.size(), limits.evidence_per_fault);
  EXPECT_TRUE(bounded.active_is_complete) << "the list of faults itself was not cut";
  EXPECT_EQ(counters.cut_lists, 3);
}

}  // namespace
}  // namespace airworthy::health
