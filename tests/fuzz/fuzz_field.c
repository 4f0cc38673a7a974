/* Any text as the value of a field of every type: what is accepted is within its range and reads
 * back from what is printed; what is refused changes nothing. */
#include <stdio.h>

#include "fuzz.h"
#include "mild/field.h"

typedef struct {
    double number, vector[3];
    int integer, yes;
    uint64_t seed;
    char name[12];
} Values;

static const MildField fields[] = {
    MILD_FIELD(Values, number, MILD_FIELD_DOUBLE, 1, -1e6, 1e6, "[m] a number"),
    MILD_FIELD(Values, vector, MILD_FIELD_DOUBLE, 3, -1e300, 1e300, "[m] three numbers"),
    MILD_FIELD(Values, integer, MILD_FIELD_INT, 1, -2147483648.0, 2147483647.0, "[-] an integer"),
    MILD_FIELD(Values, yes, MILD_FIELD_BOOL, 1, 0, 1, "bool"),
    MILD_FIELD(Values, seed, MILD_FIELD_UINT64, 1, 0, 1.8446744073709552e19, "[-] a seed"),
    MILD_FIELD(Values, name, MILD_FIELD_TEXT, 12, 0, 0, "a name"),
};
enum { FIELDS = sizeof fields / sizeof *fields };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const Values start = {.number = 1.5, .vector = {1, 2, 3}, .name = "start"};
    char *text = malloc(size + 1), printed[200];
    fuzz_check(text != NULL);
    memcpy(text, data, size);
    text[size] = '\0';
    for (int f = 0; f < FIELDS; f++) {
        Values values = start, again = start;
        MildError error = {0};
        MildStatus status = mild_field_parse(&fields[f], &values, text, "fuzz", &error);
        if (status != MILD_OK) {
            fuzz_check(memcmp(&values, &start, sizeof start) == 0 && error.status == status &&
                       error.text[0]);
            continue;
        }
        fuzz_check(mild_fields_check(fields, FIELDS, &values, "fuzz", &error) == MILD_OK);
        int length = mild_field_print(&fields[f], &values, printed, sizeof printed);
        fuzz_check(length >= 0 && length < (int)sizeof printed);
        fuzz_check(mild_field_parse(&fields[f], &again, printed, "again", &error) == MILD_OK);
        fuzz_check(memcmp(&values, &again, sizeof values) == 0);
    }
    const char *nearest = NULL;
    const MildField *found = mild_field_find(fields, FIELDS, text, &nearest);
    fuzz_check(nearest != NULL && (!found || strcmp(found->name, text) == 0));
    free(text);
    return 0;
}
