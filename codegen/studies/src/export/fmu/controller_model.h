/* What the unit steps: the controller under its supervisor, over controller.h. */
#ifndef MODEL_H
#define MODEL_H

#include "controller.h"

typedef struct {
    specgen_config config;
    specgen_machine machine;
} Model;

/* Words of reals. */
static uint64_t model_of_real(double value) {
    return specgen_of_real((specgen_real)value);
}

static double model_to_real(uint64_t word) {
    return specgen_to_real(word);
}

/* In memory that is zero. 0 if there is one. */
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

/* Into a model that was created. */
static void model_copy(Model *to, const Model *from) {
    *to = *from;
}

/* Settings act together: single ones may be out of range until the last of them is set. NULL, or what is wrong. */
static const char *model_settings(Model *model, const uint64_t *settings, uint64_t *outputs) {
    (void)outputs;
    return specgen_config_load(&model->config, settings) == 0
               ? NULL
               : "a setting is out of its range: docs/settings.md of specgen has them";
}

static const char *model_step(Model *model, const uint64_t *inputs, uint64_t *outputs) {
    specgen_machine_step(&model->config, &model->machine, inputs, outputs);
    return NULL;
}

#endif
