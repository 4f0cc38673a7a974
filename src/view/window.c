#include "view/window.h"

#ifdef MILD_GLFW

#include <GLFW/glfw3.h>
#include <dlfcn.h>
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

/* GLFW, which is loaded when a window is asked for: a program without windows runs without it. */
static struct {
    int (*init)(void);
    void (*terminate)(void);
    void (*hint)(int, int);
    GLFWwindow *(*create)(int, int, const char *, GLFWmonitor *, GLFWwindow *);
    void (*destroy)(GLFWwindow *);
    void (*make_current)(GLFWwindow *);
    void (*swap_interval)(int);
    void (*swap)(GLFWwindow *);
    void (*poll)(void);
    int (*should_close)(GLFWwindow *);
    void (*get_size)(GLFWwindow *, int *, int *);
    void (*get_cursor)(GLFWwindow *, double *, double *);
    void (*set_pointer)(GLFWwindow *, void *);
    void *(*get_pointer)(GLFWwindow *);
    GLFWkeyfun (*set_key)(GLFWwindow *, GLFWkeyfun);
    GLFWmousebuttonfun (*set_button)(GLFWwindow *, GLFWmousebuttonfun);
    GLFWcursorposfun (*set_move)(GLFWwindow *, GLFWcursorposfun);
    GLFWscrollfun (*set_scroll)(GLFWwindow *, GLFWscrollfun);
} glfw;

static int load_glfw(void) {
    static const struct {
        const char *name;
        void *function; /* of type (*)(...) */
    } calls[] = {
        {"glfwInit", &glfw.init},
        {"glfwTerminate", &glfw.terminate},
        {"glfwWindowHint", &glfw.hint},
        {"glfwCreateWindow", &glfw.create},
        {"glfwDestroyWindow", &glfw.destroy},
        {"glfwMakeContextCurrent", &glfw.make_current},
        {"glfwSwapInterval", &glfw.swap_interval},
        {"glfwSwapBuffers", &glfw.swap},
        {"glfwPollEvents", &glfw.poll},
        {"glfwWindowShouldClose", &glfw.should_close},
        {"glfwGetFramebufferSize", &glfw.get_size},
        {"glfwGetCursorPos", &glfw.get_cursor},
        {"glfwSetWindowUserPointer", &glfw.set_pointer},
        {"glfwGetWindowUserPointer", &glfw.get_pointer},
        {"glfwSetKeyCallback", &glfw.set_key},
        {"glfwSetMouseButtonCallback", &glfw.set_button},
        {"glfwSetCursorPosCallback", &glfw.set_move},
        {"glfwSetScrollCallback", &glfw.set_scroll},
    };
    void *library = dlopen("libglfw.so.3", RTLD_NOW | RTLD_LOCAL);
    for (size_t i = 0; library && i < sizeof calls / sizeof *calls; i++) {
        void *symbol = dlsym(library, calls[i].name); /* its bits, as in gl.c */
        memcpy(calls[i].function, &symbol, sizeof symbol);
        if (!symbol) {
            dlclose(library);
            library = NULL;
        }
    }
    return library != NULL;
}

int window_available(void) {
    static int loaded = -1;
    if (loaded < 0) {
        loaded = load_glfw();
    }
    return loaded && glfw.init();
}

static void on_key(GLFWwindow *handle, int key, int scancode, int action, int modifiers) {
    (void)scancode;
    (void)modifiers;
    if (action == GLFW_RELEASE) {
        return;
    }
    WindowInput *input = &((Window *)glfw.get_pointer(handle))->input;
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
    Window *window = glfw.get_pointer(handle);
    if (button == GLFW_MOUSE_BUTTON_LEFT) {
        window->dragging = action == GLFW_PRESS;
    }
    glfw.get_cursor(handle, &window->mouse_x, &window->mouse_y);
}

static void on_move(GLFWwindow *handle, double x, double y) {
    Window *window = glfw.get_pointer(handle);
    if (window->dragging) {
        window->input.turn -= DRAG_GAIN * (x - window->mouse_x);
        window->input.lift -= DRAG_GAIN * (y - window->mouse_y);
    }
    window->mouse_x = x, window->mouse_y = y;
}

static void on_scroll(GLFWwindow *handle, double x, double y) {
    (void)x;
    ((Window *)glfw.get_pointer(handle))->input.zoom += 0.1 * y;
}

Window *window_create(int width, int height, const char *title, MildError *error) {
    if (!window_available()) {
        mild_fail(error, MILD_ERROR_IO,
                  "window: no display, or no GLFW (apt-get install libglfw3); use --video FILE.mp4 "
                  "instead");
        return NULL;
    }
    Window *window = calloc(1, sizeof *window);
    glfw.hint(GLFW_SAMPLES, 4);
    if (window) {
        window->handle = glfw.create(width, height, title, NULL, NULL);
    }
    if (!window || !window->handle) {
        mild_fail(error, MILD_ERROR_IO,
                  "window: the display gives no OpenGL window; use --video FILE.mp4 instead");
        free(window);
        glfw.terminate();
        return NULL;
    }
    window->input.time_scale = 1.0;
    glfw.make_current(window->handle);
    glfw.swap_interval(1);
    glfw.set_pointer(window->handle, window);
    glfw.set_key(window->handle, on_key);
    glfw.set_button(window->handle, on_button);
    glfw.set_move(window->handle, on_move);
    glfw.set_scroll(window->handle, on_scroll);
    return window;
}

void window_destroy(Window *window) {
    if (!window) {
        return;
    }
    glfw.destroy(window->handle);
    glfw.terminate();
    free(window);
}

void window_size(Window *window, int *width, int *height) {
    glfw.get_size(window->handle, width, height);
}

void window_show(Window *window, WindowInput *input) {
    glfw.swap(window->handle);
    glfw.poll();
    if (glfw.should_close(window->handle)) {
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
