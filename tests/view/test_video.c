/* The video file: whole under its name with the right number of frames, or one clear line and no
 * file. */
#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "kit.h"
#include "view/video.h"

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

TEST_MAIN(NULL, NULL)
