/* Loads a unit and steps it tick by tick as an importer would: GUID, file of input words of 64 bits, inputs and outputs a tick, and the kind
   of each ('r' or 'i'); writes output words. Reals of 64 bits. */
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    void *logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished, *environment;
} Callbacks;

int main(int count, char **arguments) {
    /* unit.so guid inputs.bin outputs.bin period inputs kinds */
    void *unit = count == 8 ? dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL) : NULL;
    FILE *in, *out;
    const double period = count == 8 ? atof(arguments[5]) : 0;
    const unsigned inputs = count == 8 ? (unsigned)atoi(arguments[6]) : 0;
    const unsigned all = count == 8 ? (unsigned)strlen(arguments[7]) : 0;
    const Callbacks callbacks = {NULL, calloc, free, NULL, NULL};
    uint64_t word;
    unsigned k, tick = 0;
    void *instance, *saved = NULL;
    if (unit == NULL) {
        return 1;
    }
#define FUNCTION(name, ...) \
    int (*name)(void *, ##__VA_ARGS__) = (int (*)(void *, ##__VA_ARGS__))dlsym(unit, "fmi2" #name)
    void *(*Instantiate)(const char *, int, const char *, const char *, const void *, int, int) =
        (void *(*)(const char *, int, const char *, const char *, const void *, int, int))dlsym(unit, "fmi2Instantiate");
    FUNCTION(SetupExperiment, int, double, double, int, double);
    FUNCTION(EnterInitializationMode);
    FUNCTION(ExitInitializationMode);
    FUNCTION(SetReal, const unsigned *, size_t, const double *);
    FUNCTION(SetInteger, const unsigned *, size_t, const int *);
    FUNCTION(GetReal, const unsigned *, size_t, double *);
    FUNCTION(GetInteger, const unsigned *, size_t, int *);
    FUNCTION(DoStep, double, double, int);
    FUNCTION(GetFMUstate, void **);
    FUNCTION(SetFMUstate, void *);
    FUNCTION(FreeFMUstate, void **);
    if (Instantiate("other", 1, "{}", NULL, &callbacks, 0, 0) != NULL) {
        return 2;
    }
    instance = Instantiate("unit", 1, arguments[2], NULL, &callbacks, 0, 0);
    in = fopen(arguments[3], "rb");
    out = fopen(arguments[4], "wb");
    if (instance == NULL || in == NULL || out == NULL || SetupExperiment(instance, 0, 0, 0, 0, 0) ||
        EnterInitializationMode(instance) || ExitInitializationMode(instance)) {
        return 3;
    }
    while (fread(&word, sizeof word, 1, in) == 1) {
        for (k = 0; k < inputs; k++) {
            double real;
            int whole = (int)(uint32_t)word;
            memcpy(&real, &word, sizeof real);
            if (arguments[7][k] == 'r' ? SetReal(instance, &k, 1, &real) : SetInteger(instance, &k, 1, &whole)) {
                return 4;
            }
            if (k + 1 < inputs && fread(&word, sizeof word, 1, in) != 1) {
                return 5;
            }
        }
        /* Once a step is taken twice, from a state that was kept. */
        if (tick == 100 && (GetFMUstate(instance, &saved) || DoStep(instance, tick * period, period, 0) ||
                            SetFMUstate(instance, saved) || FreeFMUstate(instance, &saved))) {
            return 6;
        }
        if (DoStep(instance, tick * period, period, 1)) {
            return 7;
        }
        for (k = inputs; k < all; k++) {
            double real = 0;
            int whole = 0;
            if (arguments[7][k] == 'r' ? GetReal(instance, &k, 1, &real) : GetInteger(instance, &k, 1, &whole)) {
                return 8;
            }
            word = (uint32_t)whole;
            if (arguments[7][k] == 'r') {
                memcpy(&word, &real, sizeof word);
            }
            fwrite(&word, sizeof word, 1, out);
        }
        tick++;
    }
    return fclose(out);
}
