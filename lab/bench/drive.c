// SPDX-FileCopyrightText: 2026 The antenna_drive authors
// SPDX-License-Identifier: Apache-2.0
//
// The lock-step loop of the drive in plain C: what a compiler makes of it is the limit that the
// emulator is measured against. The article's model alone, without the terms of other effects;
// the same scheme as antenna_drive.physics and antenna_drive.emulator: each unit one macro-step
// from what all put out at its start, classical Runge-Kutta, switchings located by halving.

#include <math.h>
#include <stdbool.h>
#include <string.h>

#define STATES_MAX 14
#define HALVINGS 21
#define SWITCHINGS_LIMIT 40
#define MODES_MAX 6

typedef struct { double value, slope; } Signal;

typedef struct {
    double sign, gear_ratio, start_in_gap;
    double k_command, tau_1;
    double rate_gain, integral_time, lag, feedback, tach_gain, bias_gain;
    double resistance, inductance, back_emf, kappa, voltage_limit;
    double torque_constant, current_limit, inertia, coulomb, stiction_ratio, threshold;
    double stiffness, half_gap, damping;
} Motor;

typedef struct {
    double pot, fade_out, current_volts, low, high, k_2, s_2, k_3, g_4, fixed, fixed_voltage;
    double steady, gain, pole, difference;
} Share;

typedef struct {
    double gear_ratio, inertia, coulomb, stiction_ratio, threshold;
    double modes;
    double mode_inertia[MODES_MAX], mode_omega[MODES_MAX], mode_damping[MODES_MAX];
    double elevation[MODES_MAX], cross_elevation[MODES_MAX];
} Axis;

typedef struct { Motor motor[2]; Share share; Axis axis; } Drive;

// What a unit integrates with: its equations for a frozen mode, and whether the mode still holds.
typedef struct Unit Unit;
struct Unit {
    int n;
    double x[STATES_MAX];
    int mode[3];
    Signal u[5];
    const void *p;
};

static inline double held(const Signal *u, double t) { return u->value + u->slope * t; }
static inline double clip(double v, double low, double high) { return fmin(fmax(v, low), high); }

#define INTEGRATOR(NAME)                                                                        \
static void NAME##_settle(Unit *m, double t) {                                                  \
    for (int i = 0; i < 4; i++)                                                                 \
        if (!NAME##_switch(m, t, m->x, true)) break;                                            \
}                                                                                               \
static void NAME##_advance(Unit *m, double h, int steps) {                                      \
    double k1[STATES_MAX], k2[STATES_MAX], k3[STATES_MAX], k4[STATES_MAX], k5[STATES_MAX];      \
    double y[STATES_MAX], z[STATES_MAX], *x = m->x, t = 0.0, step = h / steps;                  \
    int done = 0, switchings = 0, n = m->n;                                                     \
    NAME##_settle(m, 0.0);                                                                      \
    while (done < steps) {                                                                      \
        double end = (done + 1) * step, dt = end - t;                                           \
        NAME##_rates(m, t, x, k1);                                                              \
        for (int j = 0; j < n; j++) y[j] = x[j] + 0.5 * dt * k1[j];                             \
        NAME##_rates(m, t + 0.5 * dt, y, k2);                                                   \
        for (int j = 0; j < n; j++) y[j] = x[j] + 0.5 * dt * k2[j];                             \
        NAME##_rates(m, t + 0.5 * dt, y, k3);                                                   \
        for (int j = 0; j < n; j++) y[j] = x[j] + dt * k3[j];                                   \
        NAME##_rates(m, end, y, k4);                                                            \
        for (int j = 0; j < n; j++)                                                             \
            y[j] = x[j] + dt / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j]);               \
        if (switchings < SWITCHINGS_LIMIT && NAME##_switch(m, end, y, false)) {                 \
            double low = 0.0, high = 1.0;                                                       \
            NAME##_rates(m, end, y, k5);                                                        \
            for (int i = 0; i < HALVINGS; i++) {                                                \
                double s = 0.5 * (low + high);                                                  \
                cubic(n, x, k1, y, k5, dt, s, z);                                               \
                if (NAME##_switch(m, t + s * dt, z, false)) high = s; else low = s;             \
            }                                                                                   \
            cubic(n, x, k1, y, k5, dt, high, z);                                                \
            t += high * dt;                                                                     \
            memcpy(x, z, n * sizeof *x);                                                        \
            switchings++;                                                                       \
            NAME##_settle(m, t);                                                                \
            if (high == 1.0) { done++; t = end; }                                               \
        } else {                                                                                \
            memcpy(x, y, n * sizeof *x);                                                        \
            done++;                                                                             \
            t = end;                                                                            \
            if (switchings == SWITCHINGS_LIMIT) NAME##_settle(m, t);                            \
        }                                                                                       \
    }                                                                                           \
}

