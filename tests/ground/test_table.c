/* The table of ground models: every row is whole, and a model reads the fields that its row names,
 * those and no others. */
#include "ground_kit.h"

#include "ground/law/models.h"

#define SOFT_MODELS MILD_MODEL_RIGID

static const MildField *field_of(const char *key) {
    return mild_field_find(mild_material_fields, mild_material_field_count, key, NULL);
}

/* Bool: the key is in a row's list. */
static int listed(const char *const *keys, int most, const char *key) {
    for (int k = 0; k < most && keys[k]; k++) {
        if (strcmp(keys[k], key) == 0) {
            return 1;
        }
    }
    return 0;
}

TEST(test_rows) {
    for (int m = 0; m < MILD_MODELS; m++) {
        const MildModelInfo *info = mild_model_info((MildModel)m);
        MildModel found = MILD_MODEL_RIGID;
        assert_true(mild_model_find(mild_model_names[m], &found) && (int)found == m);
        assert_true(info->summary && *info->summary && info->source && *info->source);
        assert_int_equal(info->concentric, mild_model_is_concentric((MildModel)m));
        for (int k = 0; k < MILD_MODEL_FIELDS && info->fields[k]; k++) {
            if (!field_of(info->fields[k])) {
                fail_msg("%s: no field is called %s", mild_model_names[m], info->fields[k]);
            }
        }
        for (int k = 0; k < MILD_MODEL_SCALED && info->scaled[k]; k++) {
            assert_true(listed(info->fields, MILD_MODEL_FIELDS, info->scaled[k]));
            assert_int_equal(field_of(info->scaled[k])->type, MILD_FIELD_DOUBLE);
        }
        for (int k = 0; k < MILD_MODEL_PRESETS && info->presets[k]; k++) {
            MildMaterial material;
            MildError error = {0};
            assert_true(mild_material_preset(info->presets[k], &material));
            assert_int_equal(material.model, m);
            assert_int_equal(mild_material_check(&material, &error), MILD_OK);
        }
        assert_true(m == MILD_MODEL_RIGID || info->fields[0]);
        /* what depends on the motion says how: the batch has no other way to know */
        const ModelRow *row = model_row(m);
        assert_int_equal(row->motion != 0, row->direction != NULL);
        assert_int_equal(row->motion & LAW_ALL, 0);
        assert_true(m == MILD_MODEL_MILD || m == MILD_MODEL_RIGID || info->scaled[0]);
    }
    assert_false(mild_model_find("ecc_sprin", &(MildModel){0}));
}

/* Sum of the wrench's numbers, each with a weight of its own, over a foot led by hand: down to 16
 * mm and sideways, up, down again to where the bed is, out, and into its imprint. */
static double led(const MildMaterial *m, const MildSole *plate, const MildSole *one) {
    const MildSole *sole = mild_model_is_concentric((MildModel)m->model) ? one : plate;
    enum { STEPS = 40, WAYS = 5, TILES = 8 };
    static const double depths[WAYS + 1] = {-0.002, 0.016, 0.013, 0.019, -0.005, 0.016};
    Kit kit;
    double sum = 0.0;
    kit_open(&kit, 1, (MildSole *)(uintptr_t)sole, NULL, m, 1e-3);
    free(kit.ground);
    kit.bytes = mild_ground_bytes_imprints(kit.soles, 1, TILES);
    kit.ground = mild_ground_init_imprints(aligned_alloc(64, (kit.bytes + 63) / 64 * 64), kit.soles,
                                           1, TILES);
    kit.input.position[0][2] -= depths[0];
    for (int s = 0; s < WAYS * STEPS; s++) {
        const double down = (depths[s / STEPS + 1] - depths[s / STEPS]) / (STEPS * kit.input.dt);
        kit.input.free_velocity[0] = 0.03;
        kit.input.free_velocity[2] = -down;
        kit_solve(&kit);
        kit_advance(&kit);
        const MildFootResult *foot = &kit.result.foot[0];
        for (int k = 0; k < 3; k++) {
            sum += (1.0 + k + 0.01 * s) * foot->force[k] + (5.0 + k) * foot->torque[k];
        }
    }
    kit_close(&kit);
    return sum;
}

/* Another number of the field, within its range. */
static void change(MildMaterial *m, const MildField *field) {
    void *at = (char *)m + field->offset;
    if (field->type == MILD_FIELD_BOOL) {
        m->passive = !m->passive;
        return;
    }
    double value;
    memcpy(&value, at, sizeof value);
    value = value == 0 ? 0.5 * field->max : 1.1 * value <= field->max ? 1.1 * value : 0.9 * value;
    memcpy(at, &value, sizeof value);
}

TEST(test_fields) {
    MildError error = {0};
    MildSole *plate = kit_plate(4, 3);
    MildSole *one = mild_sole_concentric(plate, &error);
    for (int model = 0; model < SOFT_MODELS; model++) {
        const MildModelInfo *info = mild_model_info((MildModel)model);
        for (int f = 0; f < mild_material_field_count; f++) {
            const MildField *field = &mild_material_fields[f];
            if (field->type == MILD_FIELD_NAME) {
                continue; /* the model itself */
            }
            MildMaterial base = mild_material_default(), other;
            base.model = model;
            base.recovery = 0.3;
            base.bed_depth = 0.017;
            const int regains = strcmp(field->name, "regain_length") == 0;
            if (regains || strcmp(field->name, "grip") == 0 ||
                strcmp(field->name, "slip_growth") == 0) { /* of ground that slip weakens */
                base.slip_length = 0.002;
                base.recovery = 0.0;
                base.regain_length = 0.05;
                base.grip = 0.1;
            }
            if (field->type == MILD_FIELD_BOOL) {
                base.c_d = 0.3; /* the clamp acts */
            }
            other = base;
            change(&other, field);
            const double a = led(&base, plate, one), b = led(&other, plate, one);
            const int reads = fabs(a - b) > 1e-9 * fabs(a);
            if (reads != listed(info->fields, MILD_MODEL_FIELDS, field->name)) {
                fail_msg("%s %s %s, its row says otherwise", mild_model_names[model],
                         reads ? "reads" : "does not read", field->name);
            }
        }
    }
    mild_sole_destroy(one);
    mild_sole_destroy(plate);
}

TEST_MAIN(NULL, NULL)
