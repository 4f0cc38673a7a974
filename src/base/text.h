/* Small text tools of the program: the nearest valid name, numbers from text, lists. */
#ifndef BASE_TEXT_H
#define BASE_TEXT_H

#include <stddef.h>
#include <stdint.h>

/* The nearest of names[0..count) to a name that somebody wrote, the first of several; NULL when
 * count is 0. A character more, less or another, or two neighbours exchanged, is an edit. Words,
 * which _ divides, may be missing: at the end of a known name, or of what `name` begins, for half
 * an edit; at both ends of `name` for half an edit a character. Only the first 63 characters of a
 * name count. */
const char *text_nearest(const char *name, const char *const *names, int count);

/* The index of the first that is `name` itself, or -1. */
int text_find(const char *name, const char *const *names, int count);

/* The index of the nearest of names that lie `stride` bytes apart; -1: there is none. */
int text_nearest_of(const char *name, const void *names, size_t stride, int count);

/* Takes the next line off *rest, as configurations have it: without its end (LF, CR LF or CR), its
 * comment, which begins with ; or # at its start or after a blank, and blanks at its end. Returns
 * its length from *line. */
size_t text_line(const char **rest, const char **line);

/* Reads all of `text` as a finite number or an integer. Returns 0 when it is not one. */
int text_double(const char *text, double *value);
int text_int(const char *text, int *value);
int text_uint64(const char *text, uint64_t *value);

/* Replaces by '?', in place, what a terminal may obey (control characters, also those above ASCII)
 * and what is no UTF-8; the characters of `keep` stay. Returns how many bytes at the end, left as
 * they are, begin a character that is not complete: 0 .. 3. */
size_t text_plain(char *text, size_t size, const char *keep);

/* Bytes as "1.23 GiB" and a duration as "1 h 02 min", "4 min 05 s" or "12 s"; return `text`. */
const char *text_bytes(double bytes, char *text, size_t size);
const char *text_duration(double seconds, char *text, size_t size);

enum { TEXT_CELL = 24 };
/* A number in the format of its column, such as "%.2f"; "-" for NaN, because nothing was measured.
 * Returns `text`. */
const char *text_cell(const char *format, double value, char text[TEXT_CELL]);

#endif
