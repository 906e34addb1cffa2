/* Loop of the guard process: read the drives, ask control, decide, write, record; once per period.

   The counterpart in Python is live/guard_process.py, and both give the same commands and rows for the same inputs (a
   test compares them). This file allocates nothing, and waits only for the next period, for the drives and for control,
   each with a bound. It decides nothing by itself: the guard is safety/native/core.c, called by address. */
#define _GNU_SOURCE
#include <math.h>

#include "../../rig/drives/canopen/native/drives.h"
#include "../../rig/drives/udp/native/drives.h"
#include "mailbox.h"

/* Check sums of all records and of all constants: a library that was made from others is not used. */
const int64_t loop_layouts[4] = {LAYOUT_OF_LIVE_LOOP, LAYOUT_OF_DRIVE_MACHINE, LAYOUT_OF_UDP_DRIVES,
                                 LAYOUT_OF_CAN_DRIVES};

#define PUT_AT(data, at, type, value)                                                                                 \
    do {                                                                                                              \
        const type put_at = (type)(value);                                                                            \
        memcpy((uint8_t *)(data) + (at), &put_at, sizeof put_at);                                                     \
    } while (0)

static int64_t int_at(const void *data, int64_t at)
{
    int64_t value;
    memcpy(&value, (const uint8_t *)data + at, sizeof value);
    return value;
}

static double double_at(const void *data, int64_t at)
{
    double value;
    memcpy(&value, (const uint8_t *)data + at, sizeof value);
    return value;
}

typedef int (*write_function)(void *, int64_t, double, const double *, const double *);

static double *guard_of(const live_loop *loop) { return loop->guard; }
static drive_machine *drives_of(const live_loop *loop) { return loop->drives; }
static int64_t now_ns(const live_loop *loop) { return machine_now(drives_of(loop)); }

static void trip(const live_loop *loop, int64_t reason)
{
    ((void (*)(double *, long, int))loop->guard_trip)(guard_of(loop), (long)reason, 0);
}

/* --- supervisor: orders in, happenings out ------------------------------------------------------------------------ */

/* Tell the supervisor what has happened; a supervisor that does not read loses it, and the loop goes on. */
static void tell(live_loop *loop, int64_t kind, double value, int64_t period)
{
    const int64_t count = loop->happened;
    if (count - (int64_t)load(&loop->heard) >= HAPPENINGS) {
        loop->unheard += 1;
        return;
    }
    loop->happenings[count % HAPPENINGS] = (happening_place){kind, value, loop->now, now_ns(loop), period};
    store(&loop->happened, (uint64_t)count + 1);
}

/* Give an order; return 0 if there is no room, because the loop has not taken the last ones. For the supervisor. */
int64_t loop_order(live_loop *loop, const order_place *order)
{
    const int64_t count = loop->ordered;
    if (count - (int64_t)load(&loop->taken) >= ORDERS)
        return 0;
    loop->orders[count % ORDERS] = *order;
    store(&loop->ordered, (uint64_t)count + 1);
    return 1;
}

/* Copy the next happening; return 0 if there is none. For the supervisor. */
int64_t loop_hear(live_loop *loop, happening_place *happening)
{
    if (loop->heard == (int64_t)load(&loop->happened))
        return 0;
    *happening = loop->happenings[loop->heard % HAPPENINGS];
    store(&loop->heard, (uint64_t)loop->heard + 1);
    return 1;
}

/* Ask for a soft descent and the end of the loop. For the supervisor. */
void loop_end(live_loop *loop) { store(&loop->end_asked, load(&loop->end_asked) + 1); }

/* Say that the supervisor lives. For the supervisor. */
void loop_beat(live_loop *loop) { store(&loop->beat_ns, (uint64_t)now_ns(loop)); }

static void press_stop(live_loop *loop)
{
    loop->acts |= ACT_STOP_PRESSED;
    loop->is_ending = 1;
    trip(loop, GUARD_STOP_PRESSED);
}

