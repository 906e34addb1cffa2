/* See drives.h. Compile without fast mathematics and without contraction: the same frames must give the same numbers as
   in Python. */
#define _GNU_SOURCE
#include "drives.h"

#include <errno.h>
#include <linux/can.h>
#include <math.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "The frames are little endian, and this file copies numbers as they are."
#endif

enum { DATAGRAM = 4096, FRAME_DATA = 8, NOT_HEARD = -1, NOTHING = 0, HEARD = 1 };

/* Frame with eleven-bit number and data. */
typedef struct {
    int64_t cob, size;
    uint8_t data[FRAME_DATA];
} frame;

/* --- datagrams of python-can's `udp_multicast`: a map in msgpack ---------------------------------------------------- */

typedef struct {
    const uint8_t *at, *end;
} reader;

/* Value of one entry: a number, or a text. */
typedef struct {
    int64_t number, size;
    const uint8_t *text; /* NULL for a number */
} value;

static int64_t big_endian(const uint8_t *at, int bytes)
{
    uint64_t number = 0;
    for (int k = 0; k < bytes; k++)
        number = number << 8 | at[k];
    return (int64_t)number;
}

/* Take so many bytes; return NULL if there are fewer. */
static const uint8_t *taken(reader *from, int64_t bytes)
{
    if (bytes < 0 || from->end - from->at < bytes)
        return NULL;
    const uint8_t *at = from->at;
    from->at += bytes;
    return at;
}

/* Take a number, a text or bytes; return 0 for anything else. A float counts as the number 0. */
static int is_taken(reader *from, value *found)
{
    static const int sizes[] = {1, 2, 4, 8};
    const uint8_t *kind = taken(from, 1);
    if (kind == NULL)
        return 0;
    *found = (value){0, 0, NULL};
    int64_t length = -1;
    if (*kind < 0x80 || *kind == 0xC0 || *kind == 0xC2 || *kind == 0xC3) {
        found->number = *kind == 0xC3 ? 1 : *kind < 0x80 ? *kind : 0;
        return 1;
    }
    if (*kind >= 0xCC && *kind <= 0xCF) { /* unsigned */
        const int bytes = sizes[*kind - 0xCC];
        const uint8_t *at = taken(from, bytes);
        if (at == NULL)
            return 0;
        found->number = big_endian(at, bytes);
        return 1;
    }
    if (*kind == 0xCA || *kind == 0xCB)
        return taken(from, *kind == 0xCA ? 4 : 8) != NULL;
    if (*kind >= 0xA0 && *kind < 0xC0)
        length = *kind & 0x1F;
    else if (*kind == 0xC4 || *kind == 0xD9) {
        const uint8_t *at = taken(from, 1);
        length = at == NULL ? -1 : *at;
    }
    found->text = taken(from, length);
    found->size = length;
    return found->text != NULL;
}

static int is(const value *text, const char *name)
{
    return text->size == (int64_t)strlen(name) && memcmp(text->text, name, strlen(name)) == 0;
}

/* Read a datagram; return 1 for a frame of another participant, 0 for any other. */
static int is_frame_in(const can_drives *drives, const uint8_t *data, int64_t size, frame *found)
{
    reader from = {data, data + size};
    const uint8_t *kind = taken(&from, 1);
    int64_t entries = -1;
    if (kind != NULL && *kind >= 0x80 && *kind < 0x90)
        entries = *kind & 0x0F;
    int is_data = 0;
    *found = (frame){-1, 0, {0}};
    for (int64_t k = 0; k < entries; k++) {
        value name, what;
        if (!is_taken(&from, &name) || name.text == NULL || !is_taken(&from, &what))
            return 0;
        if (is(&name, "arbitration_id") && what.text == NULL) {
            found->cob = what.number;
        } else if (is(&name, "data") && what.text != NULL && what.size <= FRAME_DATA) {
            memcpy(found->data, what.text, (size_t)what.size);
            found->size = what.size;
            is_data = 1;
        } else if ((is(&name, "is_extended_id") || is(&name, "is_remote_frame") || is(&name, "is_error_frame")) &&
                   what.number != 0) {
            return 0;
        } else if (is(&name, "channel") && what.text != NULL && what.size == CAN_MARK_BYTES &&
                   memcmp(what.text, drives->mark, CAN_MARK_BYTES) == 0) {
            return 0;
        }
    }
    return is_data && found->cob >= 0;
}

