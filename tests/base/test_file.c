/* Files and texts of layer base: what is read and what is refused, written whole or not at all,
 * told apart, locked. Paths: joined, beside each other and the program, data, folders that are
 * made. */
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/file.h"
#include "base/paths.h"
#include "kit.h"

static char folder[] = "/tmp/mild_test_file_XXXXXX";

static int setup(void **state) {
    (void)state;
    return mkdtemp(folder) && chdir(folder) == 0 ? 0 : -1;
}

static int teardown(void **state) {
    (void)state;
    char command[80];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command);
}

static void assert_holds(const char *path, const char *text) {
    size_t size;
    MildError error = {0};
    char *bytes = file_read(path, 1000, &size, &error);
    expect_good(bytes != NULL, &error);
    assert_string_equal(bytes, text);
    assert_int_equal(size, strlen(text));
    free(bytes);
}

TEST(test_only_regular_files_are_read) {
    size_t size;
    assert_int_equal(mkfifo("pipe", 0600), 0);
    alarm(20); /* a reader that waits at the pipe ends the test */
    static const char *const refused[] = {"pipe", "/dev/zero", "/dev/null", "/", "missing", ""};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        MildError error = {0};
        assert_null(file_open(refused[i], &error));
        assert_error(&error, MILD_ERROR_IO, *refused[i] ? refused[i] : "read");
        assert_null(file_read(refused[i], 100, &size, &error));
        assert_error(&error, MILD_ERROR_IO, *refused[i] ? refused[i] : "read");
    }
    alarm(0);
    MildError error = {0};
    assert_int_equal(file_write("ten", "0123456789", 10, &error), MILD_OK);
    assert_holds("ten", "0123456789");
    assert_null(file_read("ten", 9, &size, &error));
    assert_int_equal(error.status, MILD_ERROR_FORMAT);
}

TEST(test_write) {
    static const char *const nowhere[] = {"no/file", "/dev/full", "."}; /* full, as a disk is */
    char name[PATH_SIZE];
    MildError error = {0};
    assert_int_equal(file_write("file", "first", 5, &error), MILD_OK);
    assert_holds("file", "first");
    assert_int_equal(file_write("file", "2nd", 3, &error), MILD_OK); /* shorter: nothing remains */
    assert_holds("file", "2nd");
    assert_int_equal(file_write("file", "", 0, &error), MILD_OK);
    assert_holds("file", "");
    assert_int_equal(file_write("/dev/null", "x", 1, &error), MILD_OK);
    for (size_t i = 0; i < sizeof nowhere / sizeof *nowhere; i++) {
        assert_refused(file_write(nowhere[i], "x", 1, &error), MILD_ERROR_IO, &error, nowhere[i]);
    }
    memset(name, 'n', sizeof name);
    name[PATH_SIZE - 1] = '\0';
    assert_int_equal(file_write(name, "x", 1, &error), MILD_ERROR_ARGUMENT);
    assert_int_equal(file_write("", "x", 1, &error), MILD_ERROR_ARGUMENT);
}

/* What can be written is found out without a trace. */
TEST(test_check_write) {
    MildError error = {0};
    assert_int_equal(file_check_write("to_be", &error), MILD_OK);
    assert_int_not_equal(access("to_be", F_OK), 0);
    assert_int_equal(file_write("kept", "kept", 4, &error), MILD_OK);
    assert_int_equal(file_check_write("kept", &error), MILD_OK);
    assert_holds("kept", "kept");
    assert_int_equal(file_check_write("/dev/null", &error), MILD_OK);
    assert_int_equal(file_check_write("", &error), MILD_ERROR_ARGUMENT);
    assert_int_equal(file_check_write("no/file", &error), MILD_ERROR_IO);
    assert_int_equal(file_check_write("/proc/self/maps", &error), MILD_ERROR_IO);
    assert_refused(file_check_write(folder, &error), MILD_ERROR_IO, &error, folder);
}

/* A pipe is written to and stays one. */
TEST(test_pipe) {
    MildError error = {0};
    char read_back[8] = "";
    struct stat info;
    assert_int_equal(mkfifo("written_pipe", 0600), 0);
    const int reader = open("written_pipe", O_RDONLY | O_NONBLOCK);
    assert_true(reader >= 0);
    assert_int_equal(file_check_write("written_pipe", &error), MILD_OK);
    assert_int_equal(file_write("written_pipe", "hello", 5, &error), MILD_OK);
    assert_int_equal(read(reader, read_back, sizeof read_back), 5);
    assert_string_equal(read_back, "hello");
    assert_true(stat("written_pipe", &info) == 0 && S_ISFIFO(info.st_mode));
    close(reader);
}

