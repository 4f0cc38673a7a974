/* Any text as a soil file. It may be refused with a message that names it, never crash, and what is
 * accepted is in range and reads back from its own text to the same numbers. */
#include "fuzz.h"
#include "ground/soil/soil.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    MildMaterial material = mild_material_default(), again = material;
    const MildMaterial before = material;
    MildError error = {0};
    char *text = malloc(size + 1);
    fuzz_check(text != NULL);
    memcpy(text, data, size);
    text[size] = '\0';
    const MildStatus status = soil_parse(text, "fuzz.ini", &material, &error);
    if (status != MILD_OK) {
        fuzz_check(error.status == status && strncmp(error.text, "fuzz.ini:", 9) == 0);
        fuzz_check(!strpbrk(error.text, "\r\n"));
        fuzz_check(memcmp(&material, &before, sizeof before) == 0);
    } else {
        const char *notes[64] = {text, text};
        const SoilNotes remarks = {text, notes};
        fuzz_check(mild_material_field_count <= 64);
        fuzz_check(mild_material_check(&material, &error) == MILD_OK);
        char *plain = soil_text(&material, NULL), *noted = soil_text(&material, &remarks);
        fuzz_check(plain && soil_parse(plain, "again", &again, &error) == MILD_OK);
        for (int i = 0; i < mild_material_field_count; i++) {
            const MildField *field = &mild_material_fields[i];
            const size_t bytes = field->type == MILD_FIELD_DOUBLE ? sizeof(double) : sizeof(int);
            fuzz_check(!soil_reads(&material, field) ||
                       memcmp((char *)&material + field->offset, (char *)&again + field->offset,
                              bytes) == 0);
        }
        /* remarks stay remarks, whatever is in them */
        fuzz_check(noted && soil_parse(noted, "noted", &again, &error) == MILD_OK);
        char *twice = soil_text(&again, NULL);
        fuzz_check(twice && strcmp(plain, twice) == 0);
        free(plain);
        free(noted);
        free(twice);
    }
    free(text);
    return 0;
}
