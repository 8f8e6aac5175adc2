/* The supervised controller in a program in C: static memory, one function that a timer's interrupt or a task calls once a period.
   What a board has to bring stands at the end of it: gauges, codes, amplifiers. */
#include "controller.h"

static specgen_config config;
static specgen_machine machine;

/* Of the board. Gauges in m, one a leg; codes of the converter, one a leg; whether the amplifiers are to be on. */
extern void board_read_gauges(double gauges[6]);
extern void board_write_codes(const int32_t codes[6]);
extern void board_enable_amplifiers(int on);

/* Once, before the first tick: 0, or the library is not the one that the header was written for, or a setting is out of range. */
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

/* Each period: a request of the operator (SPECGEN_REQUEST_…) and what happened (0, or SPECGEN_EVENT_…). Returns the supervisor's word. */
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

/* What two runs are compared by. */
uint64_t control_digest(void) {
    return specgen_machine_digest(&machine);
}
