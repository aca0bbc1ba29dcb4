#include "cli/import/alfa.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>

#include "cli/import/topic.h"

namespace airworthy::importer {
namespace {

namespace fs = std::filesystem;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kRadPerDeg = std::numbers::pi / 180.0;

std::optional<fs::path> existing(const fs::path& folder, const std::string& topic) {
  for (const char* suffix : {".csv", ".csv.xz"}) {
    const fs::path file = folder / (topic + suffix);
    std::error_code error;
    if (fs::exists(file, error)) return file;
  }
  return std::nullopt;
}

// The time of measurement where the topic has one, else the time at which the recorder received the row.
rt::Expected<Topic> open_topic(const fs::path& file, const std::vector<std::string>& columns) {
  auto reader = CsvReader::open(file);
  if (!reader) return tl::unexpected<rt::Error>{reader.error()};
  constexpr const char* kStamp = "field.header.stamp";
  const char* time_column = reader->find(kStamp) ? kStamp : "%time";
  return Topic::open(std::move(*reader), {time_column, TimeColumn::Unit::kNanoseconds, {}}, columns);
}

rt::Expected<Topic> open_required(const fs::path& folder, const std::string& topic,
                                  const std::vector<std::string>& columns) {
  const auto file = existing(folder, topic);
  if (!file) return rt::fail_with(fmt::format("{}: no {}.csv or {}.csv.xz", folder.string(), topic, topic));
  return open_topic(*file, columns);
}

/// Airspeed, climb, guidance errors: each the newest value, unknown once older than kTimeout, the default of
/// the MAVLink driver.
class FlightStateFields {
 public:
  static constexpr Duration kTimeout{3'000'000};

  void set_errors(TimePoint t, double altitude_m, double airspeed_m_s, double crosstrack_m) {
    errors_time_ = t;
    errors_ = {altitude_m, airspeed_m_s, crosstrack_m};
  }
  void set_hud(TimePoint t, double airspeed_m_s, double groundspeed_m_s, double climb_m_s,
               double altitude_m) {
    hud_time_ = t;
    hud_ = {airspeed_m_s, groundspeed_m_s, climb_m_s, altitude_m};
  }
  void publish(TimePoint t, FlightLog& log) const {
    const bool has_errors = errors_time_ && t - *errors_time_ <= kTimeout;
    const bool has_hud = hud_time_ && t - *hud_time_ <= kTimeout;
    flight_state_t message;
    message.altitude_error_m = has_errors ? errors_[0] : kNaN;
    message.airspeed_error_m_s = has_errors ? errors_[1] : kNaN;
    message.crosstrack_error_m = has_errors ? errors_[2] : kNaN;
    message.airspeed_m_s = has_hud ? hud_[0] : kNaN;
    message.groundspeed_m_s = has_hud ? hud_[1] : kNaN;
    message.climb_m_s = has_hud ? hud_[2] : kNaN;
    message.altitude_m = has_hud ? hud_[3] : kNaN;
    message.armed = -1;
    message.landed_state = -1;
    message.mode = -1;
    log.publish(message, t);
  }

 private:
  std::optional<TimePoint> errors_time_;
  std::optional<TimePoint> hud_time_;
  std::array<double, 3> errors_{};
  std::array<double, 4> hud_{};
};

/// A feed made of one table.
class TopicFeed : public Feed {
 public:
  explicit TopicFeed(Topic topic) : topic_{std::move(topic)} {}
  rt::Expected<bool> next() override { return topic_.next(); }
  TimePoint time() const override { return topic_.time(); }
  std::uint64_t position() const override { return topic_.reader().position(); }
  std::uint64_t size() const override { return topic_.reader().size(); }

 protected:
  Topic topic_;
};

class ImuFeed final : public TopicFeed {
 public:
  using TopicFeed::TopicFeed;
  static const std::vector<std::string>& columns() {
    static const std::vector<std::string> kColumns{
        "field.linear_acceleration.x", "field.linear_acceleration.y", "field.linear_acceleration.z",
        "field.angular_velocity.x",    "field.angular_velocity.y",    "field.angular_velocity.z"};
    return kColumns;
  }
  // mavros turns to x forward, y left, z up.
  void publish(FlightLog& log) override {
    imu_t message;
    message.sensor_id = 0;
    message.accel_m_s2[0] = topic_[0];
    message.accel_m_s2[1] = -topic_[1];
    message.accel_m_s2[2] = -topic_[2];
    message.gyro_rad_s[0] = topic_[3];
    message.gyro_rad_s[1] = -topic_[4];
    message.gyro_rad_s[2] = -topic_[5];
    message.temperature_degC = kNaN;
    message.averaging_window_s = kNaN;
    log.publish(message, time());
  }
};

/// The throttle column is not read: it shows the injected fault (docs/import.md).
class HudFeed final : public TopicFeed {
 public:
  HudFeed(Topic topic, FlightStateFields& state) : TopicFeed{std::move(topic)}, state_{state} {}
  static const std::vector<std::string>& columns() {
    static const std::vector<std::string> kColumns{"field.airspeed", "field.groundspeed", "field.climb",
                                                   "field.altitude"};
    return kColumns;
  }
  void publish(FlightLog& log) override {
    state_.set_hud(time(), topic_[0], topic_[1], topic_[2], topic_[3]);
    state_.publish(time(), log);
  }

