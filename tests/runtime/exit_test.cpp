#include "runtime/process/exit.h"

#include <gtest/gtest.h>
#include <sysexits.h>

namespace airworthy::rt {
namespace {

TEST(ExitTest, FailPrefixesEveryLineWithTheProgram) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(fail(EX_CONFIG, Error{"t.toml:1:1: a: bad\nt.toml:2:1: b: bad"}), EX_CONFIG);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "process_test: t.toml:1:1: a: bad\nprocess_test: t.toml:2:1: b: bad\n");
}

TEST(ExitTest, FailWithoutTextStillSaysWho) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(fail(EX_UNAVAILABLE, Error{}), EX_UNAVAILABLE);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "process_test: \n");
}

TEST(ExitTest, LeavePrintsSuccessOnStdout) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  EXPECT_EQ(leave({EX_OK, "x 1.0"}), EX_OK);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "x 1.0\n");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ExitTest, LeavePrintsFailureOnStderr) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  EXPECT_EQ(leave({EX_USAGE, "no"}), EX_USAGE);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "process_test: no\n");
}

}  // namespace
}  // namespace airworthy::rt
