#include "cli/calibrate/suggest_pairs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "cli/eval/flight_run.h"
#include "core/math/cholesky.h"

namespace airworthy::calibrate {
namespace {

using response::Signal;

constexpr int kMostColumns = 2 * kMostInputs + 1;
constexpr std::size_t kFewestTicks = 100;  // in each half
constexpr double kBlock_s = 5.0;           // the halves take turns, so that take-off and cruise are in both
constexpr double kLeastPredictability = 0.05;
using Matrix = BoundedMatrix<double, kMostColumns>;
using Vector = BoundedVector<double, kMostColumns>;

constexpr std::array kCommanded{Signal::kRollSetpoint,  Signal::kPitchSetpoint, Signal::kThrustSetpoint,
                                Signal::kRollError,     Signal::kPitchError,    Signal::kAltitudeError,
                                Signal::kAirspeedError, Signal::kCommand0,      Signal::kCommand1,
                                Signal::kCommand2,      Signal::kCommand3,      Signal::kCommand4,
                                Signal::kCommand5,      Signal::kCommand6,      Signal::kCommand7};
constexpr std::array kMeasured{Signal::kRollRate,       Signal::kPitchRate, Signal::kYawRate,
                               Signal::kEulerPitchRate, Signal::kRoll,      Signal::kPitch,
                               Signal::kAccelX,         Signal::kAccelY,    Signal::kAccelZ,
                               Signal::kAirspeed,       Signal::kClimb};

// An error contains the angle it is the error of.
bool is_circular(Signal command, Signal measured) {
  return (command == Signal::kRollError && measured == Signal::kRoll) ||
         (command == Signal::kPitchError && measured == Signal::kPitch);
}

enum class Shape { kLinear, kWithOddSquare };

// Sums of least squares over one half of the ticks.
struct Sums {
  Matrix a;
  Vector b;
  double yy = 0;
  double y = 0;
  std::size_t count = 0;

