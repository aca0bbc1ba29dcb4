#include "gateway/health/input_limits.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace airworthy::health {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kLargestTime_us = std::int64_t{1} << 60;

unsigned byte_at(const std::string& text, std::size_t i) { return static_cast<unsigned char>(text[i]); }

/// Length of the valid UTF-8 sequence at `i`, 0 if there is none (overlong forms and surrogates are none).
std::size_t utf8_length(const std::string& text, std::size_t i) {
  const unsigned lead = byte_at(text, i);
  if (lead < 0x80) return 1;
  std::size_t length = 0;
  if (lead >= 0xC2 && lead <= 0xDF) length = 2;
  if (lead >= 0xE0 && lead <= 0xEF) length = 3;
  if (lead >= 0xF0 && lead <= 0xF4) length = 4;
  if (length == 0 || i + length > text.size()) return 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte_at(text, i + k) & 0xC0U) != 0x80U) return 0;
  }
  const unsigned second = byte_at(text, i + 1);
  if (lead == 0xE0 && second < 0xA0) return 0;
  if (lead == 0xED && second > 0x9F) return 0;
  if (lead == 0xF0 && second < 0x90) return 0;
  if (lead == 0xF4 && second > 0x8F) return 0;
  return length;
}

/// C0, DEL and C1 (U+0080 to U+009F): all that a terminal could obey.
bool is_control(const std::string& text, std::size_t i, std::size_t length) {
  const unsigned lead = byte_at(text, i);
  if (length == 1) return lead < 0x20 || lead == 0x7F;
  return lead == 0xC2 && byte_at(text, i + 1) < 0xA0;
}

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
  void name(std::string& s) const { s = clean_text(s, limits_.name_bytes); }
  void text(std::string& s) const { s = clean_text(s, limits_.text_bytes); }

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

std::string clean_text(const std::string& text, std::size_t max_bytes) {
  std::string out;
  out.reserve(std::min(text.size(), max_bytes));
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    const std::size_t written = length == 0 || is_control(text, i, length) ? 1 : length;
    if (out.size() + written > max_bytes) break;
    if (length == 0) {
      out += '?';
    } else if (is_control(text, i, length)) {
      out += ' ';
    } else {
      out.append(text, i, length);
    }
    i += std::max<std::size_t>(length, 1);
  }
  return out;
}

TimePoint clamp_time(TimePoint t) { return from_us(std::clamp(to_us(t), -kLargestTime_us, kLargestTime_us)); }

void bound_input(Input& input, const HealthLimits& limits, HealthCounters& counters) {
  std::visit(Bounder{limits, counters}, input);
}

}  // namespace airworthy::health
