/* libFuzzer target: any bytes as a force-depth record. Refused with a message, or fitted to finite values inside their
 * bounds. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "app/fit_csv.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(int right) {
    if (!right) abort();
}

static void fit(const FitPoint *points, int count) {
    FitDef def = {.material = mild_material_default(), .elements = 55, .pitch = 0.0195, .free = {1, 1, 1, 1, 1, 1}};
    FitResult result;
    MildError error;
    check(fit_run(&def, points, count, &result, &error) == MILD_OK);
    for (int p = 0; p < FIT_PARAMETERS; p++) {
        const FitParameter *parameter = &result.parameter[p];
        double low, high;
        fit_range(&def.material, (FitName)p, &low, &high);
        check(parameter->value >= low && parameter->value <= high);
        if (parameter->state != FIT_FITTED) continue;
        check(parameter->low >= low && parameter->low <= parameter->value);
        check(parameter->high <= high && parameter->high >= parameter->value);
    }
    check(isfinite(result.residual));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    FitPoint *points = NULL;
    int count = 0;
    MildError error = {0};
    FILE *file = size ? fmemopen((void *)(uintptr_t)data, size, "r") : NULL;
    if (!file) return 0;
    MildStatus status = fit_csv_read_file(file, "record", &points, &count, &error);
    fclose(file);
    if (status == MILD_OK) {
        check(count >= FIT_POINTS_MIN);
        if (count < 24 && size % 16 == 0) fit(points, count); /* few and short ones: a fit takes longer than a file */
    } else {
        check(error.status == status && error.text[0]);
    }
    free(points);
    return 0;
}
