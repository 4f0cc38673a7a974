/* grains: beds of grains, and plates that are pressed, dragged, turned and dropped on them.
 * lab/grains/README.md says what it computes; lab/grains/run.py runs the list of cases. */
#include <chrono>

#include "record.h"
#include "walk.h"

static const char usage[] =
    "usage: grains [options] --case 'NAME SHAPE TILT STAGE...' [--case ...]\n"
    "\n"
    "Fills beds of grains, one for each seed, lets them settle, and runs each case on all of\n"
    "them, from the settled beds. Each gives FOLDER/NAME-SEED.csv. Rows are means over time.\n"
    "\n"
    "  --out FOLDER          where the CSVs go (default .)\n"
    "  --seeds A[-B]         one bed each (default 1)\n"
    "  --grain D             [m] mean diameter (default 0.005)\n"
    "  --spread S            diameters are uniform within this share of the mean (default 0.1)\n"
    "  --box L,W,H           [m] length and width, periodic, and depth (default 0.45,0.35,0.12)\n"
    "  --friction MU         between grains, and of walls and plates (default 0.5)\n"
    "  --rolling MU          rolling resistance (default 0)\n"
    "  --restitution E       (default 0.5)\n"
    "  --contact NAME        linear or hertz (default linear)\n"
    "  --stiffness K         [Pa] linear: normal stiffness over diameter; hertz: E/(1 - nu^2)/2\n"
    "                        (default 1e6)\n"
    "  --density RHO         [kg/m^3] of a grain (default 2500)\n"
    "  --steps N             time steps in the shortest collision (default 25)\n"
    "  --settle T            [s] time to settle, before levelling (default 0.5)\n"
    "  --bed FILE            a settled bed, lines of `x y z radius` [m]\n"
    "  --write-bed FILE      writes the first settled bed so\n"
    "  --rows N              about how many rows a record has (default 150)\n"
    "  --bands W             [m] writes FOLDER/NAME-SEED-bands.csv too: force up by bands of the\n"
    "                        bottom so wide, from its edge, under a sphere from its middle\n"
    "  --case TEXT           a case; stages are press:DEPTH@SPEED, drag:PATH@SPEED,\n"
    "                        load:PATH@SPEED, swipe:DEG@RATE, hold:T, drop:MASS@SPEED,T,\n"
    "                        move:VX,VY,VZ,PITCH,YAW,T[,MASS];\n"
    "                        shapes are disc:D, rect:L,W, polygon:X,Y,..., sphere:R\n"
    "\n"
    "Under a robot, as COMMAND of `mild eval --program COMMAND` (README.md): no case, and\n"
    "  --sole SHAPE          outline of the first foot's sole, in the foot's frame\n"
    "  --sole-z Z            [m] height of the sole in the foot's frame (default 0)\n"
    "  --sole-height H       [m] of the block that the foot is (default 0.06)\n"
    "  --sides S,S...        of each foot: 1, or -1 for the mirror image (default 1,-1)\n"
    "  --track L             [m] length of the way (default 4)\n"
    "  --reach R             [m] grains nearer to the middle of a sole move (default 0.3)\n"
    "  --frames F            [1/s] pictures of the grains (default 25)\n"
    "A bed of --box for each foot settles, and is put behind itself until the way is long enough.\n"
    "Writes FOLDER/beds-TRIAL.bin, frames-TRIAL.bin and walk-TRIAL.json.\n";

struct Options {
    BedDef bed;
    std::string out = ".", write_bed;
    int rows = 150;
    float band = 0;
    std::vector<Case> cases;
    WalkDef walk;
};

struct FloatOption {
    const char *name;
    float BedDef::*value;
    double least, most;
};

static const FloatOption float_options[] = {
    {"--grain", &BedDef::grain, 1e-5, 1},     {"--spread", &BedDef::spread, 0, 0.9},
    {"--friction", &BedDef::friction, 0, 10}, {"--rolling", &BedDef::rolling, 0, 10},
    {"--density", &BedDef::density, 1, 1e5},  {"--restitution", &BedDef::restitution, 0.01, 1},
    {"--steps", &BedDef::steps, 1, 1e4},      {"--stiffness", &BedDef::stiffness, 1, 1e13},
    {"--settle", &BedDef::settle, 0, 1e3}};

/* A number within a range. */
static double number_within(const std::string &name, const std::string &value, double least,
                            double most) {
    const double x = number(value, name);
    if (!(x >= least && x <= most)) {
        char range[80];
        snprintf(range, sizeof range, " is outside %g .. %g", least, most);
        stop(name.c_str(), (" " + value + range).c_str());
    }
    return x;
}

static bool option_float(BedDef *def, const std::string &name, const std::string &value) {
    for (const FloatOption &option : float_options) {
        if (name == option.name) {
            def->*option.value = (float)number_within(name, value, option.least, option.most);
            return true;
        }
    }
    return false;
}

static void option_seeds(BedDef *def, const std::string &value) {
    const std::vector<std::string> part = words(value, "-");
    const std::string begin = part.empty() ? "" : part[0];
    const long first = (long)number_within("--seeds", begin, 0, 1e9);
    const long last = part.size() > 1 ? (long)number_within("--seeds", part[1], 0, 1e9) : first;
    if (part.size() > 2 || last < first || last - first > 63) {
        stop("--seeds: A or A-B, up to 64 of them");
    }
    def->seeds.clear();
    for (long s = first; s <= last; s++) {
        def->seeds.push_back((uint64_t)s);
    }
}

