/* Elements of a triangle mesh, however fine or coarse its triangles: they are cut into pieces, and
 * the pieces of a cell of space that face the same side are one element. */
#include <math.h>
#include <stdlib.h>

#include "ground/sole/sole_inside.h"

#define MESH_PIECES_MAX (1 << 21)
#define MESH_CUT 0.25   /* [-] longest edge of a piece, over the pitch */
#define MESH_INSET 1e-3 /* [-] of a cell: a face on the border between two cells is in the inner */
#define MESH_LEAST 1e-100 /* [m^2] a triangle of less area has no normal: squares round to 0 */
#define MESH_OPEN 1e-6    /* [-] the area vectors of a closed mesh sum to less than this share */

typedef struct {
    double corner[3][3]; /* [m] */
    double normal[3];    /* [-] */
    double area;         /* [m^2] */
} Triangle;

void samples_add(Samples *samples, const Sample *sample) {
    if (samples->status == MILD_OK && samples->count == samples->most) {
        samples->status = MILD_ERROR_RANGE;
    }
    if (samples->status != MILD_OK) {
        return;
    }
    if (samples->count == samples->room) {
        const int room = samples->room ? 2 * samples->room : 256;
        Sample *list = realloc(samples->list, (size_t)room * sizeof *list);
        if (!list) {
            samples->status = MILD_ERROR_MEMORY;
            return;
        }
        samples->list = list;
        samples->room = room;
    }
    samples->list[samples->count++] = *sample;
}

static double length_of(const double *a) {
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

static double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double *a, const double *b, double *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static Triangle triangle_of(const MildShape *mesh, int t) {
    Triangle out;
    double side[2][3];
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < 3; k++) {
            out.corner[c][k] = mesh->vertices[3 * mesh->triangles[3 * t + c] + k];
        }
    }
    for (int k = 0; k < 3; k++) {
        side[0][k] = out.corner[1][k] - out.corner[0][k];
        side[1][k] = out.corner[2][k] - out.corner[0][k];
    }
    cross(side[0], side[1], out.normal);
    const double twice = length_of(out.normal);
    out.area = 0.5 * twice;
    for (int k = 0; k < 3; k++) {
        out.normal[k] /= twice > 0.0 ? twice : 1.0;
    }
    return out;
}

int mesh_closed(const MildShape *mesh, double *volume) {
    double sum[3] = {0.0}, area = 0.0;
    *volume = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const Triangle triangle = triangle_of(mesh, t);
        area += triangle.area;
        *volume += triangle.area / 3.0 * dot(triangle.normal, triangle.corner[0]);
        for (int k = 0; k < 3; k++) {
            sum[k] += triangle.area * triangle.normal[k];
        }
    }
    return length_of(sum) <= MESH_OPEN * area;
}

/* Counts crossings of a ray whose direction is no likely plane's. */
int mesh_contains(const MildShape *mesh, const double point[3]) {
    static const double ray[3] = {0.5377, 0.2163, 0.8149};
    int inside = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *vertex = &mesh->triangles[3 * t];
        const double *corner = &mesh->vertices[3 * vertex[0]];
        double e1[3], e2[3], from[3], p[3], q[3];
        for (int k = 0; k < 3; k++) {
            e1[k] = mesh->vertices[3 * vertex[1] + k] - corner[k];
            e2[k] = mesh->vertices[3 * vertex[2] + k] - corner[k];
            from[k] = point[k] - corner[k];
        }
        cross(ray, e2, p);
        cross(from, e1, q);
        const double scale = dot(e1, p);
        const double u = dot(from, p) / scale, v = dot(ray, q) / scale;
        inside ^= scale != 0.0 && u >= 0.0 && v >= 0.0 && u + v < 1.0 && dot(e2, q) / scale > 0.0;
    }
    return inside;
}

/* The cells of a mesh: their number along each axis is whole. */
typedef struct {
    double low[3];  /* [m] */
    double edge[3]; /* [m] */
} Cells;

static Cells cells_of(const MildShape *mesh, double pitch) {
    Cells cells;
    for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (int v = 0; v < mesh->vertex_count; v++) {
            low = fmin(low, mesh->vertices[3 * v + k]);
            high = fmax(high, mesh->vertices[3 * v + k]);
        }
        cells.low[k] = low;
        cells.edge[k] = fmax(high - low, pitch) / fmax(round((high - low) / pitch), 1.0);
    }
    return cells;
}