static void cubic(int n, const double *x, const double *dx, const double *y, const double *dy,
                  double dt, double s, double *z) {
    double s2 = s * s, s3 = s2 * s, a = 2.0 * s3 - 3.0 * s2 + 1.0, b = (s3 - 2.0 * s2 + s) * dt;
    double c = 3.0 * s2 - 2.0 * s3, d = (s3 - s2) * dt;
    for (int j = 0; j < n; j++) z[j] = a * x[j] + b * dx[j] + c * y[j] + d * dy[j];
}

// Eq. (4)-(8): the mode of a body with friction that follows.
static int next_slip(int slip, double rate, double applied, double coulomb, double stiction,
                     double threshold) {
    if (slip == 0) return applied > stiction ? 1 : applied < -stiction ? -1 : 0;
    if (slip * rate < 0.0) return 0;
    if (slip * rate <= threshold && slip * applied < coulomb && fabs(applied) <= stiction)
        return 0;
    return slip;
}

// ------------------------------------------------------------------ motor, amplifiers, gearbox

enum { VOLTAGE, INTEGRAL, DEMAND, CURRENT, ANGLE, RATE, IMPULSE, MOTOR_STATES };
enum { SLIP, SIDE, WINDING };
enum { FREE, FROZEN, HELD };
enum { COMMAND, COUNTER, AXIS_ANGLE, AXIS_RATE };

static double twist(const Unit *m, double t, const double *x, double *rate) {
    const Motor *p = m->p;
    const Signal *u = m->u;
    double angle = u[AXIS_ANGLE].value
        + (u[AXIS_RATE].value + 0.5 * u[AXIS_RATE].slope * t) * t;
    *rate = x[RATE] - p->gear_ratio * held(&u[AXIS_RATE], t);
    return x[ANGLE] - p->gear_ratio * angle;
}

static double gear_torque(const Unit *m, double t, const double *x, double *rate) {
    const Motor *p = m->p;
    double angle = twist(m, t, x, rate);
    if (m->mode[SIDE] > 0) return p->stiffness * (angle - p->half_gap) + p->damping * *rate;
    if (m->mode[SIDE] < 0) return p->stiffness * (angle + p->half_gap) + p->damping * *rate;
    return 0.0;
}

static double demand(const Unit *m, double t, const double *x, double *error, double *centre) {
    const Motor *p = m->p;
    double bias = p->sign * p->bias_gain * held(&m->u[COUNTER], t);
    *error = p->rate_gain * (x[VOLTAGE] - p->tach_gain * x[RATE] + bias);
    *centre = p->back_emf / p->kappa / (p->resistance + p->feedback) * x[RATE];
    return *error + x[INTEGRAL];
}

static double motor_acceleration(const Unit *m, const double *x, double torque) {
    const Motor *p = m->p;
    if (m->mode[SLIP] == 0) return 0.0;
    return (p->torque_constant * x[CURRENT] - torque - m->mode[SLIP] * p->coulomb) / p->inertia;
}

static double needed(const Unit *m, double t, const double *x, double error, double turning) {
    const Motor *p = m->p;
    double volts = (p->k_command * held(&m->u[COMMAND], t) - x[VOLTAGE]) / p->tau_1;
    double slope = p->rate_gain * (volts - p->tach_gain * turning
                                   + p->sign * p->bias_gain * m->u[COUNTER].slope);
    double centre = p->back_emf / p->kappa / (p->resistance + p->feedback) * turning;
    return error > 0.0 ? centre - slope : slope - centre;
}

static double current_rate(const Motor *p, const double *x) {
    double volts = clip(p->kappa * ((p->resistance + p->feedback) * x[DEMAND]
                                    - p->feedback * x[CURRENT]),
                        -p->voltage_limit, p->voltage_limit);
    return ((volts - p->back_emf * x[RATE]) / p->kappa - p->resistance * x[CURRENT])
        / p->inductance;
}

