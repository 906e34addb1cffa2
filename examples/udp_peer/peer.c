/* Controller that speaks docs/reference/udp_protocol.md, as a template: C99, no dependency, no allocation.
 *
 *     cc -std=c99 -O2 -Wall -Wextra -pedantic peer.c -lm -o peer && ./peer 47100
 *
 * On a microcontroller, replace `serve` by your network code, `motor_step` by your drives, and the random grant
 * by hardware random numbers. `controller_receive` and `controller_step` stay as they are.
 */
#define _POSIX_C_SOURCE 200809L
#include "exograv_udp.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define JOINTS 4
#define STATES 32 /* number of recent states that a command may answer */
#define PACKET_BYTES 1024
#define PERIOD_US 1000u
#define WATCHDOG_US 20000u

/* These values must equal those of drives.toml: name, rated and greatest current [A], brake [N m s/rad]; samples are counted. */
static const exograv_nameplate_joint PLATES[JOINTS] = {
    {"shoulder_flexion", 3.0f, 9.0f, 10.0f, 1},
    {"shoulder_abduction", 3.0f, 9.0f, 10.0f, 1},
    {"shoulder_rotation", 2.2f, 6.7f, 10.0f, 1},
    {"elbow_flexion", 2.2f, 6.7f, 4.0f, 1},
};

typedef struct {
    double q, v, temperature;
    float current;         /* current in the motor [A] */
    float asked, damping;  /* from the last command */
    int64_t told, until;   /* arrival of the last command, and end of its life [us] */
    uint16_t fault, samples;
    bool enabled;
} motor;

typedef struct {
    uint32_t address;
    uint16_t port;
} sender;

typedef struct {
    motor motors[JOINTS];
    uint32_t session, grant, newest, sequence, command, refused;
    sender host;
    int64_t heard; /* [us] */
    bool was_enabled;
    struct {
        uint32_t sequence;
        int64_t polled; /* [us] */
        bool is_there;
    } states[STATES];
    uint64_t random;
} controller;

/* ---- the motor: a pendulum, in place of a real one ---- */

static const double INERTIA = 0.5, WEIGHT = 5.0, FRICTION = 0.5, PER_AMPERE = 4.0, WARM_S = 60.0;

static void motor_off(motor *m, uint16_t fault) {
    m->fault |= fault;
    m->enabled = false;
    m->asked = 0.0f;
}

/* Apply the drive's own reactions first: watchdog, heat, the end of a command's life, its limit. */
static void motor_step(motor *m, const exograv_nameplate_joint *plate, int64_t now, double dt) {
    if (m->enabled && now - m->told > (int64_t)WATCHDOG_US) motor_off(m, EXOGRAV_FAULT_WATCHDOG);
    if (m->temperature > 110.0) motor_off(m, EXOGRAV_FAULT_TEMPERATURE);
    const bool is_driven = m->enabled && now < m->until;
    const float most = plate->current_max_A;
    m->current = !is_driven ? 0.0f : m->asked > most ? most : m->asked < -most ? -most : m->asked;
    const double damping = is_driven ? m->damping : plate->brake_Nms_per_rad;
    const double share = m->current / plate->current_rated_A;
    m->temperature += (25.0 + 60.0 * share * share - m->temperature) * dt / WARM_S;
    /* The damping is that of the coming step (implicit Euler), so the step is stable for any damping. */
    const double push = PER_AMPERE * m->current - WEIGHT * sin(m->q);
    m->v = (m->v + dt / INERTIA * push) / (1.0 + dt / INERTIA * (damping + FRICTION));
    m->q += dt * m->v;
    m->samples++; /* with a real drive: only when its sensors were read anew */
}

/* ---- the protocol ---- */