/* Cell of a piece, and which of six ways it faces. */
static int64_t cells_key(const Cells *cells, const Sample *piece) {
    int64_t key = 0;
    int way = 0;
    for (int k = 0; k < 3; k++) {
        const double inset = MESH_INSET * piece->normal[k];
        key = key << 17 |
              (int64_t)(floor((piece->at[k] - cells->low[k]) / cells->edge[k] - inset) + 1.0);
        way = fabs(piece->normal[k]) > fabs(piece->normal[way]) ? k : way;
    }
    return key << 3 | (int64_t)(2 * way + (piece->normal[way] > 0.0));
}

/* The piece of a triangle at these shares of the way from its first corner to the others. */
static void triangle_piece(const Triangle *triangle, const Cells *cells, double area, double a,
                           double b, Samples *pieces) {
    Sample piece = {.area = area};
    for (int k = 0; k < 3; k++) {
        const double *c[3] = {triangle->corner[0], triangle->corner[1], triangle->corner[2]};
        piece.at[k] = c[0][k] + a * (c[1][k] - c[0][k]) + b * (c[2][k] - c[0][k]);
        piece.normal[k] = triangle->normal[k];
    }
    piece.key = cells_key(cells, &piece);
    samples_add(pieces, &piece);
}

/* Cuts a triangle into n^2 alike. */
static void triangle_cut(const Triangle *triangle, const Cells *cells, double pitch,
                         Samples *pieces) {
    double longest = 0.0;
    for (int c = 0; c < 3; c++) {
        double side[3];
        for (int k = 0; k < 3; k++) {
            side[k] = triangle->corner[(c + 1) % 3][k] - triangle->corner[c][k];
        }
        longest = fmax(longest, length_of(side));
    }
    const int n = (int)ceil(fmax(longest / (MESH_CUT * pitch), 1.0));
    const double area = triangle->area / n / n;
    for (int i = 0; i < n && pieces->status == MILD_OK; i++) {
        for (int j = 0; i + j < n; j++) {
            triangle_piece(triangle, cells, area, (i + 1.0 / 3) / n, (j + 1.0 / 3) / n, pieces);
            if (i + j < n - 1) {
                triangle_piece(triangle, cells, area, (i + 2.0 / 3) / n, (j + 2.0 / 3) / n, pieces);
            }
        }
    }
}

/* By cell, then by place in the mesh, so that sums do not depend on the sorting algorithm. */
static int piece_compare(const void *left, const void *right) {
    const Sample *a = left, *b = right;
    if (a->key != b->key) {
        return a->key < b->key ? -1 : 1;
    }
    for (int k = 0; k < 3; k++) {
        if (a->at[k] != b->at[k]) {
            return a->at[k] < b->at[k] ? -1 : 1;
        }
    }
    return 0;
}

/* One element in place of `count` pieces: their mean place and normal, weighted by area. */
static void pieces_join(const Sample *piece, int count, Samples *samples) {
    Sample sum = {.area = 0.0};
    for (int i = 0; i < count; i++) {
        sum.area += piece[i].area;
        for (int k = 0; k < 3; k++) {
            sum.at[k] += piece[i].area * piece[i].at[k];
            sum.normal[k] += piece[i].area * piece[i].normal[k];
        }
    }
    const double length = length_of(sum.normal);
    for (int k = 0; k < 3; k++) {
        sum.at[k] /= sum.area;
        sum.normal[k] /= length;
    }
    samples_add(samples, &sum);
}

void mesh_sample(const MildShape *mesh, double pitch, Samples *samples) {
    const Cells cells = cells_of(mesh, pitch);
    Samples pieces = {.most = MESH_PIECES_MAX};
    for (int t = 0; t < mesh->triangle_count && pieces.status == MILD_OK; t++) {
        const Triangle triangle = triangle_of(mesh, t);
        if (triangle.area > MESH_LEAST) {
            triangle_cut(&triangle, &cells, pitch, &pieces);
        }
    }
    samples->status = pieces.status;
    if (pieces.count > 0 && pieces.status == MILD_OK) {
        qsort(pieces.list, (size_t)pieces.count, sizeof *pieces.list, piece_compare);
        for (int i = 0, end; i < pieces.count && samples->status == MILD_OK; i = end) {
            for (end = i + 1; end < pieces.count && pieces.list[end].key == pieces.list[i].key;) {
                end++;
            }
            pieces_join(pieces.list + i, end - i, samples);
        }
    }
    free(pieces.list);
}
