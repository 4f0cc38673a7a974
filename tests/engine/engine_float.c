#define MILD_REAL_FLOAT
#define ENGINE_TEXT engine_text_float
#include "engine_text.inc"

size_t engine_work_bytes(void) {
    return sizeof(EngineWork);
}
