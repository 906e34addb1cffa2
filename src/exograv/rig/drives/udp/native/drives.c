/* Translation of host.py and link.py; see drives.h. Compile without fast mathematics and without contraction: the same
   packets must give the same numbers as in Python. */
#define _GNU_SOURCE
#include "drives.h"

#include <math.h>
#include <string.h>

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "The protocol is little endian, and this file copies numbers as they are."
#endif

/* --- packets ------------------------------------------------------------------------------------------------------ */

static uint32_t crc_table[256];

__attribute__((constructor)) static void make_crc_table(void)
{
    for (uint32_t value = 0; value < 256; value++) {
        uint32_t rest = value;
        for (int bit = 0; bit < 8; bit++)
            rest = rest & 1 ? 0xEDB88320u ^ (rest >> 1) : rest >> 1;
        crc_table[value] = rest;
    }
}

/* CRC-32 of zlib. */
static uint32_t crc(const uint8_t *data, int64_t size)
{
    uint32_t rest = 0xFFFFFFFFu;
    for (int64_t k = 0; k < size; k++)
        rest = crc_table[(rest ^ data[k]) & 0xFF] ^ (rest >> 8);
    return rest ^ 0xFFFFFFFFu;
}

#define PUT(data, at, type, value)                                                                                    \
    do {                                                                                                              \
        const type put = (type)(value);                                                                               \
        memcpy((data) + (at), &put, sizeof put);                                                                      \
    } while (0)

static uint16_t u16_at(const uint8_t *data, int64_t at) { uint16_t value; memcpy(&value, data + at, 2); return value; }
static uint32_t u32_at(const uint8_t *data, int64_t at) { uint32_t value; memcpy(&value, data + at, 4); return value; }
static float f32_at(const uint8_t *data, int64_t at) { float value; memcpy(&value, data + at, 4); return value; }
static double f64_at(const uint8_t *data, int64_t at) { double value; memcpy(&value, data + at, 8); return value; }

static int64_t length(int kind, int64_t joints)
{
    /* A poll is as long as its answer, so that the controller cannot be used to amplify traffic. */
    return kind == UDP_COMMAND ? UDP_COMMAND_JOINTS_AT + joints * UDP_COMMAND_JOINT_BYTES + UDP_CRC_BYTES
                               : UDP_STATE_JOINTS_AT + joints * UDP_STATE_JOINT_BYTES + UDP_CRC_BYTES;
}

/* Begin a packet with a new sequence number, and return that number. The buffer must be empty. */
static uint32_t begin_packet(udp_drives *drives, uint8_t *data, int kind, int flags, uint32_t answers)
{
    drives->sequence += 1; /* 0 follows the last */
    PUT(data, UDP_HEADER_MAGIC_AT, uint32_t, UDP_MAGIC);
    PUT(data, UDP_HEADER_VERSION_AT, uint8_t, UDP_VERSION);
    PUT(data, UDP_HEADER_TYPE_AT, uint8_t, kind);
    PUT(data, UDP_HEADER_JOINTS_AT, uint8_t, drives->machine.joints);
    PUT(data, UDP_HEADER_FLAGS_AT, uint8_t, flags);
    PUT(data, UDP_HEADER_SESSION_AT, uint32_t, drives->session);
    PUT(data, UDP_HEADER_GRANT_AT, uint32_t, drives->grant);
    PUT(data, UDP_HEADER_SEQUENCE_AT, uint32_t, drives->sequence);
    PUT(data, UDP_HEADER_ANSWERS_AT, uint32_t, answers);
    PUT(data, UDP_HEADER_TIME_NS_AT, uint64_t, machine_now(&drives->machine));
    return drives->sequence;
}

static void end_packet(udp_drives *drives, uint8_t *data, int kind)
{
    const int64_t size = length(kind, drives->machine.joints), at = size - UDP_CRC_BYTES;
    PUT(data, at, uint32_t, crc(data, at));
    if (!machine_sends(&drives->machine, data, size))
        drives->counts[UDP_COUNT_NOT_SENT] += 1; /* no receiver, or a full buffer: the same as a lost packet */
}

