#include "ground/model.h"

const ModelRow model_rigid = {
    .info = {.summary = "the engine's own contact: train, eval, play; no parameters",
             .source = "MuJoCo"},
};
