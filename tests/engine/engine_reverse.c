#include "base/hd.h"

#undef EACH_LANE
#define EACH_LANE(l) for (int l = LANES - 1; l >= 0; l--)
#define ENGINE_TEXT engine_text_reverse
#include "engine_text.inc"
