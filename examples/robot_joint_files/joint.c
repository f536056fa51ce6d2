/* Copyright 2026 The antenna_drive authors
 * 
 * Licensed under the Apache License, Version 2.0 (the "License");
 * you may not use this file except in compliance with the License.
 * You may obtain a copy of the License at
 * 
 *     http://www.apache.org/licenses/LICENSE-2.0
 * 
 * Unless required by applicable law or agreed to in writing, software
 * distributed under the License is distributed on an "AS IS" BASIS,
 * WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
 * See the License for the specific language governing permissions and
 * limitations under the License.
 */

/*
 * The joint of joint.xml as an FMU for co-simulation: a motor with friction, a shaft, a load, and
 * a position servo with a limited torque. SI units. build_fmu.py compiles it against the headers
 * of the FMI standard: with FMI_VERSION=2 for FMI 2, else for FMI 3.
 */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#if FMI_VERSION == 2
#include "fmi2Functions.h"
#define STATUS fmi2Status
#define OK fmi2OK
#define ERROR fmi2Error
#else
#include "fmi3Functions.h"
#define STATUS fmi3Status
#define OK fmi3OK
#define ERROR fmi3Error
#endif

/* Value references, in the order of VARIABLES in build_fmu.py. */
enum {
    REFERENCE, PUSH, LOAD, COULOMB, VISCOUS, COMPLIANCE, HALF_GAP, LOAD_FRICTION, MOTOR_ANGLE,
    TORQUE, COUNT
};

static const double MOTOR = 2e-4, STIFFNESS = 50.0, DAMPING = 2e-3;
static const double GAIN = 0.8, RATE_GAIN = 0.04, LIMIT = 0.5;
static const double LONGEST_STEP = 2e-5;
static const double START[COUNT] = {0.0, 0.0, 3e-4, 0.03, 8e-4, 0.0, 0.0, 0.0, 0.0, 0.0};

typedef struct {
    double value[COUNT];
    double q, w, load_q, load_w;
} Joint;

static double limited(double value, double limit) {
    return fmax(fmin(value, limit), -limit);
}

static void begin(Joint *joint) {
    memset(joint, 0, sizeof *joint);
    memcpy(joint->value, START, sizeof START);
}

static double torque_of(const Joint *joint) {
    return limited(GAIN * (joint->value[REFERENCE] - joint->q) - RATE_GAIN * joint->w, LIMIT);
}

/* The rate after a step in which dry friction brings the body to rest, but not beyond. */
static double rubbed(double rate, double stopped) {
    return rate > 0.0 ? fmax(rate - stopped, 0.0) : fmin(rate + stopped, 0.0);
}

static void advance(Joint *joint, double duration) {
    const double *v = joint->value;
    const double stiffness = 1.0 / (1.0 / STIFFNESS + v[COMPLIANCE]);
    const int count = (int)fmax(ceil(duration / LONGEST_STEP - 1e-6), 1.0);
    const double h = duration / count;
    for (int i = 0; i < count; ++i) {
        const double twist = joint->q - joint->load_q, w = joint->w, load_w = joint->load_w;
        const double shaft = stiffness * (twist - limited(twist, v[HALF_GAP]))
            + DAMPING * (w - load_w);
        const double driving = torque_of(joint) - shaft - v[VISCOUS] * w;
        joint->w = rubbed(w + h * driving / MOTOR, h * v[COULOMB] / MOTOR);
        joint->load_w = rubbed(load_w + h * (shaft + v[PUSH]) / v[LOAD],
                               h * v[LOAD_FRICTION] / v[LOAD]);
        joint->q += 0.5 * h * (w + joint->w);
        joint->load_q += 0.5 * h * (load_w + joint->load_w);
    }
}

static STATUS get(Joint *joint, const unsigned *reference, size_t count, double *value) {
    joint->value[MOTOR_ANGLE] = joint->q;
    joint->value[TORQUE] = torque_of(joint);
    for (size_t i = 0; i < count; ++i) {
        if (reference[i] >= COUNT)
            return ERROR;
        value[i] = joint->value[reference[i]];
    }
    return OK;
}

static STATUS set(Joint *joint, const unsigned *reference, size_t count, const double *value) {
    for (size_t i = 0; i < count; ++i) {
        if (reference[i] >= MOTOR_ANGLE)
            return ERROR;
        joint->value[reference[i]] = value[i];
    }
    return OK;
}

#if FMI_VERSION == 2

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging) {
    Joint *joint = malloc(sizeof *joint);
    if (joint)
        begin(joint);
    return joint;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2Reset(fmi2Component c) {
    begin(c);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                       fmi2Real value[]) {
    return get(c, vr, count, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                       const fmi2Real value[]) {
    return set(c, vr, count, value);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_way_back) {
    advance(c, step);
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop) {
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }

#else

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
    const fmi3ValueReference intermediate[], size_t intermediates,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update) {
    Joint *joint = malloc(sizeof *joint);
    if (joint)
        begin(joint);
    return joint;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3Reset(fmi3Instance c) {
    begin(c);
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                          fmi3Float64 value[], size_t values) {
    return get(c, vr, count, value);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                          const fmi3Float64 value[], size_t values) {
    return set(c, vr, count, value);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean stop_defined, fmi3Float64 stop) {
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_way_back,
                      fmi3Boolean *event, fmi3Boolean *ends, fmi3Boolean *early,
                      fmi3Float64 *reached) {
    advance(c, step);
    *event = *ends = *early = fmi3False;
    *reached = time + step;
    return fmi3OK;
}

#endif
