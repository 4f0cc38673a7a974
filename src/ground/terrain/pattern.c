/* A pattern consists of fields, each of one material. With smooth borders the fields are divided
 * into small cells, and a cell near a border also has the label and the share of the neighbouring
 * material. */
#include "ground/terrain/grid.h"

#include <limits.h>
#include <stdlib.h>

#define PATTERN_WORK 4e9 /* limit on the cells visited while borders are blended */

/* Label of the field (i, j). */
typedef int (*PatternLabel)(const MildMapDef *def, int i, int j);

static int label_stripes(const MildMapDef *def, int i, int j) {
    (void)j;
    return i % def->patch_count;
}

static int label_checker(const MildMapDef *def, int i, int j) {
    return (i + j) % def->patch_count;
}

static int label_image(const MildMapDef *def, int i, int j) {
    return def->labels[(size_t)(def->label_rows - 1 - j) * (size_t)def->label_columns + (size_t)i];
}

/* Allocates the labels. With sharp borders a field is one cell; otherwise it is divided into cells
 * of about def->cell. */
static MildStatus pattern_allocate(MildMap *map, const MildMapDef *def, int columns, int rows,
                                   int repeats, MildError *error) {
    double fine = def->border > 0.0 ? ceil(def->patch_size / def->cell - 1e-9) : 1.0;
    double fine_y = rows > 1 ? fine : 1.0;
    double cell = def->patch_size / fine;
    double cells = columns * fine * (rows * fine_y);
    double edge = 2.0 * ceil(0.5 * def->border / cell) + 1.0; /* of the search window */
    double window = rows > 1 ? edge * edge : edge;
    if (cells > MILD_MAP_POINTS_MAX || cells * window > PATTERN_WORK) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "terrain.patches: %g cells with a border of %g m are too many: use a "
                         "larger terrain.cell or a smaller terrain.border",
                         cells, def->border);
    }
    map->labels =
        grid_make(columns * (int)fine, rows * (int)fine_y, cell, def->patch_size / fine_y, repeats);
    map->label = malloc((size_t)cells * sizeof *map->label);
    return map->label ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "terrain: out of memory");
}

/* Index of a cell that may lie beyond the grid: wrapped around if the grid repeats, else
 * clamped. */
static int neighbour(int index, int count, int repeats) {
    if (repeats) {
        return (index % count + count) % count;
    }
    return index < 0 ? 0 : index >= count ? count - 1 : index;
}

/* Blends cell (i, j) with the nearest other material. At the distance d from that material, its
 * share is 1/2 - d/border. Across a straight border the mixture thus changes linearly from one
 * material to the other. */
static void pattern_blend(MildMap *map, double border, int i, int j) {
    const Grid *grid = &map->labels;
    Label *here = &map->label[(size_t)j * (size_t)grid->columns + (size_t)i];
    double cell = grid->cell_x;
    double nearest = 0.5 * border;
    int cells = (int)ceil(nearest / cell); /* to search on either side */
    int cells_y = grid->rows > 1 ? cells : 0;
    for (int dj = -cells_y; dj <= cells_y; dj++) {
        const int row = neighbour(j + dj, grid->rows, grid->repeats);
        const Label *labels = &map->label[(size_t)row * (size_t)grid->columns];
        const double y = dj ? cell * (abs(dj) - 0.5) : 0;
        for (int di = -cells; di <= cells; di++) {
            const int column = i + di; /* most are in the grid */
            const int inside = column >= 0 && column < grid->columns;
            const int other =
                labels[inside ? column : neighbour(column, grid->columns, grid->repeats)].first;
            if (other == here->first) {
                continue;
            }
            const double x = di ? cell * (abs(di) - 0.5) : 0;
            const double distance = sqrt(x * x + y * y);
            if (distance < nearest) {
                nearest = distance;
                here->second = (unsigned char)other;
            }
        }
    }
    /* With a subnormal border, rounding half of it could make the share negative. */
    here->share = (unsigned char)lround(255.0 * fmax(0.5 - nearest / border, 0.0));
}

static MildStatus pattern_make(MildMap *map, const MildMapDef *def, int columns, int rows,
                               int repeats, PatternLabel label, MildError *error) {
    MildStatus status = pattern_allocate(map, def, columns, rows, repeats, error);
    if (status != MILD_OK) {
        return status;
    }
    const Grid *grid = &map->labels;
    int fine = grid->columns / columns, fine_y = grid->rows / rows;
    for (int j = 0; j < grid->rows; j++) {
        for (int i = 0; i < grid->columns; i++) {
            int first = label(def, i / fine, j / fine_y);
            if (first >= map->label_count) {
                map->label_count = first + 1;
            }
            map->label[(size_t)j * (size_t)grid->columns + (size_t)i] =
                (Label){(unsigned char)first, 0, 0};
        }
    }
    for (int j = 0; def->border > 0.0 && j < grid->rows; j++) {
        for (int i = 0; i < grid->columns; i++) {
            pattern_blend(map, def->border, i, j);
        }
    }
    return MILD_OK;
}

MildStatus pattern_fill(MildMap *map, const MildMapDef *def, MildError *error) {
    int count = def->patch_count;
    if (def->patches == MILD_PATTERN_NONE) {
        return MILD_OK;
    }
    if (count < 1 || count > UCHAR_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "terrain.patches: patch_count = %d is outside 1 .. %d", count, UCHAR_MAX);
    }
    if (def->border > def->patch_size) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "terrain.border = %g is wider than terrain.patch_size = %g", def->border,
                         def->patch_size);
    }
    if (def->patches == MILD_PATTERN_STRIPES) {
        return pattern_make(map, def, count, 1, 1, label_stripes, error);
    }
    if (def->patches == MILD_PATTERN_CHECKER) {
        return pattern_make(map, def, count, count, 1, label_checker, error);
    }
    if (!def->labels || def->label_columns < 1 || def->label_rows < 1) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "terrain.patches = image needs an image of labels (terrain.labels)");
    }
    MildStatus status =
        pattern_make(map, def, def->label_columns, def->label_rows, 0, label_image, error);
    if (status != MILD_OK) {
        return status;
    }
    map->labels.x0 = -0.5 * def->label_columns * def->patch_size;
    map->labels.y0 = -0.5 * def->label_rows * def->patch_size;
    return MILD_OK;
}
