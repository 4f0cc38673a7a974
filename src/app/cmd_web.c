/* mild web: serves the walk in a browser that `make web` built (docs/web.md). */
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/serve.h"
#include "base/paths.h"

/* As serve_folder opens them: no links. */
static int is_served(const char *path) {
    struct stat about;
    return lstat(path, &about) == 0 && S_ISREG(about.st_mode) && access(path, R_OK) == 0;
}

static MildStatus check_built(const char *folder, MildError *error) {
    static const char *const files[] = {"index.html", "mild.wasm", "sa01.bin"};
    char path[PATH_SIZE];
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        MildStatus status = path_join(folder, files[i], path, error);
        if (status != MILD_OK) {
            return status;
        }
        if (!is_served(path)) {
            return mild_fail(
                error, MILD_ERROR_IO,
                "no file %.200s to read: this installation has no page; `make web` in the "
                "source tree builds it (it installs emscripten), then `mild web --folder "
                "build/web`",
                path);
        }
    }
    return MILD_OK;
}

int cmd_web(int argc, char **argv) {
    char built[PATH_SIZE];
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
        .summary = "Serves the walk in a browser, which `make web` builds. Open the address that "
                   "it prints; Ctrl-C ends it.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .examples = "  mild web\n  mild web --port 0\n",
    };
    CliArgs args;
    const CliOutcome outcome = cli_parse(&command, argc, argv, &args);
    if (outcome != CLI_RUN) {
        return outcome == CLI_DONE ? 0 : CLI_EXIT_BAD_INPUT;
    }
    MildError error = {0};
    MildStatus status = check_built(folder, &error);
    const int listening = status == MILD_OK ? serve_listen(address, &port, &error) : -1;
    if (listening >= 0) {
        printf("mild web: http://%s:%d/ (Ctrl-C ends it)\n", address, port);
        fflush(stdout);
        serve_folder(listening, folder, &error);
    }
    return cli_fail("web", &error);
}
