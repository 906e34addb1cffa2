/* Frames of a CAN bus, as bus.py sends and receives them through python-can. */
#pragma once
#include "record.h"

enum { FRAME_DATA_MAX = 8, NOT_A_FRAME = -1 };

typedef struct can_message {
    int64_t cob; /* NOT_A_FRAME: our own, an error frame, a remote frame, one with a 29-bit number, or a broken one */
    int64_t size;
    uint8_t data[FRAME_DATA_MAX];
} can_message;

/* Send a frame of at most eight bytes; a full or disconnected adapter loses it, and it is counted. */
void can_send(can_drives *drives, int64_t cob, const uint8_t *data, int64_t size);

/* Take the next frame that is waiting or arrives before `until_ns`; return 0 if there is none. */
int can_receive(can_drives *drives, can_message *message, int64_t until_ns);
