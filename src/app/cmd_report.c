/* mild report: one page about training runs, which Python draws (docs/report.md). */
#include "app/commands.h"
#include "app/package.h"

int cmd_report(int argc, char **argv) {
    (void)argc;
    return package_script("python/mild/report.py", argv);
}
