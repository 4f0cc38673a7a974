/* What all tests share: cmocka with what it needs, and comparisons that fail with a name and both
 * numbers. */
#ifndef KIT_H
#define KIT_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

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

/* Whether walks are only begun: MILD_TEST_SHORT, which scripts/check.sh sets for builds with a
 * sanitizer, for what a walk measures is the same in every build. */
static inline int kit_short(void) {
    return getenv("MILD_TEST_SHORT") != NULL;
}

#endif