 private:
  FlightStateFields& state_;
};

/// The nav_info topics: mavros makes them of one NAV_CONTROLLER_OUTPUT packet and the newest ATTITUDE, one
/// after the other, within 5 ms. A packet has the time of its first row; a topic that lacks a row keeps its
/// values.
class NavFeed final : public Feed {
 public:
  static constexpr Duration kPacketSpan{5'000};
  enum Which : std::size_t { kRoll, kPitch, kYaw, kErrors, kTopics };
  static constexpr std::array<const char*, kTopics> kNames{"nav_info-roll", "nav_info-pitch", "nav_info-yaw",
                                                           "nav_info-errors"};
  static const std::vector<std::string>& columns(std::size_t topic) {
    static const std::vector<std::string> kAngle{"field.commanded", "field.measured"};
    static const std::vector<std::string> kError{"field.alt_error", "field.aspd_error", "field.xtrack_error"};
    return topic == kErrors ? kError : kAngle;
  }

  NavFeed(std::vector<Topic> topics, FlightStateFields& state) : topics_{std::move(topics)}, state_{state} {}

  rt::Expected<bool> next() override {
    for (std::size_t i = 0; i < kTopics; ++i) {
      if (const auto advanced = advance(i); !advanced) return tl::unexpected<rt::Error>{advanced.error()};
    }
    std::optional<TimePoint> first;
    for (std::size_t i = 0; i < kTopics; ++i) {
      if (waiting_[i] && (!first || topics_[i].time() < *first)) first = topics_[i].time();
    }
    if (!first) return false;
    time_ = *first;
    for (std::size_t i = 0; i < kTopics; ++i) {
      fresh_[i] = waiting_[i] && topics_[i].time() - time_ <= kPacketSpan;
    }
    return true;
  }

  TimePoint time() const override { return time_; }

  void publish(FlightLog& log) override {
    bool attitude_is_fresh = false;
    for (const std::size_t i : {kRoll, kPitch, kYaw}) {
      if (!fresh_[i]) continue;
      commanded_rad_[i] = topics_[i][0] * kRadPerDeg;
      const double measured_rad = topics_[i][1] * kRadPerDeg;
      // Held between updates: only a change is a measurement. Of the first row nobody knows how old it is.
      const bool changed = has_measured_[i] && measured_rad != measured_rad_[i];
      if (i != kYaw && changed) attitude_is_fresh = true;
      measured_rad_[i] = measured_rad;
      has_measured_[i] = true;
    }
    if (attitude_is_fresh) publish_attitude(log);
    if (fresh_[kRoll] || fresh_[kPitch]) publish_setpoint(log);
    if (fresh_[kErrors]) {
      const Topic& errors = topics_[kErrors];
      constexpr double kMPerCm = 0.01;
      state_.set_errors(time_, errors[0], errors[1] * kMPerCm, errors[2]);
      state_.publish(time_, log);
    }
  }

  std::uint64_t position() const override {
    std::uint64_t sum = 0;
    for (const Topic& topic : topics_) sum += topic.reader().position();
    return sum;
  }
  std::uint64_t size() const override {
    std::uint64_t sum = 0;
    for (const Topic& topic : topics_) sum += topic.reader().size();
    return sum;
  }

 private:
  // Reads the topic's next row if the last one has been used.
  rt::Expected<void> advance(std::size_t i) {
    if (ended_[i] || (waiting_[i] && !fresh_[i])) return {};
    const auto more = topics_[i].next();
    if (!more) return tl::unexpected<rt::Error>{more.error()};
    waiting_[i] = *more;
    ended_[i] = !*more;
    fresh_[i] = false;
    return {};
  }

  void publish_attitude(FlightLog& log) const {
    attitude_t message;
    message.roll_rad = measured_rad_[kRoll];
    message.pitch_rad = measured_rad_[kPitch];
    message.yaw_rad = measured_rad_[kYaw];
    std::fill(std::begin(message.rates_rad_s), std::end(message.rates_rad_s), kNaN);
    log.publish(message, time_);
  }

  // The commanded yaw is the bearing of the path, not a set-point of the attitude controller.
  void publish_setpoint(FlightLog& log) const {
    attitude_setpoint_t message;
    message.roll_rad = commanded_rad_[kRoll];
    message.pitch_rad = commanded_rad_[kPitch];
    message.yaw_rad = kNaN;
    std::fill(std::begin(message.rates_rad_s), std::end(message.rates_rad_s), kNaN);
    message.thrust_ratio = kNaN;
    log.publish(message, time_);
  }

  std::vector<Topic> topics_;
  FlightStateFields& state_;
  std::array<bool, kTopics> waiting_{};  // a row was read and not yet used
  std::array<bool, kTopics> fresh_{};    // it belongs to the current packet
  std::array<bool, kTopics> ended_{};
  std::array<double, 3> commanded_rad_{kNaN, kNaN, kNaN};
  std::array<double, 3> measured_rad_{kNaN, kNaN, kNaN};
  std::array<bool, 3> has_measured_{};
  TimePoint time_;
};

/// What a code of a failure_status topic says.
struct FailureCode {
  const char* topic;
  std::int64_t code;
  const char* component;
  const char* fault_kind;
};
constexpr std::array<FailureCode, 9> kFailureCodes{{
    {"failure_status-engines", 1, "engine", "thrust_loss"},
    {"failure_status-elevator", 1, "elevator", "stuck"},
    {"failure_status-rudder", 1, "rudder", "stuck"},
    {"failure_status-rudder", 2, "rudder", "hardover_left"},
    {"failure_status-rudder", 3, "rudder", "hardover_right"},
    {"failure_status-aileron", 1, "right aileron", "stuck"},
    {"failure_status-aileron", 2, "left aileron", "stuck"},
    {"failure_status-aileron", 3, "left aileron", "stuck"},
    {"failure_status-aileron", 3, "right aileron", "stuck"},
}};

rt::Expected<void> read_failures(const fs::path& file, std::string_view topic_name,
                                 std::vector<Truth>& truths) {
  auto topic = open_topic(file, {"field.data"});
  if (!topic) return tl::unexpected<rt::Error>{topic.error()};
  for (;;) {
    const auto more = topic->next();
    if (!more) return tl::unexpected<rt::Error>{more.error()};
    if (!*more) return {};
    const double code = (*topic)[0];
    bool known = code == 0.0;
    for (const FailureCode& row : kFailureCodes) {
      if (row.topic != topic_name || static_cast<double>(row.code) != code) continue;
      known = true;
      const auto same = [&](const Truth& truth) {
        return truth.component == row.component && truth.fault_kind == row.fault_kind;
      };
      // Repeated as long as the fault lasts: the first one is the onset.
      if (std::none_of(truths.begin(), truths.end(), same)) {
        truths.push_back({row.component, row.fault_kind, topic->time(), {}, kNaN});
      }
    }
    if (!known) return topic->reader().fail(fmt::format("failure code {} is not known", code));
  }
}

rt::Expected<std::vector<Truth>> read_truth(const fs::path& folder) {
  const std::string name = sequence_name(folder);
  std::vector<Truth> truths;
  if (name.find("no_ground_truth") != std::string::npos) return truths;
  std::string_view done;
  for (const FailureCode& row : kFailureCodes) {
    if (row.topic == done) continue;
    done = row.topic;
    const auto file = existing(folder, row.topic);
    if (!file) continue;
    if (const auto read = read_failures(*file, row.topic, truths); !read) {
      return tl::unexpected<rt::Error>{read.error()};
    }
  }
  if (name.find("no_failure") != std::string::npos) {
    if (!truths.empty()) {
      return rt::fail_with(
          fmt::format("{}: called no_failure, but its failure_status topics report one", folder.string()));
    }
    truths.push_back({"", kNoFault, {}, {}, kNaN});
  }
  return truths;
}

}  // namespace

std::string sequence_name(const fs::path& folder) {
  const fs::path normal = fs::absolute(folder).lexically_normal();
  return normal.has_filename() ? normal.filename().string() : normal.parent_path().filename().string();
}

rt::Expected<LogSummary> import_alfa(const fs::path& folder, const fs::path& log_path,
                                     const std::string& vehicle, const Progress& progress) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return rt::fail_with(folder.string() + ": no such folder");
  auto truths = read_truth(folder);
  if (!truths) return tl::unexpected<rt::Error>{truths.error()};

