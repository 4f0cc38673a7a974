#define ENGINE_TEXT engine_text_double
#include "engine_text.inc"
