/* The videos of a run folder on a page. */
#ifndef MILD_RUN_VIDEO_H
#define MILD_RUN_VIDEO_H

#include <stdio.h>

#include "app/run_files.h"

/* Writes a <video> for each video of the run: up to 4 MiB as part of the page, which will be at
 * `page` ("-": standard output), otherwise as a link relative to it. */
MildStatus run_video_write(const RunFiles *run, const char *page, FILE *html, MildError *error);

#endif
