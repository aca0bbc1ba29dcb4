#pragma once

#include <chrono>
#include <cstdint>

namespace airworthy::rt {

/// Real time that handlers take. A step is one message or one timer.
class StepMeter {
 public:
  struct Summary {
    std::int64_t steps = 0;  ///< since the start
    double mean_us = 0;      ///< since the last summary
    double max_us = 0;
  };

  class Step {
   public:
    explicit Step(StepMeter& meter) : meter_{meter}, start_{std::chrono::steady_clock::now()} {}
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;
    ~Step() {
      meter_.add(
          std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start_).count());
    }

   private:
    StepMeter& meter_;
    std::chrono::steady_clock::time_point start_;
  };

  /// Returns and starts a new period.
  Summary take() {
    const Summary summary{steps_, count_ > 0 ? sum_us_ / static_cast<double>(count_) : 0.0, max_us_};
    count_ = 0;
    sum_us_ = max_us_ = 0;
    return summary;
  }

 private:
  void add(double us) {
    ++steps_;
    ++count_;
    sum_us_ += us;
    if (us > max_us_) max_us_ = us;
  }

  std::int64_t steps_ = 0;
  std::int64_t count_ = 0;
  double sum_us_ = 0;
  double max_us_ = 0;
};

}  // namespace airworthy::rt
