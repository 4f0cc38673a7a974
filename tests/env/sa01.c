/* The batch engine on the CPU, compiled for SA01's size alone, as a GPU's is. */
#define ENGINE_JOINTS 12
#define ENGINE_FEET 2
#define ENGINE_CORNERS 8
#define ENGINE_ENTRIES 135
#define ENGINE_CHAIN 12

/* NOLINTNEXTLINE(bugprone-suspicious-include) */
#include "env/batch_host.c"
