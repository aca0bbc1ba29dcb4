#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>

namespace airworthy::test {

/// The vehicles of the unbalance paper.
struct PaperVehicle {
  std::size_t rotors;
  double mass_kg;
  double radius_m;
  double thrust_coefficient_N_s2;
  double initial_tip_mass_mg;
};
inline constexpr PaperVehicle kSmall{4, 0.039, 0.032, 4.14e-8, 2.0};
inline constexpr PaperVehicle kMedium{4, 0.69, 0.1, 7.64e-6, 20.0};
inline constexpr PaperVehicle kHexa{6, 1.17, 0.1, 7.64e-6, 20.0};

/// Data of the very model: each force wanders about that of hover independently (standard deviation
/// `force_ratio`, correlation time that of the motors), its unbalance turns at the speed of the rotor, the
/// accelerometer adds white noise. In unison: all forces wander alike.
template <std::size_t N>
class ModelFlight {
 public:
  static constexpr double kStep_s = 0.002;

  struct Options {
    double force_ratio = 0.3;
    double correlation_s = 0.03;
    double noise_m_s2 = 1.0;
    bool is_in_unison = false;
  };

  ModelFlight(const PaperVehicle& vehicle, const std::array<double, N>& tip_mass_mg, unsigned seed)
      : ModelFlight{vehicle, tip_mass_mg, seed, Options{}} {}
  ModelFlight(const PaperVehicle& vehicle, const std::array<double, N>& tip_mass_mg, unsigned seed,
              const Options& options)
      : vehicle_{vehicle}, tip_mass_mg_{tip_mass_mg}, options_{options}, random_{seed} {
    for (std::size_t i = 0; i < N; ++i) {
      phase_rad_[i] = std::uniform_real_distribution<double>{0.0, 2.0 * std::numbers::pi}(random_);
    }
  }

  void step() {
    time_s += kStep_s;
    const double keep = std::exp(-kStep_s / options_.correlation_s);
    const double unison = normal_(random_);
    ax_m_s2 = options_.noise_m_s2 * normal_(random_);
    ay_m_s2 = options_.noise_m_s2 * normal_(random_);
    for (std::size_t i = 0; i < N; ++i) {
      const double own = normal_(random_);
      wander_[i] = keep * wander_[i] + std::sqrt(1.0 - keep * keep) * (options_.is_in_unison ? unison : own);
      const double ratio = std::max(0.05, 1.0 + options_.force_ratio * wander_[i]);
      const double force_N = vehicle_.mass_kg * 9.81 / static_cast<double>(N) * ratio;
      speed_rad_s[i] = std::sqrt(force_N / vehicle_.thrust_coefficient_N_s2);
      phase_rad_[i] = std::remainder(phase_rad_[i] + speed_rad_s[i] * kStep_s, 2.0 * std::numbers::pi);
      const double a =
          1e-6 * tip_mass_mg_[i] * vehicle_.radius_m * speed_rad_s[i] * speed_rad_s[i] / vehicle_.mass_kg;
      ax_m_s2 += a * std::cos(phase_rad_[i]);
      ay_m_s2 += (i % 2 == 0 ? a : -a) * std::sin(phase_rad_[i]);
    }
  }

  double time_s = 0.0;
  double ax_m_s2 = 0.0;
  double ay_m_s2 = 0.0;
  std::array<double, N> speed_rad_s{};

 private:
  PaperVehicle vehicle_;
  std::array<double, N> tip_mass_mg_;
  Options options_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::array<double, N> phase_rad_{};
  std::array<double, N> wander_{};
};

}  // namespace airworthy::test
