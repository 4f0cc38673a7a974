/* The learner's tables against configs/default.ini, which is what users read: keys, their order,
 * helps, ranges and defaults. */
#include "check.h"

#include <stdio.h>
#include <string.h>

#include "learn/ppo.h"

/* "# help (min .. max)" as the file has it. */
static void range_text(const MildField *field, char *text, size_t size) {
    if (field->type == MILD_FIELD_BOOL) {
        snprintf(text, size, "# %s\n", field->help);
        return;
    }
    int used = snprintf(text, size, "# %s (", field->help);
    if (field->type == MILD_FIELD_NAME) {
        for (int i = 0; i <= (int)field->max; i++) {
            used +=
                snprintf(text + used, size - (size_t)used, "%s%s", i ? ", " : "", field->names[i]);
        }
        snprintf(text + used, size - (size_t)used, ")\n");
        return;
    }
    snprintf(text + used, size - (size_t)used, "%g .. %g)\n", field->min, field->max);
}

static void check_section(const char *section, const MildField *fields, int count,
                          const void *def) {
    FILE *file = fopen(MILD_SOURCE_DIR "/configs/default.ini", "r");
    assert_non_null(file);
    char line[400], expected[400], value[300];
    snprintf(expected, sizeof expected, "[%s]\n", section);
    do {
        assert_non_null(fgets(line, sizeof line, file));
    } while (strcmp(line, expected) != 0);
    for (int i = 0; i < count; i++) {
        range_text(&fields[i], expected, sizeof expected);
        assert_non_null(fgets(line, sizeof line, file));
        assert_string_equal(line, expected);
        assert_true(mild_field_print(&fields[i], def, value, sizeof value) < (int)sizeof value);
        snprintf(expected, sizeof expected, "%s = %s\n", fields[i].name, value);
        assert_non_null(fgets(line, sizeof line, file));
        assert_string_equal(line, expected);
    }
    assert_true(!fgets(line, sizeof line, file) || strcmp(line, "\n") == 0);
    fclose(file);
}

TEST(test_defaults_are_the_files) {
    PpoDef ppo = ppo_def_default();
    PolicyDef policy = policy_def_default();
    check_section("ppo", ppo_fields, ppo_field_count, &ppo);
    check_section("policy", policy_fields, policy_field_count, &policy);
}

TEST_MAIN(NULL, NULL)
