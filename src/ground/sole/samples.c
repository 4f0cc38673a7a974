#include "ground/sole/samples.h"

#include <stdlib.h>

void samples_add(Samples *samples, const Sample *sample) {
    if (samples->count == samples->most || samples->failed) {
        samples->full |= samples->count == samples->most;
        return;
    }
    if (samples->count == samples->room) {
        const int room = samples->room ? 2 * samples->room : 256;
        Sample *list = realloc(samples->list, (size_t)room * sizeof *list);
        if (!list) {
            samples->failed = 1;
            return;
        }
        samples->list = list;
        samples->room = room;
    }
    samples->list[samples->count++] = *sample;
}
