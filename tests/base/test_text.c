/* Names, numbers and durations as text. */
#include <limits.h>

#include "base/text.h"
#include "kit.h"
#include "mild/error.h"

/* Half edits from a name to another, by which of the other and names of so many edits, with and
 * without a word behind, is nearer. */
static int distance(const char *name, const char *other) {
    char rival[80] = "";
    for (int half = 1; half < 20; half++) {
        snprintf(rival, sizeof rival, "%.*s%s%s", half / 2, "//////////", name,
                 half % 2 ? "_/" : "");
        if (text_nearest(name, (const char *[]){rival, other}, 2) == other) {
            return half - 1;
        }
    }
    return -1;
}

TEST(test_distance) {
    static const struct {
        const char *a, *b;
        int half_edits;
    } pairs[] = {
        {"", "", 0},
        {"abc", "", 6},
        {"sand", "sand", 0},
        {"kitten", "sitting", 6},
        {"sunday", "saturday", 6},
        {"flaw", "lawn", 4},
        {"intention", "execution", 10},
        {"ab", "ba", 2}, /* neighbours exchanged */
        {"ca", "abc", 6},
        {"foam", "foam4", 1}, /* begins the other */
        {"envs", "env", 2},
        {"snad", "sand_loose", 3}, /* words at the end of the other */
        {"snad", "snow", 4},
        {"action_rate", "action_smoothness", 6}, /* of both, and half an edit a character */
        {"action_rate", "yaw_rate", 12},
        {"feet_slip", "slip", 5},
        {"loose_sand", "sand_loose", 7},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        assert_int_equal(distance(pairs[i].a, pairs[i].b), pairs[i].half_edits);
    }
    char longer[80], other[80], cut[64]; /* names count as cut at 63 characters */
    memset(longer, 'a', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    memcpy(other, longer, sizeof other);
    other[62] = 'b';
    const char *const last[] = {other, longer};
    assert_ptr_equal(text_nearest(longer, last, 2), longer);
    other[62] = 'a';
    other[63] = 'b';
    assert_ptr_equal(text_nearest(longer, last, 2), other);
    memset(cut, 0, sizeof cut);
    memcpy(cut, longer, sizeof cut - 1);
    assert_ptr_equal(text_nearest("", (const char *[]){cut, other}, 2), cut);
    assert_ptr_equal(text_nearest("", (const char *[]){other, cut}, 2), other);
}

TEST(test_nearest) {
    static const char *const names[] = {"rubber", "foam60", "foam45", "sand_loose"};
    assert_string_equal(text_nearest("foam44", names, 4), "foam45");
    assert_string_equal(text_nearest("foam", names, 4), "foam60");     /* the first of two alike */
    assert_string_equal(text_nearest("sand", names, 4), "sand_loose"); /* though 6 away */
    assert_string_equal(text_nearest("s", names, 4), "sand_loose");    /* by its first word */
    assert_string_equal(text_nearest("foam45", (const char *[]){"foam45x", "foam45"}, 2), "foam45");
    assert_string_equal(text_nearest("sand_loos", names, 4), "sand_loose");
    assert_string_equal(text_nearest("foam45", names, 2), "foam60");
    assert_null(text_nearest("foam", names, 0));
}

TEST(test_numbers) {
    double number = 7;
    assert_true(text_double("-1.5e-3", &number) && number == -1.5e-3);
    assert_true(text_double("0", &number) && number == 0);
    number = 7;
    static const char *const no_numbers[] = {"", "x", "1x", "1 ", "nan", "inf", "-inf", "1e999"};
    for (size_t i = 0; i < sizeof no_numbers / sizeof *no_numbers; i++) {
        assert_false(text_double(no_numbers[i], &number));
    }
    assert_true(number == 7);
    int whole = 7;
    assert_true(text_int("-2147483648", &whole) && whole == INT_MIN);
    assert_true(text_int("2147483647", &whole) && whole == INT_MAX);
    assert_true(text_int("010", &whole) && whole == 10); /* decimal, not octal */
    static const char *const no_ints[] = {
        "", "x", "1.5", "1 ", "2147483648", "-2147483649", "99999999999999999999",
    };
    for (size_t i = 0; i < sizeof no_ints / sizeof *no_ints; i++) {
        assert_false(text_int(no_ints[i], &whole));
    }
    assert_int_equal(whole, 10);
    uint64_t large = 7;
    assert_true(text_uint64("18446744073709551615", &large) && large == UINT64_MAX);
    assert_true(text_uint64("0", &large) && large == 0);
    assert_true(text_uint64("9", &large) && large == 9);
    static const char *const no_large[] = {"", "-1", "+1", " 1", "1x", "18446744073709551616", ":"};
    for (size_t i = 0; i < sizeof no_large / sizeof *no_large; i++) {
        assert_false(text_uint64(no_large[i], &large));
    }
    assert_true(large == 9);
}

TEST(test_bytes) {
    char text[32];
    assert_string_equal(text_bytes(0, text, sizeof text), "0 B");
    assert_string_equal(text_bytes(1023, text, sizeof text), "1023 B");
    assert_string_equal(text_bytes(1024, text, sizeof text), "1.00 KiB");
    assert_string_equal(text_bytes(1.5 * 1048576, text, sizeof text), "1.50 MiB");
    assert_string_equal(text_bytes(1.25 * 1073741824, text, sizeof text), "1.25 GiB");
    assert_string_equal(text_bytes(1099511627776, text, sizeof text), "1.00 TiB");
    assert_string_equal(text_bytes(2048 * 1099511627776.0, text, sizeof text), "2048.00 TiB");
}

TEST(test_duration) {
    static const struct {
        double seconds;
        const char *text;
    } rows[] = {
        {0, "0 s"},
        {-5, "0 s"},
        {0.4, "0 s"},
        {0.6, "1 s"},
        {59.4, "59 s"},
        {59.6, "1 min 00 s"},
        {245, "4 min 05 s"},
        {3599, "59 min 59 s"},
        {3600, "1 h 00 min"},
        {3720, "1 h 02 min"},
        {100 * 3600 + 59 * 60, "100 h 59 min"},
        {1e12, "0 s"},
    };
    char text[32];
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        assert_string_equal(text_duration(rows[i].seconds, text, sizeof text), rows[i].text);
    }
}

