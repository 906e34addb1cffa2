/* Made from the classes in record.py; do not edit. docs/explanation/realtime.md says how. */
#pragma once
#include <stdint.h>
#define LAYOUT_OF_UDP_DRIVES 3636128477
#include "../../native/machine.h"

#define UDP_MAGIC 1447516229
#define UDP_VERSION 1
#define UDP_JOINTS_MAX 16
#define UDP_CRC_BYTES 4
#define UDP_REMEMBERED 64
#define UDP_READ_AT_ONCE 32
#define UDP_BUFFER 2048
#define UDP_FAULTS 255
#define UDP_LOST 64
#define UDP_PRESENT 2
#define UDP_ENABLED 1
#define UDP_ENABLE 1
#define UDP_HELLO 1
#define UDP_NAMEPLATE 2
#define UDP_POLL 3
#define UDP_STATE 4
#define UDP_COMMAND 5
#define UDP_BYE 6
#define UDP_COUNT_LENGTH 0
#define UDP_COUNT_CRC 1
#define UDP_COUNT_MAGIC 2
#define UDP_COUNT_VERSION 3
#define UDP_COUNT_TYPE 4
#define UDP_COUNT_NUMBER 5
#define UDP_COUNT_SESSION 6
#define UDP_COUNT_SEQUENCE 7
#define UDP_COUNT_DEAD 8
#define UDP_COUNT_LATE 9
#define UDP_COUNT_NOT_SENT 10
#define UDP_COUNT_NOT_HEARD 11
#define UDP_HEADER_MAGIC_AT 0
#define UDP_HEADER_VERSION_AT 4
#define UDP_HEADER_TYPE_AT 5
#define UDP_HEADER_JOINTS_AT 6
#define UDP_HEADER_FLAGS_AT 7
#define UDP_HEADER_SESSION_AT 8
#define UDP_HEADER_GRANT_AT 12
#define UDP_HEADER_SEQUENCE_AT 16
#define UDP_HEADER_ANSWERS_AT 20
#define UDP_HEADER_TIME_NS_AT 24
#define UDP_STATE_COMMAND_AT 32
#define UDP_STATE_REFUSED_AT 36
#define UDP_STATE_JOINT_POSITION_AT 0
#define UDP_STATE_JOINT_MOTOR_POSITION_AT 8
#define UDP_STATE_JOINT_CURRENT_AT 16
#define UDP_STATE_JOINT_TEMPERATURE_AT 20
#define UDP_STATE_JOINT_STATUS_AT 24
#define UDP_STATE_JOINT_FAULT_AT 26
#define UDP_STATE_JOINT_CODE_AT 28
#define UDP_STATE_JOINT_SAMPLES_AT 30
#define UDP_STATE_JOINTS_AT 40
#define UDP_STATE_JOINT_BYTES 32
#define UDP_COMMAND_AGE_US_AT 32
#define UDP_COMMAND_LIFE_US_AT 36
#define UDP_COMMAND_JOINT_CURRENT_AT 0
#define UDP_COMMAND_JOINT_DAMPING_AT 4
#define UDP_COMMAND_JOINTS_AT 40
#define UDP_COMMAND_JOINT_BYTES 8

typedef struct udp_asked {
    int64_t sequence;
    int64_t tick;
    double t;
} udp_asked;

typedef struct udp_joint {
    double position;
    double motor_position;
    double current;
    double temperature;
    int64_t fault;
    int64_t code;
    int64_t is_wanted;
    int64_t counts_samples;
    int64_t sample;
    double sampled_at;
} udp_joint;

typedef struct udp_drives {
    drive_machine machine;
    double lost_s;
    double stale_s;
    double watchdog_s;
    uint32_t session;
    uint32_t grant;
    uint32_t sequence;
    uint32_t heard;
    uint32_t taken;
    uint32_t spare;
    double heard_at;
    udp_asked polls[64];
    udp_asked states[64];
    udp_joint each[16];
    int64_t counts[12];
} udp_drives;
