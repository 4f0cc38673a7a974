#include "ground/batch/batch.h"

#include <stdlib.h>
#include <string.h>

#include "device/device.h"
#include "ground/law/begin.h"
#include "ground/law/width.h"
#include "ground/step/inside.h"

#define MATERIAL_LAW_INDEX(name) MATERIAL_LAW_##name,
enum { LAW_NUMBERS(MATERIAL_LAW_INDEX) MATERIAL_LAW_COUNT };
_Static_assert(MATERIAL_LAW_COUNT + 1 == MATERIAL_LAW_NUMBERS, "all numbers");

/* Under an element of area pitch^2 of a sole of that width. index: of the material. */
static MildStatus material_numbers(const MildMaterial *material, double pitch, double width,
                                   int index, MaterialNumbers *numbers, MildError *error) {
    MildError cause = {0};
    if (mild_material_check(material, &cause) != MILD_OK) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: material %d: %s", index, cause.text);
    }
    if (width_check(material, width, &cause) != MILD_OK) {
        return mild_fail(error, cause.status, "batch: material %d: %s", index, cause.text);
    }
    const InsideLaw inside = mild_inside_law(material, pitch, width);
    const Law law = inside.law;
    int n = 0;
#define MATERIAL_LAW_STORE(name) numbers->law[n++] = (float)law.name;
    LAW_NUMBERS(MATERIAL_LAW_STORE)
    numbers->law[n] = (float)law.cone_begin; /* 0: the place of an element in its sole says more */
    numbers->recovery = (float)inside.recovery;
    numbers->mu = (float)material->mu;
    numbers->k_drift = (float)inside.k_drift;
    numbers->b_drift = (float)inside.b_drift;
    numbers->exit_drag = (float)law_exit_drag(&law);
    numbers->entry_drag = (float)law_entry_drag(&law);
    numbers->cohesion = (float)material->cohesion;
    numbers->shear_length = (float)material->shear_length;
    numbers->projects = (float)inside.share.projects;
    numbers->slip_rate = (float)inside.share.slip_rate;
    numbers->regain_rate = (float)inside.share.regain_rate;
    numbers->grip = (float)inside.share.grip;
    numbers->growth = (float)inside.share.growth;
    numbers->side = (float)inside.share.side;
    numbers->curves = inside.curves;
    numbers->curves |= law_creates(law.mass_rate, law.drag_rate) ? (int)LAW_CREATES : 0;
    return MILD_OK;
}

MaterialNumbers *material_table(int device, const double *pitch, const double *width, int soles,
                                const MildMaterial *materials, int count, int *curves,
                                MildError *error) {
    const size_t bytes = (size_t)((count + 1) * soles) * sizeof(MaterialNumbers);
    MaterialNumbers *numbers = calloc(1, bytes);
    MildStatus status = MILD_OK;
    if (!numbers) {
        mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
        return NULL;
    }
    for (int i = 0; i < count * soles && status == MILD_OK; i++) {
        status = material_numbers(&materials[i / soles], pitch[i % soles], width[i % soles],
                                  i / soles, &numbers[i], error);
        *curves |= status == MILD_OK ? numbers[i].curves : 0;
    }
    memset(numbers + count * soles, 0xff, (size_t)soles * sizeof *numbers); /* not a number */
    MaterialNumbers *table = status == MILD_OK ? device_alloc(device, bytes, error) : NULL;
    if (table && device_copy(device, table, numbers, bytes, error) != MILD_OK) {
        device_free(device, table);
        table = NULL;
    }
    free(numbers);
    return table;
}
