#!/usr/bin/env python3
"""Flash and static RAM of programs for the target, from their ELF files: `sizes.py FOLDER`, as a table."""

import struct
import sys
from pathlib import Path

PROGRAMS = [
    ("rig", "`rig`, QEMU (with the emulated mechanics)"),
    ("on_chip", "`on_chip`, QEMU (with the emulated mechanics)"),
    ("rig_stm32f407", "`rig_stm32f407`"),
    ("on_chip_stm32f407", "`on_chip_stm32f407` (designs on the chip)"),
    ("lqr", "LQR's step alone"),
    ("lqr_sliding", "sliding mode's step alone"),
    ("mpc", "MPC's step alone"),
    ("kalman", "Kalman filter's step alone"),
    ("supervisor", "counts to voltage, every controller and estimator"),
    ("wire", "the rig's end of the wire alone"),
]
# Of section headers: the flags SHF_ALLOC and SHF_WRITE, the type SHT_NOBITS.
ALLOCATED, WRITABLE, ZEROED = 2, 1, 8


def sizes(path: Path) -> tuple[int, int]:
    """Bytes of flash and of static RAM."""
    data = path.read_bytes()
    (table,) = struct.unpack_from("<I", data, 0x20)
    entry, count = struct.unpack_from("<HH", data, 0x2E)
    flash = ram = 0
    for i in range(count):
        _, kind, flags, _, _, size = struct.unpack_from(
            "<IIIIII", data, table + i * entry
        )
        if not flags & ALLOCATED:
            continue
        if kind != ZEROED:
            flash += size
        if flags & WRITABLE:
            ram += size
    return flash, ram


def main() -> None:
    folder = Path(sys.argv[1])
    print("| program | flash, B | static RAM, B |")
    print("|---|---|---|")
    for name, what in PROGRAMS:
        flash, ram = sizes(folder / name)
        print(f"| {what} | {flash:,} | {ram:,} |")


if __name__ == "__main__":
    main()
