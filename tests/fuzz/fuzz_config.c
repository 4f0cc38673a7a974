/* libFuzzer target: any text as a config file. It may fail, never crash, and what it accepts must print and read back
 * to the same values. Build with -DMILD_FUZZ=ON and clang, run: build-fuzz/tests/fuzz_config tests/fuzz/config */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "app/experiment.h"
#include "app/grounds.h"

enum { SECTIONS = EXPERIMENT_SECTIONS + 1 };

typedef struct {
    ExperimentDef experiment;
    MildMaterial material;
    ConfigSection sections[SECTIONS];
} Target;

static void target_init(Target *target) {
    target->experiment = experiment_def_default();
    target->material = mild_material_default();
    experiment_sections(&target->experiment, target->sections);
    target->sections[EXPERIMENT_SECTIONS] = grounds_section(&target->material);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static Target first, second;
    MildError error;
    char *text = malloc(size + 1);
    if (!text) return 0;
    memcpy(text, data, size);
    text[size] = '\0';
    target_init(&first);
    if (config_read_text(first.sections, SECTIONS, text, "fuzz", 0, &error) == MILD_OK) {
        char *once = config_text(first.sections, SECTIONS, size % 2 == 0);
        target_init(&second);
        if (!once || config_read_text(second.sections, SECTIONS, once, "again", 1, &error) != MILD_OK) abort();
        char *plain = config_text(first.sections, SECTIONS, 0), *twice = config_text(second.sections, SECTIONS, 0);
        if (!plain || !twice || strcmp(plain, twice) != 0) abort();
        free(once);
        free(plain);
        free(twice);
    }
    config_override(first.sections, SECTIONS, text, &error);
    free(text);
    return 0;
}
