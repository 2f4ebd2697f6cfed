"""Emulated microcontrollers: each compiles a C program that says bytes and numbers, and returns what it said."""

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
from deadline import DEADLINE_S

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-pedantic", "-Os")

# Semihosting of Arm: the operation in r0, its argument in r1; 4 writes a string, 24 ends the emulator.
CORTEX = r"""
#include <stdint.h>
int main(void);
static void call_host(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}
void say(const char *line) { call_host(4, line); }
extern uint32_t __stack, __data_load, __data_start, __data_end, __bss_start__, __bss_end__;
static void reset(void)
{
#ifdef __ARM_FP
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* CPACR: the floating-point unit is on */
    __asm__ volatile("dsb\nisb");
#endif
    for (uint32_t *to = &__data_start, *from = &__data_load; to < &__data_end;) { *to++ = *from++; }
    for (uint32_t *to = &__bss_start__; to < &__bss_end__;) { *to++ = 0u; }
    main();
    call_host(24, (const void *)0x20026); /* ADP_Stopped_ApplicationExit */
    for (;;) { }
}
__attribute__((section(".vectors"), used)) static const void *const vectors[2] = {&__stack, (const void *)reset};
"""
CORTEX_LINKER = """
MEMORY {{ FLASH (rx) : ORIGIN = 0x00000000, LENGTH = {flash}K  RAM (rwx) : ORIGIN = 0x20000000, LENGTH = {ram}K }}
SECTIONS {{
    .text : {{ KEEP(*(.vectors)) *(.text*) *(.rodata*) . = ALIGN(4); }} > FLASH
    .ARM.exidx : {{ *(.ARM.exidx*) }} > FLASH
    __data_load = ALIGN(LOADADDR(.ARM.exidx) + SIZEOF(.ARM.exidx), 4);
    .data : AT(__data_load) {{ __data_start = .; *(.data*) . = ALIGN(4); __data_end = .; }} > RAM
    .bss : {{ __bss_start__ = .; *(.bss*) *(COMMON) . = ALIGN(4); __bss_end__ = .; }} > RAM
    __stack = ORIGIN(RAM) + LENGTH(RAM);
    end = .;
}}
"""
AVR = r"""
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
int program(void);
void say(const char *line)
{
    while (*line) {
        while (!(UCSR0A & (1 << UDRE0))) { }
        UDR0 = (uint8_t)*line++;
    }
}
int main(void)
{
    UCSR0B = 1 << TXEN0;
    program();
    cli();
    sleep_mode(); /* without interrupts: the emulator ends */
    return 0;
}
"""


@dataclass(frozen=True)
class Board:
    """An emulated microcontroller: its compiler and flags, its start-up code and the command of its emulator."""

    name: str
    compiler: str
    flags: tuple[str, ...]
    start_up: str
    emulator: tuple[str, ...]
    linker_script: str = ""
    main: str = "main"

    def skip_without_programs(self) -> None:
        """Skip a test where the compiler or the emulator is not installed."""
        for program in (self.compiler, self.emulator[0]):
            if shutil.which(program) is None:
                pytest.skip(f"no {program}")

    def said(self, folder: Path, program: str) -> str:
        """Return what a program says in the emulator, compiled with each warning an error; its headers are there."""
        (folder / "main.c").write_text(program.replace("int main(void)", f"int {self.main}(void)"), encoding="utf-8")
        (folder / "start.c").write_text(self.start_up, encoding="utf-8")
        (folder / "board.ld").write_text(self.linker_script, encoding="utf-8")
        compile_ = [self.compiler, *self.flags]
        subprocess.run([*compile_, *STRICT, "-c", "main.c"], check=True, cwd=folder, timeout=DEADLINE_S)
        subprocess.run([*compile_, "-Os", "-c", "start.c"], check=True, cwd=folder, timeout=DEADLINE_S)
        script = ["-nostartfiles", "-Wl,-T,board.ld"] if self.linker_script else []
        link = [*compile_, *script, "main.o", "start.o", "-o", "board.elf", "-lm"]
        subprocess.run(link, check=True, cwd=folder, timeout=DEADLINE_S)
        ended = subprocess.run(
            [*self.emulator, "board.elf"],
            cwd=folder,
            capture_output=True,
            encoding="utf-8",
            timeout=DEADLINE_S,
            check=True,
        )
        return ended.stdout + ended.stderr


QEMU = ("qemu-system-arm", "-nographic", "-semihosting-config", "enable=on,target=native")
BOARDS = [
    Board(
        "Cortex-M0 of a micro:bit",
        "arm-none-eabi-gcc",
        ("-mcpu=cortex-m0", "-mthumb"),
        CORTEX,
        (*QEMU, "-M", "microbit", "-kernel"),
        CORTEX_LINKER.format(flash=256, ram=16),
    ),
    Board(
        "Cortex-M4F",
        "arm-none-eabi-gcc",
        ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
        CORTEX,
        (*QEMU, "-M", "mps2-an386", "-kernel"),
        CORTEX_LINKER.format(flash=4096, ram=4096),
    ),
    Board(
        "AVR ATmega2560",
        "avr-gcc",
        ("-mmcu=atmega2560",),
        AVR,
        ("simavr", "-m", "atmega2560", "-f", "16000000"),
        main="program",
    ),
]
