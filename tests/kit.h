/* What all tests share: cmocka with what it needs, cases that list themselves, comparisons that
 * fail with a name and both numbers, and errors by their status and by what they name. */
#ifndef KIT_H
#define KIT_H

#include <ctype.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "mild/error.h"

/* A case: TEST(name) { ... }. A program runs its cases in the order of its text. */
#define TEST(name) TEST_WITH(name, NULL, NULL)

/* A case with what is called before and after it. */
#define TEST_WITH(name, before, after)                                                             \
    static void name(void);                                                                        \
    static void name##_case(void **state) {                                                        \
        (void)state;                                                                               \
        name();                                                                                    \
    }                                                                                              \
    __attribute__((constructor)) static void name##_add(void) {                                    \
        kit_add(#name, name##_case, before, after);                                                \
    }                                                                                              \
    static void name(void)

/* Declares a function that the linker puts before another (-Wl,--wrap in tests/CMakeLists.txt),
 * and that other one, as it is declared: __wrap_NAME and __real_NAME. */
#define WRAPS(name) __typeof__(name) __real_##name, __wrap_##name

/* The main function of a program of cases, with what is called before the first and after the last,
 * or NULL. Arguments of the program are names of cases: it runs these alone. */
#define TEST_MAIN(before, after)                                                                   \
    int main(int argc, char **argv) {                                                              \
        return kit_choose(argc - 1, argv + 1) ? run_cases(before, after) : 2;                      \
    }

enum { KIT_CASES = 64 };
static struct CMUnitTest kit_cases[KIT_CASES];
static size_t kit_case_count;

static inline void kit_add(const char *name, CMUnitTestFunction run, CMFixtureFunction before,
                           CMFixtureFunction after) {
    if (kit_case_count == KIT_CASES) {
        abort();
    }
    const struct CMUnitTest added = {name, run, before, after, NULL};
    kit_cases[kit_case_count++] = added;
}

/* Keeps the cases with these names, in the order of the text; all where there are none. Bool: there
 * is a case of each name. */
static inline int kit_choose(int count, char **names) {
    int chosen[KIT_CASES] = {0};
    for (int n = 0; n < count; n++) {
        size_t i = 0;
        while (i < kit_case_count && strcmp(kit_cases[i].name, names[n]) != 0) {
            i++;
        }
        if (i == kit_case_count) {
            fprintf(stderr, "%s: not a case of this program\n", names[n]);
            return 0;
        }
        chosen[i] = 1;
    }
    size_t kept = 0;
    for (size_t i = 0; i < kit_case_count; i++) {
        if (count == 0 || chosen[i]) {
            kit_cases[kept++] = kit_cases[i];
        }
    }
    kit_case_count = kept;
    return 1;
}

/* Runs the cases; the exit status. */
static inline int run_cases(CMFixtureFunction before, CMFixtureFunction after) {
    return _cmocka_run_group_tests("tests", kit_cases, kit_case_count, before, after);
}

/* Fails unless got is within tolerance of wanted; NaN fails. */
static inline void expect_near(const char *what, double got, double wanted, double tolerance) {
    if (!(fabs(got - wanted) <= tolerance)) {
        fail_msg("%s: %.12g instead of %.12g (tolerance %.1g)", what, got, wanted, tolerance);
    }
}

/* The same for entry i of an array. */
static inline void expect_entry(const char *what, int i, double got, double wanted,
                                double tolerance) {
    if (!(fabs(got - wanted) <= tolerance)) {
        fail_msg("%s[%d]: %.12g instead of %.12g (tolerance %.1g)", what, i, got, wanted,
                 tolerance);
    }
}

/* Fails with the error's text unless something is good. */
static inline void expect_good(int good, const MildError *error) {
    if (!good) {
        fail_msg("%s", error->text);
    }
}

/* Whether c is part of a word. */
static inline int kit_letter(char c) {
    return isalnum((unsigned char)c) || c == '_';
}

/* Whether a word goes on where this text begins: with a letter, or with . or - and a letter. */
static inline int kit_goes_on(const char *text) {
    return kit_letter(*text) || ((*text == '.' || *text == '-') && kit_letter(text[1]));
}

/* Whether each word of `names` (a field, a key, a flag, a file, a value) stands in the text as a
 * whole: robot.mass does not in "robot.mass_kg", nor does mass, nor 1 in "-1" or "1.5". */
static inline int kit_named(const char *text, const char *names) {
    for (names += strspn(names, " "); *names; names += strspn(names, " ")) {
        const size_t size = strcspn(names, " ");
        const char *at = text;
        while (*at && (strncmp(at, names, size) != 0 || kit_goes_on(at + size) ||
                       (at > text && (kit_letter(at[-1]) || at[-1] == '.' || at[-1] == '-')))) {
            at++;
        }
        if (!*at) {
            return 0;
        }
        names += size;
    }
    return 1;
}

/* What is wrong with an error that must have this status and name what the caller did wrong; NULL:
 * nothing. Its sentence is free. */
static inline const char *kit_error_fault(const MildError *error, MildStatus status,
                                          const char *names) {
    const size_t size = strlen(error->text);
    if (status == MILD_OK || error->status != status) {
        return "another status";
    }
    if (size == 0 || strcspn(error->text, "\r\n") != size) {
        return "not one line";
    }
    if (!names[strspn(names, " ")] || !kit_named(error->text, names)) {
        return "not all is named";
    }
    return NULL;
}

/* Fails unless the error has the status, is one line and names every word of `names`; then forgets
 * it, so that the next is not taken for this one. */
#define assert_error(error, status, names)                                                         \
    kit_assert_error((error), (status), (names), __FILE__, __LINE__)

static inline void kit_assert_error(MildError *error, MildStatus status, const char *names,
                                    const char *file, int line) {
    const char *fault = kit_error_fault(error, status, names);
    if (fault) {
        print_error("%s: status %d, '%s' instead of status %d, '%s'\n", fault, (int)error->status,
                    error->text, (int)status, names);
        _fail(file, line);
    }
    memset(error, 0, sizeof *error);
}

/* Fails unless a call came back with the status and such an error. */
#define assert_refused(got, status, error, names)                                                  \
    kit_assert_refused((got), (status), (error), (names), __FILE__, __LINE__)

static inline void kit_assert_refused(MildStatus got, MildStatus status, MildError *error,
                                      const char *names, const char *file, int line) {
    if (got != status) {
        print_error("status %d instead of %d: '%s'\n", (int)got, (int)status, error->text);
        _fail(file, line);
    }
    kit_assert_error(error, status, names, file, line);
}

/* The same of a text that is no MildError. */
#define assert_names(text, names)                                                                  \
    do {                                                                                           \
        if (!kit_named((text), (names))) {                                                         \
            fail_msg("'%s' does not name '%s'", (text), (names));                                  \
        }                                                                                          \
    } while (0)

/* Whether walks are only begun: MILD_TEST_SHORT, which scripts/check.sh sets for builds with a
 * sanitizer, for what a walk measures is the same in every build. */
static inline int kit_short(void) {
    return getenv("MILD_TEST_SHORT") != NULL;
}

#endif
