#include "gateway/health/input_limits.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/text/utf8.h"

namespace airworthy::health {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kLargestTime_us = std::int64_t{1} << 60;

class Bounder {
 public:
  Bounder(const HealthLimits& limits, HealthCounters& counters) : limits_{limits}, counters_{counters} {}

  void operator()(ProcessSign& sign) {
    origin(sign.origin);
    text(sign.detail);
  }

  void operator()(LinkReport& report) {
    origin(report.origin);
    name(report.link);
    text(report.detail);
    if (!std::isfinite(report.seconds_since_data) || report.seconds_since_data < 0.0) {
      report.seconds_since_data = kNaN;
    }
    report.seconds_since_data = std::min(report.seconds_since_data, 1e9);
    cut(report.rates, limits_.rates_per_link);
    for (MessageRate& rate : report.rates) {
      name(rate.name);
      if (!(rate.rate_Hz >= 0.0 && rate.rate_Hz < 1e9)) rate.rate_Hz = kNaN;
    }
  }

  void operator()(FaultReport& fault) {
    origin(fault.origin);
    name(fault.detector);
    name(fault.component);
    if (fault.component.empty()) fault.component = "unnamed component";
    name(fault.fault_kind);
    name(fault.magnitude_unit);
    text(fault.summary);
    if (!(fault.probability >= 0.0 && fault.probability <= 1.0)) fault.probability = kNaN;
    if (!std::isfinite(fault.magnitude)) fault.magnitude = kNaN;
    if (!std::isfinite(fault.magnitude_sigma) || fault.magnitude_sigma < 0.0) fault.magnitude_sigma = kNaN;
    fault.onset = clamp_time(fault.onset);
    fault.detected = clamp_time(fault.detected);
    cut(fault.candidates, limits_.candidates_per_fault);
    for (std::string& candidate : fault.candidates) name(candidate);
    cut(fault.evidence, limits_.evidence_per_fault);
    for (Evidence& item : fault.evidence) {
      name(item.name);
      name(item.unit);
      if (!std::isfinite(item.value)) item.value = kNaN;
    }
  }

  void operator()(DetectorReport& report) {
    origin(report.origin);
    name(report.detector);
    text(report.muted_reason);
    cut(report.components, limits_.components_per_detector);
    for (Assessment& assessment : report.components) {
      name(assessment.component);
      text(assessment.reason);
    }
    if (cut(report.active, limits_.faults_per_report)) report.active_is_complete = false;
    for (FaultReport& fault : report.active) (*this)(fault);
  }

 private:
  void origin(Origin& from) {
    name(from.producer);
    from.time = clamp_time(from.time);
    from.sent = clamp_time(from.sent);
  }
  void name(std::string& s) const { s = clean_text<std::string>(s, limits_.name_bytes); }
  void text(std::string& s) const { s = clean_text<std::string>(s, limits_.text_bytes); }

  template <class T>
  bool cut(std::vector<T>& list, std::size_t most) {
    if (list.size() <= most) return false;
    list.resize(most);
    ++counters_.cut_lists;
    return true;
  }

  const HealthLimits& limits_;
  HealthCounters& counters_;
};

}  // namespace

TimePoint clamp_time(TimePoint t) { return from_us(std::clamp(to_us(t), -kLargestTime_us, kLargestTime_us)); }

void bound_input(Input& input, const HealthLimits& limits, HealthCounters& counters) {
  std::visit(Bounder{limits, counters}, input);
}

}  // namespace airworthy::health
