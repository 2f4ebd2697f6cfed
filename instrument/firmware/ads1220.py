"""A driver for the ADS1220 converter, in the subset of Python that MicroPython supports.

`pipeline read --logger` copies this file, and the Arduino sketch uses the same constants. In each sample, the inputs
are converted in turn against ground. The supply is the reference voltage. Numbers in comments refer to sections of the
data sheet, Texas Instruments SBAS501C, August 2016.
"""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Protocol

    class BoardBus(Protocol):
        """The SPI bus of a board."""

        def write_readinto(self, written: bytes, read: bytearray) -> None:
            """Write bytes and read the same number of bytes at the same time."""

    class BoardPin(Protocol):
        """A digital pin of a board."""

        def value(self, level: int = ..., /) -> int:
            """Return the level of the pin, or set it."""

    class BoardClock(Protocol):
        """The clock of a board."""

        def ticks_us(self) -> int:
            """Return the time [us], which wraps around after some minutes."""

        def ticks_diff(self, end: int, start: int, /) -> int:
            """Return the time from `start` to `end` [us]."""

        def sleep_us(self, us: int, /) -> None:
            """Wait for `us` microseconds."""


RESET = 0x06  # 8.5.3.1
START = 0x08  # 8.5.3.2
READ_DATA = 0x10  # 8.5.3.4
READ_REGISTERS = 0x23  # read four registers, from the first one
WRITE_REGISTERS = 0x43  # write the same four registers
FIRST_INPUT = 0x81  # 8.6.1: MUX 1000 is AIN0 against AVSS, gain 1, amplifier bypassed as 8.3.2.2 requires
NEXT_INPUT = 0x10  # 8.6.1: MUX 1001 is AIN1, and so on
WRITE_INPUT = 0x40  # 8.5.3.6: write the first register, which selects the input
RATE = 0x60  # 8.6.1: 175 samples per second, normal mode, single-shot conversions
SUPPLY = 0xC0  # 8.6.1: the supply is the reference, because the output of a ratiometric sensor scales with it
NOTHING_ELSE = 0x00  # 8.6.1: no current sources, DRDY on its own pin only
RESET_US = 100  # 8.5.3.1: a reset takes 50 us and 32 periods of the 4.096 MHz clock, which is 58 us
LATEST_US = 10000  # timeout of a conversion, which takes 5.8 ms (8.3.5)
BAUD = 1000000  # 6.6: the period of the serial clock must be at least 150 ns
RETRY_US = 1000000  # pause before the converter is set up again


class Converter:
    """An ADS1220 on a bus in SPI mode 1 (8.5.1), with a chip-select pin and a data-ready pin."""

    def __init__(self, bus: "BoardBus", select: "BoardPin", ready: "BoardPin", clock: "BoardClock") -> None:
        self.bus = bus
        self.select = select
        self.ready = ready
        self.clock = clock
        self.t = 0  # time of the last sample since this call [us]; unlike the clock it does not wrap around
        self.last_tick = clock.ticks_us()

    def send(self, *command: int, answer: int = 0) -> bytearray:
        """Send the bytes of a command and return its response, which is `answer` bytes long."""
        received = bytearray(len(command) + answer)
        self.select.value(0)
        self.bus.write_readinto(bytes(command) + bytes(answer), received)
        self.select.value(1)
        return received[len(command) :]

    def begin(self) -> bool:
        """Reset the converter and write its settings; return whether it reads them back correctly."""
        settings = [FIRST_INPUT, RATE, SUPPLY, NOTHING_ELSE]
        self.send(RESET)
        self.clock.sleep_us(RESET_US)
        self.send(WRITE_REGISTERS, *settings)
        return list(self.send(READ_REGISTERS, answer=len(settings))) == settings

    def start(self, channel: int) -> None:
        """Start a conversion of an input; the converter settles within a single conversion (8.3.4)."""
        self.send(WRITE_INPUT, FIRST_INPUT + NEXT_INPUT * channel)
        self.send(START)

    def count(self) -> int | None:
        """Return the result of the started conversion, or None if it is not ready in time."""
        start_tick = self.clock.ticks_us()
        while self.ready.value():  # 8.5.1.3: the pin is low when data are ready
            if self.clock.ticks_diff(self.clock.ticks_us(), start_tick) > LATEST_US:
                return None
        high, middle, low = self.send(READ_DATA, answer=3)
        count = (high << 16) + (middle << 8) + low  # 8.5.2: 24 bits in two's complement, most significant byte first
        is_negative = high & 0x80
        return count - (1 << 24) if is_negative else count

    def samples(self, order: "Sequence[int]", channels: int) -> "Iterator[tuple[int, list[int]]]":
        """Yield the time of each sample [us] and the counts of its channels, until a conversion is not ready in time.

        `order` lists all inputs in the order of conversion. Tips are only on the first `channels` inputs. The other
        inputs are converted too, so that a sample lasts as long as in the design.
        """
        while True:
            now = self.clock.ticks_us()
            self.t += self.clock.ticks_diff(now, self.last_tick)
            self.last_tick = now
            counts = [0] * len(order)  # by input, not by the order of conversion
            for channel in order:
                self.start(channel)
                count = self.count()
                if count is None:
                    return
                counts[channel] = count
            yield self.t, counts[:channels]
