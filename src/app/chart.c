#include "app/chart.h"

#include <math.h>
#include <string.h>

/* [pixels] of the picture and of its axes */
enum { WIDTH = 360, HEIGHT = 200, LEFT = 52, RIGHT = 350, TOP = 26, BOTTOM = 178 };

typedef struct {
    double low, high; /* of the values, their logarithms to base 10 if `logarithmic` */
    int logarithmic;
    double from, to; /* [pixels] of low and high */
} Axis;

/* Distinct for colour-blind eyes (Okabe and Ito 2008); the yellow is darker here. */
const char *chart_color(int color) {
    static const char *const colors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                         "#e69f00", "#56b4e9", "#000000", "#b8a800"};
    return colors[color % (int)(sizeof colors / sizeof *colors)];
}

void chart_write_text(const char *text, FILE *html) {
    for (; *text; text++) {
        switch (*text) {
        case '&': fputs("&amp;", html); break;
        case '<': fputs("&lt;", html); break;
        case '>': fputs("&gt;", html); break;
        case '"': fputs("&quot;", html); break;
        default: fputc(*text, html); break;
        }
    }
}

static double scaled(const Axis *axis, double value) {
    return axis->logarithmic ? (value > 0 ? log10(value) : NAN) : value;
}

static double place(const Axis *axis, double value) {
    return axis->from +
           (scaled(axis, value) - axis->low) / (axis->high - axis->low) * (axis->to - axis->from);
}

static void include(Axis *axis, double value) {
    value = scaled(axis, value);
    if (isfinite(value)) {
        axis->low = fmin(axis->low, value);
        axis->high = fmax(axis->high, value);
    }
}

/* Of all curves and bands, with a margin. */
static Axis axis_of(const Chart *chart, int logarithmic) {
    Axis axis = {INFINITY, -INFINITY, logarithmic, BOTTOM, TOP};
    for (int c = 0; c < chart->curves; c++) {
        const ChartCurve *curve = &chart->curve[c];
        for (int i = 0; i < curve->points; i++) {
            include(&axis, curve->y[i]);
            if (curve->low) {
                include(&axis, curve->low[i]);
                include(&axis, curve->high[i]);
            }
        }
    }
    if (axis.low > axis.high) {
        axis.low = axis.high = 0;
    }
    double margin = 0.04 * (axis.high - axis.low);
    if (margin <= 1e-9 * fabs(axis.high)) {
        margin = axis.high != 0 ? 0.1 * fabs(axis.high) : 1;
    }
    axis.low -= margin;
    axis.high += margin;
    return axis;
}

/* The vertical axis: logarithmic where that is asked for and shows more than one decade. */
static Axis vertical_axis(const Chart *chart) {
    const Axis axis = axis_of(chart, chart->logarithmic);
    return axis.logarithmic && axis.high - axis.low < 1 ? axis_of(chart, 0) : axis;
}

/* 1, 2 or 5 times a power of ten, so that about four steps fill the span. */
static double tick_step(double span) {
    const double step = span / 4, power = pow(10, floor(log10(step)));
    const double rest = step / power;
    return power * (rest < 1.5 ? 1 : rest < 3.5 ? 2 : rest < 7.5 ? 5 : 10);
}

static void write_number(double value, FILE *html) {
    if (fabs(value) >= 1e6) {
        fprintf(html, "%.4gM", 1e-6 * value);
    } else if (fabs(value) >= 1e4) {
        fprintf(html, "%.4gk", 1e-3 * value);
    } else {
        fprintf(html, "%.4g", value);
    }
}

static void write_level(const Axis *y, double value, FILE *html) {
    const double at = place(y, value);
    if (scaled(y, value) < y->low || scaled(y, value) > y->high) {
        return;
    }
    fprintf(html, "<path class=grid d=\"M%d %.1fH%d\"/><text x=%d y=%.1f text-anchor=end>", LEFT,
            at, RIGHT, LEFT - 5, at + 4);
    write_number(value, html);
    fputs("</text>", html);
}

/* Powers of ten; between them 2 and 5 times these where there is room. */
static void write_decades(const Axis *y, FILE *html) {
    const double span = y->high - y->low, step = ceil(span / 6);
    for (double k = floor(y->low / step); k * step <= y->high; k++) {
        const double power = pow(10, k * step);
        write_level(y, power, html);
        if (span < 3) {
            write_level(y, 2 * power, html);
            write_level(y, 5 * power, html);
        }
    }
}

static void write_vertical(const Axis *y, FILE *html) {
    if (y->logarithmic) {
        write_decades(y, html);
        return;
    }
    const double step = tick_step(y->high - y->low);
    for (double k = ceil(y->low / step); k * step <= y->high; k++) {
        write_level(y, k == 0 ? 0 : k * step, html);
    }
}

static void write_horizontal(const Axis *x, FILE *html) {
    const double step = tick_step(x->high - x->low);
    for (double k = ceil(x->low / step); k * step <= x->high; k++) {
        fprintf(html, "<text x=%.1f y=%d text-anchor=middle>", place(x, k * step), BOTTOM + 15);
        write_number(k * step, html);
        fputs("</text>", html);
    }
}

static void write_point(const Axis *x, const Axis *y, double px, double py, const char *before,
                        FILE *html) {
    fprintf(html, "%s%.1f %.1f", before, place(x, px), place(y, py));
}

static int shown(const Axis *y, double value) {
    return isfinite(scaled(y, value));
}

/* Forward along the upper edge, back along the lower one. */
static void write_band(const ChartCurve *curve, const Axis *x, const Axis *y, FILE *html) {
    const char *before = "M";
    fprintf(html, "<path fill=\"%s\" fill-opacity=.18 d=\"", chart_color(curve->color));
    for (int i = 0; i < curve->points; i++) {
        if (shown(y, curve->low[i]) && shown(y, curve->high[i])) {
            write_point(x, y, curve->x[i], curve->high[i], before, html);
            before = "L";
        }
    }
    for (int i = curve->points - 1; i >= 0; i--) {
        if (shown(y, curve->low[i]) && shown(y, curve->high[i])) {
            write_point(x, y, curve->x[i], curve->low[i], before, html);
        }
    }
    fputs("\"/>\n", html);
}

static void write_line(const ChartCurve *curve, const Axis *x, const Axis *y, FILE *html) {
    const char *before = "M";
    fprintf(html, "<path fill=none stroke=\"%s\" stroke-width=1.5 stroke-linecap=round d=\"",
            chart_color(curve->color));
    for (int i = 0; i < curve->points; i++) {
        if (shown(y, curve->y[i])) {
            write_point(x, y, curve->x[i], curve->y[i], before, html);
            before = "L";
        }
    }
    fputs(strcmp(before, "M") == 0 ? "\"/>\n" : "h0\"/>\n", html); /* h0 shows a single point */
}

void chart_write(const Chart *chart, FILE *html) {
    const Axis y = vertical_axis(chart);
    const double last = chart->last > chart->first ? chart->last : chart->first + 1;
    const Axis x = {chart->first, last, 0, LEFT, RIGHT};
    fprintf(html, "<svg viewBox=\"0 0 %d %d\"><text class=title x=%d y=16>", WIDTH, HEIGHT, LEFT);
    chart_write_text(chart->title, html);
    fputs("</text>", html);
    write_vertical(&y, html);
    write_horizontal(&x, html);
    fputs("\n", html);
    for (int c = 0; c < chart->curves; c++) {
        if (chart->curve[c].low) {
            write_band(&chart->curve[c], &x, &y, html);
        }
        write_line(&chart->curve[c], &x, &y, html);
    }
    fputs("</svg>\n", html);
}