/* CRC-32 as in zlib, by half bytes: a table of 256 entries would be faster, but these 64 bytes are enough here. */
static uint32_t crc32_of(const uint8_t *data, size_t length) {
    static const uint32_t table[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
                                       0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                       0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    uint32_t crc = 0xffffffffu;
    for (size_t k = 0; k < length; ++k) {
        crc = (crc >> 4) ^ table[(crc ^ data[k]) & 15u];
        crc = (crc >> 4) ^ table[(crc ^ (uint32_t)(data[k] >> 4)) & 15u];
    }
    return ~crc;
}

static bool is_newer(uint32_t sequence, uint32_t than) {
    const uint32_t ahead = sequence - than;
    return ahead > 0 && ahead < 0x80000000u;
}

static void all_off(controller *c) {
    c->was_enabled = false;
    c->command = 0;
    memset(c->states, 0, sizeof c->states);
    for (int k = 0; k < JOINTS; ++k) motor_off(&c->motors[k], 0);
}

/* Random grant, different after every start and never 0, so that packets of an earlier session are refused.
 * Generator: xorshift64*, seeded at the start. */
static uint32_t next_grant(controller *c) {
    c->random ^= c->random >> 12;
    c->random ^= c->random << 25;
    c->random ^= c->random >> 27;
    const uint32_t drawn = (uint32_t)((c->random * UINT64_C(0x2545f4914f6cdd1d)) >> 32);
    return drawn ? drawn : 1u;
}

static size_t finish(controller *c, uint8_t *packet, size_t length, uint8_t type, uint8_t flags,
                     const exograv_header *asked, int64_t now) {
    const exograv_header header = {EXOGRAV_MAGIC, EXOGRAV_VERSION, type, JOINTS, flags, asked->session,
                                   flags & EXOGRAV_TAKEN ? 0 : c->grant, ++c->sequence, asked->sequence,
                                   (uint64_t)now * 1000u};
    memcpy(packet, &header, sizeof header);
    const uint32_t crc = crc32_of(packet, length - EXOGRAV_CRC_BYTES);
    memcpy(packet + length - EXOGRAV_CRC_BYTES, &crc, sizeof crc);
    return length;
}

static size_t nameplate(controller *c, uint8_t *answer, uint8_t flags, const exograv_header *asked, int64_t now) {
    exograv_nameplate own;
    memset(&own, 0, sizeof own);
    own.watchdog_us = WATCHDOG_US;
    own.period_us = PERIOD_US;
    memcpy(own.joint, PLATES, sizeof PLATES);
    memcpy(answer, &own, sizeof own);
    return finish(c, answer, EXOGRAV_HELLO_BYTES, EXOGRAV_NAMEPLATE, flags, asked, now);
}

static size_t state(controller *c, uint8_t *answer, const exograv_header *asked, int64_t now) {
    exograv_state own;
    memset(&own, 0, sizeof own);
    own.command = c->command;
    own.refused = c->refused;
    for (int k = 0; k < JOINTS; ++k) {
        const motor *m = &c->motors[k];
        exograv_state_joint *joint = &own.joint[k];
        joint->position = m->q;
        joint->motor_position = NAN;
        joint->current = m->current;
        joint->temperature = (float)m->temperature;
        joint->status = (uint16_t)(EXOGRAV_DRIVE_PRESENT | (m->enabled ? EXOGRAV_DRIVE_ENABLED : 0));
        joint->fault = m->fault;
        joint->samples = m->samples;
    }
    memcpy(answer, &own, offsetof(exograv_state, joint) + sizeof(exograv_state_joint) * JOINTS);
    const size_t length = finish(c, answer, EXOGRAV_STATE_BYTES(JOINTS), EXOGRAV_STATE, 0, asked, now);
    c->states[c->sequence % STATES].sequence = c->sequence;
    c->states[c->sequence % STATES].polled = now;
    c->states[c->sequence % STATES].is_there = true;
    return length;
}

static bool greet(controller *c, const exograv_header *h, sender from, int64_t now, bool *is_taken) {
    if (h->session == 0 || h->grant != 0) return false;
    const bool is_host = from.address == c->host.address && from.port == c->host.port;
    *is_taken = false;
    if (h->session == c->session && is_host) {
        if (!is_newer(h->sequence, c->newest)) return false;
    } else if (c->session != 0 && now - c->heard <= (int64_t)WATCHDOG_US) {
        *is_taken = true;
        return true;
    } else {
        c->session = h->session;
        c->grant = next_grant(c);
        c->host = from;
    }
    c->newest = h->sequence;
    c->heard = now;
    all_off(c);
    return true;
}

static void obey_one(controller *c, motor *m, const exograv_command_joint *told, uint8_t flags, int64_t now,
                     int64_t until) {
    if (!(flags & EXOGRAV_ENABLE)) {
        motor_off(m, 0);
        if (flags & EXOGRAV_ACKNOWLEDGE) /* clear the faults that are over */
            m->fault &= (uint16_t)(m->temperature > 95.0 ? EXOGRAV_FAULT_TEMPERATURE : 0);
    } else if (!c->was_enabled) { /* the first such command only enables, at zero torque */
        if (m->fault || m->enabled) return;
        m->enabled = true;
        m->asked = m->damping = 0.0f;
        m->told = m->until = now;
    } else if (m->enabled) {
        m->asked = told->current;
        m->damping = told->damping;
        m->told = now;
        m->until = until;
    }
}

/* Return true if the command is valid. Switching off is never too late; every other command may be. */
static bool obey(controller *c, const exograv_command *told, int64_t now) {
    for (int k = 0; k < JOINTS; ++k) {
        const exograv_command_joint *joint = &told->joint[k];
        if (!isfinite(joint->current) || !isfinite(joint->damping) || joint->damping < 0.0f) return false;
    }
    const exograv_header *h = &told->header;
    const int64_t by_poll = c->states[h->answers % STATES].polled + (int64_t)told->age_us;
    const int64_t until = (by_poll < now ? by_poll : now) + (int64_t)told->life_us;
    const bool is_known =
        c->states[h->answers % STATES].is_there && c->states[h->answers % STATES].sequence == h->answers;
    if ((h->flags & (EXOGRAV_ENABLE | EXOGRAV_ACKNOWLEDGE)) && (!is_known || until <= now)) return false;
    for (int k = 0; k < JOINTS; ++k) obey_one(c, &c->motors[k], &told->joint[k], h->flags, now, until);
    c->was_enabled = (h->flags & EXOGRAV_ENABLE) != 0;
    return true;
}

static bool has_right_length(const exograv_header *h, size_t length) {
    switch (h->type) {
        case EXOGRAV_HELLO: return h->joints == 0 && length == EXOGRAV_HELLO_BYTES;
        case EXOGRAV_POLL: return h->joints == JOINTS && length == EXOGRAV_STATE_BYTES(JOINTS);
        case EXOGRAV_COMMAND: return h->joints == JOINTS && length == EXOGRAV_COMMAND_BYTES(JOINTS);
        case EXOGRAV_BYE: return h->joints == JOINTS && length == EXOGRAV_BYE_BYTES;
        default: return false;
    }
}

static bool believe(controller *c, const uint8_t *data, size_t length, sender from, int64_t now, uint8_t *answer,
                    size_t *answered) {
    exograv_header h;
    uint32_t crc;
    if (length < EXOGRAV_BYE_BYTES) return false;
    memcpy(&h, data, sizeof h);
    if (h.magic != EXOGRAV_MAGIC || h.version != EXOGRAV_VERSION || !has_right_length(&h, length)) return false;
    memcpy(&crc, data + length - EXOGRAV_CRC_BYTES, sizeof crc);
    if (crc != crc32_of(data, length - EXOGRAV_CRC_BYTES)) return false;
    if (h.type == EXOGRAV_HELLO) {
        bool is_taken = false;
        if (!greet(c, &h, from, now, &is_taken)) return false;
        *answered = nameplate(c, answer, is_taken ? EXOGRAV_TAKEN : 0, &h, now);
        return true;
    }
    if (c->session == 0 || h.session != c->session || h.grant != c->grant) return false;
    if (from.address != c->host.address || from.port != c->host.port || !is_newer(h.sequence, c->newest)) return false;
    if (h.type == EXOGRAV_COMMAND) {
        exograv_command told;
        memset(&told, 0, sizeof told);
        memcpy(&told, data, length - EXOGRAV_CRC_BYTES);
        if (!obey(c, &told, now)) return false;
        c->command = h.sequence;
    }
    c->newest = h.sequence;
    c->heard = now;
    if (h.type == EXOGRAV_POLL) *answered = state(c, answer, &h, now);
    if (h.type == EXOGRAV_BYE) {
        all_off(c);
        c->session = 0;
    }
    return true;
}

/* Take one packet; return the number of bytes of `answer` (PACKET_BYTES) to send, never more than received. An invalid
 * packet is only counted. `now` [us] is any clock that never goes back. */
static size_t controller_receive(controller *c, const uint8_t *data, size_t length, sender from, int64_t now,
                                 uint8_t *answer) {
    size_t answered = 0;
    if (!believe(c, data, length, from, now, answer, &answered)) ++c->refused;
    return answered;
}

/* Advance one period; call this also when no packet arrives. */
static void controller_step(controller *c, int64_t now) {
    for (int k = 0; k < JOINTS; ++k) motor_step(&c->motors[k], &PLATES[k], now, 1e-6 * PERIOD_US);
}

static void controller_begin(controller *c, uint64_t seed) {
    memset(c, 0, sizeof *c);
    c->random = seed ? seed : 1u;
    for (int k = 0; k < JOINTS; ++k) c->motors[k].temperature = 25.0;
}

#ifndef EXOGRAV_WITHOUT_SOCKETS
/* ---- all code that depends on POSIX ---- */

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

static int64_t now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

static int serve(controller *c, uint16_t port) {
    static uint8_t data[PACKET_BYTES], answer[PACKET_BYTES];
    struct sockaddr_in own = {0}, from;
    socklen_t size = sizeof own;
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    own.sin_family = AF_INET;
    own.sin_port = htons(port);
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK); /* use the address of the cable to the host, never all addresses */
    if (fd < 0 || bind(fd, (struct sockaddr *)&own, sizeof own) != 0) {
        perror("peer: cannot listen on the port");
        return 1;
    }
    getsockname(fd, (struct sockaddr *)&own, &size);
    printf("listening on port %d\n", ntohs(own.sin_port));
    fflush(stdout);
    for (int64_t due = now_us() + PERIOD_US;; due += PERIOD_US) {
        int64_t left;
        if (due < now_us() - 100000) due = now_us();
        while ((left = due - now_us()) > 0) {
            struct timeval wait = {0, (suseconds_t)(left < 999999 ? left : 999999)};
            fd_set waiting;
            FD_ZERO(&waiting);
            FD_SET(fd, &waiting);
            if (select(fd + 1, &waiting, NULL, NULL, &wait) <= 0) continue;
            size = sizeof from;
            /* A datagram longer than any packet is cut, and then has a wrong length. */
            const ssize_t length = recvfrom(fd, data, sizeof data, 0, (struct sockaddr *)&from, &size);
            if (length < 0) continue;
            const sender who = {from.sin_addr.s_addr, from.sin_port};
            const size_t answered = controller_receive(c, data, (size_t)length, who, now_us(), answer);
            if (answered) sendto(fd, answer, answered, 0, (struct sockaddr *)&from, size);
        }
        controller_step(c, now_us());
    }
}

