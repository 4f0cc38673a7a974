#include "ground/step/inside.h"

#include "ground/law/models.h"
#include "ground/step/step.h"

InsideLaw mild_inside_law(const MildMaterial *material, double pitch, double width) {
    const SlotLaw slot = material_law(material, pitch, width, width);
    return (InsideLaw){
        .law = slot.law,
        .share = slot.share,
        .k_drift = slot.k_drift,
        .b_drift = slot.b_drift,
        .recovery = law_recovery(&slot.law, slot.recovery),
        .curves = curves_of(material, &slot.law) | model_row(material->model)->motion,
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
