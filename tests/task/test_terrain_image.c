/* Section [terrain]: pictures read and refused, maps made from them. */
#include <unistd.h>

#include <png.h>

#include "env/task/image.h"
#include "env/task/terrain.h"
#include "files.h"
#include "mild/ground.h"

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

/* ---- kinds of PNG that libpng's short interface does not write ---- */

typedef struct {
    int bits, color, interlace, columns, rows;
} Kind;

/* bytes: [rows][stride] as the file has them. */
static void write_kind(const Kind *kind, const png_byte *bytes, size_t stride) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    static const png_color palette[3] = {{0, 0, 0}, {51, 51, 51}, {255, 255, 255}};
    png_init_io(png, file);
    png_set_user_limits(png, 1 << 17, 1 << 17);
    png_set_IHDR(png, info, (png_uint_32)kind->columns, (png_uint_32)kind->rows, kind->bits,
                 kind->color, kind->interlace, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    if (kind->color == PNG_COLOR_TYPE_PALETTE) {
        png_set_PLTE(png, info, palette, 3);
    }
    png_write_info(png, info);
    int passes = png_set_interlace_handling(png);
    for (int pass = 0; pass < passes; pass++) {
        for (int r = 0; r < kind->rows; r++) {
            png_write_row(png, bytes + stride * (size_t)r);
        }
    }
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    fclose(file);
}

static void expect_picture(const char *what, int columns, int rows, const double *grey,
                           double tolerance) {
    Image image;
    MildError error = {0};
    if (image_read(path, &image, &error) != MILD_OK) {
        fail_msg("%s: %s", what, error.text);
    }
    assert_int_equal(image.columns, columns);
    assert_int_equal(image.rows, rows);
    for (int i = 0; i < columns * rows; i++) {
        if (!(fabs(image.grey[i] - grey[i]) <= tolerance)) {
            fail_msg("%s: pixel %d is %.6f instead of %.6f", what, i, image.grey[i], grey[i]);
        }
    }
    image_close(&image);
    assert_null(image.grey);
    assert_int_equal(image.rows + image.columns, 0);
}

TEST(test_kinds) {
    const Kind bits = {1, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, 10, 1};
    const png_byte one[2] = {0xa5, 0x80};
    const double ten[10] = {1, 0, 1, 0, 0, 1, 0, 1, 1, 0};
    write_kind(&bits, one, 2);
    expect_picture("1 bit", 10, 1, ten, 0);
    const Kind indexed = {8, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE, 3, 1};
    const png_byte index[3] = {2, 0, 1};
    const double colors[3] = {1, 0, 0.2};
    write_kind(&indexed, index, 3);
    expect_picture("palette", 3, 1, colors, 1e-12);
    const Kind alpha = {16, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_INTERLACE_NONE, 2, 1};
    const png_byte wide[8] = {0x12, 0x34, 0, 0, 0xff, 0xfe, 0x80, 0};
    const double seen[2] = {0x1234 / 65535.0, 0xfffe / 65535.0};
    write_kind(&alpha, wide, 8);
    expect_picture("16 bits, transparent", 2, 1, seen, 1e-12);
    /* the luminance of the sRGB primaries (ITU-R BT.709): 0.2126, 0.7152, 0.0722 */
    const Kind color = {8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, 3, 1};
    const png_byte primary[9] = {255, 0, 0, 0, 255, 0, 0, 0, 255};
    const double luminance[3] = {0.2126, 0.7152, 0.0722};
    write_kind(&color, primary, 9);
    expect_picture("primaries", 3, 1, luminance, 0.005);
    const Kind woven = {8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_ADAM7, COLUMNS, ROWS};
    static png_byte grey[ROWS * COLUMNS];
    static double wanted[ROWS * COLUMNS];
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        grey[i] = (png_byte)(i * 31);
        wanted[i] = grey[i] / 255.0;
    }
    write_kind(&woven, grey, COLUMNS);
    expect_picture("interlaced", COLUMNS, ROWS, wanted, 1e-12);
}

/* More pixels than a map may have points; an edge longer than 32768. */
TEST(test_too_large) {
    const Kind kinds[2] = {{1, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, 32768, 2049},
                           {1, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, 32769, 1}};
    const MildStatus wanted[2] = {MILD_ERROR_RANGE, MILD_ERROR_FORMAT};
    png_byte *zeros = calloc(4097, 2049);
    assert_non_null(zeros);
    for (int i = 0; i < 2; i++) {
        Image image;
        MildError error = {0};
        write_kind(&kinds[i], zeros, 4097);
        assert_refused(image_read(path, &image, &error), wanted[i], &error, path);
        assert_null(image.grey);
    }
    free(zeros);
}

/* No picture, a picture cut anywhere, a picture with any byte changed: an error with the file's
 * name, or a picture. */
TEST(test_refused) {
    static png_byte grey[ROWS * COLUMNS];
    char names[256];
    Image image;
    MildError error = {0};
    assert_int_equal(image_read("no/such.png", &image, &error), MILD_ERROR_IO);
    kit_write(path, "height,height\n", 14);
    assert_int_equal(image_read(path, &image, &error), MILD_ERROR_FORMAT);
    snprintf(names, sizeof names, "%s PNG", path);
    assert_error(&error, MILD_ERROR_FORMAT, names);
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        grey[i] = (png_byte)(i * 31);
    }
    write_png(grey, PNG_FORMAT_GRAY, COLUMNS, ROWS);
    size_t size;
    char *bytes = kit_read(path, &size);
    int refused = 0;
    for (size_t cut = 0; cut < size; cut += 7) {
        kit_write(path, bytes, cut);
        MildStatus status = image_read(path, &image, &error);
        refused += status != MILD_OK;
        if (status != MILD_OK) {
            assert_error(&error, MILD_ERROR_FORMAT, path);
        }
        image_close(&image);
    }
    for (size_t at = 0; at < size; at += 3) {
        bytes[at] ^= 0x55;
        kit_write(path, bytes, size);
        refused += image_read(path, &image, &error) != MILD_OK;
        image_close(&image);
        bytes[at] ^= 0x55;
    }
    free(bytes);
    assert_true(refused > (int)size / 7);
}

