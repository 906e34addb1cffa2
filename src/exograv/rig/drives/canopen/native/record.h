/* Made from the classes in record.py; do not edit. docs/explanation/realtime.md says how. */
#pragma once
#include <stdint.h>
#define LAYOUT_OF_CAN_DRIVES 2800350529
#include "../../native/machine.h"

#define CAN_COB_EMERGENCY 128
#define CAN_COB_MEASURED 384
#define CAN_COB_COMMAND 512
#define CAN_COB_MOTOR 640
#define CAN_COB_SLOW 896
#define CAN_COB_QUESTION 1536
#define CAN_COB_HEARTBEAT 1792
#define CAN_COB_NMT 0
#define CAN_COB_SYNC 128
#define CAN_LINK_SOCKETCAN 0
#define CAN_LINK_MULTICAST 1
#define CAN_STATE_NOT_READY 0
#define CAN_STATE_SWITCH_ON_DISABLED 1
#define CAN_STATE_READY 2
#define CAN_STATE_SWITCHED_ON 3
#define CAN_STATE_OPERATION_ENABLED 4
#define CAN_STATE_QUICK_STOP 5
#define CAN_STATE_FAULT_REACTION 6
#define CAN_STATE_FAULT 7
#define CAN_COUNT_NOT_SENT 0
#define CAN_COUNT_NOT_HEARD 1
#define CAN_MASTER 127
#define CAN_BOOTED 0
#define CAN_OPERATIONAL 5
#define CAN_FRAMES_AT_ONCE 64
#define CAN_MARK_BYTES 8
#define CAN_MEASURED_BYTES 8
#define CAN_MOTOR_BYTES 4
#define CAN_SLOW_BYTES 2
#define CAN_EMERGENCY_BYTES 3
#define CAN_COMMAND_BYTES 4
#define CAN_COMMAND_DAMPED_BYTES 6
#define CAN_DAMPING_MOST 65.535
#define CAN_PER_MILLE_MOST 32767
#define CAN_DISABLE_VOLTAGE 0
#define CAN_QUICK_STOP 2
#define CAN_LOST 64
#define CAN_OTHER_MASTER 32
#define CAN_INTERNAL 128
#define CAN_STATES 8
#define CAN_CLASSES 8

typedef struct can_owed {
    int64_t missing;
    int64_t came_late;
} can_owed;

typedef struct can_node {
    int64_t node;
    int64_t lost_after;
    int64_t misses;
    int64_t has_answered;
    int64_t is_wanted;
    int64_t fault;
    int64_t code;
    int64_t own_fault;
    int64_t position;
    int64_t motor_position;
    double current;
    double temperature;
    double amperes;
    int64_t state;
    int64_t control;
    int64_t has_damping;
    can_owed measured;
    can_owed motor;
} can_node;

typedef struct can_drives {
    drive_machine machine;
    int64_t link;
    uint32_t group;
    uint32_t port;
    uint8_t mark[8];
    int64_t told;
    int64_t beat_every;
    can_node each[16];
    int64_t counts[2];
} can_drives;
static const int64_t can_states[CAN_STATES][3] = {{0x4f, 0x0, 0}, {0x4f, 0x40, 1}, {0x6f, 0x21, 2}, {0x6f, 0x23, 3}, {0x6f, 0x27, 4}, {0x6f, 0x7, 5}, {0x4f, 0xf, 6}, {0x4f, 0x8, 7}};
static const int64_t can_classes[CAN_CLASSES][3] = {{0xffff, 0x8140, 0}, {0xff00, 0x8100, 1}, {0xff00, 0x8200, 1}, {0xff00, 0x7300, 8}, {0xff00, 0x9000, 16}, {0xf000, 0x2000, 4}, {0xf000, 0x4000, 2}, {0xffff, 0x0, 0}};
