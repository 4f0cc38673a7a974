/* Matrix products, row major, by oneDNN. Every product runs on the calling thread alone. The
 * learner splits its work into fixed pieces itself, so no result depends on the number of
 * threads. */
#ifndef MILD_PRODUCT_H
#define MILD_PRODUCT_H

/* Limits oneDNN to one thread when called from this thread. Returns the previous setting, which
 * product_leave restores. bf16: bool, until then factors are rounded to bfloat16 where the
 * processor multiplies such numbers (AVX512_BF16, AMX). */
int product_enter(int bf16);
void product_leave(int entered);

/* oneDNN also throws when memory runs out, which no C function can catch. From now on `fatal` is
 * called then, on the thread that threw; it must not return. */
void product_on_exception(void (*fatal)(void));

/* c[m][n] = op(a) op(b) + beta c, beta 0 or 1; op transposes where the flag is 'T'. ld*: floats
 * between rows as stored. When oneDNN fails (out of memory), c is filled with NaN, and the learner
 * drops and counts the minibatch. */
void product(char transpose_a, char transpose_b, int m, int n, int k, const float *a, int lda,
             const float *b, int ldb, float beta, float *c, int ldc);

#endif
