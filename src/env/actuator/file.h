/* An actuator network from an open file. */
#ifndef ACTUATOR_FILE_H
#define ACTUATOR_FILE_H

#include "env/actuator/actuator.h"
#include "learn/safetensors.h"

/* path: for messages. NULL, with the reason in *error, when the file does not fit the robot. */
Actuator *actuator_file_read(const Safetensors *file, const char *path, const Robot *robot,
                             MildError *error);

#endif
