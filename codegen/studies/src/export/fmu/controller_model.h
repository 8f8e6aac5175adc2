/* Model of the unit: the supervised controller, through controller.h. */
#ifndef MODEL_H
#define MODEL_H

#include "controller.h"

typedef struct {
    specgen_config config;
    specgen_machine machine;
} Model;

/* Conversions between words and reals. */
static uint64_t model_of_real(double value) {
    return specgen_of_real((specgen_real)value);
}

static double model_to_real(uint64_t word) {
    return specgen_to_real(word);
}

/* Memory must be zeroed. Returns 0 on success. */
static int model_create(Model *model) {
    if (specgen_check() != 0) {
        return 1;
    }
    specgen_machine_reset(&model->machine);
    return 0;
}

static void model_destroy(Model *model) {
    (void)model;
}

/* The target must have been created. */
static void model_copy(Model *to, const Model *from) {
    *to = *from;
}

/* Settings are checked together, so they may be out of range while being set one by one. Returns NULL, or an error message. */
static const char *model_settings(Model *model, const uint64_t *settings, uint64_t *outputs) {
    (void)outputs;
    return specgen_config_load(&model->config, settings) == 0
               ? NULL
               : "a setting is out of its range: see docs/settings.md of specgen";
}

static const char *model_step(Model *model, const uint64_t *inputs, uint64_t *outputs) {
    specgen_machine_step(&model->config, &model->machine, inputs, outputs);
    return NULL;
}

#endif
