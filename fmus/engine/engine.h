/* C interface of the engine: a scene, run many times in one call, one instance of every FMU per thread. Plain arrays in
   and out; rows of inputs and outputs are those of the Python package (tca_cosim.batch).

   A member's inputs over a step are polynomials c0 + c1 s + c2 s^2/2 + c3 s^3/6 of the time s since its start. */
#ifndef TCA_ENGINE_H
#define TCA_ENGINE_H

#include <stddef.h>

#ifdef _WIN32
#define TCA_EXPORT __declspec(dllexport)
#else
#define TCA_EXPORT __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Raised when parameters of a function change, which the sizes of structures do not show; also in engine_library.py. */
enum { TCA_INTERFACE = 2 };

enum { TCA_CONSTANT, TCA_LINE, TCA_PARABOLA, TCA_CUBIC }; /* polynomials of a connected input, by degree */

typedef struct {
  size_t source, output; /* member and index of its output */
  size_t input;          /* index of the target's input */
  int method;            /* one of the above */
  int torn;              /* whether its end value is guessed: the source is stepped later in a sweep */
} TcaLink;

typedef struct {
  size_t size;
  const unsigned* references;
  const void* values; /* double, int or const char*, as the function that sets them takes them */
} TcaValues;

typedef struct {
  const char *name, *library, *guid, *resources;
  TcaValues reals, integers, booleans, strings; /* parameters of all runs */
  size_t varied;                                /* parameters of each run, all Real */
  const unsigned* varied_references;
  const size_t* varied_columns; /* in the table of parameters */
  size_t inputs, outputs, recorded;
  const unsigned *input_references, *output_references, *recorded_references;
  size_t links;
  const TcaLink* link;
  int needs_rates;  /* whether time derivatives of the outputs are used */
  int input_degree; /* highest order of input derivatives that the FMU takes */
} TcaMember;

typedef struct {
  void *gemv, *gemm, *dot; /* of the BLAS that numpy uses: their rounding depends on machine and version; null: plain
                              sums */
  int long_integers;       /* whether their sizes are of 64 bits */
} TcaBlas;

typedef struct {
  size_t first, count;           /* members, in the order of a sweep */
  size_t unknowns;               /* outputs that torn links guess; 0: there is no algebraic loop */
  const size_t *source, *output; /* (unknowns) member and index of its output */
  const double* nominals;        /* (unknowns) of these outputs */
} TcaPart;

typedef struct {
  size_t members;
  const TcaMember* member; /* in the order of a step: but for torn links, sources before targets */
  size_t parts;
  const TcaPart* part;       /* strongly connected, in the order of a step; they make up all members */
  double coupling_tolerance; /* of the error of a loop, share of the nominals */
  double reach;              /* largest distance of a guess from the start of a step, in nominals */
  size_t max_sweeps;
  TcaBlas blas;
  double start, stop, tolerance; /* [s], [s], relative; tolerance 0: each FMU's own */
  size_t steps;
  const double *times, *lengths; /* (steps) start and length of each step [s] */
  const double* ends;            /* (steps) [s] */
  const unsigned char* events;   /* (steps) whether inputs jump at the end of the step */
  const double* polynomials;     /* (steps, 4, inputs of all members): of signals, 0 elsewhere */
  const double* starts;          /* (steps + 1, 2, inputs of all members): values and slopes after each event; before
                                    the first step also what torn links guess at first */
  size_t driven;                 /* inputs that each run has of its own, held over a step */
  const size_t* driven_columns;  /* among the inputs of all members */
} TcaPlan;

/* What a caller in another thread and a long call tell each other. */
typedef struct {
  int stop;    /* set by the caller: end before the next step */
  size_t done; /* runs of tca_batch, or steps of tca_realtime, that have ended */
} TcaWatch;

/* Runs a plan `runs` times.
   parameters: (runs, columns); inputs: (runs, steps, driven) or null; outputs: (runs, steps + 1, recorded of all
   members), the first row at the start; failures, warnings: (runs, length) texts, empty where a run succeeded and where
   no FMU warned.
   Returns the number of runs that failed or were stopped, or -1 where no instance can be made: the reason is the first
   text. */
TCA_EXPORT int tca_batch(const TcaPlan* plan, size_t runs, size_t columns, const double* parameters,
                         const double* inputs, double* outputs, size_t threads, char* failures, char* warnings,
                         size_t length, TcaWatch* watch);

typedef struct {
  size_t steps, misses;  /* of the steps counted: those that ended after the next one was due */
  size_t own_misses;     /* those that had done so too, had the thread had its core from each due time on */
  size_t allocations;    /* calls of the allocator in them; 0 where engine/counting.cpp is not loaded */
  size_t sweeps;         /* most sweeps of a loop in one of them */
  double period;         /* [s]; given */
  double worst;          /* longest computation of a step [s] */
  double worst_lateness; /* of the beginning of a step after its due time [s] */
  int locked, scheduled; /* whether memory is locked, and whether the thread has a real-time priority */
  int core;              /* that it runs on alone; -1: any */
} TcaTimes;

/* Runs a plan once, each step when it is due: step k at k times the period after the start, or at once where the period
   is 0. times: period in, the others out; durations: (steps) [s] of each step's computation; busy: (steps) [s], the
   processor time of the thread in it, nan where the system has no such clock; fixed: (steps) [s] of an
   amount of work that is always the same and about as long as a step, done behind each step where the period leaves
   time for it, else nan: how it varies is the host's doing; warnings: of FMUs. Returns 0, or -1 with the reason. */
TCA_EXPORT int tca_realtime(const TcaPlan* plan, const double* parameters, double* outputs, double* durations,
                            double* busy, double* fixed, TcaTimes* times, char* failure, char* warnings, size_t length,
                            TcaWatch* watch);

/* Sum of the sizes of the structures above and of TCA_INTERFACE shifted by 20 bits, by which a caller of another
   version is told from one of this. */
TCA_EXPORT size_t tca_plan_layout(void);

#ifdef __cplusplus
}
#endif
#endif
