/* Paths: joined, beside each other and the program, data, folders that are made. */
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/paths.h"
#include "kit.h"

static char folder[64];

static int make_folder(void **state) {
    (void)state;
    strcpy(folder, "/tmp/mild_paths_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state) {
    (void)state;
    return rmdir(folder); /* every test removes what it made */
}

static const char *in_folder(const char *name) {
    static char path[2][PATH_SIZE];
    static int turn;
    turn = !turn;
    assert_int_equal(path_join(folder, name, path[turn], NULL), MILD_OK);
    return path[turn];
}

TEST(test_join) {
    char path[PATH_SIZE], name[PATH_SIZE];
    MildError error = {0};
    assert_int_equal(path_join("a", "b.csv", path, &error), MILD_OK);
    assert_string_equal(path, "a/b.csv");
    memset(name, 'n', sizeof name);
    name[PATH_SIZE - 3] = '\0'; /* "a/" and it and the end just fit */
    assert_int_equal(path_join("a", name, path, &error), MILD_OK);
    assert_int_equal(strlen(path), PATH_SIZE - 1);
    name[PATH_SIZE - 3] = 'n';
    name[PATH_SIZE - 2] = '\0';
    assert_int_equal(path_join("a", name, path, &error), MILD_ERROR_ARGUMENT);
    assert_error(&error, MILD_ERROR_ARGUMENT, "a");
}

TEST(test_beside) {
    char path[PATH_SIZE];
    assert_int_equal(path_beside("runs/a.png", "_fit.csv", path, NULL), MILD_OK);
    assert_string_equal(path, "runs/a_fit.csv");
    assert_int_equal(path_beside("runs.d/a", ".csv", path, NULL), MILD_OK);
    assert_string_equal(path, "runs.d/a.csv");
}

TEST(test_beside_the_program) {
    char path[PATH_SIZE], name[PATH_SIZE], own[PATH_SIZE];
    const ssize_t length = readlink("/proc/self/exe", own, sizeof own - 1);
    assert_true(length > 0);
    own[length] = '\0';
    assert_string_equal(path_program(path), own);
    assert_string_equal(path_beside_program(strrchr(own, '/') + 1, path), own);
    memset(name, 'n', sizeof name);
    name[PATH_SIZE - 1] = '\0';
    assert_string_equal(path_beside_program(name, path), "");
}

/* $MILD_HOME decides; without it what lies beside the executable's folder, else the source tree. */
TEST(test_data) {
    char path[PATH_SIZE];
    setenv("MILD_HOME", "/somewhere", 1);
    assert_string_equal(path_data("models/x.xml", path), "/somewhere/models/x.xml");
    setenv("MILD_HOME", "", 1);
    assert_string_equal(path_data("configs/default.ini", path),
                        MILD_SOURCE_DIR "/configs/default.ini");
    unsetenv("MILD_HOME");
    assert_string_equal(path_data("no/such.file", path), MILD_SOURCE_DIR "/no/such.file");
    assert_int_equal(chdir("/"), 0); /* a shipped file, from any folder; what is there goes first */
    assert_string_equal(path_given("configs/quick.ini", path),
                        MILD_SOURCE_DIR "/configs/quick.ini");
    assert_string_equal(path_given("no/such.file", path), "no/such.file");
    assert_string_equal(path_given("/configs/quick.ini", path), "/configs/quick.ini");
    assert_string_equal(path_given("", path), "");
    assert_int_equal(chdir(MILD_SOURCE_DIR), 0);
    assert_string_equal(path_given("configs/quick.ini", path), "configs/quick.ini");
    char itself[PATH_SIZE] = "";
    assert_true(readlink("/proc/self/exe", itself, PATH_SIZE - 1) > 0);
    char *name = strrchr(itself, '/');
    *name = '\0';
    char *parent = strrchr(itself, '/');
    *name = '/';
    const char *relative = parent + 1; /* tests/base_test_paths: only beside the executable */
    assert_string_equal(path_data(relative, path), itself);

    char installed[PATH_SIZE]; /* as bin/mild finds share/mild/... */
    *parent = '\0';
    assert_true(snprintf(installed, sizeof installed, "%.900s/share/mild/paths", itself) > 0);
    assert_int_equal(path_make_folder(installed, NULL), MILD_OK);
    assert_string_equal(path_data("paths", path), installed);
    for (int level = 0; level < 3; level++) { /* paths, mild, share */
        assert_int_equal(rmdir(installed), 0);
        *strrchr(installed, '/') = '\0';
    }
}

TEST(test_make_folder) {
    MildError error = {0};
    const char *deep = in_folder("a/b/c");
    struct stat info;
    assert_int_equal(path_make_folder(deep, &error), MILD_OK);
    assert_true(stat(deep, &info) == 0 && S_ISDIR(info.st_mode));
    assert_int_equal(path_make_folder(deep, &error), MILD_OK); /* it is there */
    assert_int_equal(path_make_folder("", &error), MILD_ERROR_ARGUMENT);
    char name[PATH_SIZE + 1];
    memset(name, 'n', sizeof name);
    name[PATH_SIZE] = '\0';
    assert_int_equal(path_make_folder(name, &error), MILD_ERROR_ARGUMENT);
    strcpy(name + 200, "..."); /* it is cut there */
    assert_error(&error, MILD_ERROR_ARGUMENT, name);
    const char *file = in_folder("a/file");
    assert_int_equal(file_write(file, "x", 1, &error), MILD_OK);
    assert_int_equal(path_make_folder(file, &error), MILD_ERROR_IO);
    assert_error(&error, MILD_ERROR_IO, file);
    assert_int_equal(path_make_folder(in_folder("a/file/below"), &error), MILD_ERROR_IO);
    assert_error(&error, MILD_ERROR_IO, in_folder("a/file/below"));
    remove(in_folder("a/file"));
    rmdir(in_folder("a/b/c"));
    rmdir(in_folder("a/b"));
    rmdir(in_folder("a"));
}

TEST_MAIN(make_folder, remove_folder)
