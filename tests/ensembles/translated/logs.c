/* Entries of a log, each lane at a place of its own. */
typedef struct entry { long number; real at, state[2]; } entry;
static const char *const names[2] = { "one", "two" };
static const real *rows(const real *u, real *part) { (void)part; return u; }
static long note(work *w, entry *log, long *used)
{
    long place = -1;
    int i;
    if (w->x[0] > K(0.2) && *used < 3) {
        place = (*used)++;
        log[place].number = w->n[0];
        log[place].at = w->x[1];
        for (i = 0; i < 2; ++i)
            log[place].state[i] = w->x[2 + i];
    }
    return place;
}
static void f(work *w)
{
    entry log[3];
    long used = w->n[1] > 2, place = -1;
    int turn, i;
    const real *u = rows(NULL, w->x);
    memset(log, 0, sizeof log);
    for (turn = 0; turn < 3; ++turn) {
        place = note(w, log, &used);
        w->x[0] = w->x[0] - K(0.5);
        w->x[1] = w->x[1] + (u == NULL ? K(1.5) : u[turn]);
        if (place >= 0)
            log[place].at = log[place].at * K(2.0) + log[place].state[1];
    }
    for (turn = 0; turn < 3; ++turn)
        for (i = 0; i < 2; ++i)
            w->x[2 + i] = w->x[2 + i] + (real)(turn + 1) * log[turn].state[i] + log[turn].at;
    w->n[2] = used;
    w->n[3] = place < 0 ? log[0].number : log[place].number + 10 * place;
}