/* Temporary files never take a name that is in use. */
TEST(test_temporaries) {
    MildError error = {0};
    char first[PATH_SIZE], second[PATH_SIZE];
    assert_int_equal(file_write("out.tmp", "mine", 4, &error), MILD_OK);
    assert_int_equal(file_temporary("out", first, &error), MILD_OK);
    assert_int_equal(file_temporary("out", second, &error), MILD_OK);
    assert_string_not_equal(first, second);
    assert_true(file_is_temporary(first) && file_is_temporary(second));
    assert_false(file_is_temporary("out.tmp") || file_is_temporary("out") ||
                 file_is_temporary("a-b.tmp") || file_is_temporary("out.12-3.tmp.gz"));
    assert_false(file_is_temporary("policy.safetensors.2026-11.tmp") || file_is_temporary("") ||
                 file_is_temporary("out.1-2-0123456789abcdef.tmp"));
    char renamed[PATH_SIZE + 1];
    snprintf(renamed, sizeof renamed, "x%s", first);
    assert_false(file_is_temporary(renamed));
    assert_int_equal(file_write(first, "taken", 5, &error), MILD_OK);
    assert_int_equal(file_check_write("out", &error), MILD_OK);
    assert_int_equal(file_write("out", "text", 4, &error), MILD_OK);
    assert_holds("out", "text");
    assert_holds("out.tmp", "mine");
    assert_holds(first, "taken");
}

/* Whether both cannot be outputs of one command. */
static int same(const char *a, const char *b) {
    MildError error = {0};
    file_claims_drop();
    assert_int_equal(file_claim(a, "--a", &error), MILD_OK);
    const int refused = file_claim(b, "--b", &error) != MILD_OK;
    file_claims_drop();
    return refused;
}

TEST(test_same_file) {
    MildError error = {0};
    assert_int_equal(file_write("one", "1", 1, &error), MILD_OK);
    assert_int_equal(file_write("two", "1", 1, &error), MILD_OK);
    assert_int_equal(mkdir("sub", 0777), 0);
    assert_int_equal(symlink("../one", "sub/soft"), 0);
    assert_int_equal(link("one", "hard"), 0);
    assert_true(same("one", "one") && same("one", "./sub/../one"));
    assert_true(same("one", "sub/soft") && same("hard", "one"));
    assert_true(same("new", "./new") && same("sub/new", "sub/../sub/new"));
    assert_false(same("one", "two") || same("new", "sub/new") || same("new", "one"));
    assert_false(same("/dev/null", "/dev/null") || same("sub", "sub"));
}

/* What is claimed as an output cannot be read, by whatever name, nor be claimed twice. */
TEST(test_claims) {
    MildError error = {0};
    size_t size;
    assert_int_equal(file_write("claimed", "1", 1, &error), MILD_OK);
    assert_int_equal(file_write("free", "1", 1, &error), MILD_OK);
    assert_int_equal(symlink("claimed", "claimed_soft"), 0);
    assert_int_equal(link("claimed", "claimed_hard"), 0);
    assert_int_equal(file_claim("claimed", "--json", &error), MILD_OK);
    assert_int_equal(file_claim("to_come", "--csv", &error), MILD_OK);
    assert_int_equal(file_claim("./claimed_hard", "--onnx", &error), MILD_ERROR_ARGUMENT);
    assert_refused(file_claim("./to_come", "--onnx", &error), MILD_ERROR_ARGUMENT, &error,
                   "--csv --onnx ./to_come");
    static const char *const refused[] = {"claimed", "./claimed", "claimed_soft", "claimed_hard"};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        assert_null(file_read(refused[i], 10, &size, &error));
        assert_error(&error, MILD_ERROR_ARGUMENT, "--json");
        assert_null(file_open(refused[i], &error));
        assert_error(&error, MILD_ERROR_ARGUMENT, "--json");
    }
    assert_holds("free", "1");
    file_claims_drop();
    assert_holds("claimed_soft", "1");
}

/* Files that the program writes by itself are written in no other place. */
TEST(test_own) {
    MildError error = {0};
    assert_int_equal(file_write("own", "1", 1, &error), MILD_OK);
    assert_int_equal(symlink("own", "own_soft"), 0);
    assert_int_equal(symlink("nowhere", "own_dangling"), 0);
    assert_int_equal(mkfifo("own_pipe", 0600), 0);
    assert_int_equal(file_check_own("own", &error), MILD_OK);
    assert_int_equal(file_check_own("not_there", &error), MILD_OK);
    static const char *const refused[] = {"own_soft", "own_dangling", "own_pipe", "/dev/null", "/"};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        assert_int_equal(file_check_own(refused[i], &error), MILD_ERROR_IO);
    }
}

