/* Included in every file of a wheel: what glibc 2.35 has a newer version of is taken in the older
 * one, so that the wheel runs with 2.34 (Enterprise Linux 9). */
__asm__(".symver hypot, hypot@GLIBC_2.2.5");
