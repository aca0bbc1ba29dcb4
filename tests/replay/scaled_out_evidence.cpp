#include <cstdio>
#include <string>
#include <vector>

#include "tests/replay/scaled_out_flight.h"

// Recorded healthy flights with one rotor's contribution scaled out, for docs/evidence_effectiveness_recorded.md. See
// tools/evidence_effectiveness_recorded.py, which runs it.

namespace {

using airworthy::effectiveness::EffectivenessConfig;
using airworthy::effectiveness::LossKind;
using airworthy::testing::ScaledOutFlight;

/// Lines: scaled, flight, onset in s, rotor, loss, rotor named, delay in ms, kind, what is left (dashes if nothing is); and
/// healthy, flight, s judged, alarms, onsets left out as nothing was judged then.
void print(const std::string& log, const ScaledOutFlight& flight) {
  const std::size_t slash = log.find_last_of('/') + 1;
  const std::string name = log.substr(slash, log.rfind('.') - slash);
  for (const auto& one : flight.outcomes) {
    std::printf("scaled %s %.2f %zu %.1f", name.c_str(), one.onset_s, one.rotor + 1, one.loss);
    if (one.found) {
      std::printf(" %zu %.1f %s %.3f\n", one.found->rotor + 1, 1e3 * one.delay_s,
                  one.found->kind == LossKind::kPropellerLost ? "propeller_lost" : "partial_loss",
                  one.found->effectiveness);
    } else {
      std::printf(" - - - -\n");
    }
  }
  std::printf("healthy %s %.2f %d %d\n", name.c_str(), flight.judged_s, flight.healthy_alarms,
              flight.muted_onsets);
}

int fail(int code, const airworthy::rt::Error& error) {
  std::fprintf(stderr, "scaled_out_evidence: %s\n", error.text.c_str());
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr,
                 "usage: scaled_out_evidence CONFIG CALIBRATION_THAT_JUDGES CALIBRATION_SCALED_OUT LOG "
                 "[KEY=VALUE...]\n");
    return 64;
  }
  const auto load = [&](const std::string& calibration) {
    std::vector<std::string> overrides(argv + 5, argv + argc);
    overrides.push_back("calibration=" + calibration);
    return EffectivenessConfig::load(argv[1], overrides);
  };
  const auto judging = load(argv[2]);
  if (!judging) return fail(78, judging.error());
  const auto truth = load(argv[3]);
  if (!truth) return fail(78, truth.error());
  const auto flight = airworthy::testing::scale_out(argv[4], *judging, *truth);
  if (!flight) return fail(65, flight.error());
  print(argv[4], *flight);
  return 0;
}
