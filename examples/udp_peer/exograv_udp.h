/* Layout of docs/reference/udp_protocol.md as C99 structs without padding, for little-endian processors.
 * The check below fails on others. A test compares it with src/exograv/rig/drives/udp/layout.py. */
#ifndef EXOGRAV_UDP_H
#define EXOGRAV_UDP_H

#include <stddef.h>
#include <stdint.h>

#define EXOGRAV_MAGIC 0x56475845u
#define EXOGRAV_VERSION 1
#define EXOGRAV_JOINTS_MAX 16
#define EXOGRAV_NAME_BYTES 32
#define EXOGRAV_CRC_BYTES 4

enum { EXOGRAV_HELLO = 1, EXOGRAV_NAMEPLATE, EXOGRAV_POLL, EXOGRAV_STATE, EXOGRAV_COMMAND, EXOGRAV_BYE };
enum { EXOGRAV_ENABLE = 1, EXOGRAV_ACKNOWLEDGE = 2, EXOGRAV_TAKEN = 4 };
enum { EXOGRAV_DRIVE_ENABLED = 1, EXOGRAV_DRIVE_PRESENT = 2 };
enum {
    EXOGRAV_FAULT_WATCHDOG = 1,
    EXOGRAV_FAULT_TEMPERATURE = 2,
    EXOGRAV_FAULT_CURRENT = 4,
    EXOGRAV_FAULT_ENCODER = 8,
    EXOGRAV_FAULT_STOP_LINE = 16,
    EXOGRAV_FAULT_OTHER_MASTER = 32,
    EXOGRAV_FAULT_LOST = 64,
    EXOGRAV_FAULT_INTERNAL = 128
};

typedef struct {
    uint32_t magic;
    uint8_t version, type, joints, flags;
    uint32_t session, grant, sequence, answers;
    uint64_t time_ns;
} exograv_header;

typedef struct {
    char name[EXOGRAV_NAME_BYTES];
    float current_rated_A, current_max_A, brake_Nms_per_rad;
    uint32_t counts_samples; /* 1 if the states count the samples of this drive */
} exograv_nameplate_joint;

typedef struct {
    double position, motor_position; /* [rad] */
    float current, temperature;      /* [A], [deg C] */
    uint16_t status, fault, code, samples;
} exograv_state_joint;

typedef struct {
    float current, damping; /* [A], [N m s/rad] */
} exograv_command_joint;

/* The check sum follows the last joint in the packet. Its place depends on the number of joints, so it is no member. */
typedef struct {
    exograv_header header;
    uint32_t watchdog_us, period_us;
    exograv_nameplate_joint joint[EXOGRAV_JOINTS_MAX];
} exograv_nameplate;

typedef struct {
    exograv_header header;
    uint32_t command, refused;
    exograv_state_joint joint[EXOGRAV_JOINTS_MAX];
} exograv_state;

typedef struct {
    exograv_header header;
    uint32_t age_us, life_us;
    exograv_command_joint joint[EXOGRAV_JOINTS_MAX];
} exograv_command;

#define EXOGRAV_HELLO_BYTES (sizeof(exograv_nameplate) + EXOGRAV_CRC_BYTES)
#define EXOGRAV_STATE_BYTES(n) (offsetof(exograv_state, joint) + (n) * sizeof(exograv_state_joint) + EXOGRAV_CRC_BYTES)
#define EXOGRAV_COMMAND_BYTES(n) \
    (offsetof(exograv_command, joint) + (n) * sizeof(exograv_command_joint) + EXOGRAV_CRC_BYTES)
#define EXOGRAV_BYE_BYTES (sizeof(exograv_header) + EXOGRAV_CRC_BYTES)

/* C99 has no _Static_assert: instead, an array of negative length does not compile. */
typedef char exograv_no_padding[sizeof(exograv_header) == 32 && sizeof(exograv_nameplate_joint) == 48 &&
                                        sizeof(exograv_state_joint) == 32 && sizeof(exograv_command_joint) == 8
                                    ? 1
                                    : -1];
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "exograv_udp.h is for little-endian processors"
#endif

#endif
