/* The working data of SA01 alone. */
#define MILD_REAL_FLOAT
#define ENGINE_JOINTS 12
#define ENGINE_FEET 2
#define ENGINE_CORNERS 8
#define ENGINE_ENTRIES 135
#define ENGINE_CHAIN 12
#define ENGINE_BODIES 3
#include "engine_text.h"

#include "robot/engine/step.h"

size_t engine_work_bytes_sa01(void) {
    return sizeof(EngineWork);
}
