/* One tick in lock-step with a simulated machine: measure, guard, control, command, row of the recording, advance.

   The counterpart in Python is loop/pilot.py with loop/control_step.py, and both give the same rows and commands to the
   last bit for the same inputs (tests compare them). This file decides nothing by itself: guard, control law and
   machine are called by address. It allocates nothing. */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <string.h>
#include <time.h>

#include "record.h"

/* Check sum of the record and its constants: a library that was made from others is not used. */
const int64_t lock_step_layout = LAYOUT_OF_LOCK_STEP;

typedef void kernel(void *memory);
typedef void half(void *model, void *data);
typedef void guard_half(double *record);
typedef void guard_decision(double *record, const double *table);

static double now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e6 * (double)now.tv_sec + 1e-3 * (double)now.tv_nsec;
}

static void put(void *target, const void *source, int64_t numbers)
{
    memcpy(target, source, (size_t)numbers * sizeof(double));
}

/* As Handover.step: advance the ramp by one tick, and copy the parameters to where they are used. */
static void advance(const ramp *one)
{
    int64_t *counts = one->counts;
    double *x = one->x;
    if (counts[0] < counts[1]) {
        const double *start = one->start, *goal = one->goal;
        counts[0] += 1;
        const double share = (double)counts[0] / (double)counts[1];
        for (int64_t k = 0; k < one->size; k++)
            x[k] = (goal[k] - start[k]) * share + start[k];
    }
    put(one->written, x, one->size);
}

static void measure(const lock_step *s)
{
    put(s->noise_now, (const double *)s->noise + s->noise_row * s->joints, s->joints);
    ((kernel *)s->sensors)(s->sensors_memory);
}

/* As ingress.put_measurement and Guard.see. The machine has no torque sensors, and its drives report no faults. */
static int see(const lock_step *s)
{
    double *r = s->guard;
    const int64_t n = s->joints;
    r[GUARD_NOW] = s->t;
    r[GUARD_CAME] = 1.0;
    r[GUARD_SEQUENCE_IN] = (double)s->sequence;
    r[GUARD_T_IN] = s->t;
    r[GUARD_IN_CURRENT] = 1.0;
    r[GUARD_HAS_MOTOR] = s->has_motor ? 1.0 : 0.0;
    put(r + GUARD_Q_IN, s->q, n);
    put(r + GUARD_CURRENT_IN, s->current, n);
    if (s->has_motor)
        put(r + GUARD_Q_MOTOR_IN, s->q_motor, n);
    for (int64_t j = 0; j < n; j++)
        r[GUARD_TAU_IN + j] = NAN;
    ((guard_half *)s->see)(r);
    return r[GUARD_USABLE] != 0.0;
}

/* As OutputFeedback.answer: observe, then compute the desired torque. */
static void answer(const lock_step *s)
{
    const int64_t n = s->joints, from = s->tick * n;
    put(s->q_measured, s->q, n);
    ((kernel *)s->observer)(s->observer_memory);
    for (int64_t k = 0; k < s->ramps; k++)
        advance(&s->ramp[k]);
    if (!s->law)
        return;
    put(s->law_q, s->q_observed, n);
    put(s->law_v, s->v_observed, n);
    put(s->law_q_reference, (const double *)s->q_path + from, n);
    put(s->law_v_reference, (const double *)s->v_path + from, n);
    put(s->law_a_reference, (const double *)s->a_path + from, n);
    if (s->mode) {
        double *mode = s->mode;
        mode[0] = s->drive, mode[1] = s->gravity_level, mode[2] = s->arm_share;
    }
    ((kernel *)s->law)(s->law_memory);
}

/* As Guard.decide. */
static void decide(const lock_step *s)
{
    double *r = s->guard;
    r[GUARD_NOW] = s->t;
    r[GUARD_SPOKE] = 0.0;
    if (s->is_usable) {
        r[GUARD_SPOKE] = 1.0;
        r[GUARD_ANSWERS] = (double)s->sequence;
        r[GUARD_VALID_UNTIL] = s->t + s->command_life;
        put(r + GUARD_ANSWER_IN, s->tau_desired, s->joints);
    }
    ((guard_decision *)s->decide)(r, s->table);
    put(s->tau_commanded, r + GUARD_TAU, s->joints);
}

