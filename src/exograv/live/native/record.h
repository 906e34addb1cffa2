/* Made from the classes in record.py; do not edit. docs/explanation/realtime.md says how. */
#pragma once
#include <stdint.h>
#define LAYOUT_OF_LIVE_LOOP 2464987283

#define GUARD_STOP 44
#define GUARD_SINCE_STOP 45
#define GUARD_DESCENT_S 5
#define GUARD_WORN 6
#define GUARD_LEVEL 48
#define GUARD_LEVEL_WANTED 49
#define GUARD_LEVEL_STEP 50
#define GUARD_LEVEL_MOVES 51
#define GUARD_CONSENT 67
#define GUARD_DRIVEN 52
#define GUARD_CAME 35
#define GUARD_SEQUENCE_IN 36
#define GUARD_T_IN 37
#define GUARD_NOW 38
#define GUARD_IN_CURRENT 39
#define GUARD_HAS_MOTOR 40
#define GUARD_SPOKE 41
#define GUARD_ANSWERS 42
#define GUARD_VALID_UNTIL 43
#define GUARD_USABLE 58
#define GUARD_SAFE_STATE 69
#define GUARD_Q_IN 336
#define GUARD_CURRENT_IN 352
#define GUARD_TAU_IN 368
#define GUARD_Q_MOTOR_IN 384
#define GUARD_FAULTY_IN 400
#define GUARD_ANSWER_IN 416
#define GUARD_DESIRED 432
#define GUARD_TAU 480
#define GUARD_ISOLATED 544
#define GUARD_POWERLESS 560
#define GUARD_DAMPING 112
#define GUARD_WITHOUT_MODEL_SHARE 2.0
#define GUARD_MODEL_LOST 4
#define GUARD_STOP_PRESSED 15
#define ORDER_NONE 0
#define ORDER_FEEL 1
#define ORDER_WEAR 2
#define ORDER_TRIP 3
#define ORDER_CONSENT 4
#define HAPPENED_NONE 0
#define HAPPENED_MODE 1
#define HAPPENED_STOP 2
#define HAPPENED_FELT 3
#define HAPPENED_REFUSED 4
#define HAPPENED_WORN 5
#define HAPPENED_ALONE 6
#define HAPPENED_AGREED 7
#define OUTCOME_RUNNING 0
#define OUTCOME_COMPLETE 1
#define OUTCOME_ENDED_EARLY 2
#define OUTCOME_NO_REST 3
#define ORDERS 16
#define HAPPENINGS 256
#define MAILBOX_SLOTS 4
#define ACT_STOP_PRESSED 2
#define ACT_TOLD_PERSON 8
#define ACT_TOLD_LEVEL 16
#define ACT_DRIFTED 32
#define ACT_CONSENTED 64
#define CONSENT_S 120.0
#define LEVEL_MOST 1.8
#define DESCENT 1

typedef struct order_place {
    int64_t kind;
    double numbers[2];
    void *record;
    void *table;
} order_place;

typedef struct happening_place {
    int64_t kind;
    double value;
    double now;
    int64_t at_ns;
    int64_t period;
} happening_place;

typedef struct mailbox_place {
    void *head;
    void *rows;
    int64_t stride;
    int64_t count;
    int64_t value_at;
    int64_t value_bytes;
    int64_t done_at;
} mailbox_place;

typedef struct state_places {
    int64_t sequence;
    int64_t now;
    int64_t safe_state;
    int64_t persons;
    int64_t asked;
    int64_t event;
    int64_t gravity_level;
    int64_t q;
    int64_t current;
} state_places;

typedef struct answer_places {
    int64_t sequence;
    int64_t valid_until;
    int64_t mode;
    int64_t findings;
    int64_t slope;
    int64_t drive;
    int64_t gravity_level;
    int64_t arm_share;
    int64_t seen;
    int64_t drift;
    int64_t drift_joint;
    int64_t drift_cause;
    int64_t drift_Nm;
    int64_t v;
    int64_t q_reference;
    int64_t tau;
    int64_t tau_feedforward;
} answer_places;

typedef struct tick_places {
    int64_t t;
    int64_t now;
    int64_t monotonic;
    int64_t drive;
    int64_t gravity_level;
    int64_t arm_share;
    int64_t phase;
    int64_t closure_slope;
    int64_t tick_us;
    int64_t lateness_us;
    int64_t safe_state;
    int64_t sequence;
    int64_t control;
    int64_t seen;
    int64_t faulty;
    int64_t acts;
    int64_t q_measured;
    int64_t q_reference;
    int64_t v_reference;
    int64_t a_reference;
    int64_t q_motor;
    int64_t v;
    int64_t current;
    int64_t tau_measured;
    int64_t tau_feedforward;
    int64_t tau_desired;
    int64_t tau_commanded;
} tick_places;

typedef struct guard_places {
    int64_t now;
    int64_t t;
    int64_t persons;
    int64_t size;
    int64_t numbers;
} guard_places;

typedef struct live_loop {
    void *drives;
    void *read_drives;
    void *write_drives;
    void *guard;
    void *table;
    void *guard_see;
    void *guard_decide;
    void *guard_trip;
    void *guard_begin_torque;
    mailbox_place states;
    mailbox_place answers;
    mailbox_place ticks;
    state_places state_at;
    answer_places answer_at;
    tick_places tick_at;
    mailbox_place guards;
    guard_places guard_at;
    void *guard_row;
    void *guard_places;
    int64_t guard_size;
    double keeps_every_s;
    double keeps_next;
    void *state;
    void *answer;
    void *row;
    void *person_places;
    int64_t person_size;
    int64_t joints;
    int64_t modes;
    int64_t periods;
    int64_t flies;
    int64_t period_ns;
    int64_t lead_ns;
    int64_t spin_ns;
    int64_t answer_by_ns;
    int64_t poll_ns;
    int64_t given_up_after;
    int64_t asked_again_every;
    int64_t rest_at_least_every;
    int64_t alone_after_ns;
    int64_t ends_stopped;
    double slope_max;
    double life_s;
    double level_s;
    double period_s;
    double gain[16];
    void *period_of;
    void *lateness_ns;
    void *compute_ns;
    int64_t has_begun;
    int64_t started_ns;
    double now;
    int64_t safe_state;
    int64_t phase;
    int64_t mode;
    int64_t was_stopped;
    int64_t has_latched;
    int64_t is_ending;
    int64_t is_time_over;
    int64_t acts;
    int64_t persons;
    int64_t unanswered;
    int64_t silent;
    int64_t ran;
    int64_t passed;
    int64_t outcome;
    int64_t beat_ns;
    int64_t end_asked;
    int64_t end_taken;
    int64_t ordered;
    int64_t taken;
    order_place orders[16];
    int64_t happened;
    int64_t heard;
    int64_t unheard;
    happening_place happenings[256];
} live_loop;
