/* Soil files: every material comes back from its own text bit for bit, what a file may leave out,
 * and the message for each mistake. tests/fuzz/fuzz_soil.c has any text. */
#include <unistd.h>

#include "base/random.h"
#include "files.h"
#include "ground/soil/soil.h"
#include "materials.h"

/* A soil of bekker as a plate owner writes it. */
#define HAND                                                                                       \
    "# from a bevameter\n[ground]\nmodel = bekker\nexponent = 0.8\nk_c = 5790\nk_phi: 180000\n"    \
    "cohesion = 150 ; Pa\nmu = 0.62\nshear_length = 0.018\nk_drift = 0\nb_drift = 0\n"             \
    "recovery = 0.05\nbed_depth = 1\n"

static MildMaterial parsed(const char *text) {
    MildMaterial material;
    MildError error = {0};
    memset(&material, 0, sizeof material);
    expect_good(soil_parse(text, "mars.ini", &material, &error) == MILD_OK, &error);
    return material;
}

/* What a terminal would obey does not get into a file. */
TEST(test_remarks) {
    const MildMaterial m = mild_material_default();
    const char *notes[64] = {"a\tb", "\x1b[31mred\r"};
    const SoilNotes remarks = {"mild fit \x1b]0;x\x07.csv", notes};
    char *text = soil_text(&m, &remarks);
    assert_non_null(strstr(text, "# mild fit ?]0;x?.csv\n"));
    for (const char *c = text; *c; c++) {
        assert_true(*c >= ' ' || *c == '\n');
    }
    free(text);
}

/* Refused, and the material is left alone. */
static void check_bad_soil(const char *text, MildStatus status, const char *names) {
    MildMaterial material = mild_material_default();
    const MildMaterial before = material;
    MildError error = {0};
    assert_refused(soil_parse(text, "mars.ini", &material, &error), status, &error, names);
    assert_memory_equal(&material, &before, sizeof before);
    assert_int_equal(soil_parse(text, "mars.ini", &material, NULL), status);
}

/* All that the model reads is the same, bit for bit. */
static void same(const MildMaterial *a, const MildMaterial *b) {
    assert_int_equal(a->model, b->model);
    for (int i = 0; i < mild_material_field_count; i++) {
        const MildField *field = &mild_material_fields[i];
        const size_t bytes = field->type == MILD_FIELD_DOUBLE ? sizeof(double) : sizeof(int);
        if (soil_reads(a, field) &&
            memcmp((const char *)a + field->offset, (const char *)b + field->offset, bytes) != 0) {
            fail_msg("%s of %s", field->name, mild_model_names[a->model]);
        }
    }
}

TEST(test_hand) {
    const MildMaterial m = parsed(HAND);
    assert_int_equal(m.model, MILD_MODEL_BEKKER);
    assert_true(m.exponent == 0.8 && m.k_c == 5790 && m.k_phi == 180000 && m.cohesion == 150);
    assert_true(m.mu == 0.62 && m.shear_length == 0.018 && m.recovery == 0.05);
    assert_true(m.plate_width == 0 && m.refill == 0); /* left out: off */
    const MildMaterial bom = parsed("\xef\xbb\xbf; x\r\n  [ground]\r\n preset = clay \r mu=0.3");
    MildMaterial clay = kit_preset("clay");
    assert_true(bom.mu == 0.3 && bom.k_c == clay.k_c && bom.model == MILD_MODEL_BEKKER);
    const MildMaterial plain = parsed("[ground]\npreset = foam45");
    assert_true(mild_material_preset("foam45", &clay));
    assert_memory_equal(&plain, &clay, sizeof clay);
    /* the preset may come last, and `model` may repeat it */
    const MildMaterial last = parsed("[ground]\nmu = 0.3\nmodel = mild\npreset = foam45");
    assert_true(last.mu == 0.3 && last.k_pen == clay.k_pen);
}

static void draw(Random *random, MildMaterial *m) {
    *m = mild_material_default();
    m->model = (int)random_index(random, MILD_MODEL_RIGID);
    for (int i = 0; i < mild_material_field_count; i++) {
        const MildField *field = &mild_material_fields[i];
        if (field->type == MILD_FIELD_DOUBLE && random_index(random, 4)) {
            double *number = (double *)((char *)m + field->offset);
            *number = field->min + (field->max - field->min) * pow(random_unit(random), 5);
        }
    }
    m->passive = (int)random_index(random, 2);
    m->plate_width = m->plate_width < fmax(0.02, -m->k_c / m->k_phi) ? 0 : m->plate_width;
}

TEST(test_round_trip) {
    Random random = random_at(1, 2, 3);
    for (int n = 0; n < 2000; n++) {
        MildMaterial m;
        draw(&random, &m);
        const char *notes[64] = {"95 %: 1 .. 2", NULL, "two\nlines [ground]\nmu = 3"};
        const SoilNotes remarks = {"mild fit a.csv\n\n[ground]", notes};
        char *plain = soil_text(&m, NULL), *noted = soil_text(&m, &remarks);
        const MildMaterial once = parsed(plain), twice = parsed(noted);
        same(&m, &once);
        same(&m, &twice);
        free(plain);
        free(noted);
    }
}