/* As Pilot._record: the values of the tick, in the order of the table of the recording. */
static void write_row(const lock_step *s)
{
    const double *r = s->guard;
    const int64_t n = s->joints, from = s->tick * n;
    double *row = s->row, *fields = row + ROW_SCALARS;
    row[ROW_T] = s->t;
    row[ROW_NOW] = s->t;
    row[ROW_MONOTONIC] = NAN;
    row[ROW_DRIVE] = s->drive;
    row[ROW_GRAVITY_LEVEL] = s->gravity_level;
    row[ROW_ARM_SHARE] = s->arm_share;
    row[ROW_CLOSURE_SLOPE] = s->slope ? *(const double *)s->slope : 0.0;
    row[ROW_TICK_US] = s->tick_us;
    row[ROW_LATENESS_US] = NAN;
    row[ROW_SAFE_STATE] = r[GUARD_SAFE_STATE] + 1.0;
    row[ROW_SEQUENCE] = (double)s->sequence;
    row[ROW_CONTROL] = s->control;
    row[ROW_SEEN] = 0.0;
    row[ROW_FAULTY] = 0.0;
    row[ROW_ACTS] = s->acts;
    row[ROW_PHASE] = s->phase;
    put(fields + n * ROW_FIELD_Q_MEASURED, s->q, n);
    put(fields + n * ROW_FIELD_Q_REFERENCE, (const double *)s->q_path + from, n);
    put(fields + n * ROW_FIELD_V_REFERENCE, (const double *)s->v_path + from, n);
    put(fields + n * ROW_FIELD_A_REFERENCE, (const double *)s->a_path + from, n);
    put(fields + n * ROW_FIELD_Q_MOTOR, s->q_motor, n);
    put(fields + n * ROW_FIELD_V, s->v_observed, n);
    put(fields + n * ROW_FIELD_CURRENT, s->current, n);
    put(fields + n * ROW_FIELD_TAU_MEASURED, s->tau_measured, n);
    put(fields + n * ROW_FIELD_TAU_FEEDFORWARD, s->tau_feedforward, n);
    if (s->is_usable)
        put(fields + n * ROW_FIELD_TAU_DESIRED, s->tau_desired, n);
    else
        for (int64_t j = 0; j < n; j++)
            fields[n * ROW_FIELD_TAU_DESIRED + j] = NAN;
    put(fields + n * ROW_FIELD_TAU_COMMANDED, s->tau_commanded, n);
}

/* Current and damping of the command (ControlStep.take, Envelope.drive_damping); 0 if a current is not finite. */
static int command(const lock_step *s)
{
    const double *r = s->guard, *gain = s->gain, *tau = s->tau_commanded;
    double sum = 0.0, *current = s->current_in, *damping = s->damping_in;
    for (int64_t j = 0; j < s->joints; j++)
        sum += tau[j] / gain[j];
    if (!isfinite(sum))
        return 0;
    for (int64_t j = 0; j < s->joints; j++) {
        current[j] = tau[j] / gain[j];
        const double powerless = (GUARD_WITHOUT_MODEL_SHARE - 1.0) * r[GUARD_POWERLESS + j];
        /* No joint is isolated without a stop. */
        damping[j] = r[GUARD_STOP] == 0.0 ? 0.0 : (r[GUARD_ISOLATED + j] + powerless) * r[GUARD_DAMPING + j];
    }
    *(double *)s->valid_until_in = s->t + s->command_life;
    return 1;
}

/* As ShoulderPole.before_forces: MuJoCo damps near the pole, the joint forces elsewhere. */
static void before_forces(const pole *one)
{
    int64_t *is_near = one->is_near, was_near = *is_near;
    double *engine_damping = one->engine_damping;
    *is_near = 0;
    if (!(fabs(cos(*(const double *)one->abduction)) > one->far_cosine)) {
        const double *inertia = one->inertia;
        const double flexion = inertia[one->places[0]], rotation = inertia[one->places[1]];
        const double both = inertia[one->places[2]], total = flexion + rotation;
        const double least = total != 0.0 ? (flexion * rotation - both * both) / total : INFINITY;
        *is_near = one->damping_step > one->stable_share * least;
    }
    for (int k = 0; k < 2 && *is_near != was_near; k++)
        engine_damping[one->turning[k]] = *is_near ? one->damping[k] : 0.0;
}

/* As ShoulderPole.after_forces. */
static void after_forces(const pole *one)
{
    const double *velocity = one->velocity;
    double *forces = one->forces;
    for (int k = 0; k < 2 && *(const int64_t *)one->is_near; k++)
        forces[one->turning[k]] += one->damping[k] * velocity[one->turning[k]];
}

/* As Twin.write; 0 if the simulation has diverged. */
static int move(const lock_step *s)
{
    for (int64_t k = 0; k < s->arms; k++) {
        const arm *one = &s->arm[k];
        put(one->now, (const double *)one->torques + s->muscle_row * one->freedoms, one->freedoms);
    }
    for (int64_t k = 0; k < s->substeps; k++) {
        for (int64_t p = 0; p < s->poles; p++)
            before_forces(&s->pole[p]);
        ((half *)s->first_half)(s->model, s->data);
        ((kernel *)s->forces)(s->forces_memory);
        for (int64_t p = 0; p < s->poles; p++)
            after_forces(&s->pole[p]);
        ((half *)s->second_half)(s->model, s->data);
    }
    const double *velocity = s->velocity;
    double sum = 0.0;
    for (int64_t k = 0; k < s->velocities; k++)
        sum += velocity[k];
    return isfinite(sum);
}

/* Run one tick on the values that the caller has written into the record. */
int64_t lock_step_tick(lock_step *s)
{
    measure(s);
    const double start_us = now_us();
    s->is_usable = see(s);
    if (s->is_usable)
        answer(s);
    decide(s);
    s->tick_us = now_us() - start_us;
    const double *gain = s->gain, *current = s->current;
    double *tau_measured = s->tau_measured;
    for (int64_t j = 0; j < s->joints; j++)
        tau_measured[j] = gain[j] * current[j];
    write_row(s);
    if (!command(s))
        return NOT_FINITE;
    return move(s) ? FINISHED : DIVERGED;
}
