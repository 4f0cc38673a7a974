/* Any text as a config file, and as an override. It may fail, never crash, and what it accepts must
 * print and read back to the same values. */
#include "fuzz.h"
#include "run/config/experiment_keys.h"

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
    target->sections[EXPERIMENT_SECTIONS] = ground_section(&target->material);
}

static void check_round_trip(const Target *first, int comments) {
    static Target second;
    MildError error;
    target_init(&second);
    char *once = config_text(first->sections, SECTIONS, comments);
    fuzz_check(once &&
               config_read_text(second.sections, SECTIONS, once, "again", 1, &error) == MILD_OK);
    char *plain = config_text(first->sections, SECTIONS, 0),
         *twice = config_text(second.sections, SECTIONS, 0);
    fuzz_check(plain && twice && strcmp(plain, twice) == 0);
    free(once);
    free(plain);
    free(twice);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static Target first;
    MildError error = {0};
    char *text = malloc(size + 1);
    fuzz_check(text != NULL);
    memcpy(text, data, size);
    text[size] = '\0';
    target_init(&first);
    MildStatus status = config_read_text(first.sections, SECTIONS, text, "fuzz", 0, &error);
    fuzz_check(status == MILD_OK || (error.status == status && error.text[0]));
    if (status == MILD_OK && fuzz_sample(data, size, 64)) {
        check_round_trip(&first, size % 2 == 0);
    }
    target_init(&first);
    status = config_overrides(first.sections, SECTIONS, (const char *const[]){text}, 1, &error);
    if (status == MILD_OK && fuzz_sample(data, size, 64)) {
        check_round_trip(&first, 0);
    }
    free(text);
    return 0;
}
