/* The supervised controller in a C program: static memory, and one function to be called once per period by a timer interrupt or a task.
   The board provides three functions: gauges, codes, amplifiers. */
#include "controller.h"

static specgen_config config;
static specgen_machine machine;

/* Provided by the board: gauge readings in m, one per leg; converter codes, one per leg; amplifier enable. */
extern void board_read_gauges(double gauges[6]);
extern void board_write_codes(const int32_t codes[6]);
extern void board_enable_amplifiers(int on);

/* Call once before the first tick. Returns 0, or 1 if library and header do not match, or 2 if a setting is out of range. */
int control_begin(void) {
    uint64_t settings[SPECGEN_CONFIG_WORDS];
    if (specgen_check() != 0) {
        return 1;
    }
    specgen_config_default(settings);
    if (specgen_config_load(&config, settings) != 0) {
        return 2;
    }
    specgen_machine_reset(&machine);
    return 0;
}

/* Call once per period with an operator request (SPECGEN_REQUEST_…) and events (0, or SPECGEN_EVENT_…). Returns the supervisor word. */
uint32_t control_tick(uint32_t request, uint32_t events) {
    uint64_t input[SPECGEN_MACHINE_INPUT_WORDS] = {0};
    uint64_t output[SPECGEN_MACHINE_OUTPUT_WORDS];
    double gauges[6];
    int32_t codes[6];
    uint32_t supervisor;
    int leg;
    board_read_gauges(gauges);
    for (leg = 0; leg < 6; leg++) {
        input[SPECGEN_INPUT_GAUGES + leg] = specgen_of_real((specgen_real)gauges[leg]);
    }
    input[SPECGEN_INPUT_REQUEST] = request;
    input[SPECGEN_INPUT_EVENTS] = events;
    specgen_machine_step(&config, &machine, input, output);
    for (leg = 0; leg < 6; leg++) {
        codes[leg] = (int32_t)(uint32_t)output[SPECGEN_OUTPUT_DAC_CODE_0 + leg];
    }
    supervisor = (uint32_t)output[SPECGEN_OUTPUT_SUPERVISOR];
    board_enable_amplifiers((int)(supervisor >> 16 & 1u));
    board_write_codes(codes);
    return supervisor;
}

/* Digest of the state, for comparing two runs. */
uint64_t control_digest(void) {
    return specgen_machine_digest(&machine);
}
