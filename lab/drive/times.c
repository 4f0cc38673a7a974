#include "drive/runner.h"

#include <math.h>

double times_edge(int bin) {
    return 1e-6 * pow(10, (double)bin / TIMES_DECADE);
}

void times_add(Times *times, double seconds) {
    const double place = seconds > 1e-6 ? floor(TIMES_DECADE * log10(seconds / 1e-6)) : 0;
    times->bin[place < TIMES_BINS - 1 ? (int)place : TIMES_BINS - 1]++;
    times->longest = fmax(times->longest, seconds);
    times->count++;
}

double times_quantile(const Times *times, double share) {
    long seen = 0;
    for (int i = 0; i < TIMES_BINS; i++) {
        seen += times->bin[i];
        if (seen > 0 && (double)seen >= share * (double)times->count) {
            return i < TIMES_BINS - 1 ? fmin(times_edge(i + 1), times->longest) : times->longest;
        }
    }
    return times->longest;
}
