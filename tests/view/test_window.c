/* The window's keys and mouse, pressed through a GLFW of the test's own: what each asks for, by its
 * sign and size, and that it asks once. */
#include "kit.h"
#include "view/window.h"

TEST(nothing_without_windows) {
    MildError error = {0};
    assert_false(window_available());
    assert_null(window_create(64, 64, "test", &error));
    assert_error(&error, MILD_ERROR_IO, "--video");
}

#ifdef MILD_GLFW

#include <GLFW/glfw3.h>
#include <dlfcn.h>
#include <math.h>

static int display; /* bool */
static GLFWkeyfun press;
static GLFWmousebuttonfun button;
static GLFWcursorposfun move;
static GLFWscrollfun scroll;
static void *user;
static double mouse[2];

/* ---- GLFW, as far as window.c calls it: in the place of the library ---- */

WRAPS(dlopen);
void *__wrap_dlopen(const char *name, int flags) {
    return __real_dlopen(strcmp(name, "libglfw.so.3") == 0 ? NULL : name, flags);
}

int glfwInit(void) {
    return display;
}
void glfwTerminate(void) {
}
void glfwWindowHint(int hint, int value) {
    (void)hint;
    (void)value;
}
GLFWwindow *glfwCreateWindow(int width, int height, const char *title, GLFWmonitor *monitor,
                             GLFWwindow *share) {
    (void)width;
    (void)height;
    (void)title;
    (void)monitor;
    (void)share;
    return (GLFWwindow *)(void *)mouse; /* never looked into */
}
void glfwDestroyWindow(GLFWwindow *window) {
    (void)window;
}
void glfwMakeContextCurrent(GLFWwindow *window) {
    (void)window;
}
void glfwSwapInterval(int interval) {
    (void)interval;
}
void glfwSetWindowUserPointer(GLFWwindow *window, void *pointer) {
    (void)window;
    user = pointer;
}
void *glfwGetWindowUserPointer(GLFWwindow *window) {
    (void)window;
    return user;
}
GLFWkeyfun glfwSetKeyCallback(GLFWwindow *window, GLFWkeyfun callback) {
    (void)window;
    press = callback;
    return NULL;
}
GLFWmousebuttonfun glfwSetMouseButtonCallback(GLFWwindow *window, GLFWmousebuttonfun callback) {
    (void)window;
    button = callback;
    return NULL;
}
GLFWcursorposfun glfwSetCursorPosCallback(GLFWwindow *window, GLFWcursorposfun callback) {
    (void)window;
    move = callback;
    return NULL;
}
GLFWscrollfun glfwSetScrollCallback(GLFWwindow *window, GLFWscrollfun callback) {
    (void)window;
    scroll = callback;
    return NULL;
}
void glfwGetCursorPos(GLFWwindow *window, double *x, double *y) {
    (void)window;
    *x = mouse[0], *y = mouse[1];
}
void glfwGetFramebufferSize(GLFWwindow *window, int *width, int *height) {
    (void)window;
    *width = *height = 64;
}
void glfwSwapBuffers(GLFWwindow *window) {
    (void)window;
}
void glfwPollEvents(void) {
}
int glfwWindowShouldClose(GLFWwindow *window) {
    (void)window;
    return 0;
}

/* ---- tests ---- */

static Window *open_window(void) {
    MildError error = {0};
    display = 1;
    Window *window = window_create(64, 64, "test", &error);
    assert_non_null(window);
    return window;
}

/* What a key asks for; pressed, held for a repeat where `twice`, and let go. */
static WindowInput after(Window *window, int key, int twice) {
    WindowInput input;
    press(NULL, key, 0, GLFW_PRESS, 0);
    if (twice) {
        press(NULL, key, 0, GLFW_REPEAT, 0);
    }
    press(NULL, key, 0, GLFW_RELEASE, 0);
    window_show(window, &input);
    return input;
}

/* x forward, y left, z turning left: the up arrow goes forward, Q left, the left arrow turns left.
 * The letters of `mild play --help`. */