/* Whether another process gets the lock; it ends with the lock held, as if killed. */
static int other_gets_lock(void) {
    pid_t child = fork();
    if (child == 0) {
        FileLock lock;
        MildError error = {0};
        MildStatus status = file_lock(&lock, "lock", &error);
        _exit(status == MILD_OK ? 0 : kit_error_fault(&error, MILD_ERROR_ARGUMENT, "lock") ? 2 : 1);
    }
    int code;
    assert_int_equal(waitpid(child, &code, 0), child);
    assert_true(WIFEXITED(code) && WEXITSTATUS(code) < 2);
    return WEXITSTATUS(code) == 0;
}

TEST(test_lock) {
    FileLock lock;
    MildError error = {0};
    assert_true(other_gets_lock());
    assert_int_equal(access("lock", F_OK), 0); /* left behind, and no obstacle */
    assert_int_equal(file_lock(&lock, "lock", &error), MILD_OK);
    assert_false(other_gets_lock());
    file_unlock(&lock);
    assert_int_equal(access("lock", F_OK), -1);
    file_unlock(&lock);
    assert_true(other_gets_lock());
    assert_int_equal(file_lock(&lock, "no/folder/lock", &error), MILD_ERROR_IO);
}

/* Somebody else's file of that name stays. */
TEST(test_foreign_lock) {
    static const char *const texts[] = {"", "mine", "A lock of mild."};
    FileLock lock;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        MildError error = {0};
        assert_int_equal(file_write("foreign", texts[i], strlen(texts[i]), &error), MILD_OK);
        assert_refused(file_lock(&lock, "foreign", &error), MILD_ERROR_FORMAT, &error, "foreign");
        file_unlock(&lock);
        assert_holds("foreign", texts[i]);
    }
    MildError error = {0};
    assert_int_equal(symlink("elsewhere", "linked_lock"), 0);
    assert_int_equal(mkfifo("lock_pipe", 0600), 0);
    assert_int_not_equal(file_lock(&lock, "linked_lock", &error), MILD_OK);
    assert_int_equal(file_lock(&lock, "lock_pipe", &error), MILD_ERROR_FORMAT);
    assert_int_equal(access("elsewhere", F_OK), -1);
}

/* ---- paths ---- */

static char place[64];

static int make_place(void **state) {
    (void)state;
    strcpy(place, "/tmp/mild_paths_XXXXXX");
    return mkdtemp(place) ? 0 : -1;
}

static int remove_place(void **state) {
    (void)state;
    return rmdir(place); /* every test removes what it made */
}

static const char *in_folder(const char *name) {
    static char path[2][PATH_SIZE];
    static int turn;
    turn = !turn;
    assert_int_equal(path_join(place, name, path[turn], NULL), MILD_OK);
    return path[turn];
}

TEST_WITH(test_join, make_place, remove_place) {
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
    assert_refused(path_join("a", name, path, &error), MILD_ERROR_ARGUMENT, &error, "a");
}

TEST_WITH(test_beside, make_place, remove_place) {
    char path[PATH_SIZE];
    assert_int_equal(path_beside("runs/a.png", "_fit.csv", path, NULL), MILD_OK);
    assert_string_equal(path, "runs/a_fit.csv");
    assert_int_equal(path_beside("runs.d/a", ".csv", path, NULL), MILD_OK);
    assert_string_equal(path, "runs.d/a.csv");
}

TEST_WITH(test_beside_the_program, make_place, remove_place) {
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

/* $MILD_HOME decides; without it what lies beside the executable's place, else the source tree. */
TEST_WITH(test_data, make_place, remove_place) {
    char path[PATH_SIZE];
    setenv("MILD_HOME", "/somewhere", 1);
    assert_string_equal(path_data("models/x.xml", path), "/somewhere/models/x.xml");
    setenv("MILD_HOME", "", 1);
    assert_string_equal(path_data("configs/default.ini", path),
                        MILD_SOURCE_DIR "/configs/default.ini");
    unsetenv("MILD_HOME");
    assert_string_equal(path_data("no/such.file", path), MILD_SOURCE_DIR "/no/such.file");
    assert_int_equal(chdir("/"), 0); /* a shipped file, from any place; what is there goes first */
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
    const char *relative = parent + 1; /* tests/base_test_file: only beside the executable */
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

TEST_WITH(test_make_folder, make_place, remove_place) {
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
    assert_refused(path_make_folder(file, &error), MILD_ERROR_IO, &error, file);
    assert_refused(path_make_folder(in_folder("a/file/below"), &error), MILD_ERROR_IO, &error,
                   in_folder("a/file/below"));
    remove(in_folder("a/file"));
    rmdir(in_folder("a/b/c"));
    rmdir(in_folder("a/b"));
    rmdir(in_folder("a"));
}

TEST_MAIN(setup, teardown)