static void motor_rates(const Unit *m, double t, const double *x, double *dx) {
    const Motor *p = m->p;
    double error, centre, rate, free;
    double wanted = demand(m, t, x, &error, &centre);
    double torque = gear_torque(m, t, x, &rate);
    double turning = motor_acceleration(m, x, torque);
    dx[VOLTAGE] = (p->k_command * held(&m->u[COMMAND], t) - x[VOLTAGE]) / p->tau_1;
    if (m->mode[WINDING] == FREE) {
        dx[INTEGRAL] = error / p->integral_time;
    } else if (m->mode[WINDING] == FROZEN) {
        dx[INTEGRAL] = 0.0;
    } else {
        free = clip(needed(m, t, x, error, turning), 0.0, fabs(error) / p->integral_time);
        dx[INTEGRAL] = error > 0.0 ? free : -free;
    }
    dx[DEMAND] = (clip(wanted, centre - p->current_limit, centre + p->current_limit)
                  - x[DEMAND]) / p->lag;
    dx[CURRENT] = current_rate(p, x);
    dx[ANGLE] = x[RATE];
    dx[RATE] = turning;
    dx[IMPULSE] = torque;
}

static int next_winding(int winding, double error, double excess, double need, const Motor *p) {
    double free = fabs(error) / p->integral_time;
    if (winding == HELD) return need >= free ? FREE : need < 0.0 ? FROZEN : HELD;
    if (excess > 0.0) {
        if (winding == FREE && need > 0.0) return need >= free ? FREE : HELD;
        return FROZEN;
    }
    return winding == FROZEN && 0.0 < need && need < free ? HELD : FREE;
}

static bool motor_switch(Unit *m, double t, double *x, bool commit) {
    const Motor *p = m->p;
    double rate, error, centre;
    double angle = twist(m, t, x, &rate);
    int side = 0, winding = m->mode[WINDING], slip = m->mode[SLIP];
    if (angle > p->half_gap && p->stiffness * (angle - p->half_gap) + p->damping * rate > 0.0)
        side = 1;
    else if (angle < -p->half_gap
             && p->stiffness * (angle + p->half_gap) + p->damping * rate < 0.0)
        side = -1;
    double wanted = demand(m, t, x, &error, &centre);
    double excess = (error > 0.0 ? wanted - centre : centre - wanted) - p->current_limit;
    if (excess > 0.0 || winding != FREE) {
        double torque = gear_torque(m, t, x, &rate);
        double need = needed(m, t, x, error, motor_acceleration(m, x, torque));
        winding = next_winding(winding, error, excess, need, p);
    }
    if (slip == 0 || slip * x[RATE] <= p->threshold) {
        double applied = p->torque_constant * x[CURRENT] - gear_torque(m, t, x, &rate);
        slip = next_slip(slip, x[RATE], applied, p->coulomb, p->stiction_ratio * p->coulomb,
                         p->threshold);
    }
    bool changed = slip != m->mode[SLIP] || side != m->mode[SIDE] || winding != m->mode[WINDING];
    if (commit && changed) {
        m->mode[SLIP] = slip;
        m->mode[SIDE] = side;
        m->mode[WINDING] = winding;
        if (slip == 0) x[RATE] = 0.0;
    }
    return changed;
}

static void motor_outputs(const Unit *m, double t, Signal *y) {
    const Motor *p = m->p;
    const double *x = m->x;
    double rate, torque = gear_torque(m, t, x, &rate);
    double turning = motor_acceleration(m, x, torque), slope = current_rate(p, x);
    double twisting = turning - p->gear_ratio * m->u[AXIS_RATE].slope;
    y[0] = (Signal){x[CURRENT], slope};
    y[1] = (Signal){torque, torque == 0.0 ? 0.0 : p->stiffness * rate + p->damping * twisting};
    y[2] = (Signal){0.0, 0.0};
    y[3] = (Signal){x[RATE], turning};
    y[4] = (Signal){x[CURRENT], slope};
}

INTEGRATOR(motor)

static void motor_step(Unit *m, double h, int steps, Signal *y) {
    double extrapolated = (y[1].value + 0.5 * y[1].slope * h) * h;
    m->x[IMPULSE] = 0.0;
    motor_advance(m, h, steps);
    motor_outputs(m, h, y);
    y[2].value = m->x[IMPULSE] - extrapolated;
}

// ------------------------------------------------------------------- torque share and Filter 1

enum { LOAD, SHARE, COUNTER_TORQUE, SHARE_STATES };

