/* The run log: CSV that survives a kill, TensorBoard records whose frames check. */
#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/paths.h"
#include "train/events.h"
#include "train/log.h"

static char folder[64];

static int make_folder(void **state) {
    (void)state;
    strcpy(folder, "/tmp/mild_log_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state) {
    (void)state;
    char path[PATH_SIZE];
    DIR *dir = opendir(folder);
    for (struct dirent *entry; dir && (entry = readdir(dir));) {
        if (entry->d_name[0] != '.' && path_join(folder, entry->d_name, path, NULL) == MILD_OK) {
            remove(path);
        }
    }
    if (dir) {
        closedir(dir);
    }
    return rmdir(folder);
}

static size_t read_file(const char *path, char *data, size_t size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t length = fread(data, 1, size - 1, file);
    fclose(file);
    data[length] = '\0';
    return length;
}

static void test_crc32c(void **state) {
    (void)state;
    static const unsigned char zeros[32] = {0};
    assert_int_equal(events_crc32c("123456789", 9),
                     0xe3069283u); /* the check value of the CRC catalogue */
    assert_int_equal(events_crc32c(zeros, 32), 0x8a9136aau); /* RFC 3720, appendix B.4 */
}

static void test_csv_resume(void **state) {
    (void)state;
    static const char *const columns[] = {"reward/gait", "rate"};
    char path[PATH_SIZE], text[1024];
    MildError error = {0};
    path_join(folder, "log.csv", path, NULL);
    Log *log = log_open(folder, columns, 2, -1, &error);
    assert_non_null(log);
    for (int i = 1; i <= 4; i++) {
        assert_int_equal(log_row(log, i, (double[]){0.5 * i, 1e9}, &error), MILD_OK);
    }
    log_close(log);
    FILE *torn = fopen(path, "a"); /* killed in the middle of a row */
    fputs("5,2.5", torn);
    fclose(torn);
    log = log_open(folder, columns, 2, 2, &error);
    assert_non_null(log);
    assert_int_equal(log_row(log, 3, (double[]){-1, 2}, &error), MILD_OK);
    log_close(log);
    read_file(path, text, sizeof text);
    assert_string_equal(text, "iteration,reward/gait,rate\n1,0.5,1e+09\n2,1,1e+09\n3,-1,2\n");
    static const char *const other[] = {"reward/gait", "speed"};
    assert_null(log_open(folder, other, 2, 2, &error));
    assert_non_null(strstr(error.text, "columns"));
}

static uint32_t little_endian(const unsigned char *bytes) {
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
           (uint32_t)bytes[3] << 24;
}

static uint32_t masked(uint32_t crc) {
    return ((crc >> 15) | (crc << 17)) + 0xa282ead8u;
}

static void test_records(void **state) {
    (void)state;
    enum { TAGS = 300 };
    static char names[TAGS][32], data[200000];
    static const char *tags[TAGS];
    static double values[TAGS];
    for (int i = 0; i < TAGS; i++) {
        snprintf(names[i], sizeof names[i], "group/%d", i);
        tags[i] = names[i];
        values[i] = i;
    }
    char path[PATH_SIZE];
    path_join(folder, "events", path, NULL);
    FILE *file = fopen(path, "wb");
    assert_int_equal(events_write_version(file, 1e9), 0);
    assert_int_equal(events_write_start(file, 1e9, 77), 0);
    assert_int_equal(events_write_scalars(file, 1e9, 1LL << 40, tags, values, TAGS), 0);
    fclose(file);
    size_t length = read_file(path, data, sizeof data), at = 0;
    int records = 0, scalars = 0;
    for (; at < length; records++) {
        const unsigned char *record = (const unsigned char *)data + at;
        uint32_t size = little_endian(record);
        assert_int_equal(little_endian(record + 8), masked(events_crc32c(record, 8)));
        assert_int_equal(little_endian(record + 12 + size),
                         masked(events_crc32c(record + 12, size)));
        for (uint32_t i = 12; i + 6 < 12 + size; i++) {
            scalars += memcmp(record + i, "group/", 6) == 0;
        }
        at += 16 + size;
    }
    assert_int_equal(at, length);
    assert_int_equal(scalars, TAGS);
    assert_true(records >= 3);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_crc32c),
        cmocka_unit_test_setup_teardown(test_csv_resume, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_records, make_folder, remove_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
