/* Checkpoints from memory; ppo_save and ppo_load of ppo.h are the ones for users. */
#ifndef MILD_PPO_FILE_H
#define MILD_PPO_FILE_H

#include "learn/ppo.h"
#include "learn/safetensors.h"

/* ppo_load from an open file; `path` names it in messages. */
MildStatus ppo_load_file(Ppo *ppo, const Safetensors *file, const char *path, void *extra,
                         size_t extra_size, MildError *error);

#endif
