/* Any polygon as the outline of a sole: refused with a message, or a raster with the elements that
 * it says, finite and inside the outline's box. */
#include "fuzz.h"
#include "mild/ground.h"

enum { POINTS_MAX = 10 };

static double take_pitch(Bytes *bytes) {
    static const double usual[] = {0.02, 0.025, 0.03, 0.05, 0.07, 0.1, 0.3, 1.0};
    int kind = take_below(bytes, 9);
    return kind < 8 ? usual[kind] : take_number(bytes, 1.0);
}

static void check_sole(const MildSoleDef *def, const MildSole *sole) {
    int count = mild_sole_elements(sole);
    fuzz_check(count >= 1 && (def->target_elements == 0 || count == def->target_elements));
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 2 * def->points; i++) {
        low[i % 2] = fmin(low[i % 2], def->outline[i]);
        high[i % 2] = fmax(high[i % 2], def->outline[i]);
    }
    for (int i = 0; i < count; i++) {
        double x = mild_sole_x(sole)[i], y = mild_sole_y(sole)[i], margin = def->pitch;
        fuzz_check(x > low[0] - margin && x < high[0] + margin && y > low[1] - margin &&
                   y < high[1] + margin);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    Bytes bytes = {data, data + size};
    double outline[2 * POINTS_MAX];
    int kind = take_below(&bytes, 16);
    MildSoleDef def = {.outline = outline,
                       .points = take_below(&bytes, POINTS_MAX + 1),
                       .pitch = take_pitch(&bytes)};
    def.target_elements = kind == 0   ? take_below(&bytes, 32)
                          : kind == 1 ? (int)take_byte(&bytes) - 64
                                      : 0;
    def.sole_z = kind == 2 ? take_number(&bytes, 0.1) : -0.05;
    double reach = def.pitch > 0.0 && def.pitch < 1.0 ? 2.0 * def.pitch : 0.15;
    for (int i = 0; i < 2 * def.points; i++) {
        outline[i] = take_number(&bytes, reach);
    }
    MildError error = {0};
    MildSole *sole = mild_sole_create(&def, &error);
    if (sole) {
        check_sole(&def, sole);
    } else {
        fuzz_check(error.status != MILD_OK && error.text[0]);
    }
    mild_sole_destroy(sole);
    return 0;
}
