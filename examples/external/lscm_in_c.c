/* A complete solver in C, least squares conformal maps: OBJ in, OBJ with UVs out. No library.
 *
 *     cc -O2 -o lscm_in_c lscm_in_c.c -lm
 *     cembench validate --command './lscm_in_c {input} {output}' \
 *         --program target='free boundary' --program 'seconds=solve: (\S+) s'
 */
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <time.h>

enum { MOST = 1000000 };
static double P[MOST][3], w[MOST][3];             /* points; half cotangents of the corners */
static long long out[MOST], squares[MOST];        /* next - previous on the boundary; of squares */
static double complex z[MOST], r[MOST], p[MOST], q[MOST];
static int f[MOST][3], n, m, pins[2];

static double away(const double *a, const double *b) {
    return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

/* y = half the gradient of E_C = E_D - A at x, zero at the pins; returns <x, y>. */
static double gradient(const double complex *x, double complex *y) {
    double sum = 0;
    for (int i = 0; i < n; i++) {
        int ends = out[i] ? squares[i] / out[i] : 0;    /* next + previous, counted from 0 */
        y[i] = out[i] ? 0.5 * I * (x[(ends + out[i]) / 2] - x[(ends - out[i]) / 2]) : 0;
    }
    for (int t = 0; t < m; t++)
        for (int k = 0; k < 3; k++) {
            int i = f[t][(k + 1) % 3], j = f[t][(k + 2) % 3];
            y[i] += w[t][k] * (x[i] - x[j]), y[j] += w[t][k] * (x[j] - x[i]);
        }
    y[pins[0]] = y[pins[1]] = 0;
    for (int i = 0; i < n; i++) sum += creal(conj(x[i]) * y[i]);
    return sum;
}

int main(int count, char **words) {
    char line[1000];
    double mean[3] = {0}, rr = 0, first;
    FILE *file = count > 2 ? fopen(words[1], "r") : NULL;
    if (!file) return fprintf(stderr, "usage: lscm_in_c IN.obj OUT.obj\n"), 2;
    while (fgets(line, sizeof line, file) && n < MOST && m < MOST)
        if (sscanf(line, "v %lf %lf %lf", P[n], P[n] + 1, P[n] + 2) == 3) n++;
        else if (sscanf(line, "f %d %d %d", f[m], f[m] + 1, f[m] + 2) == 3)
            f[m][0]--, f[m][1]--, f[m++][2]--;
    clock_t start = clock();
    for (int t = 0; t < m; t++)
        for (int k = 0; k < 3; k++) {       /* the lengths of the edges; twins cancel in the sums */
            int i = f[t][k], j = f[t][(k + 1) % 3], h = f[t][(k + 2) % 3];
            double a = away(P[i], P[j]), b = away(P[i], P[h]), c = away(P[j], P[h]);
            double s = (a + b + c) / 2, area = sqrt(s * (s - a) * (s - b) * (s - c));
            w[t][k] = (a * a + b * b - c * c) / (8 * area);
            out[i] += j - h, squares[i] += (long long)j * j - (long long)h * h;
        }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) mean[k] += P[i][k] / n;
    for (int k = 0; k < 2; k++) {           /* the pins: far apart on the boundary */
        const double *from = k ? P[pins[0]] : mean;
        for (int i = 0; i < n; i++)
            if (out[i] && (!out[pins[k]] || away(P[i], from) > away(P[pins[k]], from))) pins[k] = i;
    }
    z[pins[0]] = -1, z[pins[1]] = 1;
    gradient(z, r);                         /* conjugate gradients from there */
    for (int i = 0; i < n; i++) p[i] = r[i] = -r[i], rr += creal(conj(r[i]) * r[i]);
    first = rr;
    for (int k = 0; k < 20 * n && rr > 1e-26 * first; k++) {
        double a = rr / gradient(p, q), before = rr;
        for (int i = rr = 0; i < n; i++)
            z[i] += a * p[i], r[i] -= a * q[i], rr += creal(conj(r[i]) * r[i]);
        for (int i = 0; i < n; i++) p[i] = r[i] + rr / before * p[i];
    }
    printf("solve: %.9f s\n", (double)(clock() - start) / CLOCKS_PER_SEC);
    if (!(file = fopen(words[2], "w"))) return perror(words[2]), 1;
    for (int i = 0; i < n; i++) fprintf(file, "v %.17g %.17g %.17g\n", P[i][0], P[i][1], P[i][2]);
    for (int i = 0; i < n; i++) fprintf(file, "vt %.17g %.17g\n", creal(z[i]), cimag(z[i]));
    for (int t = 0; t < m; t++) {
        for (int k = 0; k < 3; k++) fprintf(file, "%s%d/%d", k ? " " : "f ", f[t][k] + 1, f[t][k] + 1);
        fprintf(file, "\n");
    }
    return fclose(file) ? 1 : 0;
}