/* Lead the felt level to another one, under the conditions of `Guard.feel`. Before the first stop only. */
static void feel(live_loop *loop, double level, double ramp_s, int64_t period)
{
    double *r = guard_of(loop), step = loop->period_s / loop->level_s;
    const int may = !loop->has_latched && r[GUARD_WORN] != 0.0 && r[GUARD_DRIVEN] == 0.0 && r[GUARD_STOP] == 0.0;
    const double most = r[GUARD_CONSENT] > 0.0 ? LEVEL_MOST : 1.0;
    if (!may || !(0.0 <= level && level <= most) || !(0.0 <= ramp_s && ramp_s < INFINITY)) {
        tell(loop, HAPPENED_REFUSED, level, period);
        return;
    }
    if (ramp_s > 0.0) {
        const double longest = fabs(level - r[GUARD_LEVEL]) * loop->period_s / ramp_s;
        step = longest < step ? longest : step;
    }
    r[GUARD_LEVEL_WANTED] = level;
    r[GUARD_LEVEL_STEP] = step;
    r[GUARD_LEVEL_MOVES] = 1.0;
    loop->acts |= ACT_TOLD_LEVEL;
    tell(loop, HAPPENED_FELT, level, period);
}

/* Take the wearer's consent to levels above 1, under the conditions of `Guard.consent`. */
static void consent(live_loop *loop, int64_t period)
{
    double *r = guard_of(loop);
    const int may = r[GUARD_WORN] != 0.0 && r[GUARD_STOP] == 0.0;
    if (may) {
        r[GUARD_CONSENT] = CONSENT_S;
        loop->acts |= ACT_CONSENTED;
    }
    tell(loop, HAPPENED_AGREED, may ? 1.0 : 0.0, period);
}

/* Take the limits of the person as identified. The felt level in force stays. */
static void wear(live_loop *loop, const double *person, void *table, int64_t period)
{
    double *r = guard_of(loop);
    const int64_t *places = loop->person_places;
    const double level = r[GUARD_WORN] != 0.0 ? r[GUARD_LEVEL] : 0.0;
    for (int64_t k = 0; k < loop->person_size; k++)
        r[places[k]] = person[places[k]];
    r[GUARD_LEVEL] = level;
    loop->table = table;
    loop->persons += 1;
    loop->acts |= ACT_TOLD_PERSON;
    tell(loop, HAPPENED_WORN, 0.0, period);
}

/* Take at most one order, and look after the supervisor: its silence means the end. */
static void obey(live_loop *loop, int64_t period)
{
    const int64_t asked = (int64_t)load(&loop->end_asked), beat_ns = (int64_t)load(&loop->beat_ns);
    if (asked != loop->end_taken) {
        loop->end_taken = asked;
        press_stop(loop);
    } else if (beat_ns != 0 && !loop->is_ending && now_ns(loop) - beat_ns > loop->alone_after_ns) {
        tell(loop, HAPPENED_ALONE, 0.0, period);
        press_stop(loop);
    }
    if (loop->taken == (int64_t)load(&loop->ordered))
        return;
    const order_place order = loop->orders[loop->taken % ORDERS];
    store(&loop->taken, (uint64_t)loop->taken + 1);
    if (order.kind == ORDER_FEEL)
        feel(loop, order.numbers[0], order.numbers[1], period);
    else if (order.kind == ORDER_CONSENT)
        consent(loop, period);
    else if (order.kind == ORDER_WEAR)
        wear(loop, order.record, order.table, period);
    else if (order.kind == ORDER_TRIP) {
        loop->acts |= ACT_DRIFTED;
        trip(loop, (int64_t)order.numbers[0]);
    }
}

/* --- one tick ----------------------------------------------------------------------------------------------------- */

/* Write the newest measurement into the guard's record. */
static void put_measurement(const live_loop *loop)
{
    const drive_machine *drives = drives_of(loop);
    double *r = guard_of(loop);
    r[GUARD_NOW] = loop->now;
    r[GUARD_CAME] = r[GUARD_IN_CURRENT] = 1.0;
    r[GUARD_SEQUENCE_IN] = (double)drives->state_sequence;
    r[GUARD_T_IN] = drives->state_t;
    r[GUARD_HAS_MOTOR] = drives->has_q_motor ? 1.0 : 0.0;
    for (int64_t j = 0; j < loop->joints; j++) {
        r[GUARD_Q_IN + j] = drives->q[j];
        r[GUARD_CURRENT_IN + j] = drives->joint_current[j];
        r[GUARD_TAU_IN + j] = NAN;
        if (drives->has_q_motor)
            r[GUARD_Q_MOTOR_IN + j] = drives->q_motor[j];
        r[GUARD_FAULTY_IN + j] = drives->faulty >> j & 1 ? 1.0 : 0.0;
    }
}

