/* See drives.h. Compile without fast mathematics and without contraction: the same frames must give the same numbers as
   in Python. */
#define _GNU_SOURCE
#include "drives.h"

#include <math.h>
#include <string.h>

#include "frames.h"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "The frames are little endian, and this file copies numbers as they are."
#endif

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

static void on_measured(can_node *node, const can_message *got)
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

static void take(can_node *node, const can_message *got)
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
        node->misses = node->lost_after + 1; /* its answer is not awaited */
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

static void hear(can_drives *drives, const can_message *got)
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

/* True unless an answer is missing of a drive that was not silent before the question. */
static int is_complete_now(const can_drives *drives)
{
    for (int64_t j = 0; j < drives->machine.joints; j++)
        if (!drives->each[j].has_answered && drives->each[j].misses <= drives->each[j].lost_after)
            return 0;
    return 1;
}

static void owe(can_owed *owed) { owed->missing = owed->came_late ? owed->missing + 1 : 1; }

/* Ask every drive; return 1 if each that is not silent has answered in time. */
static int ask(can_drives *drives)
{
    can_message got;
    for (int k = 0; k < CAN_FRAMES_AT_ONCE && can_receive(drives, &got, machine_now(&drives->machine)); k++)
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
    can_send(drives, CAN_COB_SYNC, NULL, 0);
    for (int k = 0; k < CAN_FRAMES_AT_ONCE && !is_complete_now(drives) && can_receive(drives, &got, until_ns); k++)
        hear(drives, &got);
    const int is_complete = is_complete_now(drives);
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
    const double wanted = is_told ? rint(current / node->amperes) : 0.0;
    const int16_t per_mille = (int16_t)(wanted > CAN_PER_MILLE_MOST    ? CAN_PER_MILLE_MOST
                                        : wanted < -CAN_PER_MILLE_MOST ? -CAN_PER_MILLE_MOST
                                                                       : wanted);
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
        uint8_t data[FRAME_DATA_MAX];
        const int64_t size = order(&drives->each[j], limited[j], damping[j], data);
        can_send(drives, CAN_COB_COMMAND + drives->each[j].node, data, size);
    }
    if (drives->told % drives->beat_every == 0) {
        const uint8_t beat = CAN_OPERATIONAL;
        can_send(drives, CAN_COB_HEARTBEAT + CAN_MASTER, &beat, sizeof beat);
    }
    drives->told += 1;
    return 1;
}
