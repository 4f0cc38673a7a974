/* What the program prints is plain text, whatever the names in a file hold. */
#ifndef MILD_PLAIN_H
#define MILD_PLAIN_H

/* From now on standard output and standard error replace control characters but line ends and tabs
 * by '?' (text_plain). A name in a file cannot move the cursor, change colours, or answer in the
 * user's name. */
void plain_streams(void);

#endif
