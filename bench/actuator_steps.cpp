// Counts instructions of one step: see bench/count_steps.h. Usage: actuator_steps METHOD ROTORS STEPS
#include "bench/actuator_steps.h"

#include "bench/count_steps.h"

int main(int argc, char** argv) {
  return airworthy::bench::count_steps(argc, argv, "actuator_steps", airworthy::bench::with_steps);
}
