/* Edges of a picture that was drawn with one sample per pixel. */
#include "kit.h"
#include "view/smooth.h"

#define WIDTH 96
#define HEIGHT 64
#define SAMPLES 16 /* of a side of a pixel, in the reference */

static unsigned char from[HEIGHT][WIDTH][3], to[HEIGHT][WIDTH][3], luma[(HEIGHT + 1) * WIDTH];

/* Bright above a line through the middle, dark below. */
static int above(double x, double y, double slope) {
    return y - 0.5 * HEIGHT > slope * (x - 0.5 * WIDTH);
}

static void draw(double slope) {
    for (int j = 0; j < HEIGHT; j++) {
        for (int i = 0; i < WIDTH; i++) {
            memset(from[j][i], above(i + 0.5, j + 0.5, slope) ? 220 : 30, 3);
        }
    }
}

/* Share of the pixel above the line. */
static double covered(int i, int j, double slope) {
    int count = 0;
    for (int k = 0; k < SAMPLES * SAMPLES; k++) {
        count += above(i + (k % SAMPLES + 0.5) / SAMPLES, j + (k / SAMPLES + 0.5) / SAMPLES, slope);
    }
    return (double)count / (SAMPLES * SAMPLES);
}

/* [-] of 255: root mean square from the true picture, over the pixels that the line cuts. */
static double error_of(unsigned char picture[HEIGHT][WIDTH][3], double slope) {
    double sum = 0;
    int cut = 0;
    for (int j = 2; j < HEIGHT - 2; j++) {
        for (int i = 2; i < WIDTH - 2; i++) {
            double share = covered(i, j, slope);
            if (share > 0 && share < 1) {
                sum += pow(picture[j][i][1] - (30 + 190 * share), 2);
                cut++;
            }
        }
    }
    return sqrt(sum / cut);
}

/* Steps are longest where an edge is close to a row or a column: there the error halves. The sixth
 * is mixed along its own direction, not along its mirror image, which would leave more. Elsewhere
 * it does not grow. */
TEST(slanted_edges_come_closer_to_the_truth) {
    const double slopes[] = {0.06, -0.12, 0.2, 8, -16, 0.9, -0.3, 0.45, -1.0, 3};
    for (int k = 0; k < 10; k++) {
        draw(slopes[k]);
        smooth_edges(&from[0][0][0], WIDTH, HEIGHT, luma, &to[0][0][0]);
        double before = error_of(from, slopes[k]), after = error_of(to, slopes[k]);
        print_message("slope %6.2f: off by %.0f before, %.0f after\n", slopes[k], before, after);
        assert_true(after < (k < 6 ? 0.6 : 1.01) * before);
    }
}

/* A level edge has no steps, and grain is no edge. */
TEST(the_rest_stays) {
    draw(0);
    smooth_edges(&from[0][0][0], WIDTH, HEIGHT, luma, &to[0][0][0]);
    assert_memory_equal(from, to, sizeof from);
    srand(5);
    for (int j = 0; j < HEIGHT; j++) {
        for (int i = 0; i < WIDTH; i++) {
            for (int c = 0; c < 3; c++) {
                from[j][i][c] = (unsigned char)(178 + rand() % 45);
            }
        }
    }
    smooth_edges(&from[0][0][0], WIDTH, HEIGHT, luma, &to[0][0][0]);
    assert_memory_equal(from, to, sizeof from);
}

/* A slanted line two pixels wide keeps its brightness: colours are mixed along it, not across. */
TEST(lines_stay) {
    for (int side = 0; side < 2; side++) {
        memset(from, 30, sizeof from);
        for (int j = 1; j < HEIGHT; j++) {
            for (int k = 0; k < 2; k++) {
                memset(from[j][side ? WIDTH - 20 - j + k : 20 + j + k], 220, 3);
            }
        }
        smooth_edges(&from[0][0][0], WIDTH, HEIGHT, luma, &to[0][0][0]);
        for (int j = 8; j < HEIGHT - 8; j++) {
            assert_true(to[j][side ? WIDTH - 20 - j : 20 + j][1] > 170);
        }
    }
}

TEST_MAIN(NULL, NULL)
