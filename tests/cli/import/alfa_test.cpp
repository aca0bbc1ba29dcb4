#include "cli/import/alfa.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "tests/cli/import/import_support.h"

namespace airworthy::importer {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

/// One second of a sequence, 50 ms a packet; each test spoils one file.
class AlfaTest : public ::testing::Test {
 protected:
  AlfaTest() {
    files_["nav_info-roll.csv"] =
        "%time,field.header.stamp,field.commanded,field.measured\n"
        "1500000000001000000,1500000000000000999,10,1\n"
        "1500000000051000000,1500000000050000000,20,1\n"
        "1500000000101000000,1500000000100000000,20,2\n";
    files_["nav_info-pitch.csv"] =
        "%time,field.header.stamp,field.commanded,field.measured\n"
        "1500000000001100000,1500000000000100000,-5,-4\n"
        "1500000000051100000,1500000000050100000,-5,-4\n"
        "1500000000101100000,1500000000100100000,-6,-3\n";
    files_["nav_info-yaw.csv"] =
        "%time,field.header.stamp,field.commanded,field.measured\n"
        "1500000000001200000,1500000000000200000,100,90\n"
        "1500000000051200000,1500000000050200000,100,91\n"
        "1500000000101200000,1500000000100200000,100,92\n";
    files_["nav_info-errors.csv"] =
        "%time,field.header.stamp,field.alt_error,field.aspd_error,field.xtrack_error,field.wp_dist\n"
        "1500000000001300000,1500000000000300000,1.5,-250,3,1\n"
        "1500000000051300000,1500000000050300000,1.6,-240,3,1\n"
        "1500000000101300000,1500000000100300000,1.7,-230,3,1\n";
    files_["imu-data_raw.csv"] =
        "%time,field.header.stamp,field.angular_velocity.x,field.angular_velocity.y,"
        "field.angular_velocity.z,field.linear_acceleration.x,field.linear_acceleration.y,"
        "field.linear_acceleration.z\n"
        "1500000000021000000,1500000000020000000,0.1,0.2,0.3,1,2,9.8\n"
        "1500000000121000000,1500000000120000000,0,0,0,0,0,9.81\n";
    files_["vfr_hud.csv"] =
        "%time,field.header.stamp,field.airspeed,field.groundspeed,field.heading,field.throttle,"
        "field.altitude,field.climb\n"
        "1500000000041000000,1500000000040000000,15,20,90,0.5,400,-0.5\n";
  }

  void write(const std::string& sequence) const {
    const auto folder = folder_.path() / sequence;
    std::filesystem::create_directories(folder);
    for (const auto& [name, content] : files_) std::ofstream{folder / name, std::ios::binary} << content;
  }
  rt::Expected<LogSummary> import(const std::string& sequence = "s1_no_failure") {
    write(sequence);
    return import_alfa(folder_.path() / sequence, log_, "alfa", no_progress);
  }
  /// The error's text without the folder's name.
  std::string error(const std::string& sequence = "s1_no_failure") {
    const auto summary = import(sequence);
    if (summary) return "no error";
    EXPECT_FALSE(std::filesystem::exists(log_));
    EXPECT_FALSE(std::filesystem::exists(log_.string() + ".partial"));
    const std::string folder = (folder_.path() / sequence).string();
    EXPECT_EQ(summary.error().text.substr(0, folder.size()), folder);
    return summary.error().text.substr(folder.size());
  }
  void add_line(const std::string& file, const std::string& line) { files_[file] += line + "\n"; }