static uint8_t *put_text(uint8_t *at, const char *text)
{
    const size_t length = strlen(text);
    *at = (uint8_t)(0xA0 | length);
    memcpy(at + 1, text, length);
    return at + 1 + length;
}

static uint8_t *put_no(uint8_t *at, const char *name)
{
    at = put_text(at, name);
    *at = 0xC2;
    return at + 1;
}

/* Write a datagram as python-can does; return its size. */
static int64_t datagram_of(const can_drives *drives, const frame *sent, uint8_t *data)
{
    uint8_t *at = data;
    *at++ = 0x8B; /* eleven entries */
    at = put_text(at, "timestamp");
    *at++ = 0xCB;
    memset(at, 0, 8);
    at += 8;
    at = put_text(at, "arbitration_id");
    if (sent->cob < 0x80) {
        *at++ = (uint8_t)sent->cob;
    } else if (sent->cob < 0x100) {
        *at++ = 0xCC;
        *at++ = (uint8_t)sent->cob;
    } else {
        *at++ = 0xCD;
        *at++ = (uint8_t)(sent->cob >> 8);
        *at++ = (uint8_t)sent->cob;
    }
    at = put_no(at, "is_extended_id");
    at = put_no(at, "is_remote_frame");
    at = put_no(at, "is_error_frame");
    at = put_text(at, "channel");
    *at++ = 0xA0 | CAN_MARK_BYTES;
    memcpy(at, drives->mark, CAN_MARK_BYTES);
    at += CAN_MARK_BYTES;
    at = put_text(at, "dlc");
    *at++ = (uint8_t)sent->size;
    at = put_text(at, "data");
    *at++ = 0xC4;
    *at++ = (uint8_t)sent->size;
    memcpy(at, sent->data, (size_t)sent->size);
    at += sent->size;
    at = put_no(at, "is_fd");
    at = put_no(at, "bitrate_switch");
    at = put_no(at, "error_state_indicator");
    return at - data;
}

/* --- bus ---------------------------------------------------------------------------------------------------------- */

static int is_sent_to_group(can_drives *drives, const uint8_t *data, int64_t size)
{
    if (drives->machine.send_hook)
        return machine_sends(&drives->machine, data, size);
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((uint16_t)drives->port)};
    to.sin_addr.s_addr = htonl(drives->group);
    return sendto((int)drives->machine.socket, data, (size_t)size, MSG_DONTWAIT | MSG_NOSIGNAL, (struct sockaddr *)&to,
                  sizeof to) == size;
}

/* Send one frame. A full or disconnected adapter loses it; missing answers then show the loss. */
static void send_frame(can_drives *drives, int64_t cob, const uint8_t *data, int64_t size)
{
    int is_sent;
    if (drives->link == CAN_LINK_SOCKETCAN) {
        struct can_frame sent = {.can_id = (canid_t)cob, .len = (uint8_t)size};
        if (size > 0)
            memcpy(sent.data, data, (size_t)size);
        is_sent = machine_sends(&drives->machine, (const uint8_t *)&sent, sizeof sent);
    } else {
        frame sent = {cob, size, {0}};
        uint8_t datagram[DATAGRAM];
        if (size > 0)
            memcpy(sent.data, data, (size_t)size);
        is_sent = is_sent_to_group(drives, datagram, datagram_of(drives, &sent, datagram));
    }
    drives->counts[CAN_COUNT_NOT_SENT] += !is_sent;
}

/* Receive the next datagram before `until_ns`: HEARD for a frame of another participant. One that is none counts too. */
static int heard(can_drives *drives, frame *found, int64_t until_ns, int *budget)
{
    uint8_t data[DATAGRAM];
    while (*budget > 0) {
        *budget -= 1;
        const int64_t size = machine_receives(&drives->machine, data, sizeof data, until_ns);
        if (size == 0)
            return NOTHING;
        if (size < 0) {
            drives->counts[CAN_COUNT_NOT_HEARD] += 1;
            return NOT_HEARD;
        }
        if (drives->link == CAN_LINK_MULTICAST) {
            if (is_frame_in(drives, data, size, found))
                return HEARD;
            continue;
        }
        struct can_frame came;
        if (size < (int64_t)sizeof came)
            continue;
        memcpy(&came, data, sizeof came);
        if (came.can_id & (CAN_ERR_FLAG | CAN_RTR_FLAG | CAN_EFF_FLAG) || came.len > FRAME_DATA)
            continue;
        *found = (frame){came.can_id & CAN_SFF_MASK, came.len, {0}};
        memcpy(found->data, came.data, came.len);
        return HEARD;
    }
    return NOTHING;
}

