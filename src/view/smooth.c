#include "view/view_parts.h"

#include <math.h>
#include <string.h>

#define EDGE_LEAST 20   /* [-] of 255: smaller differences of brightness are no edge */
#define EDGE_SHARE 4    /* [-] nor is a difference below the brightness divided by this: grain */
#define REACH_MAX 8.0F  /* [pixels] farthest sample along an edge */
#define GENTLE 0.03125F /* [-] share of the brightness added to a gradient before dividing by it */

/* What is around a pixel. */
typedef struct {
    int least, most; /* brightness */
    float x, y;      /* [pixels] direction of the edge */
} Edge;

static int brightness(const unsigned char *rgb) {
    return (5 * rgb[0] + 9 * rgb[1] + 2 * rgb[2]) >> 4;
}

static int least(int a, int b) {
    return a < b ? a : b;
}

static int most(int a, int b) {
    return a > b ? a : b;
}

static float limited(float value, float lowest, float highest) {
    return value < lowest ? lowest : value > highest ? highest : value;
}

/* Marks the pixels of a row whose brightness differs enough from that of a neighbour. */
static void find_edges(const unsigned char *restrict luma, int width,
                       unsigned char *restrict edge) {
    const unsigned char *up = luma - width, *down = luma + width;
    for (int i = 1; i < width - 1; i++) {
        int dark = least(least(luma[i], least(up[i], down[i])), least(luma[i - 1], luma[i + 1]));
        int light = most(most(luma[i], most(up[i], down[i])), most(luma[i - 1], luma[i + 1]));
        edge[i] = light - dark >= EDGE_LEAST && EDGE_SHARE * (light - dark) >= light;
    }
}

/* The direction is normal to the gradient over the four corners and long where the edge is close to
 * a row or a column, as a step of it then is. */
static Edge edge_of(const unsigned char *luma, int width) {
    const unsigned char *up = luma - width, *down = luma + width;
    float x = (float)(down[-1] + down[1] - up[-1] - up[1]);
    float y = (float)(up[-1] + down[-1] - up[1] - down[1]);
    float sum = (float)(up[-1] + up[1] + down[-1] + down[1]);
    float smaller = fabsf(x) < fabsf(y) ? fabsf(x) : fabsf(y);
    float scale = 1.0F / (smaller + GENTLE * sum + 0.5F);
    return (Edge){
        .least = least(least(luma[0], least(up[0], down[0])), least(luma[-1], luma[1])),
        .most = most(most(luma[0], most(up[0], down[0])), most(luma[-1], luma[1])),
        .x = limited(x * scale, -REACH_MAX, REACH_MAX),
        .y = limited(y * scale, -REACH_MAX, REACH_MAX),
    };
}

/* Adds weight times the colour at (x, y) [pixels], linear between pixels. */
static void sample(const unsigned char *rgb, int width, int height, float x, float y, float weight,
                   float sum[3]) {
    x = limited(x, 0.0F, (float)(width - 2));
    y = limited(y, 0.0F, (float)(height - 2));
    int i = (int)x, j = (int)y;
    float u = x - (float)i, v = y - (float)j;
    const unsigned char *low = rgb + 3 * ((size_t)j * (size_t)width + (size_t)i);
    const unsigned char *high = low + 3 * (size_t)width;
    for (int c = 0; c < 3; c++) {
        float bottom = (1 - u) * (float)low[c] + u * (float)low[c + 3];
        float top = (1 - u) * (float)high[c] + u * (float)high[c + 3];
        sum[c] += weight * ((1 - v) * bottom + v * top);
    }
}

static void store(const float sum[3], unsigned char *rgb) {
    for (int c = 0; c < 3; c++) {
        rgb[c] = (unsigned char)(sum[c] + 0.5F);
    }
}

/* The mean of four samples along the edge, or of the inner two where the outer two have left it. */
static void smooth_pixel(const unsigned char *from, int width, int height, int i, int j,
                         const Edge *edge, unsigned char *to) {
    static const float inner = 1.0F / 6, outer = 0.5F;
    float two[3] = {0}, four[3];
    unsigned char mean[3];
    for (int side = -1; side <= 1; side += 2) {
        float at = inner * (float)side;
        sample(from, width, height, (float)i + at * edge->x, (float)j + at * edge->y, 0.5F, two);
    }
    for (int c = 0; c < 3; c++) {
        four[c] = 0.5F * two[c];
    }
    for (int side = -1; side <= 1; side += 2) {
        float at = outer * (float)side;
        sample(from, width, height, (float)i + at * edge->x, (float)j + at * edge->y, 0.25F, four);
    }
    store(four, mean);
    int seen = brightness(mean);
    store(seen < edge->least || seen > edge->most ? two : four, to);
}

/* After Lottes 2009, "FXAA". */
void smooth_edges(const unsigned char *from, int width, int height, unsigned char *luma,
                  unsigned char *to) {
    const size_t pixels = (size_t)width * (size_t)height;
    unsigned char *edge = luma + pixels;
    memcpy(to, from, 3 * pixels);
    for (size_t p = 0; p < pixels; p++) {
        luma[p] = (unsigned char)brightness(from + 3 * p);
    }
    for (int j = 1; j < height - 1; j++) {
        const size_t row = (size_t)j * (size_t)width;
        find_edges(luma + row, width, edge);
        for (int i = 1; i < width - 1; i++) {
            if (edge[i]) {
                const Edge found = edge_of(luma + row + i, width);
                smooth_pixel(from, width, height, i, j, &found, to + 3 * (row + (size_t)i));
            }
        }
    }
}

void smooth_flip(const unsigned char *rgb, int width, int height, unsigned char *flipped) {
    const size_t row = (size_t)width * 3, rows = (size_t)height;
    for (size_t r = 0; r < rows; r++) {
        memcpy(flipped + r * row, rgb + (rows - 1 - r) * row, row);
    }
}
