/* Runs tick.c with small dummy gauge readings, and prints the result of the last tick.
     cc -std=c11 -Wall example.c tick.c -L. -lcontroller -Wl,-rpath,'$ORIGIN' -o example && ./example 1000 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "controller.h"

int control_begin(void);
uint32_t control_tick(uint32_t request, uint32_t events);
uint64_t control_digest(void);

static long tick;
static int32_t last[6];

void board_read_gauges(double gauges[6]) {
    int leg;
    for (leg = 0; leg < 6; leg++) {
        gauges[leg] = 1e-9 * (double)((tick + leg) % 7);
    }
}

void board_write_codes(const int32_t codes[6]) {
    int leg;
    for (leg = 0; leg < 6; leg++) {
        last[leg] = codes[leg];
    }
}

void board_enable_amplifiers(int on) {
    (void)on;
}

int main(int count, char **arguments) {
    const long ticks = count > 1 ? atol(arguments[1]) : 1000;
    uint32_t supervisor = 0;
    int failed = control_begin();
    if (failed != 0) {
        fprintf(stderr, "controller.h and the library do not match (%d)\n", failed);
        return 1;
    }
    for (tick = 0; tick < ticks; tick++) {
        supervisor = control_tick(tick == 0 ? SPECGEN_REQUEST_NONE : SPECGEN_REQUEST_ARM, 0);
    }
    printf("%s, %ld ticks: supervisor %08" PRIx32 ", codes %" PRId32 " %" PRId32 " %" PRId32 " %" PRId32 " %" PRId32 " %" PRId32
           ", digest %016" PRIx64 "\n",
           SPECGEN_NAME, ticks, supervisor, last[0], last[1], last[2], last[3], last[4], last[5], control_digest());
    return 0;
}