  rt::TemporaryFolder folder_;
  std::filesystem::path log_ = folder_.path() / "flight.lcm";
  std::map<std::string, std::string> files_;
};

TEST_F(AlfaTest, MergesTheTopicsInOrderOfTime) {
  const auto summary = import();
  ASSERT_TRUE(summary) << summary.error().text;
  using Entry = std::pair<std::string, std::int64_t>;
  constexpr std::int64_t kStart = 1'500'000'000'000'000;
  EXPECT_EQ(order_of(log_), (std::vector<Entry>{{"alfa/GROUND_TRUTH", kStart},
                                                {"alfa/ATTITUDE_SETPOINT", kStart},
                                                {"alfa/FLIGHT_STATE", kStart},
                                                {"alfa/IMU", kStart + 20'000},
                                                {"alfa/FLIGHT_STATE", kStart + 40'000},
                                                {"alfa/ATTITUDE_SETPOINT", kStart + 50'000},
                                                {"alfa/FLIGHT_STATE", kStart + 50'000},
                                                {"alfa/ATTITUDE", kStart + 100'000},
                                                {"alfa/ATTITUDE_SETPOINT", kStart + 100'000},
                                                {"alfa/FLIGHT_STATE", kStart + 100'000},
                                                {"alfa/IMU", kStart + 120'000}}));
  EXPECT_EQ(summary->start_us, kStart);
  EXPECT_EQ(summary->end_us, kStart + 120'000);
  EXPECT_EQ(summary->messages, (std::map<std::string, std::int64_t>{{"alfa/ATTITUDE", 1},
                                                                    {"alfa/ATTITUDE_SETPOINT", 3},
                                                                    {"alfa/FLIGHT_STATE", 4},
                                                                    {"alfa/GROUND_TRUTH", 1},
                                                                    {"alfa/IMU", 2}}));
}

TEST_F(AlfaTest, HeadersAreThoseOfAProcess) {
  ASSERT_TRUE(import());
  const auto imu = read_log<imu_t>(log_, "alfa/IMU");
  ASSERT_EQ(imu.size(), 2U);
  EXPECT_EQ(imu[0].header.producer, "airworthy-import");
  EXPECT_EQ(imu[0].header.time_us, 1'500'000'000'020'000);
  EXPECT_EQ(imu[0].header.sent_us, imu[0].header.time_us);
  EXPECT_EQ(imu[0].header.seq, 0);
  EXPECT_EQ(imu[1].header.seq, 1);
  EXPECT_GT(imu[0].header.session, 0);
  EXPECT_LT(imu[0].header.session, std::int64_t{1} << 48);
  EXPECT_EQ(imu[1].header.session, imu[0].header.session);
}

TEST_F(AlfaTest, TurnsTheInertialAxesFromFluToFrd) {
  ASSERT_TRUE(import());
  const auto imu = read_log<imu_t>(log_, "alfa/IMU");
  ASSERT_EQ(imu.size(), 2U);
  EXPECT_EQ(imu[0].accel_m_s2[0], 1.0);
  EXPECT_EQ(imu[0].accel_m_s2[1], -2.0);
  EXPECT_EQ(imu[0].accel_m_s2[2], -9.8);
  EXPECT_EQ(imu[0].gyro_rad_s[0], 0.1);
  EXPECT_EQ(imu[0].gyro_rad_s[1], -0.2);
  EXPECT_EQ(imu[0].gyro_rad_s[2], -0.3);
  EXPECT_EQ(imu[0].sensor_id, 0);
  EXPECT_TRUE(std::isnan(imu[0].temperature_degC));
  EXPECT_TRUE(std::isnan(imu[0].averaging_window_s));
}

TEST_F(AlfaTest, PublishesAttitudeOnlyWhenItsMeasurementIsFresh) {
  ASSERT_TRUE(import());
  const auto attitude = read_log<attitude_t>(log_, "alfa/ATTITUDE");
  // Not at the first row, whose age is unknown; not when only the yaw differs.
  ASSERT_EQ(attitude.size(), 1U);
  EXPECT_DOUBLE_EQ(attitude[0].roll_rad, 2.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(attitude[0].pitch_rad, -3.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(attitude[0].yaw_rad, 92.0 * kRadPerDeg);
  for (const double rate : attitude[0].rates_rad_s) EXPECT_TRUE(std::isnan(rate));
}

TEST_F(AlfaTest, PublishesTheSetpointOfEveryPacket) {
  ASSERT_TRUE(import());
  const auto setpoint = read_log<attitude_setpoint_t>(log_, "alfa/ATTITUDE_SETPOINT");
  ASSERT_EQ(setpoint.size(), 3U);
  EXPECT_DOUBLE_EQ(setpoint[0].roll_rad, 10.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(setpoint[1].roll_rad, 20.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(setpoint[2].pitch_rad, -6.0 * kRadPerDeg);
  for (const auto& message : setpoint) {
    EXPECT_TRUE(std::isnan(message.yaw_rad));
    EXPECT_TRUE(std::isnan(message.thrust_ratio));
  }
}

TEST_F(AlfaTest, APacketThatLacksARowKeepsTheLastValue) {
  auto& pitch = files_["nav_info-pitch.csv"];
  const auto second = pitch.find("1500000000051100000");
  pitch.erase(second, pitch.find('\n', second) + 1 - second);
  ASSERT_TRUE(import());
  const auto setpoint = read_log<attitude_setpoint_t>(log_, "alfa/ATTITUDE_SETPOINT");
  ASSERT_EQ(setpoint.size(), 3U);
  EXPECT_DOUBLE_EQ(setpoint[1].roll_rad, 20.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(setpoint[1].pitch_rad, -5.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(setpoint[2].pitch_rad, -6.0 * kRadPerDeg);
}

TEST_F(AlfaTest, FillsTheFlightStateInSiUnits) {
  ASSERT_TRUE(import());
  const auto state = read_log<flight_state_t>(log_, "alfa/FLIGHT_STATE");
  ASSERT_EQ(state.size(), 4U);
  EXPECT_TRUE(std::isnan(state[0].airspeed_m_s));
  EXPECT_EQ(state[0].altitude_error_m, 1.5);
  EXPECT_EQ(state[0].airspeed_error_m_s, -2.5);
  EXPECT_EQ(state[0].crosstrack_error_m, 3.0);
  EXPECT_EQ(state[1].airspeed_m_s, 15.0);
  EXPECT_EQ(state[1].groundspeed_m_s, 20.0);
  EXPECT_EQ(state[1].altitude_m, 400.0);
  EXPECT_EQ(state[1].climb_m_s, -0.5);
  EXPECT_EQ(state[1].altitude_error_m, 1.5);
  EXPECT_EQ(state[3].airspeed_m_s, 15.0);
  EXPECT_EQ(state[3].altitude_error_m, 1.7);
  EXPECT_EQ(state[3].armed, -1);
  EXPECT_EQ(state[3].landed_state, -1);
  EXPECT_EQ(state[3].mode, -1);
}

TEST_F(AlfaTest, AFieldWithoutNewsForThreeSecondsIsUnknown) {
  add_line("vfr_hud.csv", "1500000003201000000,1500000003200000000,16,21,90,0.5,401,0");
  ASSERT_TRUE(import());
  const auto state = read_log<flight_state_t>(log_, "alfa/FLIGHT_STATE");
  ASSERT_EQ(state.size(), 5U);
  EXPECT_EQ(state[4].airspeed_m_s, 16.0);
  EXPECT_TRUE(std::isnan(state[4].altitude_error_m));
  EXPECT_TRUE(std::isnan(state[4].airspeed_error_m_s));
}

TEST_F(AlfaTest, NeverReadsTheTopicsThatShowTheInjectedFault) {
  ASSERT_TRUE(import());
  const std::string before = content_of(log_);
  files_["rc-out.csv"] = "garbage";
  files_["rc-in.csv"] = "";
  auto& hud = files_["vfr_hud.csv"];
  hud.replace(hud.find(",0.5,"), 5, ",x,");
  ASSERT_TRUE(import());
  EXPECT_EQ(content_of(log_), before);
}

TEST_F(AlfaTest, TakesTheReceiveTimeWhereThereIsNoStamp) {
  files_["imu-data_raw.csv"] =
      "%time,field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z,"
      "field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z\n"
      "1500000000021000999,0,0,0,0,0,0\n";
  ASSERT_TRUE(import());
  const auto imu = read_log<imu_t>(log_, "alfa/IMU");
  ASSERT_EQ(imu.size(), 1U);
  EXPECT_EQ(imu[0].header.time_us, 1'500'000'000'021'000);
}

TEST_F(AlfaTest, TheSameInputGivesTheSameBytesCompressedOrNot) {
  ASSERT_TRUE(import());
  const std::string first = content_of(log_);
  ASSERT_TRUE(import());
  EXPECT_EQ(content_of(log_), first);
  std::filesystem::remove_all(folder_.path() / "s1_no_failure");
  std::map<std::string, std::string> compressed;
  for (const auto& [name, content] : files_) compressed[name + ".xz"] = xz(content);
  files_ = compressed;
  ASSERT_TRUE(import());
  EXPECT_EQ(content_of(log_), first);
}

TEST_F(AlfaTest, ASequenceCalledNoFailureIsHealthy) {
  ASSERT_TRUE(import("s1_no_failure"));
  const auto truth = read_log<ground_truth_t>(log_, "alfa/GROUND_TRUTH");
  ASSERT_EQ(truth.size(), 1U);
  EXPECT_EQ(truth[0].component, "");
  EXPECT_EQ(truth[0].fault_kind, "none");
  EXPECT_EQ(truth[0].onset_us, -1);
  EXPECT_TRUE(std::isnan(truth[0].magnitude));
}

TEST_F(AlfaTest, ASequenceWithoutGroundTruthHasNone) {
  ASSERT_TRUE(import("s1_no_ground_truth"));
  EXPECT_TRUE(read_log<ground_truth_t>(log_, "alfa/GROUND_TRUTH").empty());
  ASSERT_TRUE(import("s1"));
  EXPECT_TRUE(read_log<ground_truth_t>(log_, "alfa/GROUND_TRUTH").empty());
}

struct CodeCase {
  const char* topic;
  int code;
  std::vector<std::pair<std::string, std::string>> faults;
};

TEST_F(AlfaTest, TheFirstRowOfAFailureTopicIsTheOnset) {
  using Faults = std::vector<std::pair<std::string, std::string>>;
  const std::vector<CodeCase> cases{
      {"engines", 1, {{"engine", "thrust_loss"}}},
      {"elevator", 1, {{"elevator", "stuck"}}},
      {"rudder", 1, {{"rudder", "stuck"}}},
      {"rudder", 2, {{"rudder", "hardover_left"}}},
      {"rudder", 3, {{"rudder", "hardover_right"}}},
      {"aileron", 1, {{"right aileron", "stuck"}}},
      {"aileron", 2, {{"left aileron", "stuck"}}},
      {"aileron", 3, {{"left aileron", "stuck"}, {"right aileron", "stuck"}}},
  };
  for (const auto& [topic, code, faults] : cases) {
    SCOPED_TRACE(std::string{topic} + std::to_string(code));
    const std::string sequence = "s1_" + std::string{topic} + std::to_string(code);
    const std::string number = std::to_string(code);
    files_.erase("failure");
    const std::string file = "failure_status-" + std::string{topic} + ".csv";
    files_[file] =
        "%time,field.data\n1500000000060000000," + number + "\n1500000000110000000," + number + "\n";
    ASSERT_TRUE(import(sequence));
    files_.erase(file);
    const auto truth = read_log<ground_truth_t>(log_, "alfa/GROUND_TRUTH");
    Faults found;
    for (const auto& message : truth) {
      found.emplace_back(message.component, message.fault_kind);
      EXPECT_EQ(message.onset_us, 1'500'000'000'060'000);
      EXPECT_EQ(message.header.time_us, message.onset_us);
    }
    EXPECT_EQ(found, faults);
  }
}

TEST_F(AlfaTest, ASecondFaultHasAnOnsetOfItsOwn) {
  files_["failure_status-aileron.csv"] =
      "%time,field.data\n1500000000060000000,2\n1500000000090000000,2\n1500000000110000000,1\n";
  ASSERT_TRUE(import("s1_two"));
  const auto truth = read_log<ground_truth_t>(log_, "alfa/GROUND_TRUTH");
  ASSERT_EQ(truth.size(), 2U);
  EXPECT_EQ(truth[0].component, "left aileron");
  EXPECT_EQ(truth[0].onset_us, 1'500'000'000'060'000);
  EXPECT_EQ(truth[1].component, "right aileron");
  EXPECT_EQ(truth[1].onset_us, 1'500'000'000'110'000);
}

TEST_F(AlfaTest, AFaultThatContradictsTheNameIsAnError) {
  files_["failure_status-engines.csv"] = "%time,field.data\n1500000000060000000,1\n";
  EXPECT_EQ(error(), ": called no_failure, but its failure_status topics report one");
}

TEST_F(AlfaTest, AnUnknownFailureCodeIsAnError) {
  files_["failure_status-engines.csv"] = "%time,field.data\n1500000000060000000,4\n";
  EXPECT_EQ(error("s1"), "/failure_status-engines.csv:2: failure code 4 is not known");
}

TEST_F(AlfaTest, AMissingTopicIsAnError) {
  files_.erase("imu-data_raw.csv");
  EXPECT_EQ(error(), ": no imu-data_raw.csv or imu-data_raw.csv.xz");
}

TEST_F(AlfaTest, AMissingFolderIsAnError) {
  const auto summary = import_alfa("/nonexistent/s1", log_, "alfa", no_progress);
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().text, "/nonexistent/s1: no such folder");
}

TEST_F(AlfaTest, AMissingColumnIsAnError) {
  files_["vfr_hud.csv"] = "%time,field.header.stamp,field.airspeed\n1,1,1\n";
  EXPECT_EQ(error(), "/vfr_hud.csv: no column \"field.groundspeed\"");
}

TEST_F(AlfaTest, AnEmptyFileIsAnError) {
  files_["vfr_hud.csv"] = "";
  EXPECT_EQ(error(), "/vfr_hud.csv: the file is empty");
}

TEST_F(AlfaTest, AFileWithoutRowsIsAnError) {
  files_["vfr_hud.csv"] =
      "%time,field.header.stamp,field.airspeed,field.groundspeed,field.altitude,field.climb\n";
  EXPECT_EQ(error(), "/vfr_hud.csv: has a header but no rows");
}

TEST_F(AlfaTest, ARowCutShortIsAnError) {
  add_line("nav_info-roll.csv", "1500000000151000000,1500000000150000000");
  EXPECT_EQ(error(), "/nav_info-roll.csv:5: 2 cells where the header has 4: truncated or corrupt");
}

TEST_F(AlfaTest, ALastLineThatIsNotEndedIsAnError) {
  files_["nav_info-roll.csv"] += "1500000000151000000,1500000000150000000,10,1";
  EXPECT_EQ(error(), "/nav_info-roll.csv:5: the last line is not ended: truncated");
}

TEST_F(AlfaTest, RowsOutOfOrderAreAnError) {
  add_line("nav_info-yaw.csv", "1500000000151200000,1500000000049000000,100,93");
  EXPECT_EQ(error(), "/nav_info-yaw.csv:5: time goes backward by 0.051200 s: rows are out of order");
}

TEST_F(AlfaTest, ACellThatIsNoNumberIsAnError) {
  add_line("nav_info-errors.csv", "1500000000151300000,1500000000150300000,1.7,abc,3,1");
  EXPECT_EQ(error(), "/nav_info-errors.csv:5: column field.aspd_error: \"abc\" is not a number");
}

TEST_F(AlfaTest, AStampThatIsNoIntegerIsAnError) {
  add_line("nav_info-errors.csv", "1500000000151300000,1.5e18,1.7,0,3,1");
  EXPECT_EQ(error(), "/nav_info-errors.csv:5: column field.header.stamp: \"1.5e18\" is not an integer");
}

TEST_F(AlfaTest, ATruncatedXzFileIsAnErrorThatNamesTheByte) {
  const std::string compressed = xz(files_["vfr_hud.csv"]);
  files_.erase("vfr_hud.csv");
  files_["vfr_hud.csv.xz"] = compressed.substr(0, compressed.size() - 40);
  EXPECT_EQ(error(),
            "/vfr_hud.csv.xz: byte " + std::to_string(compressed.size() - 40) + ": truncated xz data");
}

TEST_F(AlfaTest, AnXzFileThatIsNoneIsAnError) {
  files_.erase("vfr_hud.csv");
  files_["vfr_hud.csv.xz"] = "field.airspeed\n1\n";
  EXPECT_EQ(error(), "/vfr_hud.csv.xz: byte 0: not xz data");
}

TEST_F(AlfaTest, AnInterruptedImportLeavesNothing) {
  write("s1_no_failure");
  const auto summary = import_alfa(folder_.path() / "s1_no_failure", log_, "alfa",
                                   [](double) -> rt::Expected<void> { return rt::fail_with("interrupted"); });
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().text, "interrupted");
  EXPECT_EQ(names_in(folder_.path()), std::vector<std::string>{"s1_no_failure"});
}

TEST(SequenceName, IsTheLastPartOfThePath) {
  EXPECT_EQ(sequence_name("/a/b"), "b");
  EXPECT_EQ(sequence_name("/a/b/"), "b");
  EXPECT_EQ(sequence_name("/a/b/."), "b");
  EXPECT_EQ(sequence_name("."), std::filesystem::current_path().filename());
}

}  // namespace
}  // namespace airworthy::importer
