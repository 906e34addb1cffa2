/* Mailbox and ring in shared memory, as runtime/processes/shared_memory.py lays them out. No function waits.

   The counts are written after what they count, with the barriers that Python does not have. A reader therefore never
   takes a value that is only half written, on any processor. */
#pragma once
#include <string.h>

#include "record.h"

enum { HEAD_WRITTEN, HEAD_ACKNOWLEDGED, HEAD_LOST, MAILBOX_RETRIES = 8 };

static inline uint64_t load(const void *at) { return __atomic_load_n((const uint64_t *)at, __ATOMIC_ACQUIRE); }
static inline void store(void *at, uint64_t value) { __atomic_store_n((uint64_t *)at, value, __ATOMIC_RELEASE); }

/* Write a value in place of the one before. */
static inline void mailbox_write(const mailbox_place *box, const void *value)
{
    uint64_t *head = box->head;
    const uint64_t count = load(&head[HEAD_WRITTEN]) + 1;
    uint8_t *slot = (uint8_t *)box->rows + (count % MAILBOX_SLOTS) * (uint64_t)box->stride;
    store(slot, count);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    memcpy(slot + box->value_at, value, (size_t)box->value_bytes);
    store(slot + box->done_at, count);
    store(&head[HEAD_WRITTEN], count);
}

/* Copy the newest whole value; return 0 if there is none. */
static inline int mailbox_read(const mailbox_place *box, void *value)
{
    const uint64_t *head = box->head;
    for (int retry = 0; retry < MAILBOX_RETRIES; retry++) {
        const uint64_t count = load(&head[HEAD_WRITTEN]);
        if (count == 0)
            return 0;
        const uint8_t *slot = (const uint8_t *)box->rows + (count % MAILBOX_SLOTS) * (uint64_t)box->stride;
        const uint64_t done = load(slot + box->done_at);
        memcpy(value, slot + box->value_at, (size_t)box->value_bytes);
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        /* A writer within the slot has changed the first word before the value. */
        if (load(slot) == count && done == count)
            return 1;
    }
    return 0;
}

/* Append a value, or count it as lost if the reader has left no room. */
static inline void ring_put(const mailbox_place *ring, const void *value)
{
    uint64_t *head = ring->head;
    const uint64_t count = load(&head[HEAD_WRITTEN]);
    if (count - load(&head[HEAD_ACKNOWLEDGED]) >= (uint64_t)ring->count) {
        store(&head[HEAD_LOST], load(&head[HEAD_LOST]) + 1);
        return;
    }
    memcpy((uint8_t *)ring->rows + (count % (uint64_t)ring->count) * (uint64_t)ring->stride, value,
           (size_t)ring->value_bytes);
    store(&head[HEAD_WRITTEN], count + 1);
}
