/* One tick of the controller of a haploop scene: the arithmetic of haploop.controller, in the same order, so that it
   comes to the same bits. To be compiled without fused multiply-adds (-ffp-contract=off) and without fast-math.
   What is the scene's own stands in scene.h, and its numbers in VALUES, a variable's value at its reference. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum Estimate { UNCHANGED, DIFFERENCE, WINDOW, END_FIT, BEST_FIT, KALMAN, FUSED_KALMAN };
enum Element { DAMPING, UNIDIRECTIONAL_DAMPING, BIDIRECTIONAL_INERTIA, UNIDIRECTIONAL_INERTIA };
enum Input { OF_VELOCITY, OF_ACCELEROMETER, OF_KALMAN };

/* low_pass: gain of the first-order low-pass behind it, 0 for none. gain: of the position in x, v and a, then of the
   accelerometer's reading. */
struct Estimator { enum Estimate kind; int ticks; double bound, low_pass, gain[6]; };
struct ActiveElement { enum Element kind; bool always; int parameter; };

#include "scene.h"

/* recent: inputs, the newest first. x, v, a: what a Kalman filter predicts; x is also the last input of a difference.
   y: of the low-pass. */
struct Memory { double x, v, a, y, recent[MOST_TICKS]; int age; };

/* A plain structure without pointers: a copy of it is all that there is to go on from.
   step: plant steps since the start. commands: the newest ones, that of tick k at k % COMMANDS.
   position_is_new: a position was set since the last step. */
struct State {
    int64_t step;
    double start_s, a_before, values[VARIABLES], commands[COMMANDS];
    struct Memory velocity, acceleration;
    bool position_is_new;
};

static double raw_estimate(const struct Estimator *of, struct Memory *m, double u, double reading)
{
    double rate = u - u, total = rate, moment = rate, least = -INFINITY, most = INFINITY;
    double reach = of->bound * (1.0 + 1e-6);
    switch (of->kind) {
    case UNCHANGED:
        return u;
    case DIFFERENCE:
        rate = (u - m->x) / PERIOD_S;
        m->x = u;
        return rate;
    case WINDOW:
        rate = (u - m->recent[of->ticks - 1]) / ((m->age + (m->age < 1)) * PERIOD_S);
        m->age += m->age < of->ticks;
        break;
    case END_FIT:
    case BEST_FIT:
        for (int64_t i = 1; i <= of->ticks; i++) {
            double rise = u - m->recent[i - 1], slope = rise / i, low = (rise - reach) / i, high = (rise + reach) / i;
            bool fits = least <= slope && slope <= most;
            total = total + rise;
            moment = moment + i * rise;
            if (fits && of->kind == END_FIT)
                rate = rise / (i * PERIOD_S);
            else if (fits)
                rate = 6.0 * (2.0 * moment - i * total) / (i * (i + 1) * (i + 2) * PERIOD_S);
            least = low > least ? low : least;
            most = high < most ? high : most;
        }
        break;
    case KALMAN:
    case FUSED_KALMAN: {
        const double *g = of->gain, *h = of->gain + 3;
        double s = u - m->x, s_a = reading - m->a, v, a, x;
        bool fused = of->kind == FUSED_KALMAN;
        v = fused ? m->v + g[1] * s + h[1] * s_a : m->v + g[1] * s;
        a = fused ? m->a + g[2] * s + h[2] * s_a : m->a + g[2] * s;
        x = fused ? m->x + g[0] * s + h[0] * s_a : m->x + g[0] * s;
        m->x = x + PERIOD_S * v + PERIOD_S * PERIOD_S / 2.0 * a;
        m->v = v + PERIOD_S * a;
        m->a = a;
        return v;
    }
    }
    memmove(m->recent + 1, m->recent, (of->ticks - 1) * sizeof(double));
    m->recent[0] = u;
    return rate;
}

static double estimate(const struct Estimator *of, struct Memory *m, double u, double reading)
{
    double raw = raw_estimate(of, m, u, reading);
    if (of->low_pass == 0.0)
        return raw;
    return m->y = m->y + of->low_pass * (raw - m->y);
}

/* Begins with the first input; a low-pass begins with the first estimate. */
static void begin(const struct Estimator *of, struct Memory *m, double u, double reading)
{
    bool fits = of->kind == END_FIT || of->kind == BEST_FIT;
    m->x = u;
    m->v = m->a = 0.0 * u;
    m->age = 0;
    if (of->kind == FUSED_KALMAN)
        m->a = reading;
    for (int i = 0; i < of->ticks; i++)
        m->recent[i] = fits ? u * NAN : u;
    struct Memory ahead = *m;
    m->y = raw_estimate(of, &ahead, u, reading);
}

static double element_force(struct ActiveElement of, double parameter, double v, double a, double a_before)
{
    switch (of.kind) {
    case DAMPING:
        return -parameter * v;
    case UNIDIRECTIONAL_DAMPING:
        return v * INWARD > 0.0 ? -parameter * v : 0.0;
    case BIDIRECTIONAL_INERTIA:
        return -parameter * a;
    case UNIDIRECTIONAL_INERTIA:
        return v * a_before >= 0.0 ? -parameter * a : 0.0;
    }
    return NAN;
}

/* The encoder's count, where there is one: 0 takes the position as it comes. */
static double measured(double x, double count)
{
    return count > 0.0 ? count * (ENCODER_ROUNDING(x / count) + 0.0) : x;
}

/* Returns the command in N that answers the present inputs. */
static double tick(struct State *s)
{
    double reading = ACCELERATION ? s->values[ACCELERATION] : 0.0;
    double x = measured(s->values[POSITION], ENCODER_RESOLUTION ? s->values[ENCODER_RESOLUTION] : 0.0);
    if (s->step == 0) {
        begin(&OF_V, &s->velocity, x, reading);
        struct Memory ahead = s->velocity;
        estimate(&OF_V, &ahead, x, reading);
        double u = INPUT == OF_KALMAN ? ahead.a : INPUT == OF_ACCELEROMETER ? reading : 0.0 * x;
        begin(&OF_A, &s->acceleration, u, reading);
        s->a_before = 0.0;
    }
    double v = estimate(&OF_V, &s->velocity, x, reading);
    double u = INPUT == OF_KALMAN ? s->velocity.a : INPUT == OF_ACCELEROMETER ? reading : v;
    double a = estimate(&OF_A, &s->acceleration, u, reading);
    double out = WALL_POSITION ? s->values[WALL_POSITION] - x : 0.0 - x;
    bool contact = out * INWARD < 0.0;
    double total = contact ? s->values[WALL_STIFFNESS] * out : 0.0;
    for (int i = 0; i < N_ELEMENTS; i++) {
        double force = element_force(ELEMENTS[i], s->values[ELEMENTS[i].parameter], v, a, s->a_before);
        total = total + (contact || ELEMENTS[i].always ? force : 0.0);
    }
    s->a_before = a;
    return total;
}

/* The actuator's step of force and its saturation; 0 for none. */
static double driven(double command, double step, double most)
{
    double counts = command / step, force = command;
    if (step > 0.0 && counts - counts == 0.0)
        force = step * (rint(counts) + 0.0);
    return most > 0.0 && force > most ? most : most > 0.0 && force < -most ? -most : force;
}
