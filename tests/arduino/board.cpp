/* An emulated board: what the sketch asks of its pins, its bus, its clock and its port is asked of the test. */
#include <SPI.h>
#include <stdio.h>

struct Board {
    void (*write)(int pin, int level);
    int (*read)(int pin);
    double (*now)();
    void (*wait)(double us);
    int (*transfer)(int byte, int sck, int mosi, int miso, unsigned baud, int msb_first, int mode);
    void (*print)(const char *text);
};
static Board board;
static int sck = -1, mosi = -1, miso = -1;
static SPISettings agreed(1, MSBFIRST, SPI_MODE0);

extern "C" {
void plug(Board given) { board = given; }
void set_up() { setup(); }
void loop_once() { loop(); }
void pinMode(uint8_t, uint8_t) {}
void digitalWrite(uint8_t pin, uint8_t level) { board.write(pin, level); }
int digitalRead(uint8_t pin) { return board.read(pin); }
unsigned long micros(void) { return (uint32_t)(int64_t)board.now(); }
void delay(unsigned long ms) { board.wait(1e3 * ms); }
void delayMicroseconds(unsigned int us) { board.wait(us); }
}

static void print_as(const char *form, double number, int digits)
{
    char text[64];
    snprintf(text, sizeof text, form, digits, number);
    board.print(text);
}
void SerialPort::begin(unsigned long) {}
SerialPort::operator bool() { return true; }
void SerialPort::print(const char *text) { board.print(text); }
void SerialPort::print(char letter) { const char text[2] = {letter, 0}; board.print(text); }
void SerialPort::print(long number) { print_as("%.*f", number, 0); }
void SerialPort::print(unsigned long number) { print_as("%.*f", number, 0); }
void SerialPort::print(double number, int digits) { print_as("%.*f", number, digits); }
void SerialPort::println(const char *text) { print(text); println(); }
void SerialPort::println(unsigned long number) { print(number); println(); }
void SerialPort::println() { board.print("\r\n"); }
SerialPort Serial;

void SPIBus::setSCK(uint8_t pin) { sck = pin; }
void SPIBus::setTX(uint8_t pin) { mosi = pin; }
void SPIBus::setRX(uint8_t pin) { miso = pin; }
void SPIBus::begin() {}
void SPIBus::beginTransaction(SPISettings settings) { agreed = settings; }
uint8_t SPIBus::transfer(uint8_t byte)
{
    return (uint8_t)board.transfer(byte, sck, mosi, miso, agreed.baud, agreed.bits, agreed.edges);
}
void SPIBus::endTransaction() {}
SPIBus SPI;
