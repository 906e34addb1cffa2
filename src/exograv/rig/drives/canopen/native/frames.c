/* Frames on a socket of SocketCAN, or on python-can's interface udp_multicast; see frames.h.

   A datagram of udp_multicast is a dictionary in MessagePack. Each field is read within the bounds of the datagram, and
   a datagram that is not exactly a message of python-can is counted and dropped.
   Source: the MessagePack specification; python-can, can/interfaces/udp_multicast/utils.py and can/message.py. */
#include "frames.h"

#include <linux/can.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>

enum { DATAGRAM_MAX = 4096, OUR_DATAGRAM_MAX = 256, FD_DATA_MAX = 64 };

/* --- SocketCAN ---------------------------------------------------------------------------------------------------- */

static int64_t socketcan_bytes(int64_t cob, const uint8_t *data, int64_t size, uint8_t *bytes)
{
    struct can_frame frame = {.can_id = (canid_t)cob, .can_dlc = (uint8_t)size};
    if (size > 0)
        memcpy(frame.data, data, (size_t)size);
    memcpy(bytes, &frame, sizeof frame);
    return sizeof frame;
}

static int socketcan_message(const uint8_t *bytes, int64_t size, can_message *message)
{
    struct can_frame frame;
    if (size != sizeof frame)
        return 0;
    memcpy(&frame, bytes, sizeof frame);
    if (frame.can_dlc > FRAME_DATA_MAX)
        return 0;
    const int is_plain = !(frame.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG));
    message->cob = is_plain ? (int64_t)(frame.can_id & CAN_SFF_MASK) : NOT_A_FRAME;
    message->size = frame.can_dlc;
    memcpy(message->data, frame.data, frame.can_dlc);
    return 1;
}

/* --- udp_multicast: writing --------------------------------------------------------------------------------------- */

/* First bytes of values in MessagePack. */
enum {
    FIX_INT_END = 0x80, FIX_MAP = 0x80, FIX_MAP_END = 0x90, FIX_STRING = 0xA0, FIX_STRING_END = 0xC0, NIL = 0xC0,
    FALSE_VALUE = 0xC2, TRUE_VALUE = 0xC3, BIN_8 = 0xC4, FLOAT_64 = 0xCB, UINT_8 = 0xCC, UINT_16 = 0xCD,
    UINT_32 = 0xCE, STRING_8 = 0xD9,
};

enum { FIELDS = 11 };
enum { ARBITRATION_ID = 1, IS_EXTENDED, IS_REMOTE, IS_ERROR, CHANNEL, DLC, DATA, IS_FD, BITRATE_SWITCH, ERROR_STATE };

/* Names of the fields, in the order in which python-can writes them. */
static const char *const names[FIELDS] = {
    "timestamp", "arbitration_id", "is_extended_id", "is_remote_frame", "is_error_frame", "channel",
    "dlc", "data", "is_fd", "bitrate_switch", "error_state_indicator",
};

static uint8_t *put_bytes(uint8_t *at, const void *bytes, int64_t size)
{
    if (size > 0)
        memcpy(at, bytes, (size_t)size);
    return at + size;
}

static uint8_t *put_string(uint8_t *at, const void *text, int64_t size)
{
    *at++ = (uint8_t)(FIX_STRING + size);
    return put_bytes(at, text, size);
}

static uint8_t *put_number(uint8_t *at, int64_t value)
{
    if (value < FIX_INT_END) {
        *at++ = (uint8_t)value;
    } else if (value <= UINT8_MAX) {
        *at++ = UINT_8;
        *at++ = (uint8_t)value;
    } else {
        *at++ = UINT_16;
        *at++ = (uint8_t)(value >> 8);
        *at++ = (uint8_t)value;
    }
    return at;
}

static uint8_t *put_field(uint8_t *at, int field, const can_drives *drives, int64_t cob, const uint8_t *data,
                          int64_t size)
{
    at = put_string(at, names[field], (int64_t)strlen(names[field]));
    switch (field) {
    case 0: /* the time stamp of a message that was not received is 0.0 */
        *at++ = FLOAT_64;
        memset(at, 0, sizeof(double));
        return at + sizeof(double);
    case ARBITRATION_ID:
        return put_number(at, cob);
    case CHANNEL:
        return put_string(at, drives->mark, CAN_MARK_BYTES);
    case DLC:
        return put_number(at, size);
    case DATA:
        *at++ = BIN_8;
        *at++ = (uint8_t)size;
        return put_bytes(at, data, size);
    default:
        *at++ = FALSE_VALUE;
        return at;
    }
}

static int64_t multicast_bytes(const can_drives *drives, int64_t cob, const uint8_t *data, int64_t size,
                               uint8_t *bytes)
{
    uint8_t *at = bytes;
    *at++ = FIX_MAP + FIELDS;
    for (int field = 0; field < FIELDS; field++)
        at = put_field(at, field, drives, cob, data, size);
    return at - bytes;
}

/* --- udp_multicast: reading --------------------------------------------------------------------------------------- */

typedef struct reader {
    const uint8_t *at, *end;
    int is_wrong; /* set for good at the first byte that does not fit */
} reader;

/* Return the next `size` bytes, or NULL behind the end. */
static const uint8_t *taken(reader *in, int64_t size)
{
    if (in->is_wrong || in->end - in->at < size) {
        in->is_wrong = 1;
        return NULL;
    }
    in->at += size;
    return in->at - size;
}

static int next_byte(reader *in)
{
    const uint8_t *byte = taken(in, 1);
    return byte ? *byte : NIL;
}