  explicit Sums(int columns) : a{Matrix::Zero(columns, columns)}, b{Vector::Zero(columns)} {}
};

// The row of (1) at tick k; false where something is unknown.
bool fill(const SignalRecord& record, std::size_t k, const std::vector<PairInput>& inputs, Shape shape,
          Vector& row) {
  int column = 0;
  for (const PairInput& input : inputs) {
    const auto delay = static_cast<std::size_t>(input.delay_ticks);
    if (k < delay) return false;
    const double u = record[input.signal][k - delay];
    if (!std::isfinite(u)) return false;
    row(column++) = u;
    if (shape == Shape::kWithOddSquare) row(column++) = u * std::abs(u);
  }
  row(column) = 1.0;
  return true;
}

std::array<Sums, 2> sums_of_halves(const std::vector<SignalRecord>& records, Signal response,
                                   const std::vector<PairInput>& inputs, Shape shape) {
  const int columns = static_cast<int>(inputs.size()) * (shape == Shape::kLinear ? 1 : 2) + 1;
  std::array<Sums, 2> halves{Sums{columns}, Sums{columns}};
  auto row = Vector{columns};
  for (const SignalRecord& record : records) {
    const auto block = static_cast<std::size_t>(std::ceil(kBlock_s / record.tick_s));
    const auto& y = record[response];
    for (std::size_t k = 0; k < record.ticks(); ++k) {
      if (!std::isfinite(y[k]) || !fill(record, k, inputs, shape, row)) continue;
      Sums& sums = halves[k / block % 2];
      sums.a += row * row.transpose();
      sums.b += y[k] * row;
      sums.yy += y[k] * y[k];
      sums.y += y[k];
      ++sums.count;
    }
  }
  return halves;
}

std::optional<Vector> solve(const Sums& sums) {
  Matrix regularised = sums.a;
  for (Eigen::Index i = 0; i < regularised.rows(); ++i) regularised(i, i) *= 1.0 + 1e-9;
  Matrix inverse;
  if (!invert_positive_definite<double, kMostColumns>(regularised, inverse)) return std::nullopt;
  return Vector{inverse * sums.b};
}

// R² of `tested` with coefficients fitted elsewhere.
double r_squared(const Sums& tested, const Vector& theta) {
  const auto count = static_cast<double>(tested.count);
  const double variation = tested.yy - tested.y * tested.y / count;
  if (!(variation > 1e-12 * std::max(1.0, tested.yy))) return 0;
  const double rest = tested.yy - 2 * theta.dot(tested.b) + theta.dot(tested.a * theta);
  return std::max(0.0, 1.0 - rest / variation);
}

struct Fit {
  double predictability = 0;
  std::vector<double> gains;
};

std::optional<Fit> cross_validate(const std::vector<SignalRecord>& records, Signal response,
                                  const std::vector<PairInput>& inputs, Shape shape) {
  const auto halves = sums_of_halves(records, response, inputs, shape);
  if (halves[0].count < kFewestTicks || halves[1].count < kFewestTicks) return std::nullopt;
  const auto first = solve(halves[0]);
  const auto second = solve(halves[1]);
  if (!first || !second) return std::nullopt;  // a command that never moved
  Fit fit;
  fit.predictability = std::min(r_squared(halves[1], *first), r_squared(halves[0], *second));
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(shape == Shape::kLinear ? i : 2 * i);
    fit.gains.push_back(0.5 * ((*first)(column) + (*second)(column)));
  }
  return fit;
}

// The best of all delays for one more input.
std::optional<PairSuggestion> with_input(const std::vector<SignalRecord>& records, PairSuggestion pair,
                                         Signal command) {
  const int longest = static_cast<int>(std::lround(kLongestDelay_s / records.front().tick_s));
  std::optional<PairSuggestion> best;
  pair.inputs.push_back({command, 0, 0});
  for (int delay = 0; delay <= longest; ++delay) {
    pair.inputs.back().delay_ticks = delay;
    const auto fit = cross_validate(records, pair.response, pair.inputs, Shape::kLinear);
    if (!fit || (best && fit->predictability <= best->predictability)) continue;
    best = pair;
    best->predictability = fit->predictability;
    for (std::size_t i = 0; i < pair.inputs.size(); ++i) best->inputs[i].gain = fit->gains[i];
  }
  return best;
}

void judge_linearity(const std::vector<SignalRecord>& records, PairSuggestion& pair) {
  const auto curved = cross_validate(records, pair.response, pair.inputs, Shape::kWithOddSquare);
  const double best = curved ? std::max(curved->predictability, pair.predictability) : pair.predictability;
  pair.linearity = best > 0 ? pair.predictability / best : 0;
  pair.score = pair.predictability * pair.linearity;
}

bool has_input(const PairSuggestion& pair, Signal command) {
  return std::any_of(pair.inputs.begin(), pair.inputs.end(),
                     [command](const PairInput& input) { return input.signal == command; });
}

void sort_by_score(std::vector<PairSuggestion>& pairs) {
  std::stable_sort(pairs.begin(), pairs.end(), [](const PairSuggestion& one, const PairSuggestion& other) {
    return one.score > other.score;
  });
}

std::string describe_inputs(const PairSuggestion& pair, double tick_s) {
  std::string text;
  for (const PairInput& input : pair.inputs) {
    text += fmt::format("{}{} delay {:g} s gain {:.3g}", text.empty() ? "" : ", ", to_string(input.signal),
                        input.delay_ticks * tick_s, input.gain);
  }
  return text;
}

std::string snippet(const PairSuggestion& pair, double tick_s) {
  std::string text = fmt::format(
      "[[channel]]\nname = \"{0}\"\ncomponent = \"{0}\"\nfault_kind = \"response_anomaly\"\n"
      "severity = \"caution\"\nsummary = \"{0} unlike what is commanded\"\n"
      "response = {{signal = \"{0}\"}}\nalternative = \"shift\"\nside = \"both\"\nterms = [\n",
      to_string(pair.response));
  for (const PairInput& input : pair.inputs) {
    text += fmt::format("  {{signal = \"{}\", delay_s = {:g}}},\n", to_string(input.signal),
                        input.delay_ticks * tick_s);
  }
  return text + "  {signal = \"one\"},\n]\ndrift_sigmas = 2.0\nthreshold = 12.0\n";
}

nlohmann::json to_json(const PairSuggestion& pair, double tick_s) {
  nlohmann::json inputs = nlohmann::json::array();
  for (const PairInput& input : pair.inputs) {
    inputs.push_back(
        {{"signal", to_string(input.signal)}, {"delay_s", input.delay_ticks * tick_s}, {"gain", input.gain}});
  }
  return {{"response", to_string(pair.response)},
          {"inputs", inputs},
          {"predictability", pair.predictability},
          {"linearity", pair.linearity},
          {"score", pair.score}};
}

}  // namespace

