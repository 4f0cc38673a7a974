/* Section [terrain]: pictures read and refused, maps made from them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <png.h>

#include "mild/ground.h"
#include "task/image.h"
#include "task/terrain.h"

enum { COLUMNS = 37, ROWS = 23 };

static char path[] = "/tmp/mild_test_terrain_XXXXXX";

static int setup(void **state) {
    (void)state;
    int file = mkstemp(path);
    return file < 0 || close(file) != 0;
}

static int teardown(void **state) {
    (void)state;
    return unlink(path);
}

static void write_png(const void *pixels, png_uint_32 format, int columns, int rows) {
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)columns,
                       .height = (png_uint_32)rows,
                       .format = format};
    assert_true(png_image_write_to_file(&image, path, 0, pixels, 0, NULL));
}

/* 8 and 16 bits, grey and colour: what was written comes back. */
static void test_round_trip(void **state) {
    (void)state;
    static png_byte grey[ROWS * COLUMNS], color[ROWS * COLUMNS * 4];
    static png_uint_16 wide[ROWS * COLUMNS];
    double worst[3] = {0};
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        grey[i] = (png_byte)((i * 37) % 256);
        wide[i] = (png_uint_16)((i * 7919) % 65536);
        memset(color + 4 * i, grey[i], 3);
        color[4 * i + 3] = 255;
    }
    for (int kind = 0; kind < 3; kind++) {
        Image image;
        MildError error = {0};
        write_png(kind == 0   ? (void *)grey
                  : kind == 1 ? (void *)wide
                              : (void *)color,
                  kind == 0   ? PNG_FORMAT_GRAY
                  : kind == 1 ? PNG_FORMAT_LINEAR_Y
                              : PNG_FORMAT_RGBA,
                  COLUMNS, ROWS);
        MildStatus status = image_read(path, &image, &error);
        if (status != MILD_OK) {
            fail_msg("%s", error.text);
        }
        assert_int_equal(image.columns, COLUMNS);
        assert_int_equal(image.rows, ROWS);
        for (int i = 0; i < ROWS * COLUMNS; i++) {
            worst[kind] =
                fmax(worst[kind],
                     fabs(image.grey[i] - (kind == 1 ? wide[i] / 65535.0 : grey[i] / 255.0)));
        }
        image_close(&image);
    }
    print_message("pictures come back within %.1e (8 bits), %.1e (16 bits), %.1e (colour)\n",
                  worst[0], worst[1], worst[2]);
    assert_true(worst[0] < 1e-12 && worst[1] < 1e-12 && worst[2] < 0.005);
}

static void write_bytes(const void *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

/* No picture, a picture cut anywhere, a picture with any byte changed: an error with the file's
 * name, or a picture. */
static void test_refused(void **state) {
    (void)state;
    static png_byte grey[ROWS * COLUMNS];
    static char bytes[8192];
    Image image;
    MildError error = {0};
    assert_int_equal(image_read("no/such.png", &image, &error), MILD_ERROR_IO);
    write_bytes("height,height\n", 14);
    assert_int_equal(image_read(path, &image, &error), MILD_ERROR_FORMAT);
    assert_non_null(strstr(error.text, "not a PNG"));
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        grey[i] = (png_byte)(i * 31);
    }
    write_png(grey, PNG_FORMAT_GRAY, COLUMNS, ROWS);
    FILE *file = fopen(path, "rb");
    size_t size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    int refused = 0;
    for (size_t cut = 0; cut < size; cut += 7) {
        write_bytes(bytes, cut);
        MildStatus status = image_read(path, &image, &error);
        refused += status != MILD_OK;
        if (status != MILD_OK) {
            assert_non_null(strstr(error.text, path));
        }
        image_close(&image);
    }
    for (size_t at = 0; at < size; at += 3) {
        bytes[at] ^= 0x55;
        write_bytes(bytes, size);
        refused += image_read(path, &image, &error) != MILD_OK;
        image_close(&image);
        bytes[at] ^= 0x55;
    }
    print_message("%zu bytes of picture: %d damaged ones refused\n", size, refused);
    assert_true(refused > (int)size / 7);
}

/* A ramp of heights and a picture of two materials become the ground they show. */
static void test_terrain(void **state) {
    (void)state;
    static png_byte ramp[ROWS * COLUMNS];
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        ramp[i] = (png_byte)(5 * (i % COLUMNS));
    }
    write_png(ramp, PNG_FORMAT_GRAY, COLUMNS, ROWS);
    TerrainDef def = terrain_def_default();
    def.map.kind = MILD_MAP_IMAGE;
    def.map.patches = MILD_PATTERN_IMAGE;
    def.map.amplitude = 0.255;
    def.map.patch_size = def.map.cell = 0.1;
    snprintf(def.image, sizeof def.image, "%s", path);
    snprintf(def.labels, sizeof def.labels, "%s", path);
    MildError error = {0};
    MildMap *map;
    MildStatus status = terrain_make(&def, 2, &map, &error);
    if (status != MILD_OK) {
        fail_msg("%s", error.text);
    }
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    assert_int_equal(mild_terrain_set_map(&terrain, map, &error),
                     MILD_ERROR_ARGUMENT); /* two labels, one material */
    terrain.materials[terrain.material_count++] = sand;
    assert_int_equal(mild_terrain_set_map(&terrain, map, &error), MILD_OK);
    double worst = 0;
    for (double x = -1.8; x <= 1.8; x += 0.01) {
        worst = fmax(worst, fabs(mild_terrain_height_at(&terrain, x, 0.3) - 0.05 * (x + 1.8)));
    }
    print_message("ramp of a picture: off by %.1e m\n", worst);
    assert_true(worst < 1e-7);
    assert_int_equal(mild_terrain_material_at(&terrain, -1.0, 0), 0);
    assert_int_equal(mild_terrain_material_at(&terrain, 1.7, 0), 1);
    mild_map_destroy(map);
    def.labels[0] = '\0';
    assert_true(terrain_make(&def, 2, &map, &error) != MILD_OK);
    assert_non_null(strstr(error.text, "terrain.labels"));
    assert_null(map);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_round_trip),
                                       cmocka_unit_test(test_refused),
                                       cmocka_unit_test(test_terrain)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
