/* A map: the shape of the ground and the pattern of its materials. It never changes, so any number
 * of terrains may share it by pointer. Heights are a plane plus bilinear interpolation on a regular
 * grid. Labels are indices into the materials of the terrain that uses the map. Every query takes
 * constant time. Units are SI. Thread safety: a map is only read once it has been created. */
#ifndef MILD_MAP_H
#define MILD_MAP_H

#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"
#include "mild/field.h"

MILD_API_BEGIN

/* Shapes of the undisturbed surface h0(x, y) in terms of the fields of MildMapDef. A name in
 * capitals makes the enumerator, MILD_MAP_WAVES, and a name as users write it. */
/* clang-format off */
#define MILD_MAP_LIST(ROW)                                                                         \
    ROW(FLAT, flat)   /* 0 */                                                                      \
    ROW(SLOPE, slope) /* slope x */                                                                \
    ROW(STEPS, steps) /* amplitude where frac(x/wavelength - 1/4) is below 1/2, else 0 */          \
    ROW(WAVES, waves) /* amplitude (sin(2 pi x/wavelength) + sin(2 pi y/wavelength))/2 */          \
    ROW(ROUGH, rough) /* random heights in [-amplitude, amplitude] about one wavelength apart,     \
                         interpolated smoothly; repeats after `size` */                            \
    ROW(IMAGE, image) /* amplitude heights[row][column]; row 0 has the largest y, the middle of    \
                         the image lies at the origin, and its border heights extend outward */    \
    ROW(MIXED, mixed) /* MILD_MAP_TILES x MILD_MAP_TILES square tiles of height 0 at their edges;  \
                         repeats after `size`. A quarter of the tiles are level. The others are in \
                         equal shares pyramids, up or down, whose sides rise by a share of `slope` \
                         per metre, and waves, steps and rough ground of a share of `amplitude`,   \
                         which fade out over the last half metre. Seed and tile give relief and    \
                         share, which is uniform in [0.25, 1]. */                                  \
    ROW(BLOCKS, blocks) /* level squares of edge `wavelength`, one of them around the origin, each \
                           at random at 0, half or all of a height: the lesser of amplitude and    \
                           slope |x| of its middle; slope 0: amplitude; repeats after `size` */
/* clang-format on */

/* A row's enumerator: MILD_MAP_FLAT and so on. */
#define MILD_MAP_ID(id, name) MILD_MAP_##id,
/* A shape, in the list's order. */
typedef enum {
    MILD_MAP_LIST(MILD_MAP_ID) /* one for each row */
} MildMapKind;

#define MILD_MAP_TILES 5 /* tiles of MILD_MAP_MIXED along x, and along y */

/* Label of the material at (x, y). Labels count from 0. */
typedef enum {
    MILD_PATTERN_NONE,    /* 0 */
    MILD_PATTERN_STRIPES, /* floor(x/patch_size) modulo patch_count */
    MILD_PATTERN_CHECKER, /* (floor(x/patch_size) + floor(y/patch_size)) modulo patch_count */
    MILD_PATTERN_IMAGE /* labels[row][column] of squares of edge patch_size, placed like heights */
} MildPattern;

/* What a map is made from. */
typedef struct {
    int kind;    /* MildMapKind */
    double cell; /* [m] edge of the cells of the height grid, and of the labels near a border */
    double size; /* [m] rough, mixed, blocks: period of the heights; mixed: at least 10 */
    double amplitude;            /* [m] see MildMapKind */
    double wavelength;           /* [m] see MildMapKind */
    double slope;                /* [-] slope: rise per metre along x; mixed: of pyramids; blocks:
                                    see MildMapKind */
    uint64_t seed;               /* rough, mixed, blocks: seed of the random numbers */
    int patches;                 /* MildPattern */
    double patch_size;           /* [m] */
    int patch_count;             /* materials that stripes and checker use in turn, 1 .. 255 */
    double border;               /* [m] width over which two materials blend; 0: sharp borders */
    const double *heights;       /* [height_rows][height_columns] [-] kind image; not kept */
    int height_columns;          /* at least 2 */
    int height_rows;             /* at least 2 */
    const unsigned char *labels; /* [label_rows][label_columns] patches image; not kept */
    int label_columns;           /* at least 1 */
    int label_rows;              /* at least 1 */
} MildMapDef;

/* Level ground of one material. The other fields describe a moderate terrain and take effect when
 * `kind` or `patches` is set. */
MildMapDef mild_map_def_default(void);
/* Fields of MildMapDef with unit, range and meaning, except patch_count and the images:
 * [mild_map_field_count]. */
extern const MildField mild_map_fields[];
extern const int mild_map_field_count;

/* A map; its fields are private. */
typedef struct MildMap MildMap;

#define MILD_MAP_POINTS_MAX (1 << 26) /* largest number of heights, and of labels, of a map */
/* Makes a map. Returns NULL, with the field's name and the remedy in *error, when a number is out
 * of range or not finite, when `border` is wider than patch_size or spans too many cells, when an
 * image is missing, too small or contains a value that is not finite, when there are more than
 * MILD_MAP_POINTS_MAX points, or when out of memory. */
MildMap *mild_map_create(const MildMapDef *def, MildError *error);
/* Frees a map; NULL is allowed. No terrain may use it afterwards. */
void mild_map_destroy(MildMap *map);
/* [B] Memory of the map: 4 bytes per height and 3 per label, no matter how many robots share it. */
size_t mild_map_bytes(const MildMap *map);
/* Number of labels. The labels in use are 0 .. count - 1. */
int mild_map_label_count(const MildMap *map);
/* Bool: the height is the same everywhere. */
int mild_map_is_level(const MildMap *map);
/* [m] Edges of the rectangle after which the map repeats, or that an image covers; the larger of
 * heights and labels. 0 for a plane without a pattern. */
void mild_map_extent(const MildMap *map, double *x, double *y);
/* [m] Lowest and highest point of the surface; infinite on a slope. */
void mild_map_range(const MildMap *map, double *low, double *high);

MILD_API_END

#endif