static double bias_voltage(const Share *p, const double *x) {
    return p->fixed != 0.0 ? p->fixed_voltage : p->pot * clip(x[SHARE], p->low, p->high);
}

static double share_rate(const Share *p, const double *x) {
    return -p->s_2 * x[SHARE] + p->k_2 * (p->fade_out + p->g_4 * fabs(x[LOAD]));
}

static double counter_rate(const Unit *m, double t, const double *x) {
    const Share *p = m->p;
    double error = bias_voltage(p, x) - p->difference * (held(&m->u[1], t) - held(&m->u[0], t));
    return p->gain * error - p->pole * x[COUNTER_TORQUE];
}

static void share_rates(const Unit *m, double t, const double *x, double *dx) {
    const Share *p = m->p;
    double sum = m->u[0].value + m->u[1].value + (m->u[0].slope + m->u[1].slope) * t;
    dx[LOAD] = -p->k_3 * (x[LOAD] + p->current_volts * sum);
    dx[SHARE] = share_rate(p, x);
    dx[COUNTER_TORQUE] = counter_rate(m, t, x);
}

static bool share_switch(Unit *m, double t, double *x, bool commit) {
    const Share *p = m->p;
    (void)t;  // the modes are the state's alone
    int negative = x[LOAD] < 0.0, saturation = x[SHARE] > p->high ? 1 : x[SHARE] < p->low ? -1 : 0;
    bool changed = negative != m->mode[0] || saturation != m->mode[1];
    if (commit && changed) {
        m->mode[0] = negative;
        m->mode[1] = saturation;
    }
    return changed;
}

static void share_outputs(const Unit *m, double t, Signal *y) {
    const Share *p = m->p;
    bool still = p->fixed != 0.0 || m->mode[1] != 0;
    y[0] = (Signal){m->x[COUNTER_TORQUE], counter_rate(m, t, m->x)};
    y[1] = (Signal){bias_voltage(p, m->x), still ? 0.0 : p->pot * share_rate(p, m->x)};
}

INTEGRATOR(share)

// ------------------------------------------------------------------------------------ structure

enum { HUB_ANGLE, HUB_RATE, FIRST_MODE };
enum { TORQUE_1, TORQUE_2, MISSED_1, MISSED_2, EXTERNAL };

static double mode_torque(const Axis *p, const double *x, int j) {
    double omega = p->mode_omega[j];
    return p->mode_inertia[j] * (omega * omega * (x[2 + 2 * j] - x[HUB_ANGLE])
                                 + 2.0 * p->mode_damping[j] * omega
                                 * (x[3 + 2 * j] - x[HUB_RATE]));
}

static double applied_torque(const Unit *m, double t, const double *x) {
    const Axis *p = m->p;
    const Signal *u = m->u;
    double torque = p->gear_ratio * (u[TORQUE_1].value + u[TORQUE_2].value
                                     + (u[TORQUE_1].slope + u[TORQUE_2].slope) * t);
    torque += held(&u[EXTERNAL], t);
    for (int j = 0; j < (int)p->modes; j++) torque += mode_torque(p, x, j);
    return torque;
}

static double hub_acceleration(const Unit *m, double t, const double *x) {
    const Axis *p = m->p;
    if (m->mode[0] == 0) return 0.0;
    return (applied_torque(m, t, x) - m->mode[0] * p->coulomb) / p->inertia;
}

static void axis_rates(const Unit *m, double t, const double *x, double *dx) {
    const Axis *p = m->p;
    dx[HUB_ANGLE] = x[HUB_RATE];
    dx[HUB_RATE] = hub_acceleration(m, t, x);
    for (int j = 0; j < (int)p->modes; j++) {
        dx[2 + 2 * j] = x[3 + 2 * j];
        dx[3 + 2 * j] = -mode_torque(p, x, j) / p->mode_inertia[j];
    }
}

static bool axis_switch(Unit *m, double t, double *x, bool commit) {
    const Axis *p = m->p;
    int slip = m->mode[0];
    if (slip != 0 && slip * x[HUB_RATE] > p->threshold) return false;
    slip = next_slip(slip, x[HUB_RATE], applied_torque(m, t, x), p->coulomb,
                     p->stiction_ratio * p->coulomb, p->threshold);
    bool changed = slip != m->mode[0];
    if (commit && changed) {
        m->mode[0] = slip;
        if (slip == 0) x[HUB_RATE] = 0.0;
    }
    return changed;
}

