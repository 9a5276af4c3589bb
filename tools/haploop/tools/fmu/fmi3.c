/* FMI 3.0 for co-simulation around the controller of a haploop scene. Variables are references into State.values. */
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include "controller.h"

#ifdef FMI3_HEADERS /* the standard's own, to check this file against them */
#include "fmi3Functions.h"
#else
typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3IntermediateUpdateCallback)(void);
#endif
#ifdef _WIN32
#define FMI __declspec(dllexport)
#else
#define FMI __attribute__((visibility("default")))
#endif
#define REFERENCES fmi3Instance instance, const fmi3ValueReference references[], size_t count

/* Communication points are sums of floating-point numbers: so far from a plant step, in steps, they still mean it. */
static const double NEAR = 0.01;

struct Instance {
    struct State state;
    bool stepping;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
};

/* Tells the importer a sentence; a refusal is told whether or not it asked for messages. */
static fmi3Status tell(const struct Instance *of, fmi3Status status, const char *format, ...)
{
    char text[512];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    if (of && of->log)
        of->log(of->environment, status, "logStatusError", text);
    return status;
}

static void restart(struct State *state)
{
    memset(state, 0, sizeof *state);
    for (int i = 0; i < VARIABLES; i++)
        state->values[i] = KNOWN[i].start;
    state->position_is_new = true;
}

static double time_s(const struct State *of) { return of->start_s + of->step / PLANT_RATE; }

/* Returns the force in effect. Without delay the one that answers the position set at this tick acts at once. */
static double force_N(const struct State *of)
{
    int64_t ticks = (of->step + STEPS_PER_TICK - 1) / STEPS_PER_TICK, command = of->step - DELAY_STEPS;
    double force;
    if (DELAY_STEPS == 0 && of->step % STEPS_PER_TICK == 0 && of->position_is_new) {
        struct State ahead = *of;
        force = tick(&ahead);
    } else {
        command = command < 0 ? -1 : command / STEPS_PER_TICK;
        command = command < ticks ? command : ticks - 1;
        if (command < 0)
            return 0.0;
        force = of->commands[command % COMMANDS];
    }
    return driven(force, ACTUATOR_RESOLUTION ? of->values[ACTUATOR_RESOLUTION] : 0.0,
                  ACTUATOR_SATURATION ? of->values[ACTUATOR_SATURATION] : 0.0);
}

FMI const char *fmi3GetVersion(void) { return "3.0"; }

FMI fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n_intermediate,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    struct Instance *made = calloc(1, sizeof *made);
    if (!made)
        return NULL;
    made->environment = environment;
    made->log = log;
    if (!token || strcmp(token, TOKEN)) {
        tell(made, fmi3Error, "The instantiation token must be %s, but %s was given: model description and binary "
             "do not belong to the same FMU.", TOKEN, token ? token : "none");
        free(made);
        return NULL;
    }
    restart(&made->state);
    return made;
}

FMI void fmi3FreeInstance(fmi3Instance instance) { free(instance); }

FMI fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                           fmi3Float64 start_s, fmi3Boolean has_stop, fmi3Float64 stop_s)
{
    struct Instance *of = instance;
    if (!isfinite(start_s))
        return tell(of, fmi3Error, "The start time must be a finite number, but %g s was given.", start_s);
    of->state.start_s = start_s;
    return fmi3OK;
}

FMI fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    ((struct Instance *)instance)->stepping = true;
    return fmi3OK;
}

FMI fmi3Status fmi3Terminate(fmi3Instance instance)
{
    ((struct Instance *)instance)->stepping = false;
    return fmi3OK;
}

FMI fmi3Status fmi3Reset(fmi3Instance instance)
{
    struct Instance *of = instance;
    restart(&of->state);
    of->stepping = false;
    return fmi3OK;
}

FMI fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count, const fmi3String categories[])
{
    return fmi3OK;
}

FMI fmi3Status fmi3GetFloat64(REFERENCES, fmi3Float64 values[], size_t n)
{
    const struct Instance *of = instance;
    for (size_t i = 0; i < count; i++) {
        if (i >= n || references[i] >= VARIABLES)
            return tell(of, fmi3Error, "There is no variable with the reference %u.", (unsigned)references[i]);
        values[i] = references[i] == TIME    ? time_s(&of->state)
                    : references[i] == FORCE ? force_N(&of->state)
                                             : of->state.values[references[i]];
    }
    return fmi3OK;
}

