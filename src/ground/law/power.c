#define POWER_FN /* for the files that define POWER_CALLED */
#include "ground/law/power.h"
