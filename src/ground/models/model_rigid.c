#include "ground/law/model.h"

const ModelRow model_rigid = {
    .info = {.summary = "the engine's own contact, in train, eval and play; no parameters",
             .source = "MuJoCo"},
};