static void axis_outputs(const Unit *m, double t, Signal *y) {
    const Axis *p = m->p;
    const double *x = m->x;
    double turning = hub_acceleration(m, t, x);
    y[0] = (Signal){x[HUB_ANGLE], x[HUB_RATE]};
    y[1] = (Signal){x[HUB_RATE], turning};
    y[2] = (Signal){x[HUB_ANGLE], x[HUB_RATE]};
    y[3] = (Signal){p->gear_ratio * x[HUB_RATE], p->gear_ratio * turning};
    y[4] = y[5] = (Signal){0.0, 0.0};
    for (int j = 0; j < (int)p->modes; j++) {
        double bend = x[2 + 2 * j] - x[HUB_ANGLE], rate = x[3 + 2 * j] - x[HUB_RATE];
        y[4].value += p->elevation[j] * bend;
        y[4].slope += p->elevation[j] * rate;
        y[5].value += p->cross_elevation[j] * bend;
        y[5].slope += p->cross_elevation[j] * rate;
    }
}

INTEGRATOR(axis)

static void axis_step(Unit *m, double h, int steps, Signal *y) {
    const Axis *p = m->p;
    if (m->mode[0] != 0)
        m->x[HUB_RATE] += p->gear_ratio * (m->u[MISSED_1].value + m->u[MISSED_2].value)
            / p->inertia;
    axis_advance(m, h, steps);
    axis_outputs(m, h, y);
}

// ------------------------------------------------------------------------------ the whole drive

// The rows of the samples: two test signals, five outputs of each motor, two, six.
enum { ROW_TEST, ROW_MOTOR = 2, ROW_SHARE = 12, ROW_AXIS = 14, ROWS = 20 };

// Run from rest. commands holds both test signals at t = 0 and at the end of each macro-step; kept
// receives the samples at t = 0 and at every macro-step that `every` divides.
void run(const Drive *p, long count, double h, int steps, long every, const Signal *commands,
         Signal *kept) {
    Unit motor[2], share = {.n = SHARE_STATES, .p = &p->share};
    Unit axis = {.n = FIRST_MODE + 2 * (int)p->axis.modes, .p = &p->axis};
    Signal now[ROWS], after[ROWS];
    memset(now, 0, sizeof now);
    memset(after, 0, sizeof after);
    for (int i = 0; i < 2; i++) {
        motor[i] = (Unit){.n = MOTOR_STATES, .p = &p->motor[i]};
        motor[i].x[ANGLE] = p->motor[i].start_in_gap * p->motor[i].half_gap;
        motor_outputs(&motor[i], 0.0, after + ROW_MOTOR + 5 * i);
    }
    if (p->share.steady != 0.0)
        share.x[SHARE] = p->share.k_2 * p->share.fade_out / p->share.s_2;
    share_switch(&share, 0.0, share.x, true);
    share_outputs(&share, 0.0, after + ROW_SHARE);
    axis_outputs(&axis, 0.0, after + ROW_AXIS);
    memcpy(after, commands, 2 * sizeof *commands);
    memcpy(now, after, sizeof now);
    memcpy(kept, now, sizeof now);
    kept += ROWS;
    for (long k = 0; k < count; k++) {
        memcpy(after, commands + 2 * (k + 1), 2 * sizeof *commands);
        for (int i = 0; i < 2; i++) {
            motor[i].u[COMMAND] = now[ROW_TEST];
            motor[i].u[COUNTER] = now[ROW_SHARE];
            motor[i].u[AXIS_ANGLE] = now[ROW_AXIS];
            motor[i].u[AXIS_RATE] = now[ROW_AXIS + 1];
            motor_step(&motor[i], h, steps, after + ROW_MOTOR + 5 * i);
        }
        for (int i = 0; i < 2; i++) share.u[i] = now[ROW_MOTOR + 5 * i];
        share_advance(&share, h, steps);
        share_outputs(&share, h, after + ROW_SHARE);
        for (int i = 0; i < 2; i++) {
            axis.u[TORQUE_1 + i] = now[ROW_MOTOR + 5 * i + 1];
            axis.u[MISSED_1 + i] = now[ROW_MOTOR + 5 * i + 2];
        }
        axis.u[EXTERNAL] = now[1];
        axis_step(&axis, h, steps, after + ROW_AXIS);
        memcpy(now, after, sizeof now);
        if ((k + 1) % every == 0) {
            memcpy(kept, now, sizeof now);
            kept += ROWS;
        }
    }
}
