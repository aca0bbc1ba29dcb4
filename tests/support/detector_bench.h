#pragma once

#include <memory>
#include <string>
#include <vector>

#include "airworthy/detector_status_t.hpp"
#include "airworthy/fault_event_t.hpp"
#include "runtime/bus/channels.h"
#include "runtime/bus/lcm_bus.h"
#include "runtime/clock/manual_clock.h"
#include "runtime/process/node.h"

namespace airworthy::test {

/// A place for a detector's process on an in-process bus, and an observer of what it says there.
class DetectorBench {
 protected:
  DetectorBench(const std::string& vehicle, const std::string& process, TimePoint start)
      : clock_{start},
        observer_{*bus_, clock_, log_, {vehicle, "observer", 4}},
        node_{*bus_, clock_, log_, {vehicle, process, 5}} {
    observer_.subscribe<fault_event_t>(channel::kFaultEvent,
                                       [this](const fault_event_t& event) { events_.push_back(event); });
    observer_.subscribe<detector_status_t>(channel::kDetectorStatus,
                                           [this](const detector_status_t& status) { status_ = status; });
  }
  DetectorBench(const DetectorBench&) = delete;
  DetectorBench& operator=(const DetectorBench&) = delete;
  ~DetectorBench() = default;

  void deliver() {
    while (*bus_->dispatch(100) > 0) {
    }
  }

  std::unique_ptr<rt::LcmBus> bus_{std::move(*rt::LcmBus::open("memq://"))};
  rt::ManualClock clock_;
  rt::Log log_{"test", rt::LogLevel::kError};
  rt::Node observer_;
  rt::Node node_;  ///< of the detector
  std::vector<fault_event_t> events_;
  detector_status_t status_;  ///< the last one
};

}  // namespace airworthy::test
