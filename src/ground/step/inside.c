#include "ground/step/inside.h"

#include "ground/law/element_law.h"
#include "ground/law/models.h"

InsideLaw mild_inside_law(const MildMaterial *material, double pitch, double width) {
    const Law law = law_of(material, pitch, width);
    const Share share = share_of(material, pitch, width);
    const MildMaterial own = material_at(material, pitch);
    const int slips = share.slip_rate > 0.0; /* then path adds no resistance */
    return (InsideLaw){
        .law = law,
        .share = share,
        .k_drift = slips ? 0.0 : own.k_drift,
        .b_drift = slips ? 0.0 : own.b_drift,
        .recovery = law_recovery(&law, recovery_of(material)),
        .curves = curves_of(material, &law) | model_row(material->model)->motion,
    };
}

SoleHeap mild_inside_heap(const MildSole *sole, int element) {
    return sole_heap(sole, element);
}

Memory mild_inside_memory(const MildGround *ground, int foot) {
    return ground_memory(ground, foot);
}

MapView mild_inside_map(const MildMap *map) {
    return map_view(map);
}