FMI fmi3Status fmi3SetFloat64(REFERENCES, const fmi3Float64 values[], size_t n)
{
    struct Instance *of = instance;
    for (size_t i = 0; i < count; i++) {
        fmi3ValueReference one = references[i];
        if (i >= n || one >= VARIABLES || one == TIME || one == FORCE)
            return tell(of, fmi3Error, "No variable that can be set has the reference %u.", (unsigned)one);
        if (!(isfinite(values[i]) && values[i] >= KNOWN[one].least && values[i] <= KNOWN[one].most))
            return tell(of, fmi3Discard, "%s must be a finite number from %g to %g, but %g was given; it stays %g.",
                        KNOWN[one].name, KNOWN[one].least, KNOWN[one].most, values[i], of->state.values[one]);
    }
    for (size_t i = 0; i < count; i++) {
        of->state.values[references[i]] = values[i];
        of->state.position_is_new |= references[i] == POSITION;
    }
    return fmi3OK;
}

FMI fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 point_s, fmi3Float64 size_s, fmi3Boolean no_return,
                          fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached_s)
{
    struct Instance *of = instance;
    struct State *state = &of->state;
    int64_t into = state->step % STEPS_PER_TICK, left = STEPS_PER_TICK - into;
    double steps = size_s * PLANT_RATE, whole = rint(steps);
    *event = *terminate = *early = false;
    *reached_s = time_s(state);
    if (!of->stepping)
        return tell(of, fmi3Error, "A step was requested before initialization had ended, or after the end.");
    if (!(fabs(point_s - *reached_s) * PLANT_RATE <= NEAR))
        return tell(of, fmi3Discard, "A step must begin at %.9g s, the time of the FMU, but %.9g s was given.",
                    *reached_s, point_s);
    if (!(fabs(steps - whole) <= NEAR && whole >= 1.0 && whole <= left))
        return tell(of, fmi3Discard, "A step of %.9g s was requested at %.9g s, but it must be a whole number of plant "
                    "steps of %.9g s and lead no further than the next tick, %.9g s on: the controller measures at "
                    "every tick.", size_s, *reached_s, 1.0 / PLANT_RATE, left / PLANT_RATE);
    if (into == 0) {
        double command = tick(state);
        state->commands[state->step / STEPS_PER_TICK % COMMANDS] = command;
    }
    state->step += (int64_t)whole;
    state->position_is_new = false;
    *reached_s = time_s(state);
    return fmi3OK;
}

FMI fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *kept)
{
    const struct Instance *of = instance;
    if (!*kept && !(*kept = malloc(sizeof of->state)))
        return tell(of, fmi3Error, "There is not enough memory to keep a state.");
    memcpy(*kept, &of->state, sizeof of->state);
    return fmi3OK;
}

FMI fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState kept)
{
    memcpy(&((struct Instance *)instance)->state, kept, sizeof(struct State));
    return fmi3OK;
}

FMI fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *kept)
{
    free(*kept);
    *kept = NULL;
    return fmi3OK;
}

/* What the standard has every FMU define though it says that it does not do it; none of these may be called, so that the
   instance is all that they look at. */
#ifndef FMI3_HEADERS
#define LACKS(NAME) \
    FMI fmi3Status fmi3##NAME(fmi3Instance of) { return tell(of, fmi3Error, "fmi3" #NAME " is not provided."); }
#define WITHOUT(TYPE) LACKS(Get##TYPE) LACKS(Set##TYPE)
FMI fmi3Instance fmi3InstantiateModelExchange(fmi3String name) { return NULL; }
FMI fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name) { return NULL; }
WITHOUT(Float32) WITHOUT(Int8) WITHOUT(UInt8) WITHOUT(Int16) WITHOUT(UInt16) WITHOUT(Int32) WITHOUT(UInt32)
WITHOUT(Int64) WITHOUT(UInt64) WITHOUT(Boolean) WITHOUT(String) WITHOUT(Binary) WITHOUT(Clock)
WITHOUT(IntervalDecimal) WITHOUT(IntervalFraction) WITHOUT(ShiftDecimal) WITHOUT(ShiftFraction)
WITHOUT(ContinuousStates) LACKS(SetTime) LACKS(GetNumberOfVariableDependencies) LACKS(GetVariableDependencies)
LACKS(SerializedFMUStateSize) LACKS(SerializeFMUState) LACKS(DeserializeFMUState) LACKS(GetDirectionalDerivative)
LACKS(GetAdjointDerivative) LACKS(EnterConfigurationMode) LACKS(ExitConfigurationMode) LACKS(EnterEventMode)
LACKS(EnterStepMode) LACKS(EnterContinuousTimeMode) LACKS(EvaluateDiscreteStates) LACKS(UpdateDiscreteStates)
LACKS(CompletedIntegratorStep) LACKS(GetContinuousStateDerivatives) LACKS(GetEventIndicators)
LACKS(GetNominalsOfContinuousStates) LACKS(GetNumberOfEventIndicators) LACKS(GetNumberOfContinuousStates)
LACKS(GetOutputDerivatives) LACKS(ActivateModelPartition)
#endif
