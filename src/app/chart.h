/* Charts as SVG: curves over the iterations of a training. */
#ifndef MILD_CHART_H
#define MILD_CHART_H

#include <stdio.h>

typedef struct {
    int points;
    const double *x, *y;      /* [points]; where y is NaN there is no point */
    const double *low, *high; /* [points] the band around it; NULL: none */
    int color;                /* index, any from 0 */
} ChartCurve;

typedef struct {
    const char *title;  /* with the unit */
    int logarithmic;    /* bool: y; values that are not above 0 are left out */
    double first, last; /* of x */
    const ChartCurve *curve;
    int curves;
} Chart;

/* The colour of a curve, as CSS has it. */
const char *chart_color(int color);

/* Writes one <svg> element. */
void chart_write(const Chart *chart, FILE *html);

/* Writes a text with what HTML needs to show it as it is. */
void chart_write_text(const char *text, FILE *html);

#endif
