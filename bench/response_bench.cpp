// One update of the response detector's estimators beside a textbook dense recursive least squares of the
// same size in the same run: P and the gain as matrices of run-time size, P ← (P − K·xᵀ·P)/λ.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "core/estimators/delayed_regression.h"
#include "core/estimators/factorised_rls.h"

namespace airworthy {
namespace {

constexpr int kMostTerms = 51;
constexpr std::size_t kSamples = 1024;

struct Sample {
  Eigen::VectorXd x;
  double y = 0;
};

// Excited in every direction, so that no gate closes and no value leaves the normal range.
std::vector<Sample> samples_of(int terms) {
  std::vector<Sample> samples(kSamples);
  for (std::size_t i = 0; i < kSamples; ++i) {
    samples[i].x.resize(terms);
    for (int j = 0; j < terms; ++j) {
      samples[i].x(j) = std::sin(0.7 * static_cast<double>(i * (static_cast<std::size_t>(j) + 1)) + j);
    }
    samples[i].y = samples[i].x.sum() + 0.1 * std::sin(1.3 * static_cast<double>(i));
  }
  return samples;
}

void factorised_rls(benchmark::State& state, double forgetting) {
  const auto terms = static_cast<int>(state.range(0));
  const auto samples = samples_of(terms);
  using Rls = FactorisedRls<double, kMostTerms>;
  std::vector<Rls::Vector> regressors;
  for (const Sample& sample : samples) regressors.emplace_back(sample.x);
  Rls rls{{.terms = terms, .prior_variance = 1e4, .forgetting = forgetting, .excitation_floor = 0.0}};
  Rls::Innovation innovation;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(rls.update(regressors[i], samples[i].y, innovation));
    i = (i + 1) % kSamples;
  }
}
BENCHMARK_CAPTURE(factorised_rls, remembering, 1.0)->Arg(10)->Arg(kMostTerms);
BENCHMARK_CAPTURE(factorised_rls, forgetting, 0.999)->Arg(10)->Arg(kMostTerms);

void textbook_rls(benchmark::State& state) {
  const auto terms = static_cast<int>(state.range(0));
  const auto samples = samples_of(terms);
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(terms);
  Eigen::MatrixXd p = 1e4 * Eigen::MatrixXd::Identity(terms, terms);
  constexpr double kForgetting = 0.999;
  std::size_t i = 0;
  for (auto _ : state) {
    const Eigen::VectorXd& x = samples[i].x;
    const Eigen::VectorXd px = p * x;
    const Eigen::VectorXd k = px / (kForgetting + x.dot(px));
    theta += k * (samples[i].y - x.dot(theta));
    p = (p - k * (x.transpose() * p)).eval() / kForgetting;
    benchmark::DoNotOptimize(theta.data());
    benchmark::DoNotOptimize(p.data());
    i = (i + 1) % kSamples;
  }
}
BENCHMARK(textbook_rls)->Arg(8)->Arg(10)->Arg(kMostTerms);

// The same with what an attentive reader saves: xᵀP is (P·x)ᵀ, and nothing is copied.
void textbook_rls_thrifty(benchmark::State& state) {
  const auto terms = static_cast<int>(state.range(0));
  const auto samples = samples_of(terms);
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(terms);
  Eigen::VectorXd px(terms);
  Eigen::MatrixXd p = 1e4 * Eigen::MatrixXd::Identity(terms, terms);
  constexpr double kForgetting = 0.999;
  std::size_t i = 0;
  for (auto _ : state) {
    const Eigen::VectorXd& x = samples[i].x;
    px.noalias() = p * x;
    const double alpha = kForgetting + x.dot(px);
    theta += px * ((samples[i].y - x.dot(theta)) / alpha);
    p.noalias() -= (px / alpha) * px.transpose();
    p /= kForgetting;
    benchmark::DoNotOptimize(theta.data());
    benchmark::DoNotOptimize(p.data());
    i = (i + 1) % kSamples;
  }
}
BENCHMARK(textbook_rls_thrifty)->Arg(8)->Arg(10)->Arg(kMostTerms);

// The shipped method: what it costs on average, its refit at every fifth sample included.
void delayed_regression(benchmark::State& state) {
  const auto terms = static_cast<int>(state.range(0));
  const auto samples = samples_of(terms);
  using Regression = DelayedRegression<double, 12, 128>;
  std::vector<Regression::Vector> regressors;
  for (const Sample& sample : samples) regressors.emplace_back(sample.x);
  DelayedRegressionParams params;
  params.terms = terms;
  Regression regression{params};
  Regression::Prediction prediction;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(regression.update(regressors[i], samples[i].y, prediction));
    i = (i + 1) % kSamples;
  }
}
BENCHMARK(delayed_regression)->Arg(8);

}  // namespace
}  // namespace airworthy

BENCHMARK_MAIN();
