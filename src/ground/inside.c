#include "ground/inside.h"

#include "ground/element_law.h"
#include "ground/models.h"

InsideLaw mild_inside_law(const MildMaterial *material, double pitch, double width) {
    const Law law = law_of(material, pitch, width);
    return (InsideLaw){
        .law = law,
        .recovery = law_recovery(&law, recovery_of(material)),
        .curves = curves_of(material, &law) | model_row(material->model)->motion,
    };
}

Memory mild_inside_memory(const MildGround *ground, int foot) {
    return ground_memory(ground, foot);
}

MapView mild_inside_map(const MildMap *map) {
    return map_view(map);
}
