#include "ground/law.h"

MildElementLaw mild_element_law(const MildMaterial *material, double pitch, double depth) {
    Law law = law_of(material, pitch);
    double t = fmin(depth * law.inverse_full, 1.0), open = 1.0 - t;
    double p = law.full * t * (1.0 - t + t * t / 3.0), in_bed = depth - law.bed;
    MildElementLaw result;
    result.force = law.flat * p + law.cone * depth + law.bed_stiffness * fmax(in_bed, 0.0);
    result.stiffness = law.flat * open * open + law.cone + (in_bed > 0.0 ? law.bed_stiffness : 0.0);
    result.added_mass = law.mass * p;
    result.added_mass_per_depth = law.mass * open * open;
    return result;
}
