/* The batch engine on the CPU, compiled for the Go1's size alone, as a GPU's is, in the place
 * of the one for any robot; and what is in its environments. */
#define ENGINE_JOINTS 12
#define ENGINE_FEET 4
#define ENGINE_CORNERS 4
#define ENGINE_ENTRIES 117
#define ENGINE_CHAIN 9

/* NOLINTBEGIN(bugprone-suspicious-include) */
#include "env/batch_host.c"
#include "episode.c"
/* NOLINTEND(bugprone-suspicious-include) */
