/* Runs an exported control system on samples from standard input, and prints what it answers: numbers as their bits. */
#include "furuta_controller.c"

#include <inttypes.h>
#include <stdio.h>

#ifdef SINGLE
typedef uint32_t word;
#else
typedef uint64_t word;
#endif

static furuta_real number(uint64_t bits)
{
    const word w = (word)bits;
    furuta_real x;
    memcpy(&x, &w, sizeof x);
    return x;
}

static void print(furuta_real x)
{
    word w;
    if (x != x) {
        printf(" nan");
        return;
    }
    memcpy(&w, &x, sizeof w);
    printf(" %" PRIx64, (uint64_t)w);
}

int main(void)
{
    static furuta_controller control;
    char what;
    furuta_init(&control);
    while (scanf(" %c", &what) == 1) {
        uint64_t theta, alpha, held, target;
        uint32_t periods;
        unsigned request;
        int i;
        if (what == 'a') {
            if (scanf("%u", &request) != 1)
                return 1;
            printf("%d\n", furuta_ask(&control, (furuta_request)request));
            continue;
        }
        if (scanf("%" SCNx64 " %" SCNx64 " %" SCNx64, &theta, &alpha, &held) != 3
            || scanf("%" SCNu32 " %" SCNx64, &periods, &target) != 2)
            return 1;
        furuta_step(&control, number(theta), number(alpha), number(held), periods, number(target));
        printf("%d %d", (int)control.mode, (int)control.fault);
        print(control.u);
        for (i = 0; i < 4; i++)
            print(control.now[i]);
        print(control.reference);
        printf("\n");
    }
    return 0;
}
