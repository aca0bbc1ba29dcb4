#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/doctor/report.h"

namespace airworthy::doctor {
namespace {

const std::vector<Finding> kFindings{
    {"a.good", Level::kOk, "fine", "", "", ""},
    {"b.bad", Level::kFailure, "gone", "it matters", "mend it", "first\nsecond"},
    {"c.hidden", Level::kUnknown, "not seen", "it may matter", "", ""},
    {"d.weak", Level::kWarning, "small", "it may break", "", "buy more"},
};

TEST(DoctorReport, TextShowsCausesAndCuresBelowWhatIsAmiss) {
  EXPECT_EQ(to_text(kFindings),
            "ok       a.good                  fine\n"
            "failure  b.bad                   gone\n"
            "    why        it matters\n"
            "    cure       mend it\n"
            "    for good   first\n"
            "               second\n"
            "unknown  c.hidden                not seen\n"
            "    why        it may matter\n"
            "warning  d.weak                  small\n"
            "    why        it may break\n"
            "    for good   buy more\n"
            "1 failed, 1 warnings, 1 ok, 1 unknown\n");
}

TEST(DoctorReport, JsonHoldsEveryField) {
  const auto report = nlohmann::json::parse(to_json(kFindings));
  EXPECT_EQ(report["schema"], 1);
  EXPECT_EQ(report["failures"], 1);
  ASSERT_EQ(report["findings"].size(), 4U);
  EXPECT_EQ(report["findings"][1], nlohmann::json({{"id", "b.bad"},
                                                   {"level", "failure"},
                                                   {"found", "gone"},
                                                   {"why", "it matters"},
                                                   {"cure", "mend it"},
                                                   {"permanent", "first\nsecond"}}));
  EXPECT_EQ(report["findings"][2]["level"], "unknown");
}

TEST(DoctorReport, JsonSurvivesAPathThatIsNotUtf8) {
  const auto report = nlohmann::json::parse(to_json({{"a", Level::kOk, "free in /\xff", "", "", ""}}));
  EXPECT_EQ(report["findings"][0]["found"], "free in /\uFFFD");
}

TEST(DoctorReport, OnlyAFailureFails) {
  EXPECT_TRUE(has_failure(kFindings));
  EXPECT_FALSE(has_failure({kFindings[0], kFindings[2], kFindings[3]}));
  EXPECT_FALSE(has_failure({}));
}

}  // namespace
}  // namespace airworthy::doctor
