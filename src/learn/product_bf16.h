/* The product of product.h with factors rounded to bfloat16 and sums in float, by oneDNN, on
 * processors that multiply such numbers (AVX512_BF16, AMX). */
#ifndef MILD_PRODUCT_BF16_H
#define MILD_PRODUCT_BF16_H

/* Bool: this processor does. */
int product_has_bf16(void);

/* As product; beta is 0 or 1. Returns 0, or 1 when memory runs out or oneDNN fails, with c as it
 * was or partly written. */
int product_bf16(char transpose_a, char transpose_b, int m, int n, int k, const float *a, int lda,
                 const float *b, int ldb, float beta, float *c, int ldc);

#endif