TEST(keys) {
    static const struct {
        int key;
        WindowInput asks;
    } known[] = {
        {GLFW_KEY_UP, {.command = {0.1, 0, 0}}},
        {GLFW_KEY_DOWN, {.command = {-0.1, 0, 0}}},
        {GLFW_KEY_Q, {.command = {0, 0.1, 0}}},
        {GLFW_KEY_E, {.command = {0, -0.1, 0}}},
        {GLFW_KEY_LEFT, {.command = {0, 0, 0.1}}},
        {GLFW_KEY_RIGHT, {.command = {0, 0, -0.1}}},
        {GLFW_KEY_S, {.halt = 1}},
        {GLFW_KEY_R, {.reset = 1}},
        {GLFW_KEY_F, {.friction = 1}},
        {GLFW_KEY_V, {.friction = -1}},
        {GLFW_KEY_K, {.stiffness = 1}},
        {GLFW_KEY_M, {.stiffness = -1}},
        {GLFW_KEY_1, {.ground = 1}},
        {GLFW_KEY_9, {.ground = 9}},
        {GLFW_KEY_0, {.ground = 0}},
        {GLFW_KEY_X, {.ground = 0}},
    };
    Window *window = open_window();
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        const WindowInput *wanted = &known[i].asks;
        for (int twice = 0; twice < 2; twice++) {
            const WindowInput asks = after(window, known[i].key, twice);
            for (int c = 0; c < 3; c++) {
                assert_true(fabs(asks.command[c] - (1 + twice) * wanted->command[c]) < 1e-12);
            }
            assert_int_equal(asks.friction, (1 + twice) * wanted->friction);
            assert_int_equal(asks.stiffness, (1 + twice) * wanted->stiffness);
            assert_int_equal(asks.ground, wanted->ground);
            assert_int_equal(asks.halt, wanted->halt);
            assert_int_equal(asks.reset, wanted->reset);
            assert_false(asks.quit || asks.paused || asks.time_scale != 1);
        }
    }
    window_destroy(window);
}

TEST(keys_that_stay) {
    Window *window = open_window();
    assert_true(after(window, GLFW_KEY_SPACE, 0).paused);
    assert_true(after(window, GLFW_KEY_X, 0).paused);
    assert_false(after(window, GLFW_KEY_SPACE, 0).paused);
    assert_true(after(window, GLFW_KEY_EQUAL, 0).time_scale == 2);
    for (int i = 0; i < 9; i++) {
        after(window, GLFW_KEY_EQUAL, 0);
    }
    assert_true(after(window, GLFW_KEY_MINUS, 0).time_scale == 2); /* of at most 4 */
    for (int i = 0; i < 9; i++) {
        after(window, GLFW_KEY_MINUS, 0);
    }
    assert_true(after(window, GLFW_KEY_X, 0).time_scale == 0.0625);
    assert_true(after(window, GLFW_KEY_ESCAPE, 0).quit);
    window_destroy(window);
}

/* A picture that is dragged goes with the hand: to the right turns the camera to the right, which
 * is negative, down lowers it. Without the button nothing moves. */
TEST(mouse_drags) {
    WindowInput input;
    Window *window = open_window();
    move(NULL, 10, 10);
    window_show(window, &input);
    assert_true(input.turn == 0 && input.lift == 0);
    mouse[0] = 10, mouse[1] = 10;
    button(NULL, GLFW_MOUSE_BUTTON_LEFT, GLFW_PRESS, 0);
    move(NULL, 110, 60);
    scroll(NULL, 5, 1);
    window_show(window, &input);
    assert_true(fabs(input.turn + 0.6) < 1e-12 && fabs(input.lift + 0.3) < 1e-12);
    assert_true(fabs(input.zoom - 0.1) < 1e-12);
    button(NULL, GLFW_MOUSE_BUTTON_LEFT, GLFW_RELEASE, 0);
    move(NULL, 0, 0);
    window_show(window, &input);
    assert_true(input.turn == 0 && input.lift == 0 && input.zoom == 0);
    window_destroy(window);
}

#endif

TEST_MAIN(NULL, NULL)
