/* CHOLMOD on one system: analyse once, then factor and solve in rounds.
 *
 *   cholmod PREFIX ROUNDS own|given
 *
 * reads PREFIX.mtx, PREFIX_rhs.mtx and, for "given", PREFIX_order.txt; writes the last solution (doubles) to
 * PREFIX_cholmod.x; prints one JSON object. The first round is a warm-up and is not printed.
 *
 *   cc -O2 cholmod.c -I/usr/include/suitesparse -lcholmod -ldl -o cholmod
 */
#define _GNU_SOURCE
#include <cholmod.h>
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double seconds(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static double now(void) { return seconds(CLOCK_MONOTONIC); }

static FILE *open_file(const char *prefix, const char *ending, const char *mode) {
    char path[4096];
    snprintf(path, sizeof path, "%s%s", prefix, ending);
    FILE *file = fopen(path, mode);
    if (!file) {
        perror(path);
        exit(1);
    }
    return file;
}

static int *read_order(const char *prefix, size_t n) {
    int *order = malloc(n * sizeof *order);
    FILE *file = open_file(prefix, "_order.txt", "r");
    for (size_t i = 0; i < n; i++) {
        if (fscanf(file, "%d", &order[i]) != 1) {
            fprintf(stderr, "the order is too short\n");
            exit(1);
        }
    }
    fclose(file);
    return order;
}

static void print_list(const char *name, const double *values, int count) {
    printf("\"%s\": [", name);
    for (int i = 0; i < count; i++) printf("%s%.6e", i ? ", " : "", values[i]);
    printf("], ");
}

int main(int count, char **words) {
    if (count != 4) {
        fprintf(stderr, "cholmod PREFIX ROUNDS own|given\n");
        return 1;
    }
    const char *prefix = words[1];
    int rounds = atoi(words[2]);
    cholmod_common c;
    cholmod_start(&c);
    c.supernodal = CHOLMOD_SUPERNODAL;
    c.final_ll = 1;
    cholmod_sparse *lower = cholmod_read_sparse(open_file(prefix, ".mtx", "r"), &c);
    /* the upper triangle is what the supernodal code permutes in one pass */
    cholmod_sparse *a = cholmod_copy(lower, 1, 1, &c);
    cholmod_dense *b = cholmod_read_dense(open_file(prefix, "_rhs.mtx", "r"), &c);

    double start = now();
    cholmod_factor *l;
    if (!strcmp(words[3], "given")) {
        int *order = read_order(prefix, a->nrow);
        c.nmethods = 1;
        c.method[0].ordering = CHOLMOD_GIVEN;
        start = now();
        l = cholmod_analyze_p(a, order, NULL, 0, &c);
    } else {
        l = cholmod_analyze(a, &c);
    }
    double analyse = now() - start;

    double *factor = calloc(rounds, sizeof *factor), *solve = calloc(rounds, sizeof *solve);
    double *processor = calloc(rounds, sizeof *processor);
    cholmod_dense *x = NULL, *y = NULL, *e = NULL;
    for (int round = -1; round < rounds; round++) {
        double t0 = now(), p0 = seconds(CLOCK_PROCESS_CPUTIME_ID);
        if (!cholmod_factorize(a, l, &c) || c.status != CHOLMOD_OK) {
            fprintf(stderr, "not positive definite\n");
            return 1;
        }
        double t1 = now();
        cholmod_solve2(CHOLMOD_A, l, b, NULL, &x, NULL, &y, &e, &c);
        double t2 = now();
        if (round >= 0) {
            factor[round] = t1 - t0;
            solve[round] = t2 - t1;
            processor[round] = seconds(CLOCK_PROCESS_CPUTIME_ID) - p0;
        }
    }
    FILE *out = open_file(prefix, "_cholmod.x", "wb");
    fwrite(x->x, sizeof(double), a->nrow, out);
    fclose(out);

    char *(*core)(void) = (char *(*)(void))dlsym(RTLD_DEFAULT, "openblas_get_corename");
    printf("{\"analyse\": %.6e, ", analyse);
    print_list("refactor", factor, rounds);
    print_list("solve", solve, rounds);
    print_list("processor", processor, rounds);
    printf("\"factor_bytes\": %.0f, \"flop\": %.6e, \"kernel\": \"CHOLMOD %d.%d.%d, BLAS %s\"}\n", 8.0 * l->xsize, c.fl,
           CHOLMOD_MAIN_VERSION, CHOLMOD_SUB_VERSION, CHOLMOD_SUBSUB_VERSION, core ? core() : "unknown");
    return 0;
}