rt::Expected<SignalRecord> read_signals(const std::string& log_path, const response::ResponseConfig& config) {
  SignalRecord record;
  record.tick_s = to_seconds(config.monitor.tick_period);
  record.columns.resize(response::kSignals);
  const auto flight = eval::run_flight(log_path, config, [&record](const response::ResponseMonitor& monitor) {
    if (monitor.muted() != response::Muted::kNo) return;
    for (std::size_t i = 0; i < record.columns.size(); ++i) {
      record.columns[i].push_back(monitor.signals()[static_cast<Signal>(i)]);
    }
  });
  if (!flight) return tl::unexpected{flight.error()};
  return record;
}

Suggestions suggest_pairs(const std::vector<SignalRecord>& records) {
  Suggestions suggestions;
  if (records.empty()) return suggestions;
  for (const Signal measured : kMeasured) {
    std::optional<PairSuggestion> best;
    for (const Signal command : kCommanded) {
      if (is_circular(command, measured)) continue;
      PairSuggestion empty;
      empty.response = measured;
      auto pair = with_input(records, empty, command);
      if (!pair || pair->predictability < kLeastPredictability) continue;
      judge_linearity(records, *pair);
      suggestions.pairs.push_back(*pair);
      if (!best || pair->predictability > best->predictability) best = pair;
    }
    bool grown = false;
    while (best && best->inputs.size() < static_cast<std::size_t>(kMostInputs)) {
      std::optional<PairSuggestion> next;
      for (const Signal command : kCommanded) {
        if (is_circular(command, measured) || has_input(*best, command)) continue;
        auto pair = with_input(records, *best, command);
        if (pair && (!next || pair->predictability > next->predictability)) next = std::move(pair);
      }
      if (!next || next->predictability < best->predictability + kLeastGain) break;
      best = std::move(next);
      grown = true;
    }
    if (!grown) continue;
    judge_linearity(records, *best);
    suggestions.multi_input.push_back(*best);
  }
  sort_by_score(suggestions.pairs);
  sort_by_score(suggestions.multi_input);
  return suggestions;
}

std::string to_table(const Suggestions& suggestions, double tick_s) {
  if (suggestions.pairs.empty()) return "No measured signal follows a commanded one in these logs.\n";
  std::string text = fmt::format("{:<24} {:<24} {:>8} {:>10} {:>15} {:>10} {:>7}\n", "commanded", "measured",
                                 "delay s", "gain", "predictability", "linearity", "score");
  for (const PairSuggestion& pair : suggestions.pairs) {
    const PairInput& input = pair.inputs.front();
    text += fmt::format("{:<24} {:<24} {:>8.2f} {:>10.3g} {:>15.3f} {:>10.3f} {:>7.3f}\n",
                        to_string(input.signal), to_string(pair.response), input.delay_ticks * tick_s,
                        input.gain, pair.predictability, pair.linearity, pair.score);
  }
  if (!suggestions.multi_input.empty()) text += "\nWith several inputs:\n";
  for (const PairSuggestion& pair : suggestions.multi_input) {
    text += fmt::format("{:<24} predictability {:.3f}, linearity {:.3f}, from {}\n", to_string(pair.response),
                        pair.predictability, pair.linearity, describe_inputs(pair, tick_s));
  }
  const bool several = !suggestions.multi_input.empty() &&
                       suggestions.multi_input.front().score > suggestions.pairs.front().score;
  text += "\nA channel to begin with:\n\n" +
          snippet(several ? suggestions.multi_input.front() : suggestions.pairs.front(), tick_s);
  return text;
}

std::string to_json(const Suggestions& suggestions, double tick_s) {
  nlohmann::json document{{"pairs", nlohmann::json::array()}, {"multi_input", nlohmann::json::array()}};
  for (const PairSuggestion& pair : suggestions.pairs) document["pairs"].push_back(to_json(pair, tick_s));
  for (const PairSuggestion& pair : suggestions.multi_input)
    document["multi_input"].push_back(to_json(pair, tick_s));
  return document.dump(1) + "\n";
}

}  // namespace airworthy::calibrate
