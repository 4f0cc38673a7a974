#include "drive/drive.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/joystick.h>
#include <math.h>
#include <poll.h>
#include <stdint.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

enum { EVENTS = 64 }; /* taken at once, so that a flood does not keep a tick from its time */
#define STEP 0.1      /* [m/s, rad/s] of a key */
#define STICK 32767   /* an axis at its end */
#define DEAD_ZONE 0.1 /* [-] of a stick at rest */

static MildStatus open_gamepad(Input *input, const char *path, MildError *error) {
    uint32_t version;
    struct stat about = {0};
    input->gamepad = open(path, O_RDONLY | O_NONBLOCK);
    if (input->gamepad < 0) {
        return mild_fail(error, MILD_ERROR_IO, "--gamepad: %.200s: %s", path, strerror(errno));
    }
    fstat(input->gamepad, &about); /* a pipe may stand for the device */
    if (!S_ISFIFO(about.st_mode) && ioctl(input->gamepad, JSIOCGVERSION, &version) != 0) {
        close(input->gamepad);
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--gamepad: %.200s is no gamepad; name a file as /dev/input/js0", path);
    }
    return MILD_OK;
}

/* Keys one by one and without an echo; Ctrl-C stays a signal. */
static void open_keys(Input *input) {
    if (!isatty(STDIN_FILENO) || tcgetattr(STDIN_FILENO, &input->before) != 0) {
        return;
    }
    struct termios raw = input->before;
    raw.c_lflag &= (tcflag_t) ~(ICANON | ECHO);
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    input->keys = tcsetattr(STDIN_FILENO, TCSANOW, &raw) == 0;
}

MildStatus input_open(Input *input, const double command[3], const double range[3], int keys,
                      const char *gamepad, MildError *error) {
    memset(input, 0, sizeof *input);
    input->gamepad = -1;
    memcpy(input->command, command, sizeof input->command);
    memcpy(input->range, range, sizeof input->range);
    MildStatus status = gamepad ? open_gamepad(input, gamepad, error) : MILD_OK;
    if (status == MILD_OK && keys) {
        open_keys(input);
    }
    return status;
}

static void stand(Input *input) {
    memset(input->command, 0, sizeof input->command);
}

/* Bool: damp. */
static int take_key(Input *input, char key) {
    static const struct {
        char key;
        int part;
        double step;
    } keys[] = {{'w', 0, STEP},  {'s', 0, -STEP}, {'q', 1, STEP},
                {'e', 1, -STEP}, {'a', 2, STEP},  {'d', 2, -STEP}};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        if (key == keys[i].key) {
            double *part = &input->command[keys[i].part];
            *part = fmin(fmax(*part + keys[i].step, -input->range[keys[i].part]),
                         input->range[keys[i].part]);
        }
    }
    if (key == ' ') {
        stand(input);
    }
    return key == 'x';
}

/* Axes 1 and 0 of the left stick: forward and sideways; axis 3 of the right one: turn. Button 1:
 * damp. */
static int take_event(Input *input, const struct js_event *event) {
    /* of the command, by axis; sticks count right and down */
    static const int parts[4] = {1, 0, -1, 2};
    const int kind = event->type & ~JS_EVENT_INIT;
    if (kind == JS_EVENT_AXIS && event->number < 4 && parts[event->number] >= 0) {
        const int part = parts[event->number];
        const double stick = -(double)event->value / STICK;
        const int rests = fabs(stick) < DEAD_ZONE;
        if (input->rested[event->number]) {
            input->command[part] = rests ? 0 : fmax(stick, -1) * input->range[part];
        }
        input->rested[event->number] = input->rested[event->number] || rests;
    }
    return kind == JS_EVENT_BUTTON && event->number == 1 && event->value != 0 &&
           !(event->type & JS_EVENT_INIT);
}

/* Bool: the other end of a file from which nothing more came is gone. */
static int is_gone(int file) {
    struct pollfd asked = {file, POLLIN, 0};
    return poll(&asked, 1, 0) > 0 && (asked.revents & (POLLHUP | POLLERR | POLLNVAL));
}

static int poll_gamepad(Input *input) {
    const ssize_t whole = sizeof(struct js_event);
    struct js_event event;
    ssize_t got = whole;
    int damp = 0;
    for (int i = 0; i < EVENTS && got == whole; i++) {
        got = read(input->gamepad, &event, sizeof event);
        damp = (got == whole && take_event(input, &event)) || damp;
    }
    if (got != whole && is_gone(input->gamepad)) {
        close(input->gamepad);
        input->gamepad = -1;
        stand(input);
    }
    return damp;
}

static int poll_keys(Input *input) {
    char key;
    struct pollfd terminal = {STDIN_FILENO, POLLIN, 0};
    int more = 1, damp = 0;
    for (int i = 0; i < EVENTS && more; i++) {
        more = poll(&terminal, 1, 0) > 0 && read(STDIN_FILENO, &key, 1) == 1;
        damp = (more && take_key(input, key)) || damp;
    }
    if (!more && is_gone(STDIN_FILENO)) {
        input->keys = 0;
        stand(input);
    }
    return damp;
}

int input_poll(Input *input) {
    const int key = input->keys && poll_keys(input);
    const int button = input->gamepad >= 0 && poll_gamepad(input);
    return key || button;
}

void input_close(Input *input) {
    if (input->keys) {
        tcsetattr(STDIN_FILENO, TCSANOW, &input->before);
    }
    if (input->gamepad >= 0) {
        close(input->gamepad);
    }
}
