#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "core/time/time.h"

namespace airworthy::health {

/// What may be held at most, so that a flood of messages or names costs a counter and not the memory of the
/// vehicle.
struct HealthLimits {
  std::size_t processes = 64;
  std::size_t links = 64;
  std::size_t detectors = 64;
  std::size_t components_per_detector = 64;
  std::size_t components = 256;
  std::size_t active_faults = 256;
  std::size_t faults_per_report = 64;
  std::size_t cleared_faults =
      512;  ///< remembered, so that an event overtaken by its clear does not raise again
  std::size_t rates_per_link = 64;
  std::size_t candidates_per_fault = 8;
  std::size_t evidence_per_fault = 16;
  std::size_t reasons_per_component = 8;
  std::size_t queued_items = 4096;  ///< messages, and the faults and components listed in them
  std::size_t queued_items_per_producer = 1024;
  std::size_t name_bytes = 64;
  std::size_t text_bytes = 256;
};

struct HealthConfig {
  std::string vehicle = "vehicle";
  std::vector<std::string> expected_processes;
  /// Driver process → the detector processes that live on its data. A driver not listed may feed any
  /// detector.
  std::map<std::string, std::vector<std::string>> feeds;

  Duration process_deadline{800'000};     ///< without a life sign a process is missing
  Duration detector_deadline{1'500'000};  ///< without a status a detector judges nothing
  Duration link_deadline{3'000'000};      ///< without a report of its driver the state of a link is unknown
  Duration link_silence{2'000'000};       ///< without data an open link is silent
  Duration start_grace{5'000'000};        ///< before an expected process counts as never seen
  Duration tick_gap{500'000};             ///< a longer pause between ticks gives every deadline a fresh start
  Duration foreign_clock{2'000'000};      ///< a message further than this from the ticks has another clock
  Duration implied_window{
      3'000'000};  ///< a fault that begins this soon after the loss of its input is its effect

  HealthLimits limits;
};

}  // namespace airworthy::health
