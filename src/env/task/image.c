#include "env/task/image.h"

#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "mild/map.h"

enum { SIGNATURE = 8 };

/* A file while it is read. libpng jumps back here on an error. */
typedef struct {
    const char *path;
    FILE *file;
    MildError *error;
    png_structp png;
    png_infop info;
    unsigned char *bytes;
    png_bytep *row;
} ImageReader;

static void on_error(png_structp png, png_const_charp message) {
    const ImageReader *reader = png_get_error_ptr(png);
    mild_fail(reader->error, MILD_ERROR_FORMAT, "%.200s: not a readable PNG: %.100s", reader->path,
              message);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

/* Converts any image to one grey channel of 8 or 16 bits. */
static void make_grey(ImageReader *reader, Image *image) {
    png_structp png = reader->png;
    png_set_expand(png);
    png_set_strip_alpha(png);
    if (png_get_color_type(png, reader->info) & PNG_COLOR_MASK_COLOR) {
        png_set_rgb_to_gray(png, PNG_ERROR_ACTION_NONE, -1, -1);
    }
    png_set_interlace_handling(png);
    png_read_update_info(png, reader->info);
    image->columns = (int)png_get_image_width(png, reader->info);
    image->rows = (int)png_get_image_height(png, reader->info);
}

static int allocate(ImageReader *reader, Image *image, size_t stride) {
    size_t rows = (size_t)image->rows;
    reader->bytes = malloc(rows * stride);
    reader->row = malloc(rows * sizeof *reader->row);
    image->grey = malloc(rows * (size_t)image->columns * sizeof *image->grey);
    for (size_t r = 0; reader->bytes && reader->row && r < rows; r++) {
        reader->row[r] = reader->bytes + r * stride;
    }
    return reader->bytes && reader->row && image->grey;
}

static void convert(const ImageReader *reader, Image *image, int wide) {
    for (int r = 0; r < image->rows; r++) {
        for (int c = 0; c < image->columns; c++) {
            const unsigned char *at = reader->row[r] + (wide ? 2 * c : c);
            image->grey[(size_t)r * (size_t)image->columns + (size_t)c] =
                wide ? (at[0] << 8 | at[1]) / 65535.0 : at[0] / 255.0;
        }
    }
}

static MildStatus decode(ImageReader *reader, Image *image) {
    if (setjmp(png_jmpbuf(reader->png))) {
        return reader->error->status;
    }
    png_set_user_limits(reader->png, 1 << 15, 1 << 15);
    png_init_io(reader->png, reader->file);
    png_set_sig_bytes(reader->png, SIGNATURE);
    png_read_info(reader->png, reader->info);
    make_grey(reader, image);
    if ((double)image->columns * image->rows > MILD_MAP_POINTS_MAX) {
        return mild_fail(reader->error, MILD_ERROR_RANGE, "%.200s: %d x %d pixels are too many",
                         reader->path, image->columns, image->rows);
    }
    if (!allocate(reader, image, png_get_rowbytes(reader->png, reader->info))) {
        return mild_fail(reader->error, MILD_ERROR_MEMORY, "%.200s: out of memory", reader->path);
    }
    png_read_image(reader->png, reader->row);
    convert(reader, image, png_get_bit_depth(reader->png, reader->info) == 16);
    return MILD_OK;
}

static MildStatus read_open(ImageReader *reader, Image *image) {
    unsigned char signature[SIGNATURE];
    if (fread(signature, 1, SIGNATURE, reader->file) != SIGNATURE ||
        png_sig_cmp(signature, 0, SIGNATURE) != 0) {
        return mild_fail(reader->error, MILD_ERROR_FORMAT, "%.200s: is not a PNG image",
                         reader->path);
    }
    reader->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, reader, on_error, on_warning);
    reader->info = reader->png ? png_create_info_struct(reader->png) : NULL;
    MildStatus status = reader->info ? decode(reader, image)
                                     : mild_fail(reader->error, MILD_ERROR_MEMORY,
                                                 "%.200s: out of memory", reader->path);
    png_destroy_read_struct(&reader->png, &reader->info, NULL);
    free(reader->bytes);
    free(reader->row);
    return status;
}

MildStatus image_read_file(FILE *file, const char *name, Image *image, MildError *error) {
    MildError local = {0};
    memset(image, 0, sizeof *image);
    ImageReader reader = {.path = name, .file = file, .error = &local};
    MildStatus status = read_open(&reader, image);
    if (status == MILD_OK) {
        return MILD_OK;
    }
    image_close(image);
    return mild_fail(error, status, "%s", local.text);
}

MildStatus image_read(const char *path, Image *image, MildError *error) {
    memset(image, 0, sizeof *image);
    MildError cause = {0};
    FILE *file = file_open(path, &cause);
    if (!file) {
        return mild_fail(error, cause.status, "%s", cause.text);
    }
    MildStatus status = image_read_file(file, path, image, error);
    fclose(file);
    return status;
}

void image_close(Image *image) {
    free(image->grey);
    memset(image, 0, sizeof *image);
}