/* Return the reason to refuse these bytes as a state of this session, or -1. */
static int refusal(const udp_drives *drives, const uint8_t *data, int64_t size)
{
    if (size < UDP_STATE_COMMAND_AT + UDP_CRC_BYTES)
        return UDP_COUNT_LENGTH;
    if (u32_at(data, UDP_HEADER_MAGIC_AT) != UDP_MAGIC)
        return UDP_COUNT_MAGIC;
    if (data[UDP_HEADER_VERSION_AT] != UDP_VERSION)
        return UDP_COUNT_VERSION;
    if (data[UDP_HEADER_TYPE_AT] != UDP_STATE)
        return UDP_COUNT_TYPE;
    const int64_t joints = data[UDP_HEADER_JOINTS_AT];
    if (joints > UDP_JOINTS_MAX || size != length(UDP_STATE, joints))
        return UDP_COUNT_LENGTH;
    if (u32_at(data, size - UDP_CRC_BYTES) != crc(data, size - UDP_CRC_BYTES))
        return UDP_COUNT_CRC;
    if (u32_at(data, UDP_HEADER_SESSION_AT) != drives->session || u32_at(data, UDP_HEADER_GRANT_AT) != drives->grant ||
        joints != drives->machine.joints)
        return UDP_COUNT_SESSION;
    return -1;
}

/* True if every drive that the controller hears reports a position and a current. */
static int has_numbers(const udp_drives *drives, const uint8_t *data)
{
    for (int64_t j = 0; j < drives->machine.joints; j++) {
        const uint8_t *joint = data + UDP_STATE_JOINTS_AT + j * UDP_STATE_JOINT_BYTES;
        if (u16_at(joint, UDP_STATE_JOINT_STATUS_AT) & UDP_PRESENT &&
            !(isfinite(f64_at(joint, UDP_STATE_JOINT_POSITION_AT)) &&
              isfinite(f32_at(joint, UDP_STATE_JOINT_CURRENT_AT))))
            return 0;
    }
    return 1;
}

static int is_newer(uint32_t sequence, uint32_t than)
{
    return sequence != than && sequence - than < 0x80000000u;
}

/* --- reading ------------------------------------------------------------------------------------------------------ */

/* Take a state of this session; return the poll that it answers, or NULL if it is old or has no numbers. */
static const udp_asked *answered(udp_drives *drives, const uint8_t *data)
{
    const uint32_t sequence = u32_at(data, UDP_HEADER_SEQUENCE_AT), answers = u32_at(data, UDP_HEADER_ANSWERS_AT);
    const udp_asked *poll = &drives->polls[answers % UDP_REMEMBERED];
    if (!is_newer(sequence, drives->heard) || poll->sequence != (int64_t)answers) {
        drives->counts[UDP_COUNT_SEQUENCE] += 1;
        return NULL;
    }
    if (!has_numbers(drives, data)) {
        drives->counts[UDP_COUNT_NUMBER] += 1;
        return NULL;
    }
    drives->heard = sequence;
    drives->states[poll->tick % UDP_REMEMBERED] = (udp_asked){sequence, poll->tick, poll->t};
    return poll;
}

/* Receive the newest state before `until_ns`; at once if it answers this tick's poll. */
static const udp_asked *collect(udp_drives *drives, uint8_t *newest, int64_t until_ns)
{
    const udp_asked *found = NULL;
    uint8_t data[UDP_BUFFER];
    for (int packets = 0; packets < UDP_READ_AT_ONCE; packets++) { /* a flood must not delay our tick */
        const int64_t size = machine_receives(&drives->machine, data, sizeof data, until_ns);
        if (size == MACHINE_NOTHING)
            break;
        if (size == MACHINE_FAILED) { /* an earlier packet found no receiver */
            drives->counts[UDP_COUNT_NOT_HEARD] += 1;
            if (machine_now(&drives->machine) >= until_ns)
                break;
            continue;
        }
        const int why = refusal(drives, data, size);
        if (why >= 0) {
            drives->counts[why] += 1;
            continue;
        }
        const udp_asked *poll = answered(drives, data);
        if (poll == NULL)
            continue;
        found = poll;
        memcpy(newest, data, (size_t)size);
        if (poll->tick == drives->machine.tick)
            return found;
    }
    drives->counts[UDP_COUNT_LATE] += 1;
    return found;
}

/* Take the part of one drive. A drive that the controller does not hear keeps its last position, and one whose newest
   sample is too old is lost. */
static void take_joint(udp_joint *joint, const uint8_t *said, double t, double stale_s)
{
    const int status = u16_at(said, UDP_STATE_JOINT_STATUS_AT);
    joint->code = u16_at(said, UDP_STATE_JOINT_CODE_AT);
    joint->temperature = f32_at(said, UDP_STATE_JOINT_TEMPERATURE_AT);
    joint->fault = u16_at(said, UDP_STATE_JOINT_FAULT_AT) & UDP_FAULTS;
    joint->is_wanted = (status & UDP_PRESENT) && (status & UDP_ENABLED);
    if (status & UDP_PRESENT) {
        joint->position = f64_at(said, UDP_STATE_JOINT_POSITION_AT);
        joint->motor_position = f64_at(said, UDP_STATE_JOINT_MOTOR_POSITION_AT);
        joint->current = f32_at(said, UDP_STATE_JOINT_CURRENT_AT);
        const int64_t sample = u16_at(said, UDP_STATE_JOINT_SAMPLES_AT);
        if (sample != joint->sample) {
            joint->sample = sample;
            joint->sampled_at = t;
        } else if (joint->counts_samples && t - joint->sampled_at > stale_s) {
            joint->fault |= UDP_LOST;
            joint->is_wanted = 0;
        }
    } else {
        joint->fault |= UDP_LOST;
        joint->current = 0.0;
    }
}