  std::vector<Topic> nav;
  for (std::size_t i = 0; i < NavFeed::kTopics; ++i) {
    auto topic = open_required(folder, NavFeed::kNames[i], NavFeed::columns(i));
    if (!topic) return tl::unexpected<rt::Error>{topic.error()};
    nav.push_back(std::move(*topic));
  }
  auto imu = open_required(folder, "imu-data_raw", ImuFeed::columns());
  if (!imu) return tl::unexpected<rt::Error>{imu.error()};
  auto hud = open_required(folder, "vfr_hud", HudFeed::columns());
  if (!hud) return tl::unexpected<rt::Error>{hud.error()};

  FlightStateFields state;
  std::vector<std::unique_ptr<Feed>> feeds;
  feeds.push_back(std::make_unique<HudFeed>(std::move(*hud), state));
  feeds.push_back(std::make_unique<NavFeed>(std::move(nav), state));
  feeds.push_back(std::make_unique<ImuFeed>(std::move(*imu)));

  auto log = FlightLog::create(log_path, vehicle);
  if (!log) return tl::unexpected<rt::Error>{log.error()};
  if (const auto merged = merge(feeds, std::move(*truths), **log, progress); !merged) {
    return tl::unexpected<rt::Error>{merged.error()};
  }
  return (*log)->commit();
}

}  // namespace airworthy::importer