/* --- one drive, as CanopenNode ------------------------------------------------------------------------------------ */

static int64_t in_table(const int64_t (*table)[3], int64_t rows, int64_t word, int64_t otherwise)
{
    for (int64_t k = 0; k < rows; k++)
        if ((word & table[k][0]) == table[k][1])
            return table[k][2];
    return otherwise;
}

static void hold_against(can_node *node, int64_t fault, int64_t code)
{
    node->fault |= fault;
    node->code = code ? code : node->code;
    node->is_wanted = 0;
    node->control = CAN_DISABLE_VOLTAGE;
}

static void came(can_node *node, can_owed *owed)
{
    owed->missing = owed->missing > 1 ? owed->missing - 1 : 0;
    owed->came_late = 1;
    node->has_answered = !(node->measured.missing || node->motor.missing);
}

static void on_measured(can_node *node, const frame *got)
{
    uint16_t word;
    int32_t position;
    int16_t per_mille;
    if (got->size < CAN_MEASURED_BYTES)
        return;
    node->misses = 0;
    came(node, &node->measured);
    memcpy(&word, got->data, sizeof word);
    memcpy(&position, got->data + 2, sizeof position);
    memcpy(&per_mille, got->data + 6, sizeof per_mille);
    node->position = position;
    node->state = in_table(can_states, CAN_STATES, word & 0xFF, CAN_STATE_NOT_READY);
    node->current = node->amperes * per_mille;
    const int is_in_fault = node->state == CAN_STATE_FAULT || node->state == CAN_STATE_FAULT_REACTION;
    node->own_fault = is_in_fault ? CAN_INTERNAL : 0;
    if (node->is_wanted && node->state != CAN_STATE_OPERATION_ENABLED) {
        node->is_wanted = 0;
        node->control = CAN_DISABLE_VOLTAGE;
    }
}

static void take(can_node *node, const frame *got)
{
    const int64_t kind = got->cob - node->node;
    if (kind == CAN_COB_MEASURED) {
        on_measured(node, got);
    } else if (kind == CAN_COB_MOTOR && got->size >= CAN_MOTOR_BYTES) {
        int32_t position;
        came(node, &node->motor);
        memcpy(&position, got->data, sizeof position);
        node->motor_position = position;
    } else if (kind == CAN_COB_SLOW && got->size >= CAN_SLOW_BYTES) {
        int16_t tenths;
        memcpy(&tenths, got->data, sizeof tenths);
        node->temperature = 0.1 * tenths;
    } else if (kind == CAN_COB_EMERGENCY && got->size >= CAN_EMERGENCY_BYTES) {
        uint16_t code;
        memcpy(&code, got->data, sizeof code);
        if (code)
            hold_against(node, in_table(can_classes, CAN_CLASSES, code, CAN_INTERNAL), code);
    } else if (kind == CAN_COB_HEARTBEAT && got->size > 0 && got->data[0] == CAN_BOOTED) {
        node->misses = node->lost_after;
        hold_against(node, CAN_LOST, 0);
    }
}

/* --- one period, as CanopenCycle ---------------------------------------------------------------------------------- */

static int is_of_another_host(const can_drives *drives, int64_t cob)
{
    if (cob == CAN_COB_NMT || cob == CAN_COB_SYNC || cob == CAN_COB_HEARTBEAT + CAN_MASTER)
        return 1;
    for (int64_t j = 0; j < drives->machine.joints; j++) {
        const int64_t node = drives->each[j].node;
        if (cob == CAN_COB_COMMAND + node || cob == CAN_COB_QUESTION + node)
            return 1;
    }
    return 0;
}

static void hear(can_drives *drives, const frame *got)
{
    const int is_other = is_of_another_host(drives, got->cob);
    for (int64_t j = 0; j < drives->machine.joints; j++) {
        if (is_other)
            hold_against(&drives->each[j], CAN_OTHER_MASTER, 0);
        else
            take(&drives->each[j], got);
    }
}

static int is_silent(const can_node *node) { return node->misses >= node->lost_after; }