/* Note that no state has come for this tick. */
static void miss(udp_drives *drives, double t)
{
    const int is_lost = t - drives->heard_at > drives->lost_s;
    for (int64_t j = 0; is_lost && j < drives->machine.joints; j++) {
        drives->each[j].fault |= UDP_LOST;
        drives->each[j].is_wanted = 0;
    }
    drives->machine.incomplete += 1;
}

/* Hand the reports of the drives to the measurement. */
static void measure(udp_drives *drives, const udp_asked *asked)
{
    double position[DRIVE_JOINTS], current[DRIVE_JOINTS], motor_position[DRIVE_JOINTS];
    for (int64_t j = 0; j < drives->machine.joints; j++) {
        position[j] = drives->each[j].position;
        current[j] = drives->each[j].current;
        motor_position[j] = drives->each[j].motor_position;
    }
    machine_measure(&drives->machine, asked->t, asked->tick, position, current, motor_position);
}

void udp_read(udp_drives *drives)
{
    uint8_t packet[UDP_BUFFER] = {0}, newest[UDP_BUFFER];
    drives->machine.tick += 1;
    const double t = machine_time(&drives->machine);
    const int64_t until_ns = machine_now(&drives->machine) + drives->machine.answer_ns;
    const uint32_t sequence = begin_packet(drives, packet, UDP_POLL, 0, 0);
    end_packet(drives, packet, UDP_POLL);
    drives->polls[sequence % UDP_REMEMBERED] = (udp_asked){sequence, drives->machine.tick, t};
    const udp_asked *asked = collect(drives, newest, until_ns);
    if (asked == NULL) {
        miss(drives, t);
    } else {
        drives->heard_at = asked->t;
        drives->taken = u32_at(newest, UDP_STATE_COMMAND_AT);
        for (int64_t j = 0; j < drives->machine.joints; j++)
            take_joint(&drives->each[j], newest + UDP_STATE_JOINTS_AT + j * UDP_STATE_JOINT_BYTES, asked->t,
                       drives->stale_s);
        measure(drives, asked);
    }
    drives->machine.faulty = 0;
    for (int64_t j = 0; j < drives->machine.joints; j++)
        if (drives->each[j].fault || (drives->machine.is_on && !drives->each[j].is_wanted))
            drives->machine.faulty |= (int64_t)1 << j;
}

/* --- writing ------------------------------------------------------------------------------------------------------ */

static double bounded(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

int udp_write(udp_drives *drives, int64_t sequence, double valid_until, const double *current, const double *damping)
{
    uint8_t packet[UDP_BUFFER] = {0};
    double limited[DRIVE_JOINTS];
    if (!machine_limit(&drives->machine, current, damping, limited))
        return 0;
    for (int64_t j = 0; j < drives->machine.joints; j++) {
        uint8_t *joint = packet + UDP_COMMAND_JOINTS_AT + j * UDP_COMMAND_JOINT_BYTES;
        PUT(joint, UDP_COMMAND_JOINT_CURRENT_AT, float, limited[j]);
        PUT(joint, UDP_COMMAND_JOINT_DAMPING_AT, float, damping[j]);
    }
    if (machine_time(&drives->machine) > valid_until) {
        drives->machine.expired += 1;
        return 0;
    }
    const double now = machine_time(&drives->machine), left = valid_until - now;
    const double life_s = drives->watchdog_s < left ? drives->watchdog_s : left;
    const udp_asked *state = &drives->states[sequence % UDP_REMEMBERED];
    if (!(life_s > 0.0) || sequence < 0 || (state->tick != sequence && drives->machine.is_on)) {
        drives->machine.expired += 1;
        return 0;
    }
    PUT(packet, UDP_COMMAND_AGE_US_AT, uint32_t, bounded(rint(1e6 * (now - state->t)), 0.0, 4294967295.0));
    PUT(packet, UDP_COMMAND_LIFE_US_AT, uint32_t, bounded(trunc(1e6 * life_s), 0.0, 4294967295.0));
    begin_packet(drives, packet, UDP_COMMAND, drives->machine.is_on ? UDP_ENABLE : 0,
                 (uint32_t)(state->sequence > 0 ? state->sequence : 0));
    end_packet(drives, packet, UDP_COMMAND);
    return 1;
}