/* What a terminal obeys, or what is no UTF-8, becomes '?', byte by byte. */
TEST(test_plain) {
    static const struct {
        const char *text, *keep, *plain;
        size_t torn;
    } rows[] = {
        {"plain, \xc3\xa4, \xe2\x82\xac, \xf0\x9f\x90\x95", "", NULL, 0},
        {"\x1b[2J\x1b]0;title\x07", "", "?[2J?]0;title?", 0},
        {"a\nb\tc\rd\be\x7f", "\n\t", "a\nb\tc?d?e?", 0},
        {"a\nb", "", "a?b", 0},
        {"C1: \xc2\x9b"
         "31m, \x9b"
         "31m",
         "", "C1: ??31m, ?31m", 0},
        {"\xe2\x80\xae"
         "reversed \xe2\x81\xa6",
         "", "???reversed ???", 0},
        {"beside those: \xc2\xa0 \xe2\x80\xaf \xe2\x81\xa5 \xe2\x81\xaa", "", NULL, 0},
        {"first of their length: \xe0\xa0\x80 \xf0\x90\x80\x80", "", NULL, 0},
        {"overlong \xc0\x9b \xe0\x80\x9b \xf8\x80", "", "overlong ?? ??? ??", 0},
        {"\xf4\x90\x80\x80 \xff\xfe", "", "???? ??", 0},
        {"torn \xe2\x82", "", NULL, 2},
        {"torn \xc2", "", NULL, 1},
        {"\xe2"
         "ab",
         "", "?ab", 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[64];
        snprintf(text, sizeof text, "%s", rows[i].text);
        assert_int_equal(text_plain(text, strlen(text), rows[i].keep), rows[i].torn);
        assert_string_equal(text, rows[i].plain ? rows[i].plain : rows[i].text);
    }
    char zero[3] = {'a', '\0', 'b'};
    assert_int_equal(text_plain(zero, 3, "\n"), 0);
    assert_memory_equal(zero, "a?b", 3);
    MildError error = {0};
    char name[sizeof error.text];
    memset(name, 'x', sizeof name);
    strcpy(name + sizeof name - 3, "\xc3"); /* cut in the middle of a character */
    mild_fail(&error, MILD_ERROR_IO, "%s\xa4 and more", name);
    assert_int_equal(strlen(error.text), sizeof error.text - 1);
    mild_fail(&error, MILD_ERROR_IO, "no file '%s'", "\x1b[31mred\n");
    assert_string_equal(error.text, "no file '?[31mred?'");
}

TEST_MAIN(NULL, NULL)