static void print_layout(void) {
#define AT(type, field) printf(#type " " #field " %zu\n", offsetof(exograv_##type, field))
    AT(header, magic), AT(header, version), AT(header, type), AT(header, joints), AT(header, flags);
    AT(header, session), AT(header, grant), AT(header, sequence), AT(header, answers), AT(header, time_ns);
    AT(nameplate, watchdog_us), AT(nameplate, period_us), AT(nameplate, joint);
    AT(nameplate_joint, name), AT(nameplate_joint, current_rated_A), AT(nameplate_joint, current_max_A);
    AT(nameplate_joint, brake_Nms_per_rad), AT(nameplate_joint, counts_samples);
    AT(state, command), AT(state, refused), AT(state, joint);
    AT(state_joint, position), AT(state_joint, motor_position), AT(state_joint, current);
    AT(state_joint, temperature), AT(state_joint, status), AT(state_joint, fault), AT(state_joint, code);
    AT(state_joint, samples);
    AT(command, age_us), AT(command, life_us), AT(command, joint);
    AT(command_joint, current), AT(command_joint, damping);
    printf("size hello %zu\nsize state %zu\nsize command %zu\nsize bye %zu\n", (size_t)EXOGRAV_HELLO_BYTES,
           (size_t)EXOGRAV_STATE_BYTES(JOINTS), (size_t)EXOGRAV_COMMAND_BYTES(JOINTS), (size_t)EXOGRAV_BYE_BYTES);
}

int main(int count, char **words) {
    static controller c;
    if (count > 1 && strcmp(words[1], "--layout") == 0) {
        print_layout();
        return 0;
    }
    controller_begin(&c, (uint64_t)now_us() * UINT64_C(0x9e3779b97f4a7c15) ^ (uint64_t)getpid());
    return serve(&c, (uint16_t)(count > 1 ? atoi(words[1]) : 47100));
}
#endif
