/* A video file: raw frames through a pipe into ffmpeg (H.264, yuv420p, mp4). Written under a
 * temporary name and renamed when complete, so a video that has its name is whole. */
#ifndef VIEW_VIDEO_H
#define VIEW_VIDEO_H

#include "mild/error.h"

typedef struct Video Video;

/* width and height even [pixels], fps [1/s]. The encoder is `ffmpeg` in PATH. */
Video *video_open(const char *path, int width, int height, double fps, MildError *error);
/* rgb: [height][width][3], top row first. */
MildStatus video_frame(Video *video, const unsigned char *rgb, MildError *error);
/* Waits for ffmpeg and renames. On any earlier failure the temporary file is removed and the
 * failure is repeated here. Frees the video in every case. */
MildStatus video_close(Video *video, MildError *error);

#endif
