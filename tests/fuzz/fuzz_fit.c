/* Any bytes as a force-depth record. Refused with a message, or (a sample: a fit takes a thousand
 * times longer than a file) fitted to finite values inside their bounds. */
#include <stdio.h>

#include "fuzz.h"
#include "identify/fit.h"
#include "identify/fit_csv.h"

static void check(const FitValue *value) {
    if (value->state == FIT_FITTED) {
        fuzz_check(value->low <= value->value && value->value <= value->high);
    } else if (value->state == FIT_LIMIT) {
        fuzz_check(isnan(value->value) && isfinite(value->low) + isfinite(value->high) == 1);
    } else if (value->state != FIT_HELD && value->state != FIT_FILLED) {
        fuzz_check(isnan(value->value) && isnan(value->low) && isnan(value->high));
    }
}

static void fit(const FitPoint *points, int count, int model) {
    const MildMaterial fill = mild_material_default();
    FitDef def = {.plate = {{55, 0.0195, 0.1, NULL}},
                  .plates = 1,
                  .material = fill,
                  .fill = model % 2 ? &fill : NULL};
    FitResult result;
    MildError error;
    def.material.model = model / 2;
    const MildStatus status = fit_run(&def, points, count, &result, &error);
    fuzz_check(status == MILD_OK || count < FIT_POINTS_MIN + FIT_PARAMETERS_MAX);
    if (status != MILD_OK) {
        return;
    }
    for (int i = 0; i < result.parameters; i++) {
        const FitValue *value = &result.parameter[i];
        double low, high;
        check(value);
        fit_range(value->field, &low, &high);
        fuzz_check(!(value->low < low) && !(value->high > high));
    }
    for (int i = 0; i < result.combinations; i++) {
        check(&result.combination[i]);
    }
    fuzz_check(isfinite(result.residual) && result.rows > 0 && result.rows <= count);
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
            fit(points, count, data[size - 1] % (2 * MILD_MODEL_RIGID));
        }
    } else {
        fuzz_check(error.status == status && error.text[0]);
    }
    free(points);
    return 0;
}
