/* Pinned numbers: tests/pins.txt holds what this tree computed when it was last right, and this
 * reads it. A hash holds on one platform, to the last bit; a plain number holds on every platform,
 * within a tolerance. */
#ifndef TEST_PINS_H
#define TEST_PINS_H

#include <stddef.h>
#include <stdint.h>

/* What else than compiler and processor the last bit depends on. */
enum { PIN_ON_MUJOCO = 1, PIN_ON_ONEDNN = 2 };

/* FNV-1a (Fowler, Noll and Vo) of `size` bytes, continued from `hash`. */
#define PIN_HASH_START 0xcbf29ce484222325u
uint64_t pin_hash(uint64_t hash, const void *data, size_t size);

/* Compares with the row of this platform. Nothing fails when the platform has no row; pin_finish
 * says so. */
void pin_exact(const char *name, unsigned depends_on, uint64_t hash);
/* Compares with the row that holds everywhere: |value - pinned| <= tolerance |pinned|. */
void pin_near(const char *name, double value, double tolerance);

/* The platform's names and how many numbers are pinned here, on standard output; the number of
 * pins that differ. With PIN_ROWS=FILE in the environment nothing is compared: all rows are written
 * to FILE, for scripts/pin.sh. */
int pin_finish(void);

#endif
