/* Any bytes as a force-depth record. Refused with a message, or (a sample: a fit takes a thousand
 * times longer than a file) fitted to finite values inside their bounds. */
#include <stdio.h>

#include "fuzz.h"
#include "lab/fit_csv.h"

static void fit(const FitPoint *points, int count) {
    FitDef def = {.material = mild_material_default(),
                  .elements = 55,
                  .pitch = 0.0195,
                  .free = {1, 1, 1, 1, 1, 1}};
    FitResult result;
    MildError error;
    fuzz_check(fit_run(&def, points, count, &result, &error) == MILD_OK);
    for (int p = 0; p < FIT_PARAMETERS; p++) {
        const FitParameter *parameter = &result.parameter[p];
        double low, high;
        fit_range(&def.material, (FitName)p, &low, &high);
        fuzz_check(parameter->value >= low && parameter->value <= high);
        if (parameter->state != FIT_FITTED) {
            continue;
        }
        fuzz_check(parameter->low >= low && parameter->low <= parameter->value);
        fuzz_check(parameter->high <= high && parameter->high >= parameter->value);
    }
    fuzz_check(isfinite(result.residual));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    FitPoint *points = NULL;
    int count = 0;
    MildError error = {0};
    FILE *file = size ? fmemopen((void *)(uintptr_t)data, size, "r") : NULL;
    if (!file) {
        return 0;
    }
    MildStatus status = fit_csv_read_file(file, "record", &points, &count, &error);
    fclose(file);
    if (status == MILD_OK) {
        fuzz_check(count >= FIT_POINTS_MIN);
        if (count < 24 && fuzz_sample(data, size, 4096)) {
            fit(points, count);
        }
    } else {
        fuzz_check(error.status == status && error.text[0]);
    }
    free(points);
    return 0;
}
