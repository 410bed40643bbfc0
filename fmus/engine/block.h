/* C interface for blocks of macro steps: what the Python master does in one step after the other (cosim/master.py), for
   subsystems that are instances of FMUs, without Python in between. Numbers are the same to the last bit.

   The master owns all memory; whatever is not const is read and written, so that it can go on from there. */
#ifndef TCA_BLOCK_H
#define TCA_BLOCK_H

#include "engine/engine.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  size_t source; /* node */
  int method;    /* TCA_CONSTANT, TCA_LINE or TCA_CUBIC */
  size_t size;
  const size_t *outputs, *inputs; /* (size) indices of the source's outputs and of the target's inputs */
} TcaGroup;                       /* links of one kind from one node to another */

typedef struct {
  void *set_real, *set_input_derivatives, *get_real, *get_output_derivatives, *do_step, *get_state, *set_state;
  void* component; /* null: the outputs stay as they are */
  size_t inputs, outputs, recorded;
  const unsigned *input_references, *output_references, *recorded_references;
  int needs_rates;       /* whether samples have time derivatives */
  int takes_polynomials; /* whether it takes derivatives of inputs */
  int accepted_degree;   /* highest order of those */
  size_t varying;        /* inputs that signals change from step to step */
  const size_t* varying_columns;
  size_t upstream, forward, torn; /* groups from components before, from nodes before it in the sweep, and guessed */
  const TcaGroup *upstream_group, *forward_group, *torn_group;

  double* polynomials; /* (4, inputs) of the step to come */
  double* sent;        /* (4, inputs) constant ones that the FMU has, where has_sent */
  int has_sent;
  int degree;      /* highest order of derivatives sent so far */
  double* samples; /* (3, 1 + 2 outputs) time, values and rates, from old to new */
  void** state;    /* handle of the state at the start of a step */
  double seconds;  /* spent in it */
  size_t restores; /* states restored */
} TcaNode;

enum { TCA_LEAST = 3, TCA_SOLUTIONS = 6 }; /* solutions that a guess needs, and that are kept for it */

typedef struct {
  size_t first, count; /* its nodes, in the order of a sweep */
  size_t size;         /* unknowns n: outputs that are guessed; 0: there is no loop */
  size_t sources;      /* nodes that have them */
  const size_t* source;
  const size_t* source_size; /* (sources) */
  const size_t* output;      /* (n) index of each among its node's outputs, source after source */
  const double* scale;       /* (n) nominals */
  double* columns;           /* (n, 2n) secants, newest first */
  double* combined;          /* (n, 2n) combinations of them with orthonormal differences of residuals */
  size_t kept;               /* how many there are */
  double* times;             /* (TCA_SOLUTIONS) of the last solutions of the loop, from old to new [s] */
  double* solutions;         /* (TCA_SOLUTIONS, n) */
  size_t solved;             /* how many there are; a block begins with TCA_LEAST at least */
} TcaComponent;

typedef struct {
  size_t nodes;
  TcaNode* node; /* component after component */
  size_t components;
  TcaComponent* component;
  TcaBlas blas;
  double tolerance; /* of the coupling error, share of the nominals */
  double radius;    /* largest distance of a guess from the start of a step, in nominals */
  size_t max_sweeps;
} TcaBlock;

typedef struct {
  size_t steps;
  const double *times, *lengths, *ends; /* (steps) [s] */
  const double* signals;                /* (steps, 4, varying inputs of all nodes) */
  double limit;                         /* wall time after which no other step is begun [s] */
  double* records;                      /* (steps, recorded of all nodes) */
  double* logs;                         /* (steps, 3) sweeps, residual and error */
  double* combined;                     /* (steps, n, 2n) secants of the last loop after each step */
  size_t* kept;                         /* (steps) */
  double seconds, recording_seconds;    /* of all steps, and of it for records */
  int failed;                           /* whether a step failed, in place of the time being over */
} TcaSteps;

/* Takes steps until one fails, or the time is over. Returns how many. A step that fails in any way, or with a warning,
   leaves everything as it was before, so that the master can take it. -1: a state could not be restored. */
TCA_EXPORT long tca_take_steps(TcaBlock* block, TcaSteps* steps);

/* Takes steps of one node without driven inputs, as a host does that never goes back: no state is saved. Returns how
   many; where that is not all, the next one failed. */
TCA_EXPORT size_t tca_step_alone(const TcaNode* node, const TcaSteps* steps);

/* Sum of the sizes of the structures above, and of TCA_INTERFACE as in tca_plan_layout(). */
TCA_EXPORT size_t tca_layout(void);

/* What tca_take_steps does with secants, for the check that it rounds as the master: adds the difference (dx, dr) of n
   unknowns and writes the secant step and the rest (2n) for the residual r. */
TCA_EXPORT void tca_secants(const TcaBlas* blas, TcaComponent* loop, const double* dx, const double* dr,
                            const double* r, double* split);

/* The same for the cubic (4, outputs) of two samples. */
TCA_EXPORT void tca_cubic(const TcaBlas* blas, size_t outputs, const double* from, const double* to, double* cubic);

/* Euclidean norm (n), correctly rounded but for one case in 10^15. */
TCA_EXPORT double tca_norm(const double* v, size_t n);

#ifdef __cplusplus
}
#endif
#endif
