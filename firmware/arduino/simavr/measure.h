/* What the sketch costs. */
#ifndef MEASURE_H
#define MEASURE_H

/* Prints it: cycles of the interrupts, stack, time on the line, the largest rate of the encoders. */
void measure(const char *chip, const char *elf);

#endif
