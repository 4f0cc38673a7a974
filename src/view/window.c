#include "view/window.h"

#ifdef MILD_GLFW

#include <GLFW/glfw3.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SPEED_STEP 0.1  /* [m/s], [rad/s] per key press */
#define DRAG_GAIN 0.006 /* [rad] per pixel */

struct Window {
    GLFWwindow *handle;
    WindowInput input;
    double mouse_x, mouse_y;
    int dragging;
};

int window_available(void) {
    return 1;
}

static void on_key(GLFWwindow *handle, int key, int scancode, int action, int modifiers) {
    (void)scancode;
    (void)modifiers;
    if (action == GLFW_RELEASE) {
        return;
    }
    WindowInput *input = &((Window *)glfwGetWindowUserPointer(handle))->input;
    if (key >= GLFW_KEY_1 && key <= GLFW_KEY_9) {
        input->ground = key - GLFW_KEY_1 + 1;
    }
    switch (key) {
    case GLFW_KEY_ESCAPE: input->quit = 1; break;
    case GLFW_KEY_SPACE: input->paused = !input->paused; break;
    case GLFW_KEY_R: input->reset = 1; break;
    case GLFW_KEY_UP: input->command[0] += SPEED_STEP; break;
    case GLFW_KEY_DOWN: input->command[0] -= SPEED_STEP; break;
    case GLFW_KEY_LEFT: input->command[2] += SPEED_STEP; break;
    case GLFW_KEY_RIGHT: input->command[2] -= SPEED_STEP; break;
    case GLFW_KEY_Q: input->command[1] += SPEED_STEP; break;
    case GLFW_KEY_E: input->command[1] -= SPEED_STEP; break;
    case GLFW_KEY_S: input->halt = 1; break;
    case GLFW_KEY_F: input->friction++; break;
    case GLFW_KEY_V: input->friction--; break;
    case GLFW_KEY_K: input->stiffness++; break;
    case GLFW_KEY_M: input->stiffness--; break;
    case GLFW_KEY_EQUAL: input->time_scale = fmin(2.0 * input->time_scale, 4.0); break;
    case GLFW_KEY_MINUS: input->time_scale = fmax(0.5 * input->time_scale, 0.0625); break;
    default: break;
    }
}

static void on_button(GLFWwindow *handle, int button, int action, int modifiers) {
    (void)modifiers;
    Window *window = glfwGetWindowUserPointer(handle);
    if (button == GLFW_MOUSE_BUTTON_LEFT) {
        window->dragging = action == GLFW_PRESS;
    }
    glfwGetCursorPos(handle, &window->mouse_x, &window->mouse_y);
}

static void on_move(GLFWwindow *handle, double x, double y) {
    Window *window = glfwGetWindowUserPointer(handle);
    if (window->dragging) {
        window->input.turn -= DRAG_GAIN * (x - window->mouse_x);
        window->input.lift -= DRAG_GAIN * (y - window->mouse_y);
    }
    window->mouse_x = x, window->mouse_y = y;
}

static void on_scroll(GLFWwindow *handle, double x, double y) {
    (void)x;
    ((Window *)glfwGetWindowUserPointer(handle))->input.zoom += 0.1 * y;
}

Window *window_create(int width, int height, const char *title, MildError *error) {
    if (!glfwInit()) {
        mild_fail(error, MILD_ERROR_IO, "window: no display; use --video FILE.mp4 instead");
        return NULL;
    }
    Window *window = calloc(1, sizeof *window);
    glfwWindowHint(GLFW_SAMPLES, 4);
    if (window) {
        window->handle = glfwCreateWindow(width, height, title, NULL, NULL);
    }
    if (!window || !window->handle) {
        mild_fail(error, MILD_ERROR_IO,
                  "window: the display gives no OpenGL window; use --video FILE.mp4 instead");
        free(window);
        glfwTerminate();
        return NULL;
    }
    window->input.time_scale = 1.0;
    glfwMakeContextCurrent(window->handle);
    glfwSwapInterval(1);
    glfwSetWindowUserPointer(window->handle, window);
    glfwSetKeyCallback(window->handle, on_key);
    glfwSetMouseButtonCallback(window->handle, on_button);
    glfwSetCursorPosCallback(window->handle, on_move);
    glfwSetScrollCallback(window->handle, on_scroll);
    return window;
}

void window_destroy(Window *window) {
    if (!window) {
        return;
    }
    glfwDestroyWindow(window->handle);
    glfwTerminate();
    free(window);
}

void window_size(Window *window, int *width, int *height) {
    glfwGetFramebufferSize(window->handle, width, height);
}

void window_show(Window *window, WindowInput *input) {
    glfwSwapBuffers(window->handle);
    glfwPollEvents();
    if (glfwWindowShouldClose(window->handle)) {
        window->input.quit = 1;
    }
    *input = window->input;
    window->input.reset = window->input.halt = 0;
    window->input.ground = window->input.friction = window->input.stiffness = 0;
    window->input.turn = window->input.lift = window->input.zoom = 0;
    memset(window->input.command, 0, sizeof window->input.command);
}

#else

int window_available(void) {
    return 0;
}

Window *window_create(int width, int height, const char *title, MildError *error) {
    (void)width;
    (void)height;
    (void)title;
    mild_fail(
        error, MILD_ERROR_IO,
        "window: this program was built without GLFW (apt-get install libglfw3-dev, then rebuild); "
        "use --video FILE.mp4 instead");
    return NULL;
}

void window_destroy(Window *window) {
    (void)window;
}

void window_size(Window *window, int *width, int *height) {
    (void)window;
    *width = *height = 0;
}

void window_show(Window *window, WindowInput *input) {
    (void)window;
    input->quit = 1;
}

#endif
