/* Model of the unit: the simulated machine, through the Rust sources beside this file (rust/host-sim/unit). */
#ifndef MODEL_H
#define MODEL_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "fmu.h"

typedef struct specgen_plant specgen_plant;
specgen_plant *specgen_plant_new(const uint8_t *text, size_t length);
specgen_plant *specgen_plant_copy(const specgen_plant *plant);
void specgen_plant_free(specgen_plant *plant);
const char *specgen_plant_prepare(specgen_plant *plant, const uint64_t *settings, uint64_t *outputs, size_t count);
const char *specgen_plant_step(
    specgen_plant *plant, const uint64_t *inputs, size_t given, uint64_t *outputs, size_t count);

typedef struct {
    specgen_plant *plant;
} Model;

/* Conversions between words and reals. */
static uint64_t model_of_real(double value) {
    uint64_t word;
    memcpy(&word, &value, sizeof word);
    return word;
}

static double model_to_real(uint64_t word) {
    double value;
    memcpy(&value, &word, sizeof value);
    return value;
}

/* Memory must be zeroed. Returns 0 on success. */
static int model_create(Model *model) {
    model->plant = specgen_plant_new((const uint8_t *)FMU_PLANT, sizeof FMU_PLANT - 1);
    return model->plant == NULL;
}

static void model_destroy(Model *model) {
    specgen_plant_free(model->plant);
    model->plant = NULL;
}

/* The target must have been created. */
static void model_copy(Model *to, const Model *from) {
    specgen_plant *copy = specgen_plant_copy(from->plant);
    specgen_plant_free(to->plant);
    to->plant = copy;
}

/* Prepares the machine and sets its outputs. Returns NULL, or an error message. */
static const char *model_settings(Model *model, const uint64_t *settings, uint64_t *outputs) {
    return specgen_plant_prepare(model->plant, settings, outputs, FMU_OUTPUTS);
}

static const char *model_step(Model *model, const uint64_t *inputs, uint64_t *outputs) {
    return specgen_plant_step(model->plant, inputs, FMU_INPUTS, outputs, FMU_OUTPUTS);
}

#endif
