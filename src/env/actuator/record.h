/* Logs of joints as CSV: a header line, then a row per instant. Columns are time_s and, for each
 * joint that was logged, JOINT.error_rad (target minus angle), JOINT.speed_rad_s, JOINT.torque_nm.
 */
#ifndef ACTUATOR_RECORD_H
#define ACTUATOR_RECORD_H

#include <stdio.h>

#include "mild/error.h"
#include "robot/robot.h"

enum { RECORD_ROWS_MAX = 1000000, RECORD_FILES_MAX = 64 };

typedef struct {
    float error;  /* [rad] */
    float speed;  /* [rad/s] */
    float torque; /* [N m] */
} RecordJoint;

/* A file. */
typedef struct {
    int first, rows;              /* of Record.time */
    double interval;              /* [s] between rows: the median */
    int logged[ROBOT_JOINTS_MAX]; /* bool */
} RecordFile;

typedef struct {
    const Robot *robot; /* borrowed */
    int joints;
    int files;
    RecordFile file[RECORD_FILES_MAX];
    int rows;           /* of all files */
    double *time;       /* [s] [rows] */
    RecordJoint *joint; /* [rows][joints]; 0 where it was not logged */
} Record;

/* Appends a file. Columns are found by name, in any order; others are ignored. The message names
 * file, line, column and remedy. Destroy the record also after an error. */
MildStatus record_read(Record *record, const char *path, MildError *error);
void record_free(Record *record);

/* Writes the header, and a row: [joints] each. */
void record_print_header(const Robot *robot, FILE *csv);
void record_print_row(int joints, double time, const double *error, const double *speed,
                      const double *torque, FILE *csv);

#endif
