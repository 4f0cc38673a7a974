/* Inverse of a small matrix, for normal equations. */
#ifndef LAB_INVERSE_H
#define LAB_INVERSE_H

enum { INVERSE_MAX = 20 };

/* Inverse of the positive definite `a` (rows and columns 0 .. n - 1), which is destroyed. Returns
 * 0 when it is singular. */
int inverse_find(double a[INVERSE_MAX][INVERSE_MAX], int n,
                 double inverse[INVERSE_MAX][INVERSE_MAX]);

#endif
