/* One page of HTML about one or several training runs: curves, reward terms, evaluations, videos,
 * and how the configs differ. It refers to no other file but to videos that are too big to be part
 * of it. */
#ifndef MILD_RUN_PAGE_H
#define MILD_RUN_PAGE_H

#include "app/run_files.h"

enum { RUN_PAGE_RUNS_MAX = 16 };
#define RUN_PAGE_TITLE "<title>mild report</title>" /* by which a page is known again */

/* Runs that differ in train.seed alone are one curve, their mean, with a band from the least to
 * the greatest. runs: [count]. defaults: the keys of configs/default.ini. path: where the page will
 * be ("-": standard output), for links. Returns the page from malloc, *size bytes; NULL on
 * failure, with the reason in *error. */
char *run_page_make(const RunFiles *runs, int count, const Settings *defaults, const char *path,
                    size_t *size, MildError *error);

#endif
