/* Made from the classes in record.py; do not edit. docs/explanation/realtime.md says how. */
#pragma once
#include <stdint.h>
#define LAYOUT_OF_DRIVE_MACHINE 3842134269

#define DRIVE_JOINTS 16
#define MACHINE_NOTHING -1
#define MACHINE_FAILED -2

typedef struct drive_machine {
    void *now_hook;
    void *sleep_hook;
    void *send_hook;
    void *receive_hook;
    int64_t socket;
    int64_t joints;
    int64_t tick;
    int64_t answer_ns;
    double began_s;
    int64_t is_on;
    int64_t has_motor;
    double sign[16];
    double offset[16];
    double of_count[16];
    double of_motor_count[16];
    double current_max[16];
    double state_t;
    int64_t state_sequence;
    int64_t has_q_motor;
    int64_t faulty;
    double q[16];
    double joint_current[16];
    double q_motor[16];
    int64_t limited;
    int64_t expired;
    int64_t incomplete;
} drive_machine;
