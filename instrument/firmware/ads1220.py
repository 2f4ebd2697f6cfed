"""A driver of the ADS1220 in the subset of Python that MicroPython runs; `pipeline read --logger` copies this file.

Each sample has one conversion of each input against ground, one after the other. The supply is the reference. Numbers
in comments are sections of the data sheet, Texas Instruments SBAS501C, August 2016. The sketch for Arduino uses the
same constants.
"""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Protocol

    class BoardBus(Protocol):
        """An SPI unit of a board."""

        def write_readinto(self, written: bytes, read: bytearray) -> None:
            """Write bytes, and read as many at the same time."""

    class BoardPin(Protocol):
        """A pin of a board."""

        def value(self, level: int = ..., /) -> int:
            """Return the level of a pin, or set it."""

    class BoardClock(Protocol):
        """The clock of a board."""

        def ticks_us(self) -> int:
            """Return a time that wraps after some minutes [us]."""

        def ticks_diff(self, end: int, start: int, /) -> int:
            """Return the time between two times [us]."""

        def sleep_us(self, us: int, /) -> None:
            """Wait [us]."""


RESET = 0x06  # 8.5.3.1
START = 0x08  # 8.5.3.2
READ_DATA = 0x10  # 8.5.3.4
READ_REGISTERS = 0x23  # four registers from the first one
WRITE_REGISTERS = 0x43  # the same four registers
WRITE_INPUT = 0x40  # 8.5.3.6: the first register, which selects the input
FIRST_INPUT = 0x81  # 8.6.1: MUX 1000 is AIN0 against AVSS, gain 1, amplifier bypassed as 8.3.2.2 requires
NEXT_INPUT = 0x10  # 8.6.1: MUX 1001 is AIN1, and so on
RATE = 0x60  # 8.6.1: 175 samples a second, normal mode, single shots
SUPPLY = 0xC0  # 8.6.1: the supply as reference, so that a ratiometric sensor shows its share of it
NOTHING_ELSE = 0x00  # 8.6.1: no current sources, DRDY on its own pin only
BAUD = 1000000  # 6.6: a period of the clock lasts 150 ns at least
RESET_US = 100  # 8.5.3.1: 50 us and 32 periods of 4.096 MHz at least, which are 58 us
LATEST_US = 10000  # 8.3.5: a conversion lasts 5.8 ms
RETRY_US = 1000000


class Converter:
    """An ADS1220 on a bus in SPI mode 1 (8.5.1), with a select pin and a pin that signals ready data."""

    def __init__(self, bus: "BoardBus", select: "BoardPin", ready: "BoardPin", clock: "BoardClock") -> None:
        """Store the pins; nothing is sent yet."""
        self.bus = bus
        self.select = select
        self.ready = ready
        self.clock = clock
        self.t = 0  # time of the last sample since this call [us]; unlike the clock it does not wrap
        self.last_tick = clock.ticks_us()

    def send(self, *command: int, answer: int = 0) -> bytearray:
        """Send the bytes of a command and return its answer, which has `answer` bytes."""
        received = bytearray(len(command) + answer)
        self.select.value(0)
        self.bus.write_readinto(bytes(command) + bytes(answer), received)
        self.select.value(1)
        return received[len(command) :]

    def begin(self) -> bool:
        """Reset the converter and write its settings; return whether it holds them afterwards."""
        settings = [FIRST_INPUT, RATE, SUPPLY, NOTHING_ELSE]
        self.send(RESET)
        self.clock.sleep_us(RESET_US)
        self.send(WRITE_REGISTERS, *settings)
        return list(self.send(READ_REGISTERS, answer=len(settings))) == settings

    def start(self, channel: int) -> None:
        """Start a conversion of an input; it settles within this one conversion (8.3.4)."""
        self.send(WRITE_INPUT, FIRST_INPUT + NEXT_INPUT * channel)
        self.send(START)

    def count(self) -> int | None:
        """Return the count of the started conversion, or None if it is not ready in time."""
        start_tick = self.clock.ticks_us()
        while self.ready.value():  # 8.5.1.3: low when data are ready
            if self.clock.ticks_diff(self.clock.ticks_us(), start_tick) > LATEST_US:
                return None
        high, middle, low = self.send(READ_DATA, answer=3)
        count = (high << 16) + (middle << 8) + low  # 8.5.2: 24 bits in two's complement, most significant byte first
        return count - (1 << 24) if high & 0x80 else count

    def samples(self, order: "Sequence[int]", channels: int) -> "Iterator[tuple[int, list[int]]]":
        """Yield the time of each sample [us] and the counts of its channels, until a conversion is not ready in time.

        `order` lists the inputs in the order of conversion. Inputs beyond the channels are converted too, so that a
        sample lasts as long as in the design.
        """
        while True:
            now = self.clock.ticks_us()
            self.t += self.clock.ticks_diff(now, self.last_tick)
            self.last_tick = now
            counts = [0] * len(order)
            for channel in order:
                self.start(channel)
                count = self.count()
                if count is None:
                    return
                counts[channel] = count
            yield self.t, counts[:channels]