/* Begin at the present motor torque, as a replay does. */
static void begin(live_loop *loop, int64_t woken)
{
    double *r = guard_of(loop);
    for (int64_t j = 0; j < loop->joints; j++)
        r[GUARD_DESIRED + j] = loop->gain[j] * drives_of(loop)->joint_current[j];
    ((void (*)(double *))loop->guard_begin_torque)(r);
    loop->has_begun = 1;
    loop->started_ns = woken;
}

static void send_state(const live_loop *loop)
{
    const drive_machine *drives = drives_of(loop);
    const double *r = guard_of(loop);
    const state_places *at = &loop->state_at;
    PUT_AT(loop->state, at->sequence, int64_t, drives->state_sequence);
    PUT_AT(loop->state, at->now, double, loop->now);
    PUT_AT(loop->state, at->safe_state, int64_t, loop->safe_state);
    PUT_AT(loop->state, at->persons, int64_t, loop->persons);
    PUT_AT(loop->state, at->gravity_level, double, r[GUARD_WORN] != 0.0 ? r[GUARD_LEVEL] : 0.0);
    const size_t bytes = (size_t)loop->joints * sizeof(double);
    memcpy((uint8_t *)loop->state + at->q, drives->q, bytes);
    memcpy((uint8_t *)loop->state + at->current, drives->joint_current, bytes);
    mailbox_write(&loop->states, loop->state);
}

/* Ask control, and wait for its answer until the deadline; return 1 if it came. An answer with a mode that does not
   exist is no answer. */
static int is_answered(live_loop *loop, int64_t woken)
{
    const int64_t sequence = drives_of(loop)->state_sequence;
    const int waits = loop->silent < loop->given_up_after || sequence % loop->asked_again_every == 0;
    const int64_t until = woken + (waits ? loop->answer_by_ns : 0);
    send_state(loop);
    for (;;) {
        if (mailbox_read(&loop->answers, loop->answer) && int_at(loop->answer, loop->answer_at.sequence) == sequence) {
            const int64_t mode = int_at(loop->answer, loop->answer_at.mode);
            if (mode < 0 || mode >= loop->modes)
                break;
            loop->silent = 0;
            return 1;
        }
        const int64_t now = now_ns(loop);
        if (now >= until)
            break;
        machine_sleep_until(drives_of(loop), now + loop->poll_ns);
    }
    loop->unanswered += 1;
    loop->silent += 1;
    return 0;
}

static void enter_mode(live_loop *loop, int64_t period)
{
    const int64_t mode = int_at(loop->answer, loop->answer_at.mode);
    if (mode != loop->mode) {
        loop->mode = mode;
        loop->phase += 1;
        tell(loop, HAPPENED_MODE, (double)mode, period);
    }
}

/* Hand control's answer to the guard, and let it decide. */
static void decide(const live_loop *loop, int has_answer)
{
    double *r = guard_of(loop);
    r[GUARD_NOW] = loop->now;
    r[GUARD_SPOKE] = has_answer ? 1.0 : 0.0;
    if (has_answer) {
        r[GUARD_ANSWERS] = (double)int_at(loop->answer, loop->answer_at.sequence);
        r[GUARD_VALID_UNTIL] = double_at(loop->answer, loop->answer_at.valid_until);
        memcpy(&r[GUARD_ANSWER_IN], (const uint8_t *)loop->answer + loop->answer_at.tau,
               (size_t)loop->joints * sizeof(double));
    }
    ((void (*)(double *, double *))loop->guard_decide)(r, loop->table);
}

/* Send the decided torque as currents, and the damping of isolated joints. */
static void send_command(const live_loop *loop, const double *damping)
{
    const double *r = guard_of(loop);
    double current[DRIVE_JOINTS];
    for (int64_t j = 0; j < loop->joints; j++)
        current[j] = r[GUARD_TAU + j] / loop->gain[j];
    const int64_t answers = drives_of(loop)->state_sequence;
    ((write_function)loop->write_drives)(loop->drives, answers, loop->now + loop->life_s, current, damping);
}

