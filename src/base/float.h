/* Numbers that a float holds, in double arithmetic. */
#ifndef MILD_FLOAT_H
#define MILD_FLOAT_H

/* x rounded to float. (double)(float)x does not always round: gcc 12 drops both conversions where
 * two, four or eight neighbouring ones fill a vector, at -O2 and -O3 and on every x86-64. A
 * volatile number is stored and read. tests/base/test_random.c fails without it. */
static inline double float_rounded(double x) {
    const volatile float rounded = (float)x;
    return (double)rounded;
}

#endif