static int all_answered(const can_drives *drives)
{
    for (int64_t j = 0; j < drives->machine.joints; j++)
        if (!drives->each[j].has_answered && !is_silent(&drives->each[j]))
            return 0;
    return 1;
}

static void owe(can_owed *owed) { owed->missing = owed->came_late ? owed->missing + 1 : 1; }

/* Ask every drive; return 1 if each that is not silent has answered in time. */
static int ask(can_drives *drives)
{
    frame got;
    int budget = CAN_READ_AT_ONCE, is_complete;
    while (heard(drives, &got, machine_now(&drives->machine), &budget) == HEARD)
        hear(drives, &got);
    for (int64_t j = 0; j < drives->machine.joints; j++) {
        can_node *node = &drives->each[j];
        node->misses += 1;
        node->has_answered = 0;
        owe(&node->measured);
        if (drives->machine.has_motor)
            owe(&node->motor);
    }
    const int64_t until_ns = machine_now(&drives->machine) + drives->machine.answer_ns;
    send_frame(drives, CAN_COB_SYNC, NULL, 0);
    budget = CAN_READ_AT_ONCE;
    while (!(is_complete = all_answered(drives)) && heard(drives, &got, until_ns, &budget) == HEARD)
        hear(drives, &got);
    for (int64_t j = 0; j < drives->machine.joints; j++) {
        can_node *node = &drives->each[j];
        node->measured.came_late = node->motor.came_late = 0;
        if (is_silent(node))
            hold_against(node, CAN_LOST, 0);
    }
    return is_complete;
}

void can_read(can_drives *drives)
{
    drive_machine *machine = &drives->machine;
    double position[DRIVE_JOINTS], current[DRIVE_JOINTS], motor_position[DRIVE_JOINTS];
    machine->tick += 1;
    const double t = machine_time(machine);
    const int is_complete = ask(drives);
    int all_silent = 1;
    machine->faulty = 0;
    for (int64_t j = 0; j < machine->joints; j++) {
        const can_node *node = &drives->each[j];
        all_silent = all_silent && is_silent(node);
        if (node->fault || node->own_fault || (machine->is_on && !node->is_wanted))
            machine->faulty |= (int64_t)1 << j;
        position[j] = (double)node->position;
        current[j] = node->current;
        motor_position[j] = (double)node->motor_position;
    }
    if (is_complete && !all_silent)
        machine_measure(machine, t, machine->tick, position, current, motor_position);
    else
        machine->incomplete += 1;
}

/* Write the command to a drive as `CanopenNode.order`; return its size. */
static int64_t order(can_node *node, double current, double damping, uint8_t *data)
{
    const int is_told = node->is_wanted && !node->fault;
    const double bounded = damping > CAN_DAMPING_MOST ? CAN_DAMPING_MOST : damping > 0.0 ? damping : 0.0;
    const int16_t per_mille = is_told ? (int16_t)rint(current / node->amperes) : 0;
    const uint16_t braking = (uint16_t)rint(1000.0 * bounded);
    if (!node->has_damping && braking && is_told)
        node->control = CAN_QUICK_STOP;
    const uint16_t control = (uint16_t)node->control;
    memcpy(data, &control, sizeof control);
    memcpy(data + 2, &per_mille, sizeof per_mille);
    memcpy(data + 4, &braking, sizeof braking);
    return node->has_damping ? CAN_COMMAND_DAMPED_BYTES : CAN_COMMAND_BYTES;
}

int can_write(can_drives *drives, int64_t sequence, double valid_until, const double *current, const double *damping)
{
    (void)sequence; /* commands on this bus carry no number */
    double limited[DRIVE_JOINTS];
    if (!machine_limit(&drives->machine, current, damping, limited))
        return 0;
    if (machine_time(&drives->machine) > valid_until) {
        drives->machine.expired += 1;
        return 0;
    }
    for (int64_t j = 0; j < drives->machine.joints; j++) {
        uint8_t data[FRAME_DATA];
        const int64_t size = order(&drives->each[j], limited[j], damping[j], data);
        send_frame(drives, CAN_COB_COMMAND + drives->each[j].node, data, size);
    }
    if (drives->told % drives->beat_every == 0) {
        const uint8_t beat = CAN_OPERATIONAL;
        send_frame(drives, CAN_COB_HEARTBEAT + CAN_MASTER, &beat, sizeof beat);
    }
    drives->told += 1;
    return 1;
}
