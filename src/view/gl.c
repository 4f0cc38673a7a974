#include "view/view_parts.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

#define GL_DEVICES_MAX 8
/* OSMesa's interface is frozen; these two of its constants spare its header. */
#define OSMESA_RGBA 0x1908
#define OSMESA_UNSIGNED_BYTE 0x1401

struct GlContext {
    void *library;
    EGLDisplay display;
    EGLContext egl;
    void *osmesa;
    unsigned char osmesa_buffer
        [64 * 64 *
         4]; /* OSMesa requires a default buffer, although we draw into framebuffer objects */
};

/* Object pointers and function pointers convert through memory: POSIX guarantees the
 * representation. */
static void load(void *library, const char *name, void *function) {
    void *symbol = dlsym(library, name);
    memcpy(function, &symbol, sizeof symbol);
}

static int egl_make_current(GlContext *context, void *library, EGLDisplay display) {
    EGLBoolean (*initialize)(EGLDisplay, EGLint *, EGLint *);
    EGLBoolean (*bind_api)(EGLenum);
    EGLBoolean (*choose)(EGLDisplay, const EGLint *, EGLConfig *, EGLint, EGLint *);
    EGLContext (*create)(EGLDisplay, EGLConfig, EGLContext, const EGLint *);
    EGLBoolean (*current)(EGLDisplay, EGLSurface, EGLSurface, EGLContext);
    EGLBoolean (*destroy)(EGLDisplay, EGLContext);
    EGLBoolean (*terminate)(EGLDisplay);
    load(library, "eglInitialize", &initialize);
    load(library, "eglBindAPI", &bind_api);
    load(library, "eglChooseConfig", &choose);
    load(library, "eglCreateContext", &create);
    load(library, "eglMakeCurrent", &current);
    load(library, "eglDestroyContext", &destroy);
    load(library, "eglTerminate", &terminate);
    if (!initialize || !bind_api || !choose || !create || !current || !destroy || !terminate ||
        !initialize(display, NULL, NULL)) {
        return 0;
    }
    const EGLint attributes[] = {EGL_SURFACE_TYPE,
                                 EGL_PBUFFER_BIT,
                                 EGL_RENDERABLE_TYPE,
                                 EGL_OPENGL_BIT,
                                 EGL_RED_SIZE,
                                 8,
                                 EGL_GREEN_SIZE,
                                 8,
                                 EGL_BLUE_SIZE,
                                 8,
                                 EGL_NONE};
    EGLConfig config;
    EGLint count = 0;
    if (bind_api(EGL_OPENGL_API) && choose(display, attributes, &config, 1, &count) && count > 0) {
        context->egl = create(display, config, EGL_NO_CONTEXT, NULL);
        if (context->egl != EGL_NO_CONTEXT &&
            current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context->egl)) {
            context->display = display;
            return 1;
        }
        if (context->egl != EGL_NO_CONTEXT) {
            destroy(display, context->egl);
        }
    }
    terminate(display);
    return 0;
}

/* Devices first (a GPU without a display), then Mesa's surfaceless platform (software), then
 * whatever is default. */
static int egl_open(GlContext *context) {
    void *library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_GLOBAL);
    if (!library) {
        return 0;
    }
    void *(*address)(const char *);
    EGLDisplay (*get_display)(EGLNativeDisplayType);
    load(library, "eglGetProcAddress", &address);
    load(library, "eglGetDisplay", &get_display);
    if (!address || !get_display) {
        dlclose(library);
        return 0;
    }
    PFNEGLQUERYDEVICESEXTPROC query_devices;
    PFNEGLGETPLATFORMDISPLAYEXTPROC platform_display;
    void *symbol = address("eglQueryDevicesEXT");
    memcpy(&query_devices, &symbol, sizeof symbol);
    symbol = address("eglGetPlatformDisplayEXT");
    memcpy(&platform_display, &symbol, sizeof symbol);

    EGLDisplay candidates[GL_DEVICES_MAX + 2];
    int count = 0;
    if (query_devices && platform_display) {
        EGLDeviceEXT devices[GL_DEVICES_MAX];
        EGLint found = 0;
        if (!query_devices(GL_DEVICES_MAX, devices, &found)) {
            found = 0;
        }
        for (int i = 0; i < found; i++) {
            candidates[count++] = platform_display(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL);
        }
        candidates[count++] = platform_display(EGL_PLATFORM_SURFACELESS_MESA, NULL, NULL);
    }
    candidates[count++] = get_display(EGL_DEFAULT_DISPLAY);
    for (int i = 0; i < count; i++) {
        if (candidates[i] != EGL_NO_DISPLAY && egl_make_current(context, library, candidates[i])) {
            context->library = library;
            return 1;
        }
    }
    dlclose(library);
    return 0;
}

static int osmesa_open(GlContext *context) {
    void *library = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_GLOBAL);
    if (!library) {
        library = dlopen("libOSMesa.so", RTLD_NOW | RTLD_GLOBAL);
    }
    if (!library) {
        return 0;
    }
    void *(*create)(unsigned format, int depth, int stencil, int accumulation, void *share);
    unsigned char (*current)(void *context, void *buffer, unsigned type, int width, int height);
    load(library, "OSMesaCreateContextExt", &create);
    load(library, "OSMesaMakeCurrent", &current);
    if (create && current) {
        context->osmesa = create(OSMESA_RGBA, 24, 8, 0, NULL);
        if (context->osmesa &&
            current(context->osmesa, context->osmesa_buffer, OSMESA_UNSIGNED_BYTE, 64, 64)) {
            context->library = library;
            return 1;
        }
    }
    context->osmesa = NULL;
    dlclose(library);
    return 0;
}

GlContext *gl_create(MildError *error) {
    GlContext *context = calloc(1, sizeof *context);
    if (!context) {
        mild_fail(error, MILD_ERROR_MEMORY, "rendering: out of memory");
        return NULL;
    }
    if (egl_open(context) || osmesa_open(context)) {
        return context;
    }
    free(context);
    mild_fail(error, MILD_ERROR_IO,
              "rendering: neither EGL nor OSMesa provides an OpenGL context; install one: "
              "apt-get install libegl1 libgl1-mesa-dri (or libosmesa6)");
    return NULL;
}

void gl_destroy(GlContext *context) {
    if (!context) {
        return;
    }
    if (context->osmesa) {
        void (*destroy)(void *);
        load(context->library, "OSMesaDestroyContext", &destroy);
        destroy(context->osmesa);
    } else {
        EGLBoolean (*current)(EGLDisplay, EGLSurface, EGLSurface, EGLContext);
        EGLBoolean (*destroy)(EGLDisplay, EGLContext);
        load(context->library, "eglMakeCurrent", &current);
        load(context->library, "eglDestroyContext", &destroy);
        current(context->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        destroy(context->display, context->egl);
        /* The display stays initialised: it is shared by the whole process and drivers dislike
         * being unloaded. */
    }
    free(context);
}
