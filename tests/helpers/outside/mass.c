/* m x'' + b x' = F as an FMU of FMI 3.0 for both interfaces, of which F, x and v are called as no other FMU calls them.
   Co-simulation steps by the semi-implicit rule of Euler. Functions that are not here are stubs. */
#include "fmi3Functions.h"
#include <stdlib.h>

enum { T, PUSH, PLACE, SPEED, PLACE_RATE, SPEED_RATE, MASS, DAMPING, COUNT };
typedef struct { double of[COUNT]; } Mass;

static void *make(void)
{
    Mass *mass = calloc(1, sizeof *mass);
    mass->of[MASS] = 1.0;
    return mass;
}

static void update(Mass *m)
{
    m->of[PLACE_RATE] = m->of[SPEED];
    m->of[SPEED_RATE] = (m->of[PUSH] - m->of[DAMPING] * m->of[SPEED]) / m->of[MASS];
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e,
                                          fmi3InstanceEnvironment f, fmi3LogMessageCallback g)
{
    return make();
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e,
                                         fmi3Boolean f, fmi3Boolean g, const fmi3ValueReference h[], size_t i,
                                         fmi3InstanceEnvironment j, fmi3LogMessageCallback k,
                                         fmi3IntermediateUpdateCallback l)
{
    return make();
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance i, fmi3Boolean a, fmi3Float64 b, fmi3Float64 c, fmi3Boolean d,
                                       fmi3Float64 e)
{
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance i) { return fmi3OK; }

fmi3Status fmi3GetFloat64(fmi3Instance i, const fmi3ValueReference r[], size_t n, fmi3Float64 values[], size_t m)
{
    update(i);
    for (size_t k = 0; k < n; k++)
        values[k] = ((Mass *)i)->of[r[k]];
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance i, const fmi3ValueReference r[], size_t n, const fmi3Float64 values[], size_t m)
{
    for (size_t k = 0; k < n; k++)
        ((Mass *)i)->of[r[k]] = values[k];
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance i, fmi3Float64 t, fmi3Float64 h, fmi3Boolean a, fmi3Boolean *b, fmi3Boolean *c,
                      fmi3Boolean *d, fmi3Float64 *last)
{
    Mass *m = i;
    update(m);
    m->of[SPEED] += h * m->of[SPEED_RATE];
    m->of[PLACE] += h * m->of[SPEED];
    *b = *c = *d = fmi3False;
    *last = t + h;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance i, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *c, fmi3Boolean *d,
                                    fmi3Boolean *e, fmi3Float64 *f)
{
    *a = *b = *c = *d = *e = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance i, fmi3Boolean a, fmi3Boolean *event, fmi3Boolean *end)
{
    *event = *end = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance i, fmi3Float64 t) { return fmi3OK; }

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance i, size_t *n) { return *n = 2, fmi3OK; }
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance i, size_t *n) { return *n = 0, fmi3OK; }

fmi3Status fmi3SetContinuousStates(fmi3Instance i, const fmi3Float64 states[], size_t n)
{
    ((Mass *)i)->of[PLACE] = states[0];
    ((Mass *)i)->of[SPEED] = states[1];
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance i, fmi3Float64 states[], size_t n)
{
    states[0] = ((Mass *)i)->of[PLACE];
    states[1] = ((Mass *)i)->of[SPEED];
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance i, fmi3Float64 rates[], size_t n)
{
    update(i);
    rates[0] = ((Mass *)i)->of[PLACE_RATE];
    rates[1] = ((Mass *)i)->of[SPEED_RATE];
    return fmi3OK;
}
