/* Any bytes as a request: what is answered is a file of the folder, or an error. */
#include <string.h>

#include "app/serve.h"
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char *request = malloc(size + 1);
    fuzz_check(request != NULL);
    memcpy(request, data, size); /* not const, as received */
    const ServeAnswer answer = serve_read(request, size);
    fuzz_check(answer.status == 200 || answer.status == 400 || answer.status == 404 ||
               answer.status == 405);
    if (answer.status == 200) {
        const size_t length = strnlen(answer.name, SERVE_NAME);
        fuzz_check(answer.type != NULL && length > 0 && length < SERVE_NAME);
        fuzz_check(answer.name[0] != '.' && !strpbrk(answer.name, "/\\%:~ \r\n"));
        fuzz_check(strstr(answer.name, "..") == NULL);
    }
    free(request);
    return 0;
}