TEST(test_files) {
    char folder[] = "/tmp/mild_soil_XXXXXX", path[64], text[] = "x.txt";
    MildMaterial clay, read;
    MildError error = {0};
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/a.ini", folder);
    assert_true(mild_material_preset("clay", &clay));
    clay.mu = 1.0 / 3;
    assert_int_equal(soil_write(&clay, NULL, path, &error), MILD_OK);
    assert_int_equal(soil_find(path, &read, &error), MILD_OK);
    same(&clay, &read);
    clay.mu = 4; /* out of range: the file stays */
    assert_int_equal(soil_write(&clay, NULL, path, &error), MILD_ERROR_RANGE);
    assert_int_equal(soil_find(path, &read, &error), MILD_OK);
    assert_true(read.mu == 1.0 / 3);
    assert_refused(soil_write(&read, NULL, text, &error), MILD_ERROR_ARGUMENT, &error,
                   "x.txt .ini");
    kit_write(path, "[ground]", 9); /* with its zero */
    assert_refused(soil_find(path, &read, &error), MILD_ERROR_FORMAT, &error, path);
    static char long_file[SOIL_BYTES_MAX + 1];
    memset(long_file, '\n', sizeof long_file);
    kit_write(path, long_file, sizeof long_file);
    assert_int_not_equal(soil_find(path, &read, &error), MILD_OK);
    unlink(path);
    assert_refused(soil_find(path, &read, &error), MILD_ERROR_IO, &error, path);
    assert_int_equal(soil_find(path, &read, NULL), MILD_ERROR_IO);
    rmdir(folder);
}

TEST(test_names) {
    MildMaterial m;
    MildError error = {0};
    assert_true(soil_is_file("a.ini") && soil_is_file("./x/a.ini"));
    assert_false(soil_is_file("clay") || soil_is_file(".ini") || soil_is_file("a.ini.bak"));
    assert_int_equal(soil_find("clay", &m, &error), MILD_OK);
    assert_int_equal(m.model, MILD_MODEL_BEKKER);
    assert_refused(soil_find("cly", &m, &error), MILD_ERROR_ARGUMENT, &error, "cly clay .ini");
    assert_refused(soil_find("rigid", &m, &error), MILD_ERROR_ARGUMENT, &error, "rigid");
}

TEST(test_mistakes) {
    check_bad_soil("", MILD_ERROR_FORMAT, "mars.ini [ground]");
    check_bad_soil("# remark\n\nmu = 1", MILD_ERROR_FORMAT, "mars.ini:3 [ground]");
    check_bad_soil("[soil]", MILD_ERROR_FORMAT, "mars.ini:1 [soil] [ground]");
    check_bad_soil("[ground", MILD_ERROR_FORMAT, "mars.ini:1 [ground");
    check_bad_soil(HAND "[task]\n", MILD_ERROR_FORMAT, "mars.ini:14 [task]");
    check_bad_soil("[ground]\nmu 1", MILD_ERROR_FORMAT, "mars.ini:2");
    check_bad_soil("[ground]\nk_phy = 1", MILD_ERROR_FORMAT, "mars.ini:2 k_phy k_phi");
    check_bad_soil("[ground]\npreset = clay\nmu = 1\n\nmu = 1", MILD_ERROR_FORMAT,
                   "mars.ini:5 mu 3");
    check_bad_soil("[ground]\npreset = cley", MILD_ERROR_FORMAT, "mars.ini:2 preset cley clay");
    check_bad_soil("[ground]\npreset = other.ini", MILD_ERROR_FORMAT,
                   "mars.ini:2 preset other.ini");
    check_bad_soil("[ground]\npreset = clay\nmodel = mild", MILD_ERROR_FORMAT,
                   "mars.ini:3 model mild preset clay bekker");
    check_bad_soil("[ground]\npreset = clay\nmodel = bekkr", MILD_ERROR_ARGUMENT,
                   "mars.ini:3 ground.model bekkr bekker");
    check_bad_soil("[ground]\nmodel = rigid", MILD_ERROR_ARGUMENT, "mars.ini ground.model rigid");
    check_bad_soil("[ground]\npreset = clay\nk_pen = 5", MILD_ERROR_FORMAT,
                   "mars.ini:3 k_pen bekker");
    check_bad_soil("[ground]\npreset = clay\nmu = 3.5", MILD_ERROR_RANGE,
                   "mars.ini:3 ground.mu 3.5 0 3");
    check_bad_soil("[ground]\npreset = clay\nmu = 0,5", MILD_ERROR_ARGUMENT,
                   "mars.ini:3 ground.mu");
    check_bad_soil("[ground]\npreset = clay\nmu = nan", MILD_ERROR_ARGUMENT,
                   "mars.ini:3 ground.mu nan");
    check_bad_soil("[ground]\npreset = clay\nmu =", MILD_ERROR_ARGUMENT, "mars.ini:3 ground.mu");
    check_bad_soil("[ground]\npreset = clay\nplate_width = 1e-9", MILD_ERROR_RANGE,
                   "mars.ini ground.plate_width");
    check_bad_soil("[ground]\nmodel = bekker\nexponent = 1\n", MILD_ERROR_FORMAT,
                   "mars.ini mu bekker");
    check_bad_soil("[ground]\n\x1b]0;x\x07 = 1", MILD_ERROR_FORMAT, "mars.ini:2 ?]0;x?");
    char line[600];
    memset(line, 'x', sizeof line);
    line[sizeof line - 1] = '\0';
    check_bad_soil(line, MILD_ERROR_FORMAT, "mars.ini:1 399");
}

/* Every line of HAND is needed, but for remarks: a file that lost one is refused. */
TEST(test_lost_lines) {
    static const char *const keys[] = {"exponent",     "k_c",     "k_phi",   "cohesion", "mu",
                                       "shear_length", "k_drift", "b_drift", "bed_depth"};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        char text[] = HAND, line[64], names[64];
        snprintf(line, sizeof line, "\n%s", keys[i]);
        char *at = strstr(text, line) + 1;
        memmove(at, strchr(at, '\n') + 1, strlen(strchr(at, '\n')));
        snprintf(names, sizeof names, "mars.ini %s bekker", keys[i]);
        check_bad_soil(text, MILD_ERROR_FORMAT, names);
    }
}

TEST_MAIN(NULL, NULL)
