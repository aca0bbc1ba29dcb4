#pragma once

#include <string>
#include <vector>

#include "core/detectors/response/signals.h"
#include "runtime/error.h"
#include "services/response/response_config.h"

namespace airworthy::calibrate {

/// What one flight's ticks knew: a column of values for each signal, NaN where unknown.
struct SignalRecord {
  double tick_s = 0;
  std::vector<std::vector<double>> columns;  ///< by Signal

  [[nodiscard]] std::size_t ticks() const { return columns.empty() ? 0 : columns.front().size(); }
  [[nodiscard]] const std::vector<double>& operator[](response::Signal signal) const {
    return columns[static_cast<std::size_t>(signal)];
  }
};

[[nodiscard]] rt::Expected<SignalRecord> read_signals(const std::string& log_path,
                                                      const response::ResponseConfig& config);

/// One input of a pair.
struct PairInput {
  response::Signal signal = response::Signal::kOne;
  int delay_ticks = 0;
  double gain = 0;  ///< of the response, per unit of the input
};

/// A response that follows from commands, and how well.
///   Model           y(k) = Σ gᵢ·uᵢ(k − dᵢ) + c                                                           (1)
///   Predictability  R² of one half of the flights' ticks, with (1) fitted to the other half, the worse of
///                   the two ways; 0 where it predicts no better than the mean                            (2)
///   Linearity       (2) over the same with a term gᵢ′·uᵢ·|uᵢ| for each input, at most 1: a response that
///                   saturates or has a dead band loses                                                   (3)
///   Score           (2) × (3)
struct PairSuggestion {
  response::Signal response = response::Signal::kOne;
  std::vector<PairInput> inputs;
  double predictability = 0;
  double linearity = 0;
  double score = 0;
};

struct Suggestions {
  std::vector<PairSuggestion> pairs;        ///< one input each, best first
  std::vector<PairSuggestion> multi_input;  ///< for each response that gains from more inputs, best first
};

/// Longest delay between a command and its response that is tried.
inline constexpr double kLongestDelay_s = 1.0;
/// A further input must raise the predictability by so much.
inline constexpr double kLeastGain = 0.02;
inline constexpr int kMostInputs = 4;

[[nodiscard]] Suggestions suggest_pairs(const std::vector<SignalRecord>& records);

[[nodiscard]] std::string to_table(const Suggestions& suggestions, double tick_s);
[[nodiscard]] std::string to_json(const Suggestions& suggestions, double tick_s);

}  // namespace airworthy::calibrate
