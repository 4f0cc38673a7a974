/* mild web: serves the walk in a browser that `make web` built (docs/web.md), by Python. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/package.h"
#include "base/paths.h"

/* Python's own server, which ends in one line when it cannot listen. */
static const char code[] =
    "import runpy, sys\n"
    "try:\n"
    "    runpy.run_module('http.server', run_name='__main__', alter_sys=True)\n"
    "except OSError as error:\n"
    "    print('mild web: --address and --port:', error, file=sys.stderr)\n"
    "    sys.exit(2)\n";

/* Replaces this process; returns where that cannot be. -I: the working directory is no place of
 * modules. -u: the address is printed at once, into a pipe too. */
static int become_server(const char *folder, const char *address, int port) {
    char python[PATH_SIZE], number[8];
    package_python(python);
    snprintf(number, sizeof number, "%d", port);
    execlp(python, python, "-I", "-u", "-c", code, "--directory", folder, "--bind", address, number,
           (char *)NULL);
    return cli_fail_text("web",
                         "%.200s: %s; the page is served by Python: install python3, or name one "
                         "by MILD_PYTHON",
                         python, strerror(errno));
}

int cmd_web(int argc, char **argv) {
    char built[PATH_SIZE], index[PATH_SIZE];
    const char *folder = path_data("build/web", built), *address = "127.0.0.1";
    int port = 8080;
    const CliOption options[] = {
        {"port", CLI_INT, &port, 0, 65535, "N", "port; 0 takes a free one (default 8080)"},
        {"address", CLI_TEXT, &address, 0, 0, "A",
         "address to listen at; 0.0.0.0 lets a phone of your network in (default 127.0.0.1, this "
         "machine alone)"},
        {"folder", CLI_TEXT, &folder, 0, 0, "DIR", "folder of the page (default build/web)"},
    };
    const CliCommand command = {
        .name = "web",
        .usage = "[--port N] [--address A] [--folder DIR]",
        .summary = "Serves the walk in a browser, which `make web` builds, by `python3 -m "
                   "http.server`. Open the address that it prints; Ctrl-C ends it.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .examples = "  mild web\n  mild web --port 0\n",
    };
    CliArgs args;
    const int parsed = cli_parse(&command, argc, argv, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    MildError error = {0};
    if (path_join(folder, "index.html", index, &error) != MILD_OK) {
        return cli_fail("web", &error);
    }
    if (access(index, R_OK) != 0) {
        return cli_fail_text("web",
                             "no file %.200s to read: this installation has no page; `make web` in "
                             "the source tree builds it (it installs emscripten), then `mild web "
                             "--folder build/web`",
                             index);
    }
    return become_server(folder, address, port);
}