static void drive_damping(const live_loop *loop, double *damping)
{
    const double *r = guard_of(loop);
    for (int64_t j = 0; j < loop->joints; j++) {
        const double share = r[GUARD_ISOLATED + j] + (GUARD_WITHOUT_MODEL_SHARE - 1.0) * r[GUARD_POWERLESS + j];
        damping[j] = r[GUARD_STOP] == 0.0 ? 0.0 : share * r[GUARD_DAMPING + j];
    }
}

static void look_for_stop(live_loop *loop, double stop, int64_t period)
{
    if (stop != 0.0 && !loop->was_stopped) {
        loop->has_latched = 1;
        tell(loop, HAPPENED_STOP, stop, period);
    }
    loop->was_stopped = stop != 0.0;
}

/* --- record ------------------------------------------------------------------------------------------------------- */

static void put_answer(const live_loop *loop, int has_answer)
{
    const tick_places *at = &loop->tick_at;
    const answer_places *from = &loop->answer_at;
    const uint8_t *answer = loop->answer;
    PUT_AT(loop->row, at->drive, double, has_answer ? double_at(answer, from->drive) : NAN);
    PUT_AT(loop->row, at->gravity_level, double, has_answer ? double_at(answer, from->gravity_level) : NAN);
    PUT_AT(loop->row, at->arm_share, double, has_answer ? double_at(answer, from->arm_share) : NAN);
    PUT_AT(loop->row, at->closure_slope, float, has_answer ? double_at(answer, from->slope) : NAN);
    PUT_AT(loop->row, at->seen, uint32_t, has_answer ? int_at(answer, from->seen) : 0);
    if (has_answer)
        PUT_AT(loop->row, at->control, uint32_t, int_at(answer, from->findings));
    for (int64_t j = 0; j < loop->joints; j++) {
        const int64_t k = 8 * j;
        PUT_AT(loop->row, at->v + k, double, has_answer ? double_at(answer, from->v + k) : NAN);
        PUT_AT(loop->row, at->q_reference + k, double, has_answer ? double_at(answer, from->q_reference + k) : NAN);
        PUT_AT(loop->row, at->tau_desired + k, double, has_answer ? double_at(answer, from->tau + k) : NAN);
        PUT_AT(loop->row, at->tau_feedforward + 4 * j, float,
               has_answer ? double_at(answer, from->tau_feedforward + k) : NAN);
    }
}

static void record(live_loop *loop, int64_t period, int has_answer, int64_t woken)
{
    const drive_machine *drives = drives_of(loop);
    const double *r = guard_of(loop);
    const tick_places *at = &loop->tick_at;
    const int64_t late = woken - loop->started_ns - period * (int64_t)rint(1e9 * loop->period_s);
    PUT_AT(loop->row, at->now, double, loop->now);
    PUT_AT(loop->row, at->t, double, drives->state_t);
    PUT_AT(loop->row, at->acts, uint32_t, loop->acts);
    PUT_AT(loop->row, at->faulty, uint32_t, drives->faulty);
    PUT_AT(loop->row, at->phase, uint32_t, loop->phase);
    PUT_AT(loop->row, at->sequence, uint32_t, drives->state_sequence);
    PUT_AT(loop->row, at->safe_state, uint32_t, loop->safe_state + 1);
    PUT_AT(loop->row, at->lateness_us, float, 1e-3 * (double)(late > 0 ? late : 0));
    for (int64_t j = 0; j < loop->joints; j++) {
        const int64_t k = 8 * j;
        PUT_AT(loop->row, at->q_measured + k, double, drives->q[j]);
        PUT_AT(loop->row, at->q_motor + k, double, drives->has_q_motor ? drives->q_motor[j] : NAN);
        PUT_AT(loop->row, at->current + k, double, drives->joint_current[j]);
        PUT_AT(loop->row, at->tau_commanded + k, double, r[GUARD_TAU + j]);
        PUT_AT(loop->row, at->tau_measured + 4 * j, float, loop->gain[j] * drives->joint_current[j]);
    }
    put_answer(loop, has_answer);
    PUT_AT(loop->row, at->tick_us, float, 1e-3 * (double)(now_ns(loop) - woken));
    ring_put(&loop->ticks, loop->row);
    loop->acts = 0;
}

