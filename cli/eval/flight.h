#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/eval/judgement_log.h"
#include "core/time/time.h"

namespace airworthy::eval {

/// A fault raised by a detector.
struct Alarm {
  TimePoint time;   ///< the sample that decided
  TimePoint onset;  ///< as the detector estimates it
  std::string component;
  std::string fault_kind;
  double magnitude = std::numeric_limits<double>::quiet_NaN();  ///< in the unit of its kind
  std::vector<std::string> candidates;  ///< where the data cannot tell components apart
};

/// What really happened in a flight.
struct Truth {
  std::string component;
  std::string fault_kind;          ///< none = healthy
  std::optional<TimePoint> onset;  ///< empty = healthy
  std::optional<TimePoint> end;    ///< empty = it stays, or its end is not known
};

/// One flight as the detectors saw it.
struct Flight {
  std::string name;
  std::string vehicle;
  std::optional<Truth> truth;  ///< of the fault that begins first; empty = not known: shown, never scored
  std::vector<Truth> faults;   ///< all that GROUND_TRUTH tells of, by onset; empty = healthy, or not known
  TimePoint start;
  TimePoint end;
  std::vector<Alarm> alarms;                       ///< in order of time
  JudgementLog judgement;                          ///< a component at least is judged
  std::map<std::string, JudgementLog> components;  ///< each by itself, as far as DETECTOR_STATUS tells
  std::string misfits;  ///< counters of messages that do not fit the vehicle file, at the end
  std::string inputs;   ///< what the log has for a detector: "IMU of sensor 0, speeds of 4 rotors"
};

}  // namespace airworthy::eval
