/* grains_draw: pictures of spheres. Reads frames from standard input, writes each as RGB bytes.
 *
 * A frame: camera's place 3, its right, up and forward 9, focal length [pixels], width, height, and
 * the number n of spheres, 16 floats; then n spheres: place 3, radius, normal 3 (0: that of a
 * sphere), and its colour as red + 256 green + 65536 blue, 8 floats. Of overlapping ones the
 * nearest is seen. */
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

struct Camera {
    float eye[3], right[3], up[3], forward[3], focal, width, height, count;
};

struct Sphere {
    float at[3], radius, normal[3], colour;
};

struct Picture {
    int width, height;
    std::vector<float> depth;
    std::vector<uint8_t> rgb;
};

static const float light[3] = {0.35f, -0.45f, 0.82f};
static const float sky[3] = {236, 240, 244};

static float dot(const float *a, const float *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void paint(Picture *p, int x, int y, const float *normal, float colour) {
    const float lit = 0.42f + 0.58f * fmaxf(dot(normal, light), 0.0f);
    const uint32_t bits = (uint32_t)colour;
    uint8_t *out = &p->rgb[3 * ((size_t)y * (size_t)p->width + (size_t)x)];
    for (int k = 0; k < 3; k++) {
        out[k] = (uint8_t)(lit * (float)(bits >> 8 * k & 255u));
    }
}

static void draw(Picture *p, const Camera &c, const Sphere &s) {
    const float d[3] = {s.at[0] - c.eye[0], s.at[1] - c.eye[1], s.at[2] - c.eye[2]};
    const float z = dot(d, c.forward);
    if (z < 0.05f) {
        return;
    }
    const float size = c.focal / z, r = fmaxf(size * s.radius, 0.6f);
    const float x = 0.5f * c.width + size * dot(d, c.right);
    const float y = 0.5f * c.height - size * dot(d, c.up);
    const bool flat = dot(s.normal, s.normal) > 0.0f;
    const int x0 = (int)fmaxf(ceilf(x - r), 0), x1 = (int)fminf(floorf(x + r), c.width - 1);
    const int y0 = (int)fmaxf(ceilf(y - r), 0), y1 = (int)fminf(floorf(y + r), c.height - 1);
    for (int py = y0; py <= y1; py++) {
        for (int px = x0; px <= x1; px++) {
            const float a = ((float)px - x) / r, b = (y - (float)py) / r, square = a * a + b * b;
            if (square > 1.0f) {
                continue;
            }
            const float front = sqrtf(1.0f - square), near = z - front * s.radius;
            float &depth = p->depth[(size_t)py * (size_t)p->width + (size_t)px];
            if (near >= depth) {
                continue;
            }
            depth = near;
            float normal[3];
            for (int k = 0; k < 3; k++) {
                normal[k] =
                    flat ? s.normal[k] : a * c.right[k] + b * c.up[k] - front * c.forward[k];
            }
            paint(p, px, py, normal, s.colour);
        }
    }
}

int main() {
    Camera c;
    std::vector<Sphere> spheres;
    Picture p = {};
    while (fread(&c, sizeof c, 1, stdin) == 1) {
        p.width = (int)c.width;
        p.height = (int)c.height;
        const size_t pixels = (size_t)p.width * (size_t)p.height;
        p.depth.assign(pixels, 1e9f);
        p.rgb.resize(3 * pixels);
        for (size_t i = 0; i < 3 * pixels; i++) {
            p.rgb[i] = (uint8_t)sky[i % 3];
        }
        spheres.resize((size_t)c.count);
        if (fread(spheres.data(), sizeof(Sphere), spheres.size(), stdin) != spheres.size()) {
            fprintf(stderr, "grains_draw: a frame ends before its spheres\n");
            return 2;
        }
        for (const Sphere &s : spheres) {
            draw(&p, c, s);
        }
        if (fwrite(p.rgb.data(), 1, p.rgb.size(), stdout) != p.rgb.size() || fflush(stdout)) {
            return 1;
        }
    }
    return 0;
}
