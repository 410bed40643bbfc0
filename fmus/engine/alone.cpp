// Steps of one node alone, as a host takes them that never goes back.
#include <fmi2FunctionTypes.h>

#include "engine/block.h"

size_t tca_step_alone(const TcaNode* node, const TcaSteps* steps) {
  const auto do_step = reinterpret_cast<fmi2DoStepTYPE*>(node->do_step);
  const auto get_real = reinterpret_cast<fmi2GetRealTYPE*>(node->get_real);
  double* row = steps->records;
  for (size_t k = 0; k < steps->steps; ++k, row += node->recorded) {
    if (do_step(node->component, steps->times[k], steps->lengths[k], fmi2True) > fmi2Warning) return k;
    if (get_real(node->component, node->recorded_references, node->recorded, row) > fmi2Warning) return k;
  }
  return steps->steps;
}
