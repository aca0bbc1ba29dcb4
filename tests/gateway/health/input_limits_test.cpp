#include "gateway/health/input_limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/gateway/health/health_bench.h"

namespace airworthy::health {
namespace {

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
