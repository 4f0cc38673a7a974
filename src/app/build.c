#include "app/build.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "app/build_info.h"
#include "app/version.h"

const char *build_version(void) {
    return MILD_VERSION;
}

const char *build_compiler(void) {
    return MILD_BUILD_COMPILER;
}

const char *build_flags(void) {
    return MILD_BUILD_FLAGS;
}

const char *build_type(void) {
    return MILD_BUILD_TYPE;
}

static int cores_of_machine(void) {
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    return cores > 0 ? (int)cores : 1;
}

double build_memory_bytes(void) {
    long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    return pages > 0 && page > 0 ? (double)pages * (double)page : 0;
}

const char *build_machine(char *text, size_t size) {
    char line[256], name[160] = "unknown processor";
    FILE *file = fopen("/proc/cpuinfo", "r");
    while (file && fgets(line, sizeof line, file)) {
        const char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) == 0 && colon) {
            snprintf(name, sizeof name, "%.*s", (int)strcspn(colon + 2, "\n"), colon + 2);
            break;
        }
    }
    if (file) {
        fclose(file);
    }
    const int cores = cores_of_machine();
    snprintf(text, size, "%s, %d core%s", name, cores, cores == 1 ? "" : "s");
    return text;
}
