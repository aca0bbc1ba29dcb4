#include "runtime/process/process_status.h"

#include <unistd.h>

#include <ctime>
#include <fstream>

#include "runtime/bus/channels.h"

namespace airworthy::rt {
namespace {

std::string boot_id() {
  std::ifstream file{"/proc/sys/kernel/random/boot_id"};
  std::string id;
  std::getline(file, id);
  return id;
}

std::int64_t resident_bytes() {
  std::ifstream file{"/proc/self/statm"};
  std::int64_t total_pages = 0;
  std::int64_t resident_pages = 0;
  file >> total_pages >> resident_pages;
  return resident_pages * sysconf(_SC_PAGESIZE);
}

std::int64_t wall_time_us() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000 + t.tv_nsec / 1'000;
}

}  // namespace

ProcessStatus::ProcessStatus(Node& node, std::string config_hash, double time_scale)
    : node_{node}, publisher_{node.advertise(channel::kProcessStatus)} {
  message_.pid = getpid();
  message_.version = AIRWORTHY_VERSION;
  message_.config_hash = std::move(config_hash);
  message_.boot_id = boot_id();
  message_.time_scale = time_scale;
  node_.every(kPeriod, [this](TimePoint) { publish(); });
}

void ProcessStatus::set(ProcessState state, const std::string& detail) {
  if (state == state_ && detail == detail_) return;
  state_ = state;
  detail_ = detail;
  publish();
}

void ProcessStatus::publish() {
  const TimePoint now = node_.clock().now();
  const StepMeter::Summary steps = node_.step_meter().take();
  message_.state = static_cast<std::int8_t>(state_);
  message_.detail = detail_;
  message_.utc_offset_us = wall_time_us() - to_us(now);
  message_.rss_bytes = resident_bytes();
  message_.steps = steps.steps;
  message_.step_mean_us = steps.mean_us;
  message_.step_max_us = steps.max_us;
  message_.counters = node_.counters().to_messages();
  message_.counter_count = static_cast<std::int32_t>(message_.counters.size());
  publisher_.publish(message_, now);
}

}  // namespace airworthy::rt