static void option_box(BedDef *def, const std::string &value) {
    const std::vector<double> v = numbers(":" + value);
    if (v.size() != 3 || !(v[0] > 0 && v[1] > 0 && v[2] > 0)) {
        stop("--box: L,W,H, each above 0, not ", value.c_str());
    }
    def->length = (float)v[0];
    def->width = (float)v[1];
    def->depth = (float)v[2];
}

/* Bool: it is one of a walk. */
static bool option_walk(WalkDef *walk, const std::string &name, const std::string &value) {
    if (name == "--sole") {
        walk->shape = shape_read(value);
        if (walk->shape.points == 0) {
            stop("--sole: an outline, not ", value.c_str());
        }
    } else if (name == "--sides") {
        walk->sides = numbers(":" + value);
        if (walk->sides.empty() || walk->sides.size() > RANGE_BEDS) {
            stop("--sides: one to four numbers");
        }
    } else if (name == "--sole-z") {
        walk->sole_z = number(value, name);
    } else if (name == "--sole-height") {
        walk->height = (float)number(value, name);
    } else if (name == "--track") {
        walk->track = number(value, name);
    } else if (name == "--reach") {
        walk->reach = number(value, name);
    } else if (name == "--frames") {
        walk->frames = number(value, name);
    } else {
        return false;
    }
    return true;
}

static void option_read(Options *o, const std::string &name, const std::string &value) {
    if (option_float(&o->bed, name, value) || option_walk(&o->walk, name, value)) {
        return;
    }
    if (name == "--out") {
        o->out = value;
    } else if (name == "--seeds") {
        option_seeds(&o->bed, value);
    } else if (name == "--box") {
        option_box(&o->bed, value);
    } else if (name == "--contact" && (value == "linear" || value == "hertz")) {
        o->bed.hertz = value == "hertz";
    } else if (name == "--bed") {
        o->bed.file = value;
    } else if (name == "--write-bed") {
        o->write_bed = value;
    } else if (name == "--rows") {
        o->rows = (int)number_within(name, value, 1, 1e6);
    } else if (name == "--bands") {
        o->band = (float)number_within(name, value, 1e-6, 1);
    } else if (name == "--case") {
        o->cases.push_back(case_read(value));
    } else {
        stop("no such option: ", (name + " " + value + "; see --help").c_str());
    }
}

static void bed_write(const Bed &bed, const std::string &file) {
    FILE *out = case_open(file, "");
    const std::vector<Place> place = bed_places(bed);
    for (int i = 0; i < bed.g.per; i++) {
        if (place[(size_t)i].radius > 0) {
            const Place &p = place[(size_t)i];
            fprintf(out, "%.9g %.9g %.9g %.9g\n", (double)p.x * (double)bed.g.unit.x,
                    (double)p.y * (double)bed.g.unit.y, (double)p.z * (double)bed.g.unit.z,
                    (double)p.radius);
        }
    }
    case_close(out, file);
}

static double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/* A line of JSON, which run.py keeps in the manifest. */
static void print_bed(const Bed &bed, double seconds) {
    printf("{\"bed\": {\"dt_s\": %.6g, \"steps\": %ld, \"lists\": %ld, \"seconds\": %.2f",
           (double)bed.g.law.dt, bed.steps, bed.lists, seconds);
    const auto list = [](const char *name, const std::vector<float> &values) {
        printf(", \"%s\": [", name);
        for (size_t k = 0; k < values.size(); k++) {
            printf("%s%.5g", k ? ", " : "", (double)values[k]);
        }
        printf("]");
    };
    list("surface_m", bed.surface);
    list("solid", bed.solid);
    list("grains", std::vector<float>(bed.filled.begin(), bed.filled.end()));
    printf("}}\n");
    fflush(stdout);
}

int main(int count, char **word) {
    Options o;
    for (int k = 1; k < count; k += 2) {
        if (!strcmp(word[k], "--help")) {
            fputs(usage, stdout);
            return 0;
        }
        option_read(&o, word[k], k + 1 < count ? word[k + 1] : "");
    }
    if (o.walk.shape.points > 0) {
        walk_run(o.bed, o.walk, o.out);
        return 0;
    }
    Bed bed;
    auto start = std::chrono::steady_clock::now();
    bed_open(&bed, o.bed);
    bed_settle(&bed);
    print_bed(bed, seconds_since(start));
    if (!o.write_bed.empty()) {
        bed_write(bed, o.write_bed);
    }
    const std::vector<char *> saved = bed_save(bed);
    for (Case &c : o.cases) {
        c.shape.band = o.band;
        start = std::chrono::steady_clock::now();
        bed_restore(&bed, saved);
        case_run(&bed, c, o.rows, o.out);
        printf("{\"case\": \"%s\", \"steps\": %ld, \"seconds\": %.2f}\n", c.name.c_str(), bed.steps,
               seconds_since(start));
        fflush(stdout);
    }
    for (char *data : saved) {
        release(data);
    }
    bed_close(&bed);
    return 0;
}
