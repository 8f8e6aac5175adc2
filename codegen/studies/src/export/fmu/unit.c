/* FMI 2.0 co-simulation of the model in model.h, the controller or the plant. Variables are the words of a tick: inputs, outputs, settings, in
   this order; their kinds are in fmu.h. A step from t to t + h runs the ticks k with t <= k*period < t + h, t counted from the start of
   the experiment, all with the same inputs: with h = period it is one tick. */
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "fmu.h"
#include "model.h"

#if defined(_WIN32)
#define FMI2_EXPORT __declspec(dllexport)
#else
#define FMI2_EXPORT __attribute__((visibility("default")))
#endif

/* Types and states of FMI 2.0, sections 2.1.2 to 2.1.5 and 4.2. */
typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

enum { FIRST_OUTPUT = FMU_INPUTS, FIRST_SETTING = FIRST_OUTPUT + FMU_OUTPUTS, VARIABLES = FIRST_SETTING + FMU_SETTINGS };

/* The FMU state: everything that a step changes. */
typedef struct {
    Model model;
    uint64_t words[VARIABLES];
    double start;
    uint64_t ticks;
    int settings_changed;
    /* True after initialization mode. */
    int running;
} Content;

typedef struct {
    const fmi2CallbackFunctions *callbacks;
    const char *name;
    Content content;
} Instance;

static fmi2Status refuse(const Instance *instance, const char *message) {
    if (instance->callbacks->logger != NULL) {
        instance->callbacks->logger(
            instance->callbacks->componentEnvironment, instance->name, fmi2Error, "logStatusError", message);
    }
    return fmi2Error;
}

/* Memory must be zeroed. */
static int create(Content *content) {
    memcpy(content->words, FMU_STARTS, sizeof content->words);
    content->settings_changed = 1;
    return model_create(&content->model);
}

static void copy(Content *to, const Content *from) {
    Model model = to->model;
    model_copy(&model, &from->model);
    *to = *from;
    to->model = model;
}

static fmi2Status take_settings(Instance *instance) {
    Content *content = &instance->content;
    if (content->settings_changed) {
        const char *wrong = model_settings(&content->model, content->words + FIRST_SETTING, content->words + FIRST_OUTPUT);
        if (wrong != NULL) {
            return refuse(instance, wrong);
        }
        content->settings_changed = 0;
    }
    return fmi2OK;
}

FMI2_EXPORT const char *fmi2GetTypesPlatform(void) {
    return "default";
}

FMI2_EXPORT const char *fmi2GetVersion(void) {
    return "2.0";
}

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[]) {
    (void)c, (void)on, (void)count, (void)categories;
    return fmi2OK;
}

FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                          const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Instance *instance;
    size_t length;
    char *own;
    (void)resources, (void)visible, (void)logging;
    if (callbacks == NULL || callbacks->allocateMemory == NULL || callbacks->freeMemory == NULL || name == NULL ||
        guid == NULL || type != fmi2CoSimulation || strcmp(guid, FMU_GUID) != 0) {
        return NULL;
    }
    length = strlen(name) + 1;
    instance = (Instance *)callbacks->allocateMemory(1, sizeof(Instance) + length);
    if (instance == NULL) {
        return NULL;
    }
    own = (char *)(instance + 1);
    memcpy(own, name, length);
    instance->callbacks = callbacks;
    instance->name = own;
    if (create(&instance->content) != 0) {
        callbacks->freeMemory(instance);
        return NULL;
    }
    return instance;
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c) {
    if (c != NULL) {
        model_destroy(&((Instance *)c)->content.model);
        ((Instance *)c)->callbacks->freeMemory(c);
    }
}

FMI2_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                                           fmi2Boolean stop_defined, fmi2Real stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    ((Instance *)c)->content.start = start;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    (void)c;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    if (take_settings((Instance *)c) != fmi2OK) {
        return fmi2Error;
    }
    ((Instance *)c)->content.running = 1;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2Terminate(fmi2Component c) {
    (void)c;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    Instance *instance = (Instance *)c;
    model_destroy(&instance->content.model);
    memset(&instance->content, 0, sizeof instance->content);
    return create(&instance->content) == 0 ? fmi2OK : refuse(instance, "out of memory for the model");
}

static int is_a(fmi2ValueReference variable, char kind) {
    return variable < VARIABLES && FMU_KINDS[variable] == kind;
}

/* Inputs and settings; a plant's settings only before it runs, because they determine its preparation. */
static int is_settable(const Instance *instance, fmi2ValueReference variable) {
    return variable < FIRST_OUTPUT || (variable >= FIRST_SETTING && (FMU_TUNABLE || !instance->content.running));
}

/* In initialization mode outputs reflect the current settings. */
static fmi2Status up_to_date(Instance *instance) {
    return instance->content.running || FMU_TUNABLE ? fmi2OK : take_settings(instance);
}

