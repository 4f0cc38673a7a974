/* Private to the plugin: what the MJCF asks for. Attributes of the plugin are the keys of the
 * program: ground.KEY of MildMaterial, terrain.KEY of MildMapDef, and the ones below. */
#ifndef PLUGIN_DEF_H
#define PLUGIN_DEF_H

#include <mujoco/mujoco.h>

#include "mild/ground.h"

#define PLUGIN_NAME "mild.ground"
#define PLUGIN_TEXT_SIZE 1024
#define PLUGIN_OUTLINE_SIZE 16384

/* Section [plugin]: the attributes without a prefix. */
typedef struct {
    char feet[PLUGIN_TEXT_SIZE];       /* names of bodies or sites */
    char body[PLUGIN_TEXT_SIZE];       /* names of bodies that have elements all over */
    char sole[PLUGIN_TEXT_SIZE];       /* names of geoms */
    char outline[PLUGIN_OUTLINE_SIZE]; /* [m] polygons, one or one for each foot */
    char ground[PLUGIN_TEXT_SIZE];     /* presets and soils' files, by label of the pattern */
    double sole_z;                     /* [m] plane of the outline in the frame of the foot */
    double pitch;                      /* [m] edge of an element; 0: as the sole wants it */
    double body_pitch;                 /* [m] between the elements of a body */
    int elements;                      /* of a sole; 0: as many as fit */
    double height;                     /* [m] of the surface */
    int prints;                        /* tiles of imprints; 0: none */
    int surface;                       /* bool: level ground is drawn too */
    MildMapDef map;                    /* terrain.* */
} PluginDef;

extern const MildField plugin_fields[];
extern const int plugin_field_count;

/* All attributes, for mjpPlugin: [*count]. */
const char *const *plugin_attributes(int *count);

/* Text of an attribute of an instance; NULL when it is absent. */
const char *plugin_text(const mjModel *m, int instance, const char *attribute);

/* Reads everything but ground.*, which needs the soles. */
MildStatus plugin_def_read(const mjModel *m, int instance, PluginDef *def, MildError *error);
/* Lays the materials of `ground` in the terrain, as the commands of the program do: presets of
 * their own laws or matched to ground.model on the sole under `load` [N], then the keys ground.*.
 * sole: NULL without feet. */
MildStatus plugin_def_materials(const mjModel *m, int instance, const PluginDef *def,
                                const MildSole *sole, double load, MildTerrain *terrain,
                                MildError *error);
/* *model: of ground.model, or -1 without that key. *first: the same, or the first preset's. */
MildStatus plugin_def_model(const mjModel *m, int instance, const PluginDef *def, int *model,
                            MildModel *first, MildError *error);

/* Takes the next word from *text into `word` and moves *text behind it. Returns 0 at the end. A
 * longer word is cut off, and then names nothing. */
int plugin_word(const char **text, char *word, size_t size);

#endif
