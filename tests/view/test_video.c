/* The video file: whole under its name with the right number of frames, or one clear line and no
 * file. */
#include "kit.h"

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "view/video.h"
#include "view/view_parts.h"

#define WIDTH 96
#define HEIGHT 64
#define FRAMES 37

static char folder[64];

static int make_folder(void **state) {
    (void)state;
    strcpy(folder, "/tmp/mild_video_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state) {
    (void)state;
    return rmdir(folder); /* also: nothing was left behind */
}

static void paint(unsigned char *rgb, int frame) {
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        rgb[3 * i] = (unsigned char)(4 * frame);
        rgb[3 * i + 1] = (unsigned char)(i % WIDTH);
        rgb[3 * i + 2] = (unsigned char)(i / WIDTH);
    }
}

static int counted_frames(const char *path) {
    char command[256], line[64] = "";
    snprintf(command, sizeof command,
             "ffprobe -v error -count_frames -show_entries stream=nb_read_frames,width,height -of "
             "csv=p=0 %s",
             path);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    char *got = fgets(line, sizeof line, pipe);
    pclose(pipe);
    assert_non_null(got);
    int width, height, frames;
    assert_int_equal(sscanf(line, "%d,%d,%d", &width, &height, &frames), 3);
    assert_int_equal(width, WIDTH);
    assert_int_equal(height, HEIGHT);
    return frames;
}

static int files_in_folder(void) {
    int count = 0;
    DIR *dir = opendir(folder);
    assert_non_null(dir);
    for (struct dirent *entry; (entry = readdir(dir));) {
        count += entry->d_name[0] != '.';
    }
    closedir(dir);
    return count;
}

TEST_WITH(whole_file_under_its_name, make_folder, remove_folder) {
    MildError error = {0};
    static unsigned char rgb[WIDTH * HEIGHT * 3];
    char path[96];
    snprintf(path, sizeof path, "%s/walk.mp4", folder);
    Video *video = video_open(path, WIDTH, HEIGHT, 25, &error);
    expect_good(video != NULL, &error);
    for (int i = 0; i < FRAMES; i++) {
        paint(rgb, i);
        assert_int_equal(video_frame(video, rgb, &error), MILD_OK);
    }
    struct stat info;
    assert_int_not_equal(stat(path, &info), 0); /* not before it is whole */
    assert_int_equal(video_close(video, &error), MILD_OK);
    assert_int_equal(stat(path, &info), 0);
    assert_true(info.st_size > 500);
    assert_int_equal(files_in_folder(), 1); /* no temporary file is left */
    assert_int_equal(counted_frames(path), FRAMES);
    print_message("%d frames, %ld bytes\n", FRAMES, (long)info.st_size);
    unlink(path);
}

TEST_WITH(missing_ffmpeg_is_one_line, make_folder, remove_folder) {
    MildError error = {0};
    char path[96], *before = strdup(getenv("PATH"));
    snprintf(path, sizeof path, "%s/walk.mp4", folder);
    setenv("PATH", folder, 1);
    Video *video = video_open(path, WIDTH, HEIGHT, 25, &error);
    setenv("PATH", before, 1);
    free(before);
    assert_null(video);
    print_message("%s\n", error.text);
    assert_error(&error, MILD_ERROR_IO, path);
    assert_int_equal(files_in_folder(), 0);
}

/* ffmpeg starts and then fails: the walk must survive it (no SIGPIPE) and say why. */
TEST_WITH(failing_ffmpeg_is_one_line, make_folder, remove_folder) {
    MildError error = {0};
    static unsigned char rgb[WIDTH * HEIGHT * 3];
    char path[96], program[96], *before = strdup(getenv("PATH"));
    snprintf(path, sizeof path, "%s/walk.mp4", folder);
    snprintf(program, sizeof program, "%s/ffmpeg", folder);
    FILE *script = fopen(program, "w");
    assert_non_null(script);
    fputs("#!/bin/sh\necho 'a codec is missing' >&2\nexit 1\n", script);
    fclose(script);
    assert_int_equal(chmod(program, 0755), 0);
    setenv("PATH", folder, 1);
    Video *video = video_open(path, WIDTH, HEIGHT, 25, &error);
    setenv("PATH", before, 1);
    free(before);
    assert_non_null(video);
    MildStatus status = MILD_OK;
    for (int i = 0; i < 500 && status == MILD_OK; i++) {
        status = video_frame(video, rgb, &error);
    }
    assert_int_equal(video_close(video, &error), MILD_ERROR_IO);
    print_message("%s\n", error.text);
    assert_error(&error, MILD_ERROR_IO, "walk.mp4 ffmpeg codec");
    unlink(program);
    assert_int_equal(files_in_folder(), 0); /* no temporary file is left */
    snprintf(path, sizeof path, "%s/nowhere/walk.mp4", folder);
    assert_null(video_open(path, WIDTH, HEIGHT, 25, &error));
    assert_error(&error, MILD_ERROR_IO, path);
}

TEST(odd_size_is_refused) {
    MildError error = {0};
    assert_null(video_open("x.mp4", 95, 64, 25, &error));
    assert_int_equal(error.status, MILD_ERROR_ARGUMENT);
    assert_null(video_open("x.mp4", 96, 64, 0, &error));
}

/* ---- edges of a picture that was drawn with one sample per pixel ---- */

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

/* ---- the camera's filter: by time and not by frames, and not behind what moves evenly ---- */

#define LAG 0.4
#define SPEED 0.6

/* Where the camera looks along x after `seconds` behind a target that starts to move at once. */
static double followed(double seconds, double rate) {
    Follow follow;
    double target[3] = {1, 2, 3}, look[3];
    follow_jump(&follow, target);
    int frames = (int)lround(seconds * rate);
    for (int k = 1; k <= frames; k++) {
        target[0] = 1 + SPEED * k / rate;
        follow_step(&follow, target, 1 / rate, LAG);
    }
    follow_position(&follow, look);
    assert_true(look[1] == 2 && look[2] == 3);
    return look[0] - 1;
}

/* The response of (1 + 2 T s)/(1 + T s)^2 to the ramp v t: v t (1 - exp(-t/T)), by hand. Five
 * frames a second give what hundred give, up to the path within a frame of the filter's own output.
 */
TEST(same_at_any_frame_rate) {
    double worst = 0, seconds[] = {0.4, 1, 2, 5};
    for (int k = 0; k < 4; k++) {
        double t = seconds[k], wanted = SPEED * t * (1 - exp(-t / LAG));
        worst = fmax(worst, fabs(followed(t, 100) - wanted));
        worst = fmax(worst, 0.1 * fabs(followed(t, 5) - wanted));
    }
    print_message("camera off by %.2f mm\n", 1e3 * worst);
    assert_true(worst < 1e-3);
}

TEST(no_time_no_motion) {
    Follow follow;
    double look[3];
    follow_jump(&follow, (const double[3]){1, 1, 1});
    follow_step(&follow, (const double[3]){9, 9, 9}, 0, LAG);
    follow_position(&follow, look);
    assert_true(look[0] == 1 && look[1] == 1 && look[2] == 1);
}

TEST_MAIN(NULL, NULL)
