/* Any bytes as a record of a press, a slip or a ring. Refused with a message, or (a sample: a fit
 * takes a thousand times longer than a file) fitted to finite values inside their bounds. */
#include "fuzz.h"
#include "identify/fit.h"
#include "identify/fit_csv.h"
#include "identify/fit_law.h"
#include "unnamed_file.h"

static void check(const FitValue *value) {
    if (value->state == FIT_FITTED) {
        fuzz_check(value->low <= value->value && value->value <= value->high);
    } else if (value->state == FIT_LIMIT) {
        fuzz_check(isnan(value->value) && isfinite(value->low) + isfinite(value->high) == 1);
    } else if (value->state != FIT_HELD && value->state != FIT_FILLED) {
        fuzz_check(isnan(value->value) && isnan(value->low) && isnan(value->high));
    }
}

static void fit(FitKind kind, const FitPoint *points, int count, int model) {
    const MildMaterial fill = mild_material_default();
    FitDef def = {.kind = kind,
                  .plate = {{.elements = 55, .pitch = 0.0195, .width = 0.1, .outer = 0.05}},
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

/* A record in which the plate slides after its press. */
static void slide(const FitFile *record, int model) {
    const FitPlate plate = {.elements = 55, .pitch = 0.0195, .width = 0.1};
    MildMaterial curve = mild_material_default();
    FitPoint rows[48];
    curve.model = model / 2 % 2 ? MILD_MODEL_MILD_MERGED : MILD_MODEL_MILD;
    const int count = fit_slide_rows(&plate, &curve, record->slide, record->slide_count, rows);
    fuzz_check(count >= record->slide_count && count <= 2 * record->slide_count);
    fit(FIT_DRAG, rows, count, 2 * curve.model + model % 2);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    FitFile record;
    MildError error = {0};
    const MildStatus status = fit_csv_read(unnamed_file(data, size), &record, &error);
    if (status == MILD_OK) {
        const int model = data[size - 1] % (2 * MILD_MODEL_RIGID);
        const int press = record.kind == FIT_FILE_PRESS;
        fuzz_check(record.count >= FIT_POINTS_MIN || (!record.count && record.slide_count));
        fuzz_check(record.slide_count == 0 || (press && record.slide_count >= FIT_POINTS_MIN));
        fuzz_check(record.back_count == 0 || (press && record.back_count >= FIT_POINTS_MIN));
        if (record.kind == FIT_FILE_RING) {
            fit_file_ring(&record, 0.05, 0.02);
        }
        if (record.slide_count && record.slide_count < 24 && fuzz_sample(data, size, 64)) {
            slide(&record, model);
        }
        if (record.count && record.count < 24 && fuzz_sample(data, size, press ? 4096 : 64)) {
            fit(press ? FIT_PRESS : FIT_SHEAR, record.points, record.count,
                press ? model : 2 * MILD_MODEL_BEKKER + model % 2);
        }
        if (record.back_count && record.back_count < 24 && fuzz_sample(data, size, 64)) {
            fit(FIT_UNLOAD, record.back, record.back_count, model);
        }
    } else {
        fuzz_check(error.status == status && error.text[0]);
    }
    fit_file_close(&record);
    return 0;
}
