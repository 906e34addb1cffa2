/* Made from the classes in record.py; do not edit. docs/explanation/realtime.md says how. */
#pragma once
#include <stdint.h>
#define LAYOUT_OF_LOCK_STEP 606426792

#define ARMS 2
#define RAMPS 2
#define FINISHED 0
#define NOT_FINITE 1
#define DIVERGED 2
#define GUARD_CAME 35
#define GUARD_SEQUENCE_IN 36
#define GUARD_T_IN 37
#define GUARD_NOW 38
#define GUARD_IN_CURRENT 39
#define GUARD_HAS_MOTOR 40
#define GUARD_SPOKE 41
#define GUARD_ANSWERS 42
#define GUARD_VALID_UNTIL 43
#define GUARD_Q_IN 336
#define GUARD_CURRENT_IN 352
#define GUARD_TAU_IN 368
#define GUARD_Q_MOTOR_IN 384
#define GUARD_ANSWER_IN 416
#define GUARD_TAU 480
#define GUARD_ISOLATED 544
#define GUARD_POWERLESS 560
#define GUARD_DAMPING 112
#define GUARD_STOP 44
#define GUARD_USABLE 58
#define GUARD_SAFE_STATE 69
#define GUARD_WITHOUT_MODEL_SHARE 2.0
#define ROW_T 0
#define ROW_NOW 1
#define ROW_MONOTONIC 2
#define ROW_DRIVE 3
#define ROW_GRAVITY_LEVEL 4
#define ROW_ARM_SHARE 5
#define ROW_CLOSURE_SLOPE 6
#define ROW_TICK_US 7
#define ROW_LATENESS_US 8
#define ROW_SAFE_STATE 9
#define ROW_SEQUENCE 10
#define ROW_CONTROL 11
#define ROW_SEEN 12
#define ROW_FAULTY 13
#define ROW_ACTS 14
#define ROW_PHASE 15
#define ROW_SCALARS 16
#define ROW_FIELD_Q_MEASURED 0
#define ROW_FIELD_Q_REFERENCE 1
#define ROW_FIELD_V_REFERENCE 2
#define ROW_FIELD_A_REFERENCE 3
#define ROW_FIELD_Q_MOTOR 4
#define ROW_FIELD_V 5
#define ROW_FIELD_CURRENT 6
#define ROW_FIELD_TAU_MEASURED 7
#define ROW_FIELD_TAU_FEEDFORWARD 8
#define ROW_FIELD_TAU_DESIRED 9
#define ROW_FIELD_TAU_COMMANDED 10

typedef struct ramp {
    int64_t size;
    void *start;
    void *goal;
    void *x;
    void *counts;
    void *written;
} ramp;

typedef struct arm {
    int64_t freedoms;
    void *torques;
    void *now;
} arm;

typedef struct pole {
    void *abduction;
    void *inertia;
    void *engine_damping;
    void *velocity;
    void *forces;
    void *is_near;
    int64_t places[3];
    int64_t turning[2];
    double damping[2];
    double damping_step;
    double stable_share;
    double far_cosine;
} pole;

typedef struct lock_step {
    int64_t joints;
    int64_t substeps;
    int64_t velocities;
    int64_t arms;
    int64_t ramps;
    int64_t poles;
    int64_t has_motor;
    void *sensors;
    void *sensors_memory;
    void *noise;
    void *noise_now;
    void *q;
    void *current;
    void *q_motor;
    void *forces;
    void *forces_memory;
    void *first_half;
    void *second_half;
    void *model;
    void *data;
    void *velocity;
    void *current_in;
    void *damping_in;
    void *valid_until_in;
    void *see;
    void *decide;
    void *guard;
    void *table;
    void *observer;
    void *observer_memory;
    void *q_measured;
    void *q_observed;
    void *v_observed;
    void *law;
    void *law_memory;
    void *law_q;
    void *law_v;
    void *law_q_reference;
    void *law_v_reference;
    void *law_a_reference;
    void *mode;
    void *tau_desired;
    void *tau_feedforward;
    void *slope;
    void *gain;
    void *q_path;
    void *v_path;
    void *a_path;
    void *tau_measured;
    void *tau_commanded;
    void *row;
    arm arm[2];
    pole pole[2];
    ramp ramp[2];
    int64_t tick;
    int64_t sequence;
    int64_t noise_row;
    int64_t muscle_row;
    int64_t is_usable;
    double t;
    double command_life;
    double drive;
    double gravity_level;
    double arm_share;
    double control;
    double acts;
    double phase;
    double tick_us;
} lock_step;
