/* Runs every file of the folders it is given through the fuzz target it is linked with. */
#include <dirent.h>
#include <stdio.h>
#include <sys/stat.h>

#include "fuzz.h"

enum { PATH_LENGTH = 4096 };

static int replay_file(const char *path) {
    struct stat about;
    FILE *file = fopen(path, "rb");
    if (!file || fstat(fileno(file), &about) != 0 || !S_ISREG(about.st_mode)) {
        if (file) {
            fclose(file);
        }
        return 0;
    }
    size_t size = (size_t)about.st_size;
    uint8_t *data = malloc(size + 1);
    fuzz_check(data && fread(data, 1, size, file) == size);
    fclose(file);
    LLVMFuzzerTestOneInput(data, size);
    free(data);
    return 1;
}

int main(int argc, char **argv) {
    int files = 0;
    for (int i = 1; i < argc; i++) {
        DIR *folder = opendir(argv[i]);
        for (struct dirent *entry = folder ? readdir(folder) : NULL; entry;
             entry = readdir(folder)) {
            char path[PATH_LENGTH];
            snprintf(path, sizeof path, "%s/%s", argv[i], entry->d_name);
            files += replay_file(path);
        }
        if (folder) {
            closedir(folder);
        }
    }
    printf("%d inputs\n", files);
    return files == 0;
}