/* Hand the guard's state to the recorder, from time to time. */
static void keep_guard(live_loop *loop)
{
    if (loop->now < loop->keeps_next)
        return;
    const guard_places *at = &loop->guard_at;
    const int64_t *places = loop->guard_places;
    const double *r = guard_of(loop);
    loop->keeps_next = loop->now + loop->keeps_every_s;
    PUT_AT(loop->guard_row, at->now, double, loop->now);
    PUT_AT(loop->guard_row, at->t, double, drives_of(loop)->state_t);
    PUT_AT(loop->guard_row, at->persons, int64_t, loop->persons);
    double *numbers = (double *)((uint8_t *)loop->guard_row + at->numbers);
    for (int64_t k = 0; k < loop->guard_size; k++)
        numbers[k] = r[places[k]];
    ring_put(&loop->guards, loop->guard_row);
}

/* Run one tick; return 1 to end the loop early. */
int64_t loop_tick(live_loop *loop, int64_t period)
{
    double *r = guard_of(loop), damping[DRIVE_JOINTS];
    const int64_t woken = now_ns(loop);
    ((void (*)(void *))loop->read_drives)(loop->drives);
    loop->now = machine_time(drives_of(loop));
    if (!loop->has_begun)
        begin(loop, woken);
    PUT_AT(loop->row, loop->tick_at.monotonic, double, 1e-9 * (double)now_ns(loop));
    put_measurement(loop);
    ((void (*)(double *))loop->guard_see)(r);
    const int has_answer = r[GUARD_USABLE] != 0.0 && is_answered(loop, woken);
    const double slope = has_answer ? double_at(loop->answer, loop->answer_at.slope) : 0.0;
    if (has_answer)
        enter_mode(loop, period);
    decide(loop, has_answer);
    const double stop = r[GUARD_STOP];
    drive_damping(loop, damping);
    if (!(slope < loop->slope_max))
        trip(loop, GUARD_MODEL_LOST); /* from the next tick on: this torque is limited already */
    send_command(loop, damping);
    loop->safe_state = (int64_t)r[GUARD_SAFE_STATE];
    look_for_stop(loop, stop, period);
    record(loop, period, has_answer, woken);
    keep_guard(loop);
    obey(loop, period);
    if (loop->ends_stopped && !loop->is_ending && period + 1 >= loop->flies) {
        loop->is_time_over = 1; /* a worn machine is let down before its drives are switched off */
        press_stop(loop);
    }
    const int is_over = loop->is_ending || (loop->was_stopped && loop->ends_stopped);
    return is_over && r[GUARD_SINCE_STOP] >= r[GUARD_DESCENT_S];
}

/* --- loop --------------------------------------------------------------------------------------------------------- */

/* Sleep until a period begins; return 0 if it has begun already. */
static int has_rested(const live_loop *loop, int64_t deadline)
{
    const int sleeps = deadline - loop->spin_ns > now_ns(loop);
    if (sleeps)
        machine_sleep_until(drives_of(loop), deadline - loop->spin_ns);
    while (now_ns(loop) < deadline)
        ;
    return sleeps;
}

/* Run the loop to its end. A late tick starts at once; a period that is over is skipped, and not repeated. */
void loop_run(live_loop *loop)
{
    const int64_t start = now_ns(loop) + loop->lead_ns;
    int64_t *period_of = loop->period_of, *lateness_ns = loop->lateness_ns, *compute_ns = loop->compute_ns;
    int64_t period = 0, restless = 0, is_last = 0;
    while (period < loop->periods && restless < loop->rest_at_least_every && !is_last) {
        const int64_t deadline = start + period * loop->period_ns;
        restless = has_rested(loop, deadline) ? 0 : restless + 1;
        const int64_t woken = now_ns(loop);
        is_last = loop_tick(loop, period);
        const int64_t done = now_ns(loop), next = (done - start) / loop->period_ns;
        period_of[loop->ran] = period;
        lateness_ns[loop->ran] = woken - deadline;
        compute_ns[loop->ran] = done - woken;
        loop->ran += 1;
        period = next > period + 1 ? next : period + 1;
        loop->passed = period;
    }
    const int is_complete = period >= loop->periods || (is_last && loop->is_time_over);
    loop->outcome = is_complete ? OUTCOME_COMPLETE : is_last ? OUTCOME_ENDED_EARLY : OUTCOME_NO_REST;
}
