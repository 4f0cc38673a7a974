/* The shape of the ground and the pattern of its materials: a constant object that any number of
 * terrains share by pointer. Heights are bilinear on a regular grid, or a plane; labels name
 * materials of the terrain that uses the map. Every query is O(1). SI units. Thread safety: once
 * created a map is only read. */
#ifndef MILD_MAP_H
#define MILD_MAP_H

#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"
#include "mild/field.h"

MILD_API_BEGIN

/* Shape of the undisturbed surface h0(x, y), with the numbers of MildMapDef. */
typedef enum {
    MILD_MAP_FLAT,  /* 0 */
    MILD_MAP_SLOPE, /* slope x */
    MILD_MAP_STEPS, /* amplitude where x/wavelength - 1/4 lies in the lower half of its period, else
                       0 */
    MILD_MAP_WAVES, /* amplitude (sin(2 pi x/wavelength) + sin(2 pi y/wavelength))/2 */
    MILD_MAP_ROUGH, /* random heights in [-amplitude, amplitude], wavelength apart, joined smoothly;
                       repeats after `size` */
    MILD_MAP_IMAGE  /* amplitude heights[row][column], row 0 at the largest y, the middle at 0; the
                       border goes on */
} MildMapKind;

/* Label of the material at (x, y), counted from 0. */
typedef enum {
    MILD_PATTERN_NONE,    /* 0 */
    MILD_PATTERN_STRIPES, /* floor(x/patch_size) modulo patch_count */
    MILD_PATTERN_CHECKER, /* (floor(x/patch_size) + floor(y/patch_size)) modulo patch_count */
    MILD_PATTERN_IMAGE /* labels[row][column], pixels of edge patch_size, placed as heights are */
} MildPattern;

/* What a map is made from. */
typedef struct {
    int kind;    /* MildMapKind */
    double cell; /* [m] distance of the heights' grid points, and of the pattern's at its borders */
    double size; /* [m] rough: the pattern repeats after this length */
    double amplitude;  /* [m] see above */
    double wavelength; /* [m] see above */
    double slope;      /* [-] rise per metre along x */
    uint64_t seed;     /* of rough */
    int patches;       /* MildPattern */
    double patch_size; /* [m] */
    int patch_count;   /* materials that stripes and checker take in turn, 1 .. 255 */
    double border;     /* [m] width over which two materials blend; 0: a sharp border */
    /* of kind and patches `image`; read by mild_map_create, not kept */
    const double *heights;           /* [height_rows][height_columns] [-] */
    int height_columns, height_rows; /* at least 2 */
    const unsigned char *labels;     /* [label_rows][label_columns] */
    int label_columns, label_rows;   /* at least 1 */
} MildMapDef;

/* Level ground of one material; the other numbers are those of a moderate terrain, used as soon as
 * `kind` or `patches` says so. */
MildMapDef mild_map_def_default(void);
/* All but patch_count and the images: validation, config keys, help. */
extern const MildField mild_map_fields[];
extern const int mild_map_field_count;

/* Heights and labels, made once. */
typedef struct MildMap MildMap;

#define MILD_MAP_POINTS_MAX (1 << 26) /* most heights, and most labels, of a map */
/* Makes a map. NULL with the field's name and the remedy in *error: a number out of range or not
 * finite, an image missing, empty or with a value that is not finite, more than MILD_MAP_POINTS_MAX
 * points, out of memory. */
MildMap *mild_map_create(const MildMapDef *def, MildError *error);
/* May be NULL. No terrain may use it any more. */
void mild_map_destroy(MildMap *map);
/* [B] Memory: 4 per height, 3 per label, whatever the number of robots on it. */
size_t mild_map_bytes(const MildMap *map);
/* Labels used are 0 .. count - 1. */
int mild_map_label_count(const MildMap *map);
/* Bool: the height is the same everywhere. */
int mild_map_is_level(const MildMap *map);
/* [m] Edges of the rectangle that repeats, or that an image covers: the larger of heights and
 * labels; 0 for a plane. */
void mild_map_extent(const MildMap *map, double *x, double *y);
/* [m] lowest and highest point of what repeats; infinite on a slope. */
void mild_map_range(const MildMap *map, double *low, double *high);

MILD_API_END

#endif