static int64_t read_number(reader *in)
{
    const int first = next_byte(in);
    if (first < FIX_INT_END)
        return first;
    if (first != UINT_8 && first != UINT_16 && first != UINT_32) {
        in->is_wrong = 1;
        return 0;
    }
    const int64_t size = (int64_t)1 << (first - UINT_8);
    const uint8_t *bytes = taken(in, size);
    int64_t value = 0;
    for (int64_t k = 0; bytes && k < size; k++)
        value = value << 8 | bytes[k];
    return value;
}

static int read_truth(reader *in)
{
    const int first = next_byte(in);
    in->is_wrong |= first != FALSE_VALUE && first != TRUE_VALUE;
    return first == TRUE_VALUE;
}

/* Return a text of ASCII characters and its size, or NULL for nil where that is allowed. */
static const uint8_t *read_text(reader *in, int64_t *size, int may_be_nil)
{
    const int first = next_byte(in);
    *size = 0;
    if (may_be_nil && first == NIL)
        return NULL;
    if (first >= FIX_STRING && first < FIX_STRING_END)
        *size = first - FIX_STRING;
    else if (first == STRING_8)
        *size = next_byte(in);
    else
        in->is_wrong = 1;
    const uint8_t *text = taken(in, *size);
    for (int64_t k = 0; text && k < *size; k++)
        in->is_wrong |= text[k] >= 0x80;
    return text;
}

static int field_of(reader *in)
{
    int64_t size;
    const uint8_t *text = read_text(in, &size, 0);
    for (int field = 0; text && field < FIELDS; field++)
        if ((int64_t)strlen(names[field]) == size && memcmp(names[field], text, (size_t)size) == 0)
            return field;
    in->is_wrong = 1;
    return FIELDS;
}

static int is_our_mark(const can_drives *drives, const uint8_t *text, int64_t size)
{
    return text && size == CAN_MARK_BYTES && memcmp(drives->mark, text, CAN_MARK_BYTES) == 0;
}

/* Return 1 for a message with all fields, each once, which python-can's check accepts. */
static int multicast_message(const can_drives *drives, const uint8_t *bytes, int64_t size, can_message *message)
{
    reader in = {bytes, bytes + size, 0};
    const uint8_t *text = NULL, *data = NULL;
    int64_t number = 0, dlc = 0, text_size = 0, data_size = 0;
    int is[FIELDS] = {0}, found = 0;
    in.is_wrong = next_byte(&in) != FIX_MAP + FIELDS;
    for (int k = 0; k < FIELDS && !in.is_wrong; k++) {
        const int field = field_of(&in);
        if (in.is_wrong)
            return 0;
        found |= 1 << field;
        if (field == 0)
            in.is_wrong |= next_byte(&in) != FLOAT_64 || !taken(&in, sizeof(double));
        else if (field == ARBITRATION_ID)
            number = read_number(&in);
        else if (field == CHANNEL)
            text = read_text(&in, &text_size, 1);
        else if (field == DLC)
            dlc = read_number(&in);
        else if (field == DATA) {
            in.is_wrong |= next_byte(&in) != BIN_8;
            data_size = next_byte(&in);
            data = taken(&in, data_size);
        } else
            is[field] = read_truth(&in);
    }
    if (in.is_wrong || in.at != in.end || found != (1 << FIELDS) - 1)
        return 0;
    if (number >= (is[IS_EXTENDED] ? 0x20000000 : 0x800) || dlc > (is[IS_FD] ? FD_DATA_MAX : FRAME_DATA_MAX))
        return 0;
    if (is[IS_REMOTE] ? is[IS_ERROR] || is[IS_FD] : dlc != data_size)
        return 0;
    if (!is[IS_FD] && (is[BITRATE_SWITCH] || is[ERROR_STATE]))
        return 0;
    const int is_plain = !(is[IS_EXTENDED] || is[IS_REMOTE] || is[IS_ERROR] || is[IS_FD] ||
                           is_our_mark(drives, text, text_size));
    message->cob = is_plain ? number : NOT_A_FRAME;
    message->size = is_plain ? data_size : 0;
    memcpy(message->data, data, (size_t)message->size);
    return 1;
}

/* --- both --------------------------------------------------------------------------------------------------------- */

static int is_sent_to_group(can_drives *drives, const uint8_t *bytes, int64_t size)
{
    if (drives->machine.send_hook)
        return machine_sends(&drives->machine, bytes, size);
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((uint16_t)drives->port)};
    to.sin_addr.s_addr = htonl(drives->group);
    return sendto((int)drives->machine.socket, bytes, (size_t)size, MSG_DONTWAIT | MSG_NOSIGNAL, (struct sockaddr *)&to,
                  sizeof to) == size;
}

void can_send(can_drives *drives, int64_t cob, const uint8_t *data, int64_t size)
{
    uint8_t bytes[OUR_DATAGRAM_MAX];
    int is_sent;
    if (drives->link == CAN_LINK_SOCKETCAN)
        is_sent = machine_sends(&drives->machine, bytes, socketcan_bytes(cob, data, size, bytes));
    else
        is_sent = is_sent_to_group(drives, bytes, multicast_bytes(drives, cob, data, size, bytes));
    drives->counts[CAN_COUNT_NOT_SENT] += !is_sent;
}

int can_receive(can_drives *drives, can_message *message, int64_t until_ns)
{
    uint8_t bytes[DATAGRAM_MAX];
    const int64_t size = machine_receives(&drives->machine, bytes, sizeof bytes, until_ns);
    if (size == MACHINE_NOTHING)
        return 0;
    if (size >= 0 && (drives->link == CAN_LINK_SOCKETCAN ? socketcan_message(bytes, size, message)
                                                         : multicast_message(drives, bytes, size, message)))
        return 1;
    drives->counts[CAN_COUNT_NOT_HEARD] += 1;
    *message = (can_message){NOT_A_FRAME, 0, {0}};
    return machine_now(&drives->machine) < until_ns;
}
