/* A function of a model for XLA; Python fills it. */
typedef int model_call(int function, long count, const double *const *inputs, const long *strides,
    double *const *outputs);

typedef struct {
    model_call *call;        /* of the model */
    model_call *lanes;       /* of the library in lanes, NULL before it is compiled */
    int function, of_lanes;  /* number of the function in both */
    int inputs, outputs;
    long sizes[32];          /* numbers of each input, then of each output */
    long least;              /* samples from which on lanes are used */
    long share;              /* samples of a thread at least */
    int threads;             /* at most */
    size_t stack;            /* bytes of stack of a thread; 0: a thread of the caller has enough */
    const void *card;        /* kernels on cards; NULL: without */
} eomgen_term;
