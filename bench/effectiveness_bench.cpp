// One step of the filter of effectiveness for 4, 6 and 8 rotors, beside the same filter as a textbook writes it (matrices of
// run-time size) and in plain loops of fixed size; and one inertial sample of the whole detector.
#include "bench/effectiveness_steps.h"
#include "bench/time_steps.h"

int main(int argc, char** argv) {
  using namespace airworthy::bench;
  add_methods({"filter_double", "filter_float", "textbook_filter", "by_hand_filter", "detector_sample"},
              with_steps);
  return run_benchmarks(argc, argv);
}
