/* Protocol and drives of the C peer without sockets, for benchmarks/udp_fuzz.py. Packets and times come on standard input,
 * so that a run can be repeated and checked by the compiler's sanitizers. */
#define EXOGRAV_WITHOUT_SOCKETS
#include "../examples/udp_peer/peer.c"

typedef struct {
    int64_t now; /* [us] */
    uint32_t address;
    uint16_t port;
    uint16_t length; /* 0xffff: a step, no packet */
} order;

int main(void) {
    static controller c;
    static uint8_t data[65536], answer[PACKET_BYTES];
    order next;
    controller_begin(&c, 1);
    while (fread(&next, sizeof next, 1, stdin) == 1) {
        if (next.length == 0xffffu) {
            float does[2 * JOINTS];
            controller_step(&c, next.now);
            for (int k = 0; k < JOINTS; ++k) {
                does[k] = c.motors[k].current;
                does[JOINTS + k] = c.motors[k].enabled ? 1.0f : 0.0f;
            }
            fwrite(does, sizeof does, 1, stdout);
        } else {
            /* The block has exactly the size of the packet, so that a sanitizer finds a byte read beyond it. */
            uint8_t *packet = malloc(next.length ? next.length : 1);
            const sender from = {next.address, next.port};
            if (packet == NULL || fread(data, 1, next.length, stdin) != next.length) return 1;
            memcpy(packet, data, next.length);
            const uint16_t answered = (uint16_t)controller_receive(&c, packet, next.length, from, next.now, answer);
            free(packet);
            fwrite(&answered, sizeof answered, 1, stdout);
            fwrite(answer, 1, answered, stdout);
        }
        fflush(stdout);
    }
    return 0;
}
