#include "view/view_parts.h"

#include <math.h>
#include <string.h>

#define INSET_MARGIN 10
#define INSET_BAR 10
#define INSET_LABELS 40 /* [pixels] room for the numbers beside the bar */
#define INSET_LEAST 64  /* [pixels] height of the bar, for its two numbers */
#define INSET_TITLE 24
#define INSET_TITLE_CELLS 25 /* width of "sole pressure, kPa" in a picture that has room for it */

static const unsigned char background[3] = {30, 33, 38}, idle[3] = {70, 74, 80},
                           mark[3] = {255, 255, 255};

/* Perceptually even ramp from violet to yellow, in nine stops taken from the viridis family (CC0).
 */
static void ramp(double t, unsigned char rgb[3]) {
    static const unsigned char stops[9][3] = {{68, 1, 84},    {71, 44, 122},  {59, 81, 139},
                                              {44, 113, 142}, {33, 144, 141}, {39, 173, 129},
                                              {92, 200, 99},  {170, 220, 50}, {253, 231, 37}};
    double s = fmin(fmax(t, 0.0), 1.0) * 8.0;
    int i = s >= 8.0 ? 7 : (int)s;
    for (int c = 0; c < 3; c++) {
        rgb[c] = (unsigned char)(stops[i][c] + (s - i) * (stops[i + 1][c] - stops[i][c]));
    }
}

typedef struct {
    double x_min, x_max, y_min, y_max;
} Extent;

static Extent sole_extent(const MildSole *sole) {
    const double *x = mild_sole_x(sole), *y = mild_sole_y(sole);
    Extent e = {x[0], x[0], y[0], y[0]};
    for (int i = 1; i < mild_sole_elements(sole); i++) {
        e.x_min = fmin(e.x_min, x[i]), e.x_max = fmax(e.x_max, x[i]);
        e.y_min = fmin(e.y_min, y[i]), e.y_max = fmax(e.y_max, y[i]);
    }
    return e;
}

static int cells_along(double length, double pitch) {
    return (int)lround(length / pitch) + 1;
}

InsetLayout inset_layout(const MildSole *const *soles, int feet, int cell) {
    InsetLayout layout = {.width = INSET_MARGIN, .cell = cell};
    int rows = 0;
    for (int f = 0; f < feet; f++) {
        Extent e = sole_extent(soles[f]);
        double pitch = mild_sole_pitch(soles[f]);
        layout.width += cells_along(e.y_max - e.y_min, pitch) * cell + INSET_MARGIN;
        int n = cells_along(e.x_max - e.x_min, pitch);
        rows = n > rows ? n : rows;
    }
    int tall = rows * cell > INSET_LEAST ? rows * cell : INSET_LEAST;
    layout.height = tall + 2 * INSET_MARGIN + INSET_TITLE;
    layout.bar_left = layout.width;
    layout.bar_bottom = INSET_MARGIN;
    layout.bar_top = INSET_MARGIN + tall;
    layout.bar_right = layout.bar_left + INSET_BAR;
    layout.width = layout.bar_right + INSET_LABELS;
    layout.width =
        layout.width > INSET_TITLE_CELLS * cell ? layout.width : INSET_TITLE_CELLS * cell;
    layout.title_bottom = layout.bar_top + INSET_MARGIN / 2;
    layout.title_height = INSET_TITLE;
    return layout;
}

static void fill(const InsetLayout *layout, int left, int bottom, int width, int height,
                 const unsigned char color[3], unsigned char *rgb) {
    for (int y = bottom < 0 ? 0 : bottom; y < bottom + height && y < layout->height; y++) {
        for (int x = left < 0 ? 0 : left; x < left + width && x < layout->width; x++) {
            memcpy(rgb + 3 * ((size_t)y * (size_t)layout->width + (size_t)x), color, 3);
        }
    }
}

/* Draws one foot with its left edge at `left`; returns the width used. Foot x points up, foot y to
 * the left, as one sees one's own feet. */
static int draw_sole(const InsetLayout *layout, const MildSole *sole, const double *normal,
                     double pressure_max, int left, unsigned char *rgb) {
    Extent e = sole_extent(sole);
    double pitch = mild_sole_pitch(sole), area = pitch * pitch, sum = 0, sum_x = 0, sum_y = 0;
    const double *x = mild_sole_x(sole), *y = mild_sole_y(sole);
    int cell = layout->cell;
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        unsigned char color[3];
        if (normal[i] > 0) {
            ramp(normal[i] / area / pressure_max, color);
        } else {
            memcpy(color, idle, 3);
        }
        sum += normal[i], sum_x += normal[i] * x[i], sum_y += normal[i] * y[i];
        fill(layout, left + (int)lround((e.y_max - y[i]) / pitch * cell),
             INSET_MARGIN + (int)lround((x[i] - e.x_min) / pitch * cell), cell - 1, cell - 1, color,
             rgb);
    }
    if (sum > 1.0) {
        int cx = left + (int)lround(((e.y_max - sum_y / sum) / pitch + 0.5) * cell);
        int cy = INSET_MARGIN + (int)lround(((sum_x / sum - e.x_min) / pitch + 0.5) * cell);
        fill(layout, cx - 4, cy - 1, 9, 3, mark, rgb);
        fill(layout, cx - 1, cy - 4, 3, 9, mark, rgb);
    }
    return cells_along(e.y_max - e.y_min, pitch) * cell;
}

void inset_draw(const InsetLayout *layout, const MildSole *const *soles, int feet,
                const double *const *normal, double pressure_max, unsigned char *rgb) {
    fill(layout, 0, 0, layout->width, layout->height, background, rgb);
    int left = INSET_MARGIN;
    for (int f = 0; f < feet; f++) {
        left += draw_sole(layout, soles[f], normal[f], pressure_max, left, rgb) + INSET_MARGIN;
    }
    int span = layout->bar_top - layout->bar_bottom;
    for (int i = 0; i < span; i++) {
        unsigned char color[3];
        ramp((double)i / (span - 1), color);
        fill(layout, layout->bar_left, layout->bar_bottom + i, INSET_BAR, 1, color, rgb);
    }
}
