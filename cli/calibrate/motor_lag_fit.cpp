#include "cli/calibrate/motor_lag_fit.h"

#include <algorithm>
#include <cmath>

namespace airworthy::calibrate {
namespace {

constexpr double kShortest_s = 0.004;
constexpr double kLagStep = 1.15;  // ratio of neighbours in the grid
constexpr int kLags = 25;          // up to 0.12 s
constexpr double kDelayStep_s = 0.004;
constexpr int kDelays = 16;
constexpr double kLeastExplained = 0.02;
constexpr std::size_t kFewest = 200;
constexpr double kLongestGap_s = 0.5;

/// x of (1) at the times of the commands.
std::vector<double> lagged(const Series& command, double time_constant_s) {
  std::vector<double> x(command.value.size());
  if (!x.empty()) x[0] = command.value[0];
  for (std::size_t k = 1; k < x.size(); ++k) {
    const double share = 1.0 - std::exp(-(command.time_s[k] - command.time_s[k - 1]) / time_constant_s);
    x[k] = x[k - 1] + share * (command.value[k - 1] - x[k - 1]);
  }
  return x;
}

/// Sums of a straight line's least squares.
struct Line {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  void add(double u, double v) {
    n += 1.0;
    x += u;
    y += v;
    xx += u * u;
    xy += u * v;
    yy += v * v;
  }
  [[nodiscard]] double variance() const { return std::max(0.0, yy / n - (y / n) * (y / n)); }
  [[nodiscard]] double explained() const {
    const double spread = xx / n - (x / n) * (x / n);
    const double common = xy / n - (x / n) * (y / n);
    return spread > 0.0 ? common * common / spread : 0.0;
  }
};

Line line_of(const Series& command, const std::vector<double>& x, const Series& speed, double time_constant_s,
             double delay_s) {
  Line line;
  std::size_t k = 0;
  for (std::size_t i = 0; i < speed.value.size(); ++i) {
    const double time_s = speed.time_s[i] - delay_s;
    while (k + 1 < x.size() && command.time_s[k + 1] <= time_s) ++k;
    const double since_s = time_s - command.time_s[k];
    if (since_s < 0.0 || since_s > kLongestGap_s) continue;
    line.add(x[k] + (1.0 - std::exp(-since_s / time_constant_s)) * (command.value[k] - x[k]), speed.value[i]);
  }
  return line;
}

}  // namespace

std::optional<MotorLagFit> fit_motor_lag(const std::vector<Series>& commands,
                                         const std::vector<Series>& speeds) {
  std::optional<MotorLagFit> best;
  double least = 0.0;
  double lag_s = kShortest_s;
  for (int k = 0; k < kLags; ++k, lag_s *= kLagStep) {
    std::vector<std::vector<double>> x;
    x.reserve(commands.size());
    for (const Series& command : commands) x.push_back(lagged(command, lag_s));
    for (int d = 0; d < kDelays; ++d) {
      const double delay_s = d * kDelayStep_s;
      double left = 0.0;
      double explained = 0.0;
      double weight = 0.0;
      for (std::size_t i = 0; i < std::min(commands.size(), speeds.size()); ++i) {
        if (x[i].empty()) continue;
        const Line line = line_of(commands[i], x[i], speeds[i], lag_s, delay_s);
        if (line.n < static_cast<double>(kFewest)) continue;
        const double mean2 = (line.y / line.n) * (line.y / line.n);
        left += line.n * (line.variance() - line.explained()) / mean2;
        explained += line.n * line.explained() / mean2;
        weight += line.n;
      }
      if (weight == 0.0 || explained / weight < kLeastExplained * kLeastExplained) continue;
      if (!best || left < least) {
        least = left;
        best = {lag_s, delay_s, std::sqrt(std::max(0.0, left / weight))};
      }
    }
  }
  return best;
}

}  // namespace airworthy::calibrate