/* A ramp of heights and a picture of two materials become the ground they show. */
TEST(test_terrain) {
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
    expect_good(terrain_make(&def, 2, &map, &error) == MILD_OK, &error);
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    assert_int_equal(mild_terrain_set_map(&terrain, map, &error),
                     MILD_ERROR_ARGUMENT); /* two labels, one material */
    terrain.materials[terrain.material_count++] = sand;
    assert_int_equal(mild_terrain_set_map(&terrain, map, &error), MILD_OK);
    for (double x = -1.8; x <= 1.8; x += 0.01) {
        expect_near("ramp", mild_terrain_height_at(&terrain, x, 0.3), 0.05 * (x + 1.8), 1e-7);
    }
    mild_map_destroy(map);
}

static void refuse_terrain(const TerrainDef *def, MildStatus status, const char *names) {
    MildError error = {0};
    MildMap *map = (MildMap *)(uintptr_t)&error; /* must become NULL */
    assert_refused(terrain_make(def, 2, &map, &error), status, &error, names);
    assert_null(map);
}

/* Pictures missing, unreadable, or given for nothing. */
TEST(test_terrain_refused) {
    TerrainDef plain = terrain_def_default(), def = plain;
    def.map.kind = MILD_MAP_IMAGE;
    refuse_terrain(&def, MILD_ERROR_ARGUMENT, "terrain.image PNG");
    strcpy(def.image, "no/such.png");
    refuse_terrain(&def, MILD_ERROR_IO, "terrain.image no/such.png");
    def = plain;
    def.map.patches = MILD_PATTERN_IMAGE;
    refuse_terrain(&def, MILD_ERROR_ARGUMENT, "terrain.labels PNG");
    strcpy(def.labels, "no/such.png");
    refuse_terrain(&def, MILD_ERROR_IO, "terrain.labels no/such.png");
    def = plain;
    strcpy(def.image, path);
    refuse_terrain(&def, MILD_ERROR_ARGUMENT, "terrain.image terrain.kind");
    def = plain;
    strcpy(def.labels, path);
    def.map.kind = MILD_MAP_ROUGH;
    refuse_terrain(&def, MILD_ERROR_ARGUMENT, "terrain.labels terrain.patches");
    def = plain;
    def.map.kind = MILD_MAP_WAVES;
    def.map.wavelength = -1;
    refuse_terrain(&def, MILD_ERROR_RANGE, "terrain.wavelength -1");
}

/* Level ground of one material needs no map; a shape or a pattern does. */
TEST(test_when_a_map) {
    MildError error = {0};
    MildMap *map;
    TerrainDef def = terrain_def_default();
    assert_int_equal(terrain_make(&def, 3, &map, &error), MILD_OK);
    assert_null(map);
    def.map.kind = MILD_MAP_WAVES;
    assert_int_equal(terrain_make(&def, 3, &map, &error), MILD_OK);
    assert_non_null(map);
    assert_int_equal(mild_map_label_count(map), 1);
    assert_false(mild_map_is_level(map));
    mild_map_destroy(map);
    def.map.kind = MILD_MAP_FLAT;
    def.map.patches = MILD_PATTERN_STRIPES;
    assert_int_equal(terrain_make(&def, 3, &map, &error), MILD_OK);
    assert_non_null(map);
    assert_int_equal(mild_map_label_count(map), 3);
    assert_true(mild_map_is_level(map));
    mild_map_destroy(map);
}

TEST(test_prints) {
    TerrainDef def = terrain_def_default();
    assert_int_equal(terrain_imprint_tiles(&def), 0);
    def.memory = 1;
    assert_int_equal(terrain_imprint_tiles(&def), 128);
    def.tiles = 9;
    assert_int_equal(terrain_imprint_tiles(&def), 9);
}

/* Three materials: black, grey, white; a grey between two counts to the nearer. */
TEST(test_labels) {
    static const png_byte grey[6] = {0, 63, 64, 191, 192, 255};
    static const int label[6] = {0, 0, 1, 1, 2, 2};
    write_png(grey, PNG_FORMAT_GRAY, 6, 1);
    TerrainDef def = terrain_def_default();
    def.map.patches = MILD_PATTERN_IMAGE;
    def.map.patch_size = 1;
    strcpy(def.labels, path);
    MildError error = {0};
    MildMap *map;
    expect_good(terrain_make(&def, 3, &map, &error) == MILD_OK, &error);
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    terrain.materials[1] = terrain.materials[2] = sand;
    terrain.material_count = 3;
    assert_int_equal(mild_terrain_set_map(&terrain, map, &error), MILD_OK);
    for (int i = 0; i < 6; i++) {
        assert_int_equal(mild_terrain_material_at(&terrain, i - 2.5, 0), label[i]);
    }
    mild_map_destroy(map);
}

TEST_MAIN(setup, teardown)