FMI2_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference variables[], size_t count, fmi2Real values[]) {
    Instance *instance = (Instance *)c;
    size_t k;
    if (up_to_date(instance) != fmi2OK) {
        return fmi2Error;
    }
    for (k = 0; k < count; k++) {
        if (!is_a(variables[k], 'r')) {
            return refuse(instance, "fmi2GetReal: a variable is not real");
        }
        values[k] = model_to_real(instance->content.words[variables[k]]);
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference variables[], size_t count, fmi2Integer values[]) {
    Instance *instance = (Instance *)c;
    size_t k;
    if (up_to_date(instance) != fmi2OK) {
        return fmi2Error;
    }
    for (k = 0; k < count; k++) {
        if (!is_a(variables[k], 'i')) {
            return refuse(instance, "fmi2GetInteger: a variable is not an integer");
        }
        values[k] = (fmi2Integer)(uint32_t)instance->content.words[variables[k]];
    }
    return fmi2OK;
}

static fmi2Status set(Instance *instance, fmi2ValueReference variable, char kind, uint64_t word) {
    if (!is_a(variable, kind) || !is_settable(instance, variable)) {
        return refuse(instance, "a variable has another type, cannot be set, or can no longer be set");
    }
    instance->content.words[variable] = word;
    instance->content.settings_changed |= variable >= FIRST_SETTING;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference variables[], size_t count, const fmi2Real values[]) {
    fmi2Status status = fmi2OK;
    size_t k;
    for (k = 0; k < count && status == fmi2OK; k++) {
        status = set((Instance *)c, variables[k], 'r', model_of_real(values[k]));
    }
    return status;
}

FMI2_EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference variables[], size_t count,
                                      const fmi2Integer values[]) {
    fmi2Status status = fmi2OK;
    size_t k;
    for (k = 0; k < count && status == fmi2OK; k++) {
        status = set((Instance *)c, variables[k], 'i', (uint32_t)values[k]);
    }
    return status;
}

/* No other variable types exist. */
static fmi2Status none(fmi2Component c, size_t count) {
    return count == 0 ? fmi2OK : refuse((const Instance *)c, "there are no variables of this type");
}

FMI2_EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference v[], size_t count, fmi2Boolean values[]) {
    (void)v, (void)values;
    return none(c, count);
}

FMI2_EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference v[], size_t count, fmi2String values[]) {
    (void)v, (void)values;
    return none(c, count);
}

FMI2_EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference v[], size_t count, const fmi2Boolean values[]) {
    (void)v, (void)values;
    return none(c, count);
}

FMI2_EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference v[], size_t count, const fmi2String values[]) {
    (void)v, (void)values;
    return none(c, count);
}

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    Instance *instance = (Instance *)c;
    if (*state == NULL) {
        Content *content = (Content *)instance->callbacks->allocateMemory(1, sizeof(Content));
        if (content == NULL || create(content) != 0) {
            instance->callbacks->freeMemory(content);
            return refuse(instance, "out of memory for a state");
        }
        *state = content;
    }
    copy((Content *)*state, &instance->content);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    copy(&((Instance *)c)->content, (const Content *)state);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (*state != NULL) {
        model_destroy(&((Content *)*state)->model);
        ((Instance *)c)->callbacks->freeMemory(*state);
        *state = NULL;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    (void)state, (void)size;
    return refuse((const Instance *)c, "state serialization is not supported");
}

FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    (void)state, (void)bytes, (void)size;
    return refuse((const Instance *)c, "state serialization is not supported");
}

FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    (void)bytes, (void)size, (void)state;
    return refuse((const Instance *)c, "state serialization is not supported");
}

FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                                    const fmi2ValueReference known[], size_t knowns, const fmi2Real dk[],
                                                    fmi2Real du[]) {
    (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)dk, (void)du;
    return refuse((const Instance *)c, "directional derivatives are not supported");
}

FMI2_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t count,
                                                   const fmi2Integer order[], const fmi2Real values[]) {
    (void)v, (void)count, (void)order, (void)values;
    return refuse((const Instance *)c, "input derivatives are not supported: inputs are held");
}

FMI2_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t count,
                                                    const fmi2Integer order[], fmi2Real values[]) {
    (void)v, (void)count, (void)order, (void)values;
    return refuse((const Instance *)c, "output derivatives are not supported");
}

FMI2_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real from, fmi2Real step, fmi2Boolean no_way_back) {
    Instance *instance = (Instance *)c;
    Content *content = &instance->content;
    /* Tolerance of a millionth of a period, since importers sum rounded steps. */
    const double end = (from - content->start + step) / FMU_PERIOD - 1e-6;
    (void)no_way_back;
    if (take_settings(instance) != fmi2OK) {
        return fmi2Error;
    }
    /* Refuse NaN, and times beyond the range of the tick counter. */
    if (!(end < 9e15)) {
        return refuse(instance, "the end of the step is not a valid time");
    }
    while ((double)content->ticks < end) {
        const char *wrong = model_step(&content->model, content->words, content->words + FIRST_OUTPUT);
        if (wrong != NULL) {
            return refuse(instance, wrong);
        }
        content->ticks++;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
    return refuse((const Instance *)c, "steps are synchronous");
}

FMI2_EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}
